"""``mf.read_log`` has what the command ``convert`` has: format, offsets and a local origin."""

import numpy as np
import pytest

import mapfilter as mf

START_S = 1_777_629_600


@pytest.fixture
def walk(tmp_path):
    rows = (f"{START_S + n},{60.17 + 1e-5 * n},24.93,5" for n in range(30))
    (tmp_path / "walk.csv").write_text("\n".join(["time,lat_deg,lon_deg,accuracy_m", *rows, ""]))
    return tmp_path / "walk.csv"


@pytest.fixture
def room(tmp_path):
    rows = (f"{START_S + n},{1.5 * n},{2.0 * n}" for n in range(30))
    (tmp_path / "room.csv").write_text("\n".join(["time,east_m,north_m", *rows, ""]))
    return tmp_path / "room.csv"


@pytest.mark.parametrize("by", ["name", "path", "folder"])
def test_an_offset_moves_the_times_of_a_recording(walk, by):
    name = str(walk) if by == "path" else "walk.csv"
    log = mf.read_log(walk.parent if by == "folder" else walk, offsets_s={name: 5.0})
    assert log.start_utc_s == mf.read_log(walk).start_utc_s + 5


def test_an_origin_places_metres_of_a_local_frame(room):
    log = mf.read_log(room, origin_deg=(60.17, 24.94), crs="EPSG:32635")
    placed = mf.read_log(room, crs="EPSG:32635")
    east_m, north_m = 385_691.0, 6_672_132.0
    assert log.gnss["east_m"].iloc[0] == pytest.approx(east_m, abs=100)
    assert log.gnss["north_m"].iloc[0] == pytest.approx(north_m, abs=100)
    # Without it they are taken for those of the CRS.
    assert placed.gnss["east_m"].iloc[0] == 0


def test_a_format_is_taken_instead_of_that_of_the_content(walk):
    assert mf.read_log(walk, format="csv").gnss.equals(mf.read_log(walk).gnss)
    with pytest.raises(mf.MapfilterError, match=r'use format="\w+", or none') as refused:
        mf.read_log(walk, format="gpx")
    assert "--" not in str(refused.value)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"format": "kml"}, "format: expected one of gnettrack"),
        ({"format": 3}, "read_log, format: expected a text"),
        (
            {"offsets_s": {"run.csv": 5}},
            "the name of one of the recordings (walk.csv), found 'run.",
        ),
        ({"offsets_s": {"walk.csv": "5"}}, "read_log, offsets_s['walk.csv']: expected seconds"),
        (
            {"offsets_s": {"walk.csv": np.nan}},
            "offsets_s walk.csv: expected seconds, at most 1e+10",
        ),
        ({"offsets_s": {"walk.csv": 2e10}}, "offsets_s walk.csv: expected seconds, at most 1e+10"),
        ({"offsets_s": 5}, "read_log, offsets_s: expected the seconds to add to each file"),
        ({"origin_deg": (100.0, 20.0)}, "found 100, 20 (likely: longitude and latitude swapped)"),
        ({"origin_deg": (np.nan, 20.0)}, "origin_deg: expected a latitude and a longitude in deg"),
        ({"origin_deg": "60,24"}, "read_log, origin_deg: expected a latitude and a longitude in"),
        ({"origin_deg": (60.0,)}, "read_log, origin_deg: expected a latitude and a longitude in"),
    ],
)
def test_wrong_options_are_named_as_the_arguments(walk, wrong, told):
    with pytest.raises(mf.MapfilterError) as refused:
        mf.read_log(walk, **wrong)
    assert told in str(refused.value)


def test_all_wrong_options_are_told_together(walk):
    with pytest.raises(mf.MapfilterError) as refused:
        mf.read_log(walk, offsets_s={"a": 1.0}, origin_deg=(91, 0), factors={"turn_rad": 0.0})
    assert len(refused.value.faults) == 3


def test_a_track_log_is_projected_and_says_so(walk, tmp_path):
    mf.write_log(mf.read_log(walk), tmp_path / "log")
    other = mf.read_log(tmp_path / "log", crs="EPSG:3879")
    assert other.crs == "EPSG:3879"
    assert other.notes == ("projected from EPSG:32635 to EPSG:3879: positions",)
    placed = mf.read_log(walk, crs="EPSG:3879")
    np.testing.assert_allclose(other.fixes_m, placed.fixes_m, atol=1e-6)
    for crs in ("", "EPSG:32635", "+proj=utm +zone=35 +datum=WGS84"):
        assert mf.read_log(tmp_path / "log", crs=crs).notes == ()
    assert placed.notes == ()


def test_a_local_frame_keeps_its_metres_and_says_so(room, tmp_path):
    mf.write_log(mf.read_log(room), tmp_path / "log")
    own = mf.read_log(tmp_path / "log", crs="EPSG:3879")
    told = "crs = EPSG:3879 has no effect: the track log is in a local frame"
    assert own.notes[-1] == told
