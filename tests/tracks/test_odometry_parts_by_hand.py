"""Rows of odometry and ways between positions by hand: marks, gaps, and errors of steps."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.joining.position_motion import _unknown_between, motion_from_positions
from mapfilter.tracks.pdr.odometry_rows import (
    _between,
    _sudden,
    gap_notes,
    speed_errors,
    usable_rows,
    usual_s,
)

NAN = np.nan


@pytest.mark.parametrize(
    ("rate", "joined"),
    [
        # Between rows a second away at most, in proportion to time.
        ([1, NAN, 3, NAN, 5], [1, 2, 3, NAN, 5]),
        ([NAN, 2, NAN, 4, NAN], [NAN, 2, 2.5, 4, NAN]),
        ([1, NAN, NAN, NAN, 5], [1, NAN, NAN, NAN, 5]),
        ([NAN] * 5, [NAN] * 5),
        ([1, 2, 3, 4, 5], [1, 2, 3, 4, 5]),
    ],
)
def test_missing_yaw_rates_between_others(rate, joined):
    time_s = np.array([0.0, 0.5, 1.0, 2.5, 4.0])
    if rate[0] != rate[0] and rate[1] == 2:
        time_s = np.array([0.0, 0.5, 1.0, 2.0, 2.5])
        joined = [NAN, 2, 2 + 2 / 3, 4, NAN]
    found = _between(time_s, np.array(rate, dtype=float))
    assert found.tolist() == pytest.approx(joined, nan_ok=True)


@pytest.mark.parametrize(
    ("speed", "every_s", "marked"),
    [
        # One speed above 55 m/s that is reached and left faster than brakes could.
        ([9, 71, 71, 9], 0.1, [1, 2]),
        ([9, 55, 9], 0.1, []),
        ([9, 55.1, 9], 0.1, [1]),
        ([71, 71, 9, 9], 0.1, [0, 1]),
        ([9, 9, 71], 0.1, [2]),
        ([9, 71, 72, 9], 0.1, []),
        ([71, 71, 71], 0.1, []),
        # By more than 15 m/s, and 30 m/s in a second.
        ([45, 60.1, 45], 0.1, [1]),
        ([45.2, 60.1, 45.2], 0.1, []),
        ([9, 71, 9], 2.0, [1]),
        ([12, 71, 12], 2.0, []),
        ([9, 71, 12], 2.0, []),
        # Since the last row of the speed before.
        ([*[9] * 30, 71, *[10] * 30], 0.1, [30]),
        # Rows without a speed are not between.
        ([9, NAN, 71, NAN, 9], 0.1, [2]),
        ([9, 71], 0.1, []),
    ],
)
def test_speeds_that_come_and_go_at_once(speed, every_s, marked):
    time_s = every_s * np.arange(len(speed))
    assert np.flatnonzero(_sudden(time_s, np.array(speed, dtype=float))).tolist() == marked


def test_errors_of_steps_by_speeds():
    """0.05 m/s over the usual interval, or what is stated, and 2 % that last."""
    assert usual_s(np.array([0.0, 1, 3])) == 1.5
    assert usual_s(np.array([7.0])) == 1
    rows = pd.DataFrame({"time_s": [0.0, 0.5, 1.0, 3.0]})
    found = speed_errors(rows)
    assert (found.period_s, found.sigma_trans_m, found.scale) == pytest.approx((0.5, 0.025, 0.02))
    found = speed_errors(rows.assign(speed_sd_mps=[0.2, NAN, 0.4, 0.6]))
    assert (found.period_s, found.sigma_trans_m) == pytest.approx((0.5, 0.2))
    assert speed_errors(rows.assign(speed_sd_mps=NAN)).sigma_trans_m == pytest.approx(0.025)


def test_notes_on_usable_rows():
    rows = pd.DataFrame({"time_s": 0.1 * np.arange(6.0), "speed_mps": [9, 9, 71, 71, 9, 9.0]})
    rows["yaw_rate_radps"] = [0.1, NAN, 0.3, 0.3, NAN, 0.5]
    kept, notes = usable_rows(rows)
    assert kept["time_s"].tolist() == pytest.approx([0, 0.1, 0.4, 0.5])
    assert kept["yaw_rate_radps"].tolist() == pytest.approx([0.1, 0.2, 0.4, 0.5])
    assert notes == (
        "odometry: 2 speeds that come and go at once, such as 71.0 m/s (256 km/h), taken as "
        "missing (likely: what a bus sends where it has no value)",
        "odometry: 2 yaw rates taken from the rows around",
    )
    whole = rows.assign(speed_mps=9.0, yaw_rate_radps=0.1)
    assert usable_rows(whole) == (whole, ())


def test_notes_on_gaps():
    """Of 9 s without speeds, in which turns are known or not."""
    time_s = np.array([0.0, 1, 2, 5, 11, 12, 21, 22])
    speed = np.array([9.0, 9, 9, NAN, 9, 9, 9, 9])
    turn = np.array([0.1, 0.1, 0.1, 0.1, 0.1, 0.1, NAN, 0.1])
    assert gap_notes(time_s, speed, turn) == (
        "odometry: 1 gap (longest 9.0 s), over which motion is not known",
        "odometry: 1 gap (longest 9.0 s), over which turns alone are known",
    )
    assert gap_notes(time_s[:3], speed[:3], turn[:3]) == ()


def test_ways_between_positions_are_parted_into_seconds():
    """East by 10 m in 2 s, 10 m in 1 s: off the line by 10/3 m, over √(1 + 4/9 + 1/9)."""
    time_s = np.array([10.0, 12.0, 13.0])
    motion, errors = motion_from_positions(time_s, np.array([0.0, 10, 20]), np.zeros(3))
    assert motion["time_s"].tolist() == [10, 11, 12, 13]
    assert motion["step_m"].tolist() == [0, 5, 5, 10]
    assert motion["heading_rad"].tolist() == pytest.approx([NAN, 0, 0, 0], nan_ok=True)
    # Half of it, as there is none north; a way has two of its positions' errors.
    off_m = 10 / 3 / (1 + 4 / 9 + 1 / 9) ** 0.5
    way_m = 2**0.5 * 1.4826 * off_m / 2
    # Of one part and a half in the median.
    step_sd_m = way_m / 1.5**0.5
    assert errors.sigma_trans_m == pytest.approx(step_sd_m)


def test_short_ways_have_no_heading():
    """Of less than two of their standard deviations."""
    east = np.array([0.0, 10, 20, 30, 40, 41, 42])
    north = np.array([0.0, 1, -1, 1, -1, 1, -1])
    motion, _ = motion_from_positions(np.arange(7.0), east, north)
    assert np.isnan(motion["heading_rad"]).tolist() == [True, *[False] * 4, True, True]
    two, errors = motion_from_positions(np.arange(2.0), east[:2], 0 * north[:2])
    assert two["step_m"].tolist() == [0, 10]
    assert errors.sigma_trans_m == 0.05


@pytest.mark.parametrize(
    ("lasted_s", "unknown"), [(30.0, False), (31.0, True), (300.0, True), (301.0, True)]
)
def test_long_ways_are_unknown(lasted_s, unknown):
    lasted = np.array([*[10.0] * 9, lasted_s])
    # Of uneven ways, or fewer than ten.
    uneven = np.array([*[10.0, 30.0, 50.0] * 3, 30.0])
    assert _unknown_between(uneven, lasted).tolist() == [False] * 9 + [unknown]
    assert _unknown_between(np.full(9, 30.0), lasted[1:]).tolist() == [False] * 8 + [unknown]


@pytest.mark.parametrize(
    ("last_m", "lasted_s", "unknown"),
    [
        # Renewed by distance: those as long as usual are straight for 300 s.
        (30.0, 300.0, False),
        (30.0, 301.0, True),
        (45.0, 100.0, False),
        (45.1, 100.0, True),
    ],
)
def test_positions_that_are_renewed_by_distance(last_m, lasted_s, unknown):
    lasted = np.array([*[10.0] * 9, lasted_s])
    steps = np.array([*[30.0] * 9, last_m])
    assert _unknown_between(steps, lasted).tolist() == [False] * 9 + [unknown]
    # One of ten may be shorter than 27 m, not two; none may move.
    steps[0] = 26.9
    assert _unknown_between(steps, lasted)[-1] == unknown
    steps[1] = 26.9
    assert _unknown_between(steps, lasted)[-1]
    steps[1] = 27.1
    assert _unknown_between(steps, lasted)[-1] == unknown
    assert _unknown_between(0 * steps, lasted)[-1]
