"""Tables in other forms that are damaged, odd, or far larger than their files."""

import json
import zipfile

import geopandas as gpd
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from shapely.geometry import MultiPoint, Point

from mapfilter.errors import InputError
from mapfilter.tracks.joining.recordings import read_recordings
from mapfilter.tracks.open_options import OpenOptions
from mapfilter.tracks.readers.contained import json_tables
from mapfilter.tracks.readers.formats import read_recording

START_S = 1_777_629_330
ROWS = [
    {"time": START_S + at, "lat": 50.8 + at * 1e-5, "lon": 4.3, "rsrp": -90, "mcc": 206, "mnc": 1}
    for at in range(30)
]


def written(folder, name, content):
    path = folder / name
    path.write_text(content)
    return path


def positions_of(path):
    return read_recording(path).tables["positions"]


@pytest.mark.parametrize(
    "content",
    [
        "\n".join(json.dumps(row, indent=2) for row in ROWS),
        "".join(json.dumps(row) for row in ROWS),
        "\n".join(json.dumps(ROWS[at]) + json.dumps(ROWS[at + 1]) for at in range(0, 30, 2)),
    ],
    ids=["over lines", "on one line", "two on a line"],
)
def test_all_of_several_objects_are_read(tmp_path, content):
    assert len(positions_of(written(tmp_path, "own.json", content))) == 30


@pytest.mark.parametrize("end", ["", "trailing"])
def test_damage_within_objects_over_lines_is_noted(tmp_path, end):
    objects = [json.dumps(row, indent=2) for row in ROWS]
    whole = objects if end else [*objects[:10], objects[10][:20]]
    found = read_recording(written(tmp_path, "own.json", "\n".join([*whole, end])))
    assert len(found.tables["positions"]) == (30 if end else 10)
    assert any("cut off or damaged" in note for note in found.notes)


def test_damage_within_a_list_is_noted(tmp_path):
    parts = [*map(json.dumps, ROWS[:10]), '{"time":oops}', *map(json.dumps, ROWS[10:])]
    found = read_recording(written(tmp_path, "own.json", f"[{','.join(parts)}]"))
    assert len(found.tables["positions"]) == 10
    assert any("cut off or damaged" in note for note in found.notes)


def test_a_second_list_is_noted(tmp_path):
    content = json.dumps({"locations": ROWS, "cells": ROWS[:5]})
    found = read_recording(written(tmp_path, "own.json", content))
    assert any("cells: 5 objects left out" in note for note in found.notes)


def test_access_points_are_no_cells(tmp_path):
    """Their levels were taken for those of cells, which were not used."""
    cell = {"mobileCountryCode": 206, "mobileNetworkCode": 1, "cellId": 12, "signalStrength": -95}
    items = [
        {
            "timestamp": 1000 * (START_S + at),
            "position": {"latitude": 50 + at / 1000, "longitude": 4.3},
            "cellTowers": [cell],
            "wifiAccessPoints": [{"macAddress": "01:02:03:04:05:06", "signalStrength": -51}] * 2,
        }
        for at in range(5)
    ]
    found = read_recording(written(tmp_path, "own.json", json.dumps({"items": items})))
    assert found.tables["radio"]["level_dbm"].tolist() == [-95] * 5
    assert len(found.tables["positions"]) == 5
    assert "wifiAccessPoints: 10 objects left out, no cells" in found.notes
    both = json.dumps({"wifi": [{"rssi": -51}] * 99, "cells": ROWS})
    assert len(positions_of(written(tmp_path, "both.json", both))) == 30


def test_digits_of_json_stay(tmp_path):
    digits = '[{"time": 1777629330.25, "lat": 50.8, "lon": 4.3, "x": %s}]' % ("1" * 5000)
    assert positions_of(written(tmp_path, "own.json", digits))["time_s"].tolist() == [
        START_S + 0.25
    ]


def test_half_a_letter_in_json(tmp_path):
    content = f'[{json.dumps(ROWS[0])[:-1]}, "note": "\\ud800"}}]'
    assert len(positions_of(written(tmp_path, "own.json", content))) == 1


def test_json_that_blows_up_is_refused(tmp_path, monkeypatch):
    sparse = [{**ROWS[0], f"k{at}": 1} for at in range(3000)]
    with pytest.raises(InputError, match=r"1000 different names.*likely: export"):
        read_recording(written(tmp_path, "sparse.json", json.dumps(sparse)))
    # Four thousandths of the limit: as many values as that take ten seconds.
    assert json_tables.MOST_VALUES == 50_000_000
    monkeypatch.setattr(json_tables, "MOST_VALUES", 200_000)
    crossed = {**ROWS[0], **{f"k{at}": 1 for at in range(80)}, "l": [{"x": 1}] * 2600}
    with pytest.raises(InputError, match="5e7 values in all"):
        read_recording(written(tmp_path, "crossed.json", json.dumps([crossed, ROWS[0]])))
    crossed["l"] = crossed["l"][:2200]
    assert positions_of(written(tmp_path, "less.json", json.dumps([crossed, ROWS[0]]))) is not None
    nested = ROWS[0]
    for _ in range(20):
        nested = {**ROWS[0], "a": [nested]}
    with pytest.raises(InputError, match=r"at most 8 levels.*likely: export"):
        read_recording(written(tmp_path, "nested.json", json.dumps([nested])))


def kml(folder, inner):
    head = '<?xml version="1.0"?>\n<kml xmlns:gx="http://www.google.com/kml/ext/2.2">'
    return written(folder, "own.kml", f"{head}{inner}</kml>")


def test_a_track_keeps_times_without_places(tmp_path):
    whens = "".join(f"<when>2026-05-01T10:00:0{at}Z</when>" for at in range(6))
    places = [f"<gx:coord>{4.3 + at / 1000} 50.8 0</gx:coord>" for at in range(6)]
    places[2] = "<gx:coord/>"
    found = positions_of(kml(tmp_path, f"<gx:Track>{whens}{''.join(places)}</gx:Track>"))
    assert np.diff(found["time_s"]).tolist() == [1, 2, 1, 1]
    assert found["lon_deg"].tolist() == pytest.approx([4.3, 4.301, 4.303, 4.304, 4.305])


def test_a_track_with_more_times_than_places_is_noted(tmp_path):
    whens = "".join(f"<when>2026-05-01T10:00:0{at}Z</when>" for at in range(6))
    places = "".join(f"<gx:coord>{4.3 + at / 1000} 50.8 0</gx:coord>" for at in range(5))
    found = read_recording(kml(tmp_path, f"<gx:Track>{whens}{places}</gx:Track>"))
    assert any("not as many times as places" in note for note in found.notes)


def test_kml_without_comments_and_with_quoted_data(tmp_path):
    marks = "".join(
        f"<Placemark><TimeStamp><when>2026-05-01T10:00:0{at}Z</when></TimeStamp>"
        f'<ExtendedData><Data name="rsrp"><value><![CDATA[-9{at}]]></value></Data></ExtendedData>'
        f"<Point><coordinates>{4.3 + at / 1000},50.8</coordinates></Point></Placemark>"
        for at in range(5)
    )
    found = read_recording(kml(tmp_path, f"<!-- {marks.replace(':0', ':1')} -->{marks}"))
    assert len(found.tables["positions"]) == 5
    assert found.tables["radio"]["level_dbm"].tolist() == [-90, -91, -92, -93, -94]


def test_a_column_named_cell_identity_is_no_text_of_android(tmp_path):
    rows = "".join(f"{START_S + at},50.8,4.3{at},1234,-90\n" for at in range(10))
    path = written(tmp_path, "own.csv", f"time,lat,lon,CellIdentity,rsrp\n{rows}")
    assert len(positions_of(path)) == 10


@pytest.mark.parametrize(
    "content",
    [
        f'time,lat,lon,x\n{START_S},50.8,4.3,"CellIdentityLte:{{mCi=1}}{"a" * 200_000}"\n',
        f'2026-05-01 10:00:00 +QENG: "{"a" * 200_000}"\n' * 2,
    ],
    ids=["Android", "modem"],
)
def test_a_long_field_is_refused(tmp_path, content):
    with pytest.raises(InputError, match="likely"):
        read_recording(written(tmp_path, "own.txt", content))


def points(folder, places, comment="x"):
    rows = "".join(f"{START_S + at},{p},{comment},-90\n" for at, p in enumerate(places))
    return written(folder, "own.csv", f"time,geometry,comment,rsrp\n{rows}")


def test_rows_without_a_point_keep_their_columns(tmp_path):
    places = ["POINT (4.3 50.8)", "POINT EMPTY", "", "POINT (3e-5 50.8)"]
    found = read_recording(points(tmp_path, places, "at POINT (1 2)"))
    assert found.tables["positions"]["lon_deg"].tolist() == [4.3, 3e-5]
    assert found.tables["radio"]["level_dbm"].tolist() == [-90] * 4
    assert any("2 rows without one" in note for note in found.notes)


def test_points_of_another_system_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"SRID=31370 \(likely: export the points in WGS 84"):
        read_recording(points(tmp_path, ["SRID=31370;POINT (14 17)"] * 3))


def test_odd_columns_of_parquet(tmp_path):
    path = tmp_path / "own.parquet"
    names = ["time", "lat", "lon", "lon", "a\nb"]
    columns = [pa.array([START_S, START_S + 1]), *map(pa.array, ([50.0, 50.1], [4.0, 4.1]))]
    pq.write_table(pa.table([*columns, columns[-1], columns[-1]], names=names), path)
    assert len(positions_of(path)) == 2


def test_an_index_of_times_beside_times(tmp_path):
    path = tmp_path / "own.parquet"
    index = pd.date_range("2020-01-01", periods=2, freq="s", tz="UTC")
    frame = pd.DataFrame({"time": [START_S, START_S + 1], "lat": 50.0, "lon": [4.0, 4.1]}, index)
    frame.to_parquet(path)
    assert positions_of(path)["time_s"].tolist() == [START_S, START_S + 1]


def test_a_text_of_many_rows_in_parquet_is_refused(tmp_path):
    words = pa.DictionaryArray.from_arrays(pa.array(np.zeros(200, np.int32)), ["x" * (6 << 20)])
    path = tmp_path / "own.parquet"
    pq.write_table(pa.table({"time": np.arange(200), "x": words}), path)
    assert path.stat().st_size < 1 << 20
    with pytest.raises(InputError, match="1 GiB of texts"):
        read_recording(path)


def layer(folder, geometry, crs="EPSG:4326"):
    path = folder / "own.gpkg"
    times = [START_S + at for at in range(len(geometry))]
    gpd.GeoDataFrame({"time": times}, geometry=geometry, crs=crs).to_file(path)
    return path


def test_layers_of_several_points(tmp_path):
    each = [MultiPoint([(4.3, 50 + at / 1000)]) for at in range(5)]
    assert positions_of(layer(tmp_path, each))["lat_deg"].iloc[-1] == pytest.approx(50.004)
    with pytest.raises(InputError, match=r"one point in each row.*likely: make single points"):
        read_recording(layer(tmp_path, [MultiPoint([(4, 50), (4, 51)])] * 2))


def test_rows_of_a_layer_without_a_point_or_a_value(tmp_path):
    path = tmp_path / "own.gpkg"
    columns = {
        "time": pd.date_range("2026-05-01T10:00", periods=4, freq="s", tz="UTC"),
        "rsrp": pd.array([-90, None, -91, -92], dtype="Int64"),
        "moving": pd.array([True, None, False, True], dtype="boolean"),
    }
    places = [None, Point(), Point(4.3, 50.0), Point(4.3, 50.1)]
    gpd.GeoDataFrame(columns, geometry=places, crs="EPSG:4326").to_file(path)
    found = read_recording(path)
    assert found.tables["positions"]["lat_deg"].tolist() == [50.0, 50.1]
    assert found.tables["radio"]["level_dbm"].tolist() == [-90, -91, -92]


def test_a_layer_of_no_place_on_earth_is_refused(tmp_path):
    crs = 'LOCAL_CS["Undefined Cartesian SRS",UNIT["metre",1]]'
    with pytest.raises(InputError, match=r"crs: expected .* found Undefined .*likely: set"):
        read_recording(layer(tmp_path, [Point(4, 50)] * 2, crs))


def test_times_of_day_with_dots_are_no_dates(tmp_path):
    rows = "".join(f"10.05.{at},50.8,4.3{at},-90\n" for at in range(16, 30))
    with pytest.raises(InputError, match=r"row 2, time: expected .*'10\.05\.16'"):
        read_recording(written(tmp_path, "own.csv", f"time,lat,lon,rsrp\n{rows}"))


def test_what_the_only_file_of_a_zip_lacks_is_told(tmp_path):
    path = tmp_path / "own.kmz"
    line = "<LineString><coordinates>4,50 5,51</coordinates></LineString>"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("doc.kml", f"<kml><Placemark>{line}</Placemark></kml>")
    with pytest.raises(InputError, match="likely: a line without times"):
        read_recordings([path], OpenOptions())


def test_a_workbook_of_opendocument_is_no_zip_of_recordings(tmp_path):
    path = tmp_path / "own.ods"
    names = ("office", "table", "text")
    urn = "urn:oasis:names:tc:opendocument:xmlns"
    spaces = " ".join(f'xmlns:{name}="{urn}:{name}:1.0"' for name in names)
    cell = '<table:table-cell office:value-type="string"><text:p>{}</text:p></table:table-cell>'
    rows = [["time", "lat", "lon"], *([START_S + at, 50 + at / 1000, 4.3] for at in range(5))]
    lines = ("".join(map(cell.format, row)) for row in rows)
    table = "".join(f"<table:table-row>{line}</table:table-row>" for line in lines)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr(
            "content.xml",
            f"<office:document-content {spaces}><office:body><office:spreadsheet>"
            f'<table:table table:name="S">{table}</table:table>'
            "</office:spreadsheet></office:body></office:document-content>",
        )
        archive.writestr(
            "META-INF/manifest.xml",
            f'<manifest:manifest xmlns:manifest="{urn}:manifest:1.0">'
            '<manifest:file-entry manifest:full-path="/" manifest:media-type=""/>'
            "</manifest:manifest>",
        )
    found, _ = read_recordings([path], OpenOptions())
    assert len(found[0].tables["positions"]) == 5
