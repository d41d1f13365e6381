"""What stands in the files of an estimate, besides what is read back."""

import json
from itertools import chain
from math import nan
from xml.etree import ElementTree

import geopandas
import numpy as np
import pyarrow.parquet as pq
import pytest

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_store import (
    read_estimate,
    write_estimate,
    write_geojson,
    write_gpx,
)
from mapfilter.positioning.step_output import Fix


def fix(time_s, east_m, north_m, status=Status.TRACKING):
    covariance, radii_m = np.array([[4.0, 1.0], [1.0, 9.0]]), np.array([3.0, 4.5, 9.25])
    return Fix(time_s, east_m, north_m, covariance, radii_m, status, 1, 0.5, 0, nan,
               Reason.USED)  # fmt: skip


@pytest.fixture
def estimate():
    """Three epochs, of which one has only its east."""
    fixes = [fix(0.0, 531_002.123, 4_555_997.567), fix(1.0, 531_004.0, nan),
             fix(2.0, 531_006.789, 4_555_990.321)]  # fmt: skip
    return TrackEstimate.of_fixes("EPSG:32629", "made", fixes)


def test_a_table_has_its_columns_and_points_where_both_coordinates_are_known(tmp_path, estimate):
    write_estimate(estimate, tmp_path / "one.parquet")
    names = pq.read_table(tmp_path / "one.parquet").column_names
    assert names == [*estimate.to_dataframe(), "geometry"]
    points = geopandas.read_parquet(tmp_path / "one.parquet").geometry
    assert points.isna().tolist() == [False, True, False]
    assert (points[2].x, points[2].y) == (531_006.789, 4_555_990.321)
    back = read_estimate(tmp_path / "one.parquet")
    np.testing.assert_array_equal(back.covariance_m2, estimate.covariance_m2)
    np.testing.assert_array_equal(back.radii_m, estimate.radii_m)
    assert back.radii_m.shape == (3, 3)


def test_a_gpx_file_declares_itself_and_its_namespace(tmp_path, estimate):
    write_gpx(estimate, tmp_path / "one.gpx")
    text = (tmp_path / "one.gpx").read_text()
    assert text.startswith("<?xml version='1.0' encoding='utf-8'?>\n<gpx xmlns=")
    assert text.count("<trkpt ") == 2
    assert "ns0" not in text


def test_coordinates_have_seven_decimals_which_is_a_centimetre(tmp_path, estimate):
    write_geojson(estimate, tmp_path / "one.geojson")
    points = json.loads((tmp_path / "one.geojson").read_text())["features"]
    for place in (one["geometry"]["coordinates"] for one in points):
        assert [len(str(one).partition(".")[2]) for one in place] == [7, 7]


def test_points_state_milliseconds_and_centimetres_and_one_alone_is_no_line(tmp_path):
    one = Fix(12.34567, 531_002.0, 4_555_997.0, np.eye(2), np.array([3.0, 4.5, 9.2567]),
              Status.TRACKING, 1, 0.5, 0, nan, Reason.USED, protection_m=21.2567)  # fmt: skip
    path = tmp_path / "one.geojson"
    write_geojson(TrackEstimate.of_fixes("EPSG:32629", "made", [one]), path)
    (point,) = json.loads(path.read_text())["features"]
    assert point["geometry"]["type"] == "Point"
    assert point["properties"] == {
        "time_s": 12.346, "status": "TRACKING", "radius_95_m": 9.26, "protection_m": 21.26,
    }  # fmt: skip


S, C, T, U, L, O = Status  # noqa: E741


@pytest.mark.parametrize(
    ("status", "stretches"),
    [
        ([S, S, C, T, U, L, L, U, T, O], [[2, 3, 4], [7, 8]]),
        ([C, T, S, C, L, C, T], [[0, 1], [3], [5, 6]]),
        ([S, L, O], []),
    ],
)
def test_only_located_epochs_are_written_and_the_track_is_broken_between(
    tmp_path, status, stretches
):
    fixes = [
        fix(float(i), 531_000.0 + i, 4_555_990.0, one) for i, one in enumerate(status)
    ]  # fmt: skip
    estimate = TrackEstimate.of_fixes("EPSG:32629", "made", fixes, start_utc_s=0.0)
    write_gpx(estimate, tmp_path / "one.gpx")
    root, space = (
        ElementTree.parse(tmp_path / "one.gpx").getroot(),
        "{http://www.topografix.com/GPX/1/1}",
    )
    segments = [
        [int(point.findtext(f"{space}time")[17:19]) for point in segment.iter(f"{space}trkpt")]
        for segment in root.iter(f"{space}trkseg")
    ]
    assert segments == stretches
    write_geojson(estimate, tmp_path / "one.geojson")
    features = json.loads((tmp_path / "one.geojson").read_text())["features"]
    points = [one for one in features if one["geometry"]["type"] == "Point"]
    assert [one["properties"]["time_s"] for one in points] == list(chain.from_iterable(stretches))
    assert {one["properties"]["status"] for one in points} <= set(map(str, (C, T, U)))
    lines = [one["geometry"]["coordinates"] for one in features if one not in points]
    assert list(map(len, lines)) == [len(one) for one in stretches if len(one) > 1]
    places = {one["properties"]["time_s"]: one["geometry"]["coordinates"] for one in points}
    assert lines == [[places[i] for i in one] for one in stretches if len(one) > 1]
