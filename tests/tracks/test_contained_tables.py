"""Journeys in JSON, KML, workbooks and layers, as apps and QGIS write them."""

import json

import geopandas
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import shapely
from made_workbook import workbook

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import format_of, read_recording

START_S = 1_778_659_200  # 2026-05-13T08:00:00Z
ROWS = range(5)
ISO = [f"2026-05-13T08:00:0{at}.000Z" for at in ROWS]
LAT_DEG = [60.17 + 1e-4 * at for at in ROWS]


def read(tmp_path, name, content, **columns):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    found = read_recording(path, options=ReadOptions(columns=columns))
    assert columns or format_of(path).name == found.format
    return found


def assert_placed(found, notes=()):
    positions = found.tables["positions"]
    assert positions["time_s"].tolist() == [START_S + at for at in ROWS]
    np.testing.assert_allclose(positions["lat_deg"], LAT_DEG, atol=1e-9)
    np.testing.assert_allclose(positions["lon_deg"], 24.94, atol=1e-9)
    for note in notes:
        assert any(note in one for one in found.notes), found.notes
    return positions


def gpsd():
    tpv = [
        {"class": "TPV", "device": "/dev/ttyACM0", "mode": 3, "time": ISO[at], "lat": LAT_DEG[at],
         "lon": 24.94, "alt": 12.0, "eph": 5.2, "track": 90.0, "speed": 8.0}
        for at in ROWS
    ]  # fmt: skip
    return [{"class": "VERSION"}, *(one for t in tpv for one in (t, {"class": "SKY"}))]


def test_lines_of_gpsd(tmp_path):
    """JSON was not read at all."""
    found = read(tmp_path, "gpsd.json", "\n".join(map(json.dumps, gpsd())) + "\n")
    positions = assert_placed(found, ["5 records of SKY left out", "columns as of gpsd"])
    assert positions[["speed_mps", "course_deg", "accuracy_m"]].iloc[0].tolist() == [8, 90, 5.2]


def test_positions_of_gpsd_without_a_fix_are_left_out(tmp_path):
    records = gpsd()
    records[1] |= {"mode": 1}
    found = read(tmp_path, "gpsd.json", "\n".join(map(json.dumps, records)))
    assert len(found.tables["positions"]) == len(ROWS) - 1


OWNTRACKS = [
    {"_type": "location", "tst": START_S + at, "lat": LAT_DEG[at], "lon": 24.94, "acc": 6,
     "vel": 36, "cog": 90}
    for at in ROWS
]  # fmt: skip


def test_owntracks(tmp_path):
    stamped = [f"{ISO[at]}\t*                 \t{json.dumps(OWNTRACKS[at])}" for at in ROWS]
    for name, content in (
        ("2026-05.rec", "\n".join(stamped) + "\n"),
        ("api.json", json.dumps({"count": 5, "data": OWNTRACKS})),
        ("list.json", json.dumps([*OWNTRACKS, {"_type": "lwt", "tst": START_S}], indent=2)),
    ):
        positions = assert_placed(read(tmp_path, name, content), ["columns as of OwnTracks"])
        assert positions["speed_mps"].tolist() == [10.0] * 5, name
        assert positions["accuracy_m"].tolist() == [6.0] * 5


def test_geojson_of_qgis(tmp_path):
    cell = {"mcc": 244, "mnc": 91, "tac": 3021, "ci": 12345678, "rsrp": -80}
    features = [
        {"type": "Feature", "properties": {"time": ISO[at], **cell},
         "geometry": {"type": "Point", "coordinates": [24.94, LAT_DEG[at]]}}
        for at in ROWS
    ]  # fmt: skip
    layer = {"type": "FeatureCollection", "features": features}
    found = read(tmp_path, "drive.geojson", json.dumps(layer))
    assert_placed(found)
    assert found.tables["radio"]["cell"].unique().tolist() == ["244-91-3021-12345678"]
    name = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    assert_placed(read(tmp_path, "drive.geojson", json.dumps({"crs": name, **layer})))
    name["properties"]["name"] = "urn:ogc:def:crs:EPSG::3067"
    with pytest.raises(InputError, match="export the layer in WGS 84"):
        read(tmp_path, "drive.geojson", json.dumps({"crs": name, **layer}))


def test_objects_within_records_and_lists_of_cells(tmp_path):
    """As apps of developers write them, and Mozilla's location service takes them."""
    towers = [
        {"radioType": "lte", "mobileCountryCode": 244, "mobileNetworkCode": 91,
         "locationAreaCode": 3021, "cellId": 12345678 + at, "signalStrength": -80 - at}
        for at in range(2)
    ]  # fmt: skip
    items = [
        {"timestamp": 1000 * (START_S + at), "cellTowers": towers,
         "position": {"latitude": LAT_DEG[at], "longitude": 24.94}}
        for at in ROWS
    ]  # fmt: skip
    found = read(tmp_path, "upload.json", json.dumps({"items": items}))
    assert_placed(found)
    radio = found.tables["radio"]
    assert radio["ci"].tolist() == [12345678, 12345679] * 5
    assert radio["level_dbm"].tolist() == [-80, -81] * 5
    assert set(radio["technology"]) == {"LTE"}


def test_names_of_json_may_be_given(tmp_path):
    own = [{"zeit": ISO[at], "ort": {"breite": LAT_DEG[at], "laenge": 24.94}} for at in ROWS]
    names = {"time": "zeit", "lat_deg": "breite", "lon_deg": "laenge"}
    assert_placed(read(tmp_path, "own.json", json.dumps(own), **names))


def test_json_that_is_cut_off_is_read_until_then(tmp_path):
    for content in (json.dumps(OWNTRACKS), json.dumps({"n": 5, "data": OWNTRACKS})):
        found = read(tmp_path, "cut.json", content[:-90])
        assert len(found.tables["positions"]) == 4
        assert any("cut off or damaged" in note for note in found.notes)
    lines = [json.dumps(one) for one in OWNTRACKS]
    lines[2] = lines[2][:40]
    found = read(tmp_path, "cut.jsonl", "\n".join(lines))
    assert len(found.tables["positions"]) == 4


@pytest.mark.parametrize("content", ["[" * 100_000, '{"a":' * 100_000, '[{"lat": 1, "lon": 2', "{"])
def test_hostile_json_is_refused(tmp_path, content):
    with pytest.raises(InputError):
        read_recording_of(tmp_path, content)


def test_json_nested_deep_is_refused(tmp_path):
    inner = {"lat": 60.0, "lon": 24.0}
    for _ in range(20):
        inner = {"in": inner}
    with pytest.raises(InputError, match="nested deeper"):
        read_recording_of(tmp_path, json.dumps([inner]))


def read_recording_of(tmp_path, content):
    path = tmp_path / "own.json"
    path.write_text(content)
    return read_recording(path)


def test_json_of_sensor_logger(tmp_path):
    records = [{"sensor": "Metadata", "version": "2"}]
    for at in ROWS:
        time = {"time": str((START_S + at) * 10**9), "seconds_elapsed": str(at)}
        place = {"latitude": str(LAT_DEG[at]), "longitude": "24.94", "speed": "-1"}
        axes = {"x": "0.1", "y": "0.2", "z": "0.3"}
        records += [{"sensor": "GyroscopeUncalibrated", **time, **axes}]
        records += [{"sensor": "Gyroscope", **time, **axes, "z": "0.4"}]
        records += [
            {"sensor": "Accelerometer", **time, **axes},
            {"sensor": "Location", **time, **place},
        ]
    found = read(tmp_path, "walk.json", json.dumps(records))
    assert found.format == "sensorlogger"
    positions = assert_placed(
        found, ["GyroscopeUncalibrated: 5 rows not used (a second gyroscope)"]
    )
    assert positions["speed_mps"].isna().all()
    assert found.tables["gyroscope"]["z_radps"].tolist() == [0.4] * 5
    assert len(found.tables["linear_acceleration"]) == 5
    assert not found.unusable


KML = (
    '<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2" '
    'xmlns:gx="http://www.google.com/kml/ext/2.2"><Document>{}</Document></kml>'
)


def test_tracks_and_placemarks_of_kml(tmp_path):
    whens = "".join(f"<when>{one}</when>" for one in ISO)
    coords = "".join(f"<gx:coord>24.94 {lat} 10</gx:coord>" for lat in LAT_DEG)
    track = KML.format(f"<Placemark><gx:Track>{whens}{coords}</gx:Track></Placemark>")
    assert_placed(read(tmp_path, "track.kml", track))
    marks = "".join(
        f'<Placemark id="{at}"><name>{at}</name><TimeStamp><when>{ISO[at]}</when></TimeStamp>'
        f'<ExtendedData><Data name="rsrp"><value>-8{at}</value></Data><Data name="ci"><value>123'
        f"</value></Data></ExtendedData><Point><coordinates>24.94,{LAT_DEG[at]},10</coordinates>"
        "</Point></Placemark>"
        for at in ROWS
    )
    found = read(tmp_path, "marks.kml", KML.format(marks))
    assert_placed(found)
    assert found.tables["radio"]["level_dbm"].tolist() == [-80, -81, -82, -83, -84]
    cut = read(tmp_path, "cut.kml", KML.format(marks)[:-60])
    assert len(cut.tables["positions"]) == 4
    assert any("cut off or damaged" in note for note in cut.notes)


@pytest.mark.parametrize(
    ("inner", "told"),
    [
        ("<Placemark><LineString>1,2 3,4</LineString></Placemark>", "a line without times"),
        ("<Placemark><name>x</name></Placemark>", "export GPX"),
        ("<!ENTITY x>", "KML without entities"),
        ("<Placemark>" * 50_000, "export GPX"),
    ],
)  # fmt: skip
def test_kml_without_times_is_refused(tmp_path, inner, told):
    path = tmp_path / "line.kml"
    path.write_text(KML.format(inner))
    with pytest.raises(InputError, match=told):
        read_recording(path)


def test_a_workbook(tmp_path):
    head = ["Time", "Latitude", "Longitude", "Speed [km/h]", "RSRP [dBm]", "Cell ID", "MCC", "MNC"]
    rows = [[ISO[at], LAT_DEG[at], 24.94, 36.0, -80, 123, 244, 91] for at in ROWS]
    found = read(tmp_path, "drive.xlsx", workbook([head, *rows], [["other"]]))
    positions = assert_placed(found, ["sheet 'S1' of a workbook; 1 more not read"])
    assert positions["speed_mps"].tolist() == pytest.approx([10.0] * 5)
    assert found.tables["radio"]["level_dbm"].tolist() == [-80.0] * 5


def test_a_layer_of_points(tmp_path):
    points = [shapely.Point(24.94, lat) for lat in LAT_DEG]
    table = {"time": ISO, "rsrp": [-80, -81, None, -83, -84], "ci": [123] * 5}
    frame = geopandas.GeoDataFrame(table, geometry=points, crs=4326)
    path = tmp_path / "drive.gpkg"
    frame.to_crs(3067).to_file(path, layer="walk")
    found = read_recording(path)
    assert_placed(found, ["layer walk read as a table of 5 rows"])
    assert found.tables["radio"]["level_dbm"].tolist()[:2] == [-80.0, -81.0]
    frame.to_file(path, layer="again")
    with pytest.raises(InputError, match="found walk, again"):
        read_recording(path)


def test_of_several_layers_of_points_the_one_with_times(tmp_path):
    """Beside antennas on the same map it was refused, without a word on how to choose."""
    points = [shapely.Point(24.94, lat) for lat in LAT_DEG]
    walk = geopandas.GeoDataFrame({"Time": ISO, "rsrp": [-80.0] * 5}, geometry=points, crs=4326)
    path = tmp_path / "drive.gpkg"
    walk.to_file(path, layer="walk")
    walk[["rsrp", "geometry"]].to_file(path, layer="antennas")
    found = read_recording(path)
    assert_placed(found, ["layers of points without times not read: antennas"])
    walk.rename(columns={"Time": "Zeit"}).to_file(path, layer="other")
    options = ReadOptions(columns={"time": "Zeit"})
    assert_placed(read_recording(path, options=options), ["without the columns named not read"])
    walk.to_file(path, layer="again")
    with pytest.raises(InputError, match=r"walk, antennas, other, again.*--column time=COLUMN"):
        read_recording(path)


def test_of_several_layers_with_times_the_only_one_with_rows(tmp_path):
    """Beside the empty layers of other days, as apps prepare them, it was refused."""
    points = [shapely.Point(24.94, lat) for lat in LAT_DEG]
    walk = geopandas.GeoDataFrame({"time": ISO, "rsrp": [-80.0] * 5}, geometry=points, crs=4326)
    path = tmp_path / "drive.gpkg"
    walk[:0].to_file(path, layer="monday", geometry_type="Point")
    walk.to_file(path, layer="tuesday")
    walk[:0].to_file(path, layer="wednesday", geometry_type="Point")
    assert format_of(path) is not None
    found = read_recording(path)
    assert_placed(found, ["empty layers of points not read: monday, wednesday"])
    walk.to_file(path, layer="thursday")
    with pytest.raises(InputError, match="found tuesday, thursday"):
        read_recording(path)
    path.unlink()
    walk[:0].to_file(path, layer="monday", geometry_type="Point")
    walk[:0].to_file(path, layer="tuesday", geometry_type="Point")
    with pytest.raises(InputError, match="found monday, tuesday"):
        read_recording(path)


def test_other_json_is_no_recording(tmp_path):
    wide = json.dumps({f"{at}": {"lat": 60.0, "lon": 24.0, "time": at} for at in range(20_000)})
    plain = '{"version": 2, "crs": "EPSG:3067"}'
    for content in (plain, '[{"time": 1}]', "[1, 2]", '{"lat": 1}', wide):
        path = tmp_path / "own.json"
        path.write_text(content)
        assert format_of(path) is None
        with pytest.raises(InputError, match="JSON without records of places or cells"):
            read_recording(path)


TCX = (
    '<?xml version="1.0"?><TrainingCenterDatabase><Activities><Activity><Lap><Track>{}</Track>'
    "</Lap></Activity></Activities></TrainingCenterDatabase>"
)


def test_points_of_tcx(tmp_path):
    """They were refused."""
    points = "".join(
        f"<Trackpoint><Time>{ISO[at]}</Time><Position><LatitudeDegrees>{LAT_DEG[at]}"
        "</LatitudeDegrees><LongitudeDegrees>24.94</LongitudeDegrees></Position><Extensions><ns3:TPX>"
        "<ns3:Speed>8.0</ns3:Speed></ns3:TPX></Extensions></Trackpoint>"
        for at in ROWS
    )
    indoors = f"<Trackpoint><Time>{ISO[0]}</Time></Trackpoint>"
    positions = assert_placed(read(tmp_path, "run.tcx", TCX.format(points + indoors)))
    assert positions["speed_mps"].tolist() == [8.0] * 5
    with pytest.raises(InputError, match="recorded indoors"):
        read(tmp_path, "run.tcx", TCX.format(indoors))


@pytest.mark.parametrize("zone", ["UTC", "Europe/Helsinki", None])
def test_a_data_frame_in_parquet(tmp_path, zone):
    """It was refused, and converting it to CSV left to the reader."""
    time = pd.to_datetime([START_S + at for at in ROWS], unit="s", utc=True)
    time = time.tz_convert(zone) if zone else time.tz_localize(None)
    table = {"lat": LAT_DEG, "lon": 24.94, "rsrp": [-80, None, -82, -83, -84], "ci": [123] * 5}
    frame = pd.DataFrame({**table, "role": pd.Categorical(["serving"] * 5), "x": [[1]] * 5})
    path = tmp_path / "drive.parquet"
    for index in (False, True):
        given = frame.set_index(time) if index else frame.assign(time=time)
        given.to_parquet(path)
        found = read_recording(path)
        assert_placed(found, ["1 column without single values left out"])
        assert found.tables["radio"]["level_dbm"].tolist()[2:] == [-82.0, -83.0, -84.0]
        assert found.clock.kind == ("utc" if zone else "local")
    # Beside others it may be a part of a result.
    assert format_of(path) is None
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(InputError, match="a Parquet file that can be read"):
        read_recording(path)


def test_geojson_of_an_estimate_is_no_recording(tmp_path):
    features = [
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [24.94, LAT_DEG[at]]},
         "properties": {"time_s": at, "filter": "bayes", "status": "LOST", "radius_95_m": 9.0}}
        for at in ROWS
    ]  # fmt: skip
    layer = json.dumps({"type": "FeatureCollection", "features": features})
    with pytest.raises(InputError, match="what a filter estimated"):
        read(tmp_path, "estimate.geojson", layer)


def test_parquet_of_mapfilter_itself_is_no_recording(tmp_path):
    """Positions that a filter estimated would be taken for fixes."""
    frame = pd.DataFrame({"time": ISO, "lat": LAT_DEG, "lon": 24.94})
    path = tmp_path / "estimate.parquet"
    table = pa.Table.from_pandas(frame)
    pq.write_table(table.replace_schema_metadata({"mapfilter": "{}"}), path)
    with pytest.raises(InputError, match="what a filter estimated"):
        read_recording(path)
    frame.to_parquet(path)
    assert_placed(read_recording(path))
    for head in ("log.json", "manifest.json"):
        (tmp_path / head).write_text("{}")
        with pytest.raises(InputError, match="name the folder that it lies in"):
            read_recording(path)
        (tmp_path / head).unlink()


def test_cells_in_the_extensions_of_gpx(tmp_path):
    """They were left out without a word."""
    points = "".join(
        f'<trkpt lat="{LAT_DEG[at]}" lon="24.94"><ele>10</ele><time>{ISO[at]}</time><extensions>'
        f"<net:mcc>244</net:mcc><net:mnc>91</net:mnc><net:tac>3021</net:tac><net:ci>123</net:ci>"
        f"<net:rsrp>-8{at}</net:rsrp></extensions></trkpt>"
        for at in ROWS
    )
    text = f'<gpx version="1.1" creator="own"><trk><trkseg>{points}</trkseg></trk></gpx>'
    found = read(tmp_path, "walk.gpx", text)
    positions = assert_placed(found, ["GPX with cells read as a table of 5 rows"])
    assert positions["altitude_m"].tolist() == [10.0] * 5
    assert found.tables["radio"]["cell"].unique().tolist() == ["244-91-3021-123"]
    assert found.tables["radio"]["level_dbm"].tolist() == [-80, -81, -82, -83, -84]


@pytest.mark.parametrize("separator", [",", ";"])
@pytest.mark.parametrize(
    "point", ["POINT ({} {})", "SRID=4326;POINT({} {})", "Point Z ({} {} 10.5)"]
)
def test_points_as_well_known_text(tmp_path, separator, point):
    """As geopandas writes them by to_csv; a table was without positions."""
    if separator in point:
        point = f'"{point}"'
    rows = [separator.join([ISO[at], point.format(24.94, LAT_DEG[at]), "-80"]) for at in ROWS]
    content = "\n".join([separator.join(["time", "geometry", "rsrp"]), *rows]) + "\n"
    found = read(tmp_path, "drive.csv", content)
    assert_placed(found, ["geometry: points taken for longitude and latitude"])
    assert found.tables["radio"]["level_dbm"].tolist() == [-80.0] * 5


def test_points_in_metres_are_refused(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text(f"time,geometry\n{ISO[0]},POINT (385000 6672000)\n")
    with pytest.raises(InputError, match="not degrees"):
        read_recording(path)
