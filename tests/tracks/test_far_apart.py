"""Positions of one journey that lie kilometres apart: degrees exchanged or mirrored."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.checks.far_apart import _apart_m
from mapfilter.tracks.log import make_log
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions

TIME_S = np.arange(60.0)
LAT, LON = 60.0 + 1e-4 * TIME_S, 25.0 + 2e-4 * TIME_S


def written(tmp_path, name, lat, lon, begin_s=1.78e9):
    path = tmp_path / f"{name}.csv"
    table = pd.DataFrame({"time": begin_s + TIME_S, "latitude": lat, "longitude": lon})
    table.to_csv(path, index=False)
    return path


@pytest.mark.parametrize("begin_s", [1.78e9, 0.0])
@pytest.mark.parametrize("is_truth", [True, False])
@pytest.mark.parametrize(
    ("lat", "lon", "cause"),
    [
        (LON, LAT, "latitude and longitude swapped in one of the two"),
        (LAT, -LON, "a lost sign of longitude in one of the two"),
        (-LAT, LON, "a lost sign of latitude in one of the two"),
    ],
)
def test_exchanged_degrees_of_one_recording_are_refused(
    tmp_path, begin_s, is_truth, lat, lon, cause
):
    one = written(tmp_path, "one", LAT, LON, begin_s)
    other = written(tmp_path, "other", lat, lon, begin_s)
    options = OpenOptions(combine=CombineOptions(truth=[other] if is_truth else []))
    paths = [one] if is_truth else [one, other]
    with pytest.raises(InputError) as error:
        open_log(paths, options=options)
    (fault,) = error.value.faults
    assert fault.where == f"{other}, latitude and longitude"
    assert "near 60.00295, 25.00590 (one.csv)" in fault.expected
    assert "km off" in fault.got
    assert fault.hint == cause


@pytest.mark.parametrize("begin_s", [1.78e9, 0.0])
def test_recordings_kilometres_apart_are_noted(tmp_path, begin_s):
    one = written(tmp_path, "one", LAT, LON, begin_s)
    other = written(tmp_path, "other", LAT + 0.1, LON, begin_s)
    notes = open_log([one, other]).log.notes
    (told,) = [note for note in notes if "km from those" in note]
    assert told.startswith("other.csv: positions lie 11.1 km from those of the same times in one")
    assert not any("agree within" in note for note in notes)
    near = written(tmp_path, "near", LAT + 0.01, LON, begin_s)
    assert not any("km from" in note for note in open_log([one, near]).log.notes)


def test_places_elsewhere_do_not_tell_a_zone(tmp_path):
    one = written(tmp_path, "one", LAT, LON)
    local = pd.to_datetime(1.78e9 + 3600 + TIME_S, unit="s").strftime("%Y-%m-%dT%H:%M:%S")
    rows = pd.DataFrame({"time": local, "latitude": LAT + 1.0, "longitude": LON})
    rows.to_csv(tmp_path / "other.csv", index=False)
    notes = open_log([one, tmp_path / "other.csv"]).log.notes
    assert any("(by the overlap of times)" in note for note in notes)


@pytest.mark.parametrize(
    ("moved", "cause"),
    [
        (lambda rows: rows.rename(columns={"east_m": "north_m", "north_m": "east_m"}), "east and"),
        (lambda rows: rows.assign(east_m=rows["east_m"] + 30_000), "another journey, or fixes"),
    ],
)
def test_fixes_far_from_the_truth_of_a_log_are_noted(moved, cause):
    places = pd.DataFrame(
        {"time_s": TIME_S, "east_m": 385_000 + 5 * TIME_S, "north_m": 6_672_000 + 3 * TIME_S}
    )
    (note,) = make_log("EPSG:32635", gnss=places, truth=moved(places)).notes
    assert note.startswith("gnss lies ")
    assert f"km from the truth (median) (likely: {cause}" in note
    assert not make_log("EPSG:32635", gnss=places, truth=places.assign(east_m=386_000.0)).notes


@pytest.mark.parametrize("north_m", [6_672_000.0, 6_672_000 + 3 * TIME_S])
def test_fixes_far_from_a_truth_on_round_metres_are_noted(north_m):
    """At rest, or along a meridian of the grid."""
    truth = pd.DataFrame({"time_s": TIME_S, "east_m": 385_000.0, "north_m": north_m})
    (note,) = make_log("EPSG:32635", gnss=truth.assign(east_m=395_000.0), truth=truth).notes
    assert note.startswith("gnss lies 10.0 km from the truth (median)")


@pytest.mark.parametrize(
    ("lat", "lon"),
    [(50.5, 120.0), (-35.5, 174.8), (69.5, -160.0), (65.2, 180.0), (-17.5, -179.999)],
)
@pytest.mark.parametrize("is_truth", [True, False])
def test_one_journey_in_two_files_lies_together(tmp_path, lat, lon, is_truth):
    """Middles of both files on two sides of half a degree, and of 180 degrees of longitude."""
    north, east = lat + 1e-4 * (TIME_S - 29.5), lon + 2e-4 * (TIME_S - 29.5)
    east = (east + 180) % 360 - 180
    one = written(tmp_path, "one", north, east)
    half = slice(10, None)
    table = pd.DataFrame({"time": 1.78e9 + TIME_S, "latitude": north, "longitude": east})[half]
    other = tmp_path / "other.csv"
    table.to_csv(other, index=False)
    options = OpenOptions(combine=CombineOptions(truth=[other] if is_truth else []))
    log = open_log([one] if is_truth else [one, other], options=options).log
    assert not [note for note in log.notes if "km from" in note]
    assert any("agree within 0.0 m" in note for note in log.notes)
    for rows in (log.gnss, log.truth):
        assert len(rows) == 0 or np.ptp(rows["east_m"]) < 3000
    # Beside the antimeridian, not at the meridian of Greenwich.
    assert log.crs[-2:] in {"51", "60", "04", "01"}


def test_a_zone_is_found_by_positions_on_two_sides_of_half_a_degree(tmp_path):
    lat, lon = 50.5 + 1e-4 * (TIME_S - 29.5), 120.0 + 2e-4 * TIME_S
    utc = written(tmp_path, "utc", lat, lon)
    local = tmp_path / "local.csv"
    texts = pd.to_datetime(1.78e9 + 8 * 3600 + TIME_S, unit="s").strftime("%Y-%m-%d %H:%M:%S")
    rows = pd.DataFrame({"time": texts, "latitude": lat, "longitude": lon})[20:]
    rows.to_csv(local, index=False)
    notes = open_log([local, utc]).log.notes
    assert any("local time is UTC+08:00 (by positions, median 0.0 m" in note for note in notes)


@pytest.mark.parametrize("lon", [90.0, 90.4, -89.9])
def test_a_lost_sign_a_quarter_around_the_earth_is_named(tmp_path, lon):
    one = written(tmp_path, "one", LAT, LON - 25 + lon)
    other = written(tmp_path, "other", LAT, -(LON - 25 + lon))
    with pytest.raises(InputError, match="a lost sign of longitude"):
        open_log([one, other])


def test_tracks_on_two_sides_of_180_degrees_lie_as_far_apart_as_elsewhere(tmp_path):
    one = written(tmp_path, "one", LAT, LON - 25 + 179.8)
    other = written(tmp_path, "other", LAT, LON - 25 - 179.6)
    (told,) = [note for note in open_log([one, other]).log.notes if "km from those" in note]
    assert "other.csv: positions lie 33.4 km from those" in told


def area(west_deg, south_deg):
    """Return a hundred positions of an area of a degree: 96 of them span 0.9504 degrees."""
    step = np.arange(100) / 100
    return pd.DataFrame({"lon_deg": west_deg + step, "lat_deg": south_deg + step})


@pytest.mark.parametrize(
    ("west_deg", "south_deg", "east_m", "north_m"),
    [
        # The 2nd and 98th of a hundred are at 0.0198 and 0.9702 degrees.
        (25.0, 62.0, 0.0, 1.0496 * 111_195),
        (25.0, 58.0, 0.0, 1.0496 * 111_195),
        (27.0, 60.0, 1.0496 * 111_195 * np.cos(np.radians(60.495)), 0.0),
        (28.0, 63.0, 2.0496 * 111_195 * np.cos(np.radians(60.495)), 2.0496 * 111_195),
        (25.9, 60.9, 0.0, 0.0),
        (385.0, 60.0, 0.0, 0.0),
        (25.0, 89.5, np.inf, 0.0),
    ],
)
def test_the_distance_of_two_areas(west_deg, south_deg, east_m, north_m):
    found = _apart_m(area(25.0, 60.0), area(west_deg, south_deg))
    assert found == pytest.approx(np.hypot(east_m, north_m), rel=1e-9)
