"""Estimates as files: everything comes back, and nothing damaged does."""

import json
from dataclasses import fields, replace
from datetime import UTC, datetime
from math import inf, nan
from xml.etree import ElementTree

import geopandas
import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.errors import OutputError, StoreError
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import project
from mapfilter.positioning import estimate_store
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_store import (
    read_estimate,
    write_estimate,
    write_geojson,
    write_gpx,
)
from mapfilter.positioning.step_output import Fix, UnusedReading

CRS = "EPSG:32629"
UNKNOWN = np.full((2, 2), nan), np.full(3, nan)
PLACES = [(531_002.5, 4_555_997.5), (531_007.5, 4_555_997.5)]


def make_estimate(crs=CRS, places=PLACES):
    known = np.array([[4.0, -1.5], [-1.5, 9.0]]), np.array([3.0, 4.5, 9.25])
    fixes = [
        Fix(0.0, nan, nan, *UNKNOWN, Status.SEARCHING, 92, nan, 0, nan, Reason.NO_READING),
        Fix(
            0.48,
            *places[0],
            *known,
            Status.CONVERGED,
            1,
            0.75,
            1 << 45,
            0.5,
            Reason.USED,
            12.5,
            21.25,
        ),
        Fix(
            0.48,
            *places[1],
            *UNKNOWN,
            Status.TRACKING,
            1,
            1.0,
            -7,
            nan,
            Reason.NOT_MOVED_ENOUGH,
            14.5,
            inf,
        ),
        Fix(0.96, nan, nan, *UNKNOWN, Status.LOST, 0, nan, 0, nan, Reason.NO_CANDIDATES_LEFT),
    ]
    unused = [
        UnusedReading(0.0, "motion", "", Reason.NOT_STARTED),
        UnusedReading(0.48, "serving", 'Zelle "Ä/1"', Reason.UNKNOWN_CELL),
        UnusedReading(0.0, "gnss", "", Reason.NOT_USED_BY_FILTER, 120),
    ]
    return TrackEstimate.of_fixes(
        crs, "candidate", fixes, start_utc_s=1_700_000_000.25, unused=unused
    )


EMPTY = TrackEstimate.of_fixes(CRS, "candidate", [])
NOWHERE = TrackEstimate.of_fixes(CRS, "candidate", [make_estimate().fix(0)])


def assert_same(a, b):
    for column in fields(TrackEstimate):
        x, y = getattr(a, column.name), getattr(b, column.name)
        if isinstance(x, np.ndarray):
            assert x.dtype == y.dtype, column.name
            assert np.array_equal(x, y, equal_nan=True), column.name
        elif isinstance(x, float):
            assert x == y or np.isnan([x, y]).all(), column.name
        else:
            assert x == y, column.name


@pytest.mark.parametrize("estimate", [make_estimate(), EMPTY, NOWHERE])
def test_everything_comes_back(tmp_path, estimate):
    path = tmp_path / "out" / "estimate.parquet"
    write_estimate(estimate, path)
    assert_same(read_estimate(path), estimate)
    assert [p.name for p in path.parent.iterdir()] == ["estimate.parquet"]


def test_paths_may_be_text(tmp_path):
    estimate = make_estimate()
    for write, name in (
        (write_estimate, "e.parquet"), (write_gpx, "e.gpx"), (write_geojson, "e.geojson")
    ):  # fmt: skip
        write(estimate, str(tmp_path / name))
        assert (tmp_path / name).stat().st_size
    assert_same(read_estimate(str(tmp_path / "e.parquet")), estimate)


@settings(max_examples=30)
@given(st.lists(st.tuples(*[st.floats(allow_nan=True, allow_infinity=False)] * 5), max_size=6))
def test_all_floating_point_values_come_back(tmp_path_factory, rows):
    path = tmp_path_factory.getbasetemp() / "any.parquet"
    fixes = [
        Fix(
            float(i), e, n, np.array([[a, b], [b, c]]), np.array([a, b, c]),
            Status.TRACKING, 1, a, 0, b, Reason.USED,
        )
        for i, (e, n, a, b, c) in enumerate(rows)
    ]  # fmt: skip
    estimate = TrackEstimate.of_fixes(CRS, "candidate", fixes)
    write_estimate(estimate, path)
    assert_same(read_estimate(path), estimate)


def test_equal_estimates_give_equal_bytes_wherever_they_are_written(tmp_path):
    paths = [tmp_path / "a" / "x.parquet", tmp_path / "run=1" / "y=2.parquet"]
    for path in paths:
        write_estimate(make_estimate(), path)
        write_estimate(make_estimate(), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_geopandas_opens_it_with_its_places_and_system(tmp_path):
    write_estimate(make_estimate(), tmp_path / "estimate.parquet")
    frame = geopandas.read_parquet(tmp_path / "estimate.parquet")
    assert frame.crs.to_epsg() == 32629
    assert frame.geometry.isna().tolist() == [True, False, False, True]
    assert [(p.x, p.y) for p in frame.geometry[1:3]] == PLACES
    assert frame["status"].tolist() == ["SEARCHING", "CONVERGED", "TRACKING", "LOST"]
    assert frame["way_id"].tolist() == [0, 1 << 45, -7, 0]


@pytest.fixture
def written(tmp_path):
    path = tmp_path / "estimate.parquet"
    write_estimate(make_estimate(), path)
    return path


def refused(path, match):
    with pytest.raises(StoreError, match=match) as caught:
        read_estimate(path)
    assert str(path) in caught.value.faults[0].where
    return caught.value


def rewrite(path, change):
    """Write the file again with another table."""
    pq.write_table(change(pq.ParquetFile(path).read()), path)


def with_meta(path, **changes):
    def change(table):
        meta = json.loads(table.schema.metadata[b"mapfilter"])
        kept = {k: v for k, v in (meta | changes).items() if v is not Ellipsis}
        return table.replace_schema_metadata(
            {**table.schema.metadata, b"mapfilter": json.dumps(kept).encode()}
        )

    rewrite(path, change)


def test_a_file_that_is_missing_or_a_folder(tmp_path):
    refused(tmp_path / "none.parquet", "No such file")
    refused(tmp_path, "Is a directory")


def test_a_file_cut_off_anywhere_is_refused(written):
    data = written.read_bytes()
    for end in [0, 1, 4, 8, len(data) // 2, len(data) - 8, len(data) - 1]:
        written.write_bytes(data[:end])
        refused(written, "cut off")


def test_a_flipped_bit_in_any_column_is_refused(written):
    group = pq.ParquetFile(written).metadata.row_group(0)
    data = written.read_bytes()
    for column in (group.column(i) for i in range(group.num_columns)):
        begin = column.dictionary_page_offset or column.data_page_offset
        bad = bytearray(data)
        bad[begin + column.total_compressed_size - 1] ^= 1
        written.write_bytes(bad)
        refused(written, "an estimate")


def test_other_files_are_refused(written):
    rewrite(written, lambda table: table.replace_schema_metadata(None))
    refused(written, "Parquet that mapfilter did not write")
    written.write_text('<?xml version="1.0"?><gpx/>')
    refused(written, "Parquet")


def test_a_newer_version_is_refused_with_what_to_do(written):
    with_meta(written, version=estimate_store.VERSION + 1)
    assert refused(written, "version <= 3, found 4").faults[0].hint == "a newer mapfilter"


def test_missing_columns_are_all_named(written):
    rewrite(written, lambda table: table.drop_columns(["east_m", "status"]))
    error = refused(written, "east_m")
    assert [f.where.rpartition(", ")[2] for f in error.faults] == ["east_m", "status"]


@pytest.mark.parametrize(
    "changes",
    [
        {"crs": ...}, {"filter": ...}, {"unused": ...}, {"start_utc_s": ...}, {"version": ...},
        {"version": "one"}, {"unused": [[1.0, "motion"]]}, {"unused": [[0, "motion", "", "why"]]},
        {"unused": None},
    ],
)  # fmt: skip
def test_a_damaged_description_is_refused(written, changes):
    with_meta(written, **changes)
    refused(written, "damaged")


@pytest.mark.parametrize(("name", "row", "value"), [("status", 1, "HAPPY"), ("time_s", 0, nan)])
def test_a_damaged_value_is_refused(written, name, row, value):
    def change(table):
        values = table[name].to_pylist()
        values[row] = value
        return table.set_column(table.column_names.index(name), name, [values])

    rewrite(written, change)
    refused(written, "damaged")


@pytest.mark.parametrize("write", [write_estimate, write_gpx, write_geojson])
def test_an_output_that_cannot_be_written(tmp_path, write):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="a place that can be written"):
        write(make_estimate(), tmp_path / "file" / "estimate")


# Places whose east and north, or longitude and latitude, cannot be mistaken for each other.
WORLD = [("EPSG:32629", -8.6238, 41.1326), ("EPSG:32734", 18.4241, -33.9249),
         ("EPSG:2193", 174.7762, -41.2865)]  # fmt: skip


def estimate_at(crs, lon, lat):
    east, north = project(crs, [lon, lon + 1e-4], [lat, lat + 1e-4])
    return make_estimate(crs, list(zip(east.tolist(), north.tolist(), strict=True)))


@pytest.mark.parametrize(("crs", "lon", "lat"), WORLD)
def test_gpx_holds_the_located_epochs_in_longitude_and_latitude(tmp_path, crs, lon, lat):
    path = tmp_path / "track.gpx"
    write_gpx(estimate_at(crs, lon, lat), path, name="walk <1> & back")
    assert b"nan" not in path.read_bytes().lower()
    space = {"g": "http://www.topografix.com/GPX/1/1"}
    root = ElementTree.parse(path).getroot()
    assert root.get("version") == "1.1"
    assert root.findtext("g:trk/g:name", namespaces=space) == "walk <1> & back"
    points = root.findall("g:trk/g:trkseg/g:trkpt", space)
    found = [(float(p.get("lon")), float(p.get("lat"))) for p in points]
    assert np.allclose(found, [(lon, lat), (lon + 1e-4, lat + 1e-4)], rtol=0, atol=2e-7)
    moment = datetime.fromisoformat(points[0].findtext("g:time", namespaces=space))
    assert moment == datetime.fromtimestamp(1_700_000_000.73, UTC)


def test_gpx_of_an_unknown_start_has_no_times(tmp_path):
    write_gpx(replace(make_estimate(), start_utc_s=nan), tmp_path / "track.gpx")
    text = (tmp_path / "track.gpx").read_text()
    assert text.count("<trkpt") == 2
    assert "<time>" not in text


def test_geojson_of_an_unknown_start_has_no_times(tmp_path):
    write_geojson(replace(make_estimate(), start_utc_s=nan), tmp_path / "track.geojson")
    points = [one["properties"] for one in strict_json(tmp_path / "track.geojson")["features"]]
    assert all("time" not in one for one in points)
    assert points[-1]["time_s"] == 0.48


def strict_json(path):
    def never(name):
        raise AssertionError(f"{name} is no JSON")

    return json.loads(path.read_text(), parse_constant=never)


@pytest.mark.parametrize(("crs", "lon", "lat"), WORLD)
def test_geojson_holds_a_line_and_the_located_epochs(tmp_path, crs, lon, lat):
    path = tmp_path / "track.geojson"
    write_geojson(estimate_at(crs, lon, lat), path)
    line, *points = strict_json(path)["features"]
    expected = [(lon, lat), (lon + 1e-4, lat + 1e-4)]
    assert line["geometry"]["type"] == "LineString"
    assert np.allclose(line["geometry"]["coordinates"], expected, rtol=0, atol=2e-7)
    places = [point["geometry"]["coordinates"] for point in points]
    assert places == line["geometry"]["coordinates"]
    assert [point["properties"] for point in points] == [
        {
            "time": "2023-11-14T22:13:20.730Z",
            "time_s": 0.48,
            "status": "CONVERGED",
            "radius_95_m": 9.25,
            "protection_m": 21.25,
        },
        {
            "time": "2023-11-14T22:13:20.730Z",
            "time_s": 0.48,
            "status": "TRACKING",
            "radius_95_m": None,
            "protection_m": None,
        },
    ]
    frame = geopandas.read_file(path)
    assert frame.crs.to_epsg() == 4326


@pytest.mark.parametrize("estimate", [EMPTY, NOWHERE])
def test_nothing_located_gives_files_without_points(tmp_path, estimate):
    write_geojson(estimate, tmp_path / "track.geojson")
    write_gpx(estimate, tmp_path / "track.gpx")
    assert strict_json(tmp_path / "track.geojson") == {
        "type": "FeatureCollection", "features": [],
    }  # fmt: skip
    assert b"trkpt" not in (tmp_path / "track.gpx").read_bytes()


def test_files_of_the_first_version_have_no_levels(tmp_path):
    path = tmp_path / "estimate.parquet"
    write_estimate(make_estimate(), path)
    table = pq.read_table(path)
    meta = json.loads(table.schema.metadata[b"mapfilter"])
    assert meta["version"] == 3
    assert meta["unused"][-1][-1] == 120
    meta = {**meta, "unused": [one[:4] for one in meta["unused"]]}
    old = table.drop_columns(["radius_99_m", "protection_m"]).replace_schema_metadata(
        {**table.schema.metadata, b"mapfilter": json.dumps({**meta, "version": 1}).encode()}
    )
    pq.write_table(old, path)
    found = read_estimate(path)
    assert np.isnan(found.protection_m).all()
    assert np.isnan(found.radius_99_m).all()
    assert [one.readings for one in found.unused] == [1, 1, 1]
    assert np.array_equal(found.east_m, make_estimate().east_m, equal_nan=True)
    # A file of the present version without them is damaged.
    pq.write_table(old.replace_schema_metadata(table.schema.metadata), path)
    refused(path, "protection_m")


def test_geojson_has_the_level_or_none(tmp_path):
    write_geojson(make_estimate(), tmp_path / "e.geojson")
    features = json.loads((tmp_path / "e.geojson").read_text())["features"]
    points = [f["properties"] for f in features if f["geometry"]["type"] == "Point"]
    assert [point["protection_m"] for point in points] == [21.25, None]
