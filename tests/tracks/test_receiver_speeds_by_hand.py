"""Courses by positions, by definition; speeds and courses of a receiver at each limit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.checks.headings import (
    are_mirrored,
    compass_fault,
    heading_fault,
    headings_and_courses,
)
from mapfilter.tracks.checks.receiver_speeds import check_speeds
from mapfilter.tracks.readers.recorded.recording import Clock, Recording

SPEED_MPS = 10.0


def round_way(count=60, turns=1.0):
    """Positions on a circle, a second apart, and the azimuth of the way to each (degrees)."""
    azimuth_rad = 0.3 + 2 * np.pi * turns * np.arange(count) / count
    east_m, north_m = (np.cumsum(SPEED_MPS * f(azimuth_rad)) for f in (np.sin, np.cos))
    places = pd.DataFrame({"time_s": np.arange(float(count)), "east_m": east_m, "north_m": north_m})
    return places, np.degrees(azimuth_rad) % 360


def checked(places, speed_mps, course_deg):
    rows = pd.DataFrame(
        {"time_s": places["time_s"], "speed_mps": speed_mps, "course_deg": course_deg}
    )
    recording = Recording(
        Path("drive.csv"), "csv", "", Clock("utc"), {"positions": rows}, len(rows), (), (), ""
    )
    try:
        return check_speeds(recording, places["east_m"].to_numpy(), places["north_m"].to_numpy())
    except InputError as error:
        (fault,) = error.faults
        return fault.hint


def test_speeds_and_courses_in_their_units_are_right():
    places, azimuth_deg = round_way(600)
    assert checked(places, SPEED_MPS, azimuth_deg) == ()
    (note,) = checked(places, 3.6 * SPEED_MPS, azimuth_deg)
    assert note.startswith("drive.csv: positions, speed_mps: speeds are 3.6 times those between")
    assert note.endswith("; expected m/s")
    # Also without courses, and with some speeds alone.
    assert checked(places, 3.6 * SPEED_MPS, np.nan) == (note,)


EXCHANGED = "the columns of speed and course are exchanged"
RADIANS = "radians for degrees: call the column course [rad]"


@pytest.mark.parametrize(("count", "told"), [(23, True), (20, False)])
def test_twenty_rows_with_a_course_tell_what_it_is(count, told):
    places, azimuth_deg = round_way(count, 0.9)
    found = checked(places, SPEED_MPS, np.radians(azimuth_deg))
    assert (found == RADIANS) is told
    assert (checked(places, azimuth_deg, SPEED_MPS) == EXCHANGED) is told
    few = np.where(np.arange(count) < 19, azimuth_deg, np.nan)
    assert checked(places, few, SPEED_MPS) == ()


def test_courses_beyond_a_turn_in_radians_are_none():
    places, azimuth_deg = round_way()
    course = np.radians(azimuth_deg)
    assert checked(places, SPEED_MPS, course) == RADIANS
    course[7] = 6.29
    assert checked(places, SPEED_MPS, course) == ()


@pytest.mark.parametrize("turns", [0.1, 0.35])
def test_a_nearly_straight_way_has_one_course_that_small_numbers_fit(turns):
    """The mean of unit vectors over a third of a circle is 0.81 long, over a tenth 0.98."""
    places, azimuth_deg = round_way(turns=turns)
    found = checked(places, azimuth_deg, 170.0 + azimuth_deg)
    assert (found == EXCHANGED) is (turns > 0.3)


@pytest.mark.parametrize(
    ("off_deg", "given_off_deg", "told"),
    [
        # Cosines of 0.8 and 0.5: within 36.9 degrees of the course, and 60 degrees off it.
        (0.0, 90.0, True),
        (36.0, 90.0, True),
        (38.0, 90.0, False),
        (0.0, 61.0, True),
        (0.0, 59.0, False),
    ],
)
def test_how_well_numbers_fit_the_course(off_deg, given_off_deg, told):
    places, azimuth_deg = round_way()
    found = checked(places, azimuth_deg + off_deg, azimuth_deg + given_off_deg)
    assert (found == EXCHANGED) is told


def by_definition(motion, places):
    """Return headings and courses of groups of steps that begin every two metres of the way."""
    at = {name: lambda t, n=name: np.interp(t, places["time_s"], places[n]) for name in places}
    groups = {}
    total_m = 0.0
    end_s = motion["time_s"].tolist()
    for k in range(1, len(motion)):
        begin, end, row = end_s[k - 1], end_s[k], motion.iloc[k]
        if not (row["step_m"] > 0 and np.isfinite(row["heading_rad"])):
            continue
        if begin < places["time_s"].iloc[0] or end > places["time_s"].iloc[-1]:
            continue
        way = complex(*(at[name](end) - at[name](begin) for name in ("east_m", "north_m")))
        total_m += abs(way)
        moved, headed = groups.get(int(total_m // 2.0), (0, 0))
        groups[int(total_m // 2.0)] = moved + way, headed + np.exp(1j * row["heading_rad"])
    pairs = [(np.angle(h), np.angle(m)) for m, h in groups.values() if abs(m) >= 1.0]
    return np.array(pairs).T


@pytest.mark.parametrize("seed", range(3))
def test_headings_and_courses_of_short_steps_by_definition(seed):
    rng = np.random.default_rng(seed)
    count = 80
    course = np.cumsum(rng.normal(0.0, 0.2, count))
    length_m = rng.choice([0.0, 0.3, 0.7, 1.3, 2.6], count)
    east_m, north_m = (np.cumsum(length_m * f(course)) for f in (np.cos, np.sin))
    time_s = np.arange(float(count))
    places = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m})
    motion = pd.DataFrame(
        {
            "time_s": np.arange(-3.0, count + 3.0) + 0.25,
            "step_m": rng.choice([0.0, 0.7, 0.7, np.nan], count + 6),
            "heading_rad": rng.uniform(-3, 3, count + 6),
        }
    )
    motion.loc[rng.integers(0, count, 5), "heading_rad"] = np.nan
    found = headings_and_courses(motion, places)
    np.testing.assert_allclose(found, by_definition(motion, places), atol=1e-9)
    assert len(found[0]) > 10
    # Of fewer than twenty rows, or of a single place, nothing is said.
    assert headings_and_courses(motion.iloc[:19], places)[0].size == 0
    assert headings_and_courses(motion, places.iloc[:1])[0].size == 0


def faults(course, heading, count=100):
    """Return what is wrong with headings on a way of steps of 3 m."""
    course = np.resize(course, count)
    east_m, north_m = (np.cumsum(np.append(0.0, 3 * f(course))) for f in (np.cos, np.sin))
    places = pd.DataFrame({"time_s": np.arange(count + 1.0), "east_m": east_m, "north_m": north_m})
    steps = pd.DataFrame({"time_s": np.arange(1.0, count + 1.0), "step_m": 3.0})
    steps = steps.assign(heading_rad=heading(course))
    return heading_fault(steps, places), are_mirrored(steps, places)


CORNERS = np.repeat([0.0, np.pi / 2, np.pi, -np.pi / 2], 25)


@pytest.mark.parametrize(
    ("reference_deg", "told"), [(90, "north"), (46, "north"), (134, "north"), (44, "another"),
                                (136, "another"), (0, "another"), (180, "another")],
)  # fmt: skip
def test_from_which_axis_headings_run_clockwise(reference_deg, told):
    fault, mirrored = faults(CORNERS, lambda course: np.radians(reference_deg) - course)
    assert fault.found.startswith(f"headings run clockwise from {told}")
    assert bool(fault.remedy) is (told == "north")
    assert mirrored


@pytest.mark.parametrize(
    ("off_deg", "told", "north"),
    [(44, False, False), (46, True, False), (-46, True, False), (69, True, False),
     (71, True, True), (90, True, True), (109, True, True), (111, True, False),
     (-90, True, False), (180, True, False)],
)  # fmt: skip
def test_by_how_much_headings_are_off(off_deg, told, north):
    """The difference of the course is the negative of what is added to headings."""
    fault, mirrored = faults(CORNERS, lambda course: course - np.radians(off_deg))
    assert (fault is not None) is told
    assert not mirrored
    if told:
        # Half a turn is one in either sense.
        assert f" {off_deg} degrees off" in fault.found.replace("-180", "180")
        assert ("counted from north?" in fault.found) is north
    # On a straight way nothing is said: a compass may be off by anything.
    assert faults(0.4, lambda course: course - np.radians(off_deg))[0] is None


@pytest.mark.parametrize("count", [19, 21])
def test_a_phone_that_is_turned_at_the_only_corner_is_no_mirror(count):
    course = np.repeat([0.0, np.pi / 2], 50)
    assert not faults(course, lambda one: -one)[1]
    assert faults(CORNERS, lambda one: -one)[1]
    fault, mirrored = faults(np.resize([0.0, 2.0, 4.0], count), lambda one: -one, count)
    assert (mirrored, fault is not None) == ((count > 20,) * 2)


WAY = np.repeat([0.1, 1.6, 3.2, 1.6], 5)


@pytest.mark.parametrize(
    ("azimuth", "walked_m", "told"),
    [
        (WAY, 100.0, True),
        (WAY, 99.9, False),
        (WAY[:19], 100.0, False),
        (WAY - 3.15, 100.0, True),
        # Within a turn from 0 or from -π, to half a hundredth.
        (np.where(WAY == 0.1, -0.004, WAY), 100.0, True),
        (np.where(WAY == 3.2, 6.287, WAY), 100.0, True),
        (np.where(WAY == 3.2, 6.3, WAY), 100.0, False),
        (np.where(WAY == 0.1, -3.145, WAY - 0.1), 100.0, True),
        (np.where(WAY == 0.1, -3.15, WAY - 0.1), 100.0, False),
        (np.where(WAY == 3.2, 3.15, WAY - 1.7), 100.0, False),
        # They differ by a quarter of a turn, and are no whole numbers.
        (0.1 + 0.5 * WAY, 100.0, False),
        (0.1 + 0.52 * WAY, 100.0, True),
        (np.repeat([0.0, 2.0, 5.0, 2.0], 5), 100.0, False),
        (np.append(np.repeat([0.0, 2.0, 5.0, 2.0], 5), 1.5), 100.0, True),
        # Azimuths that scatter do not keep their value.
        (np.tile([0.1, 3.2], 10), 100.0, False),
    ],
)  # fmt: skip
def test_azimuths_that_are_radians(azimuth, walked_m, told):
    for given in (azimuth, np.append(azimuth, np.nan)):
        assert bool(compass_fault(given, walked_m)) is told
