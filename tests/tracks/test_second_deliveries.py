"""Rows of motion that come twice: filters use one of each pair, and so do checks of the log."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.checks.refused_motion import refused_faults
from mapfilter.tracks.checks.second_deliveries import once_each
from mapfilter.tracks.checks.speeds import speed_fault
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
COUNT = 900


def walk(seed=4):
    """Motion each second about blocks of 100 m, and the positions on it."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(COUNT + 1.0)
    ways_rad = np.repeat(rng.choice([0.0, np.pi / 2, -np.pi / 2], 13), 75)[:COUNT]
    step_m, heading_rad = rng.normal(1.4, 0.05, COUNT), ways_rad + rng.normal(0, 0.05, COUNT)
    east_m = 385_000 + np.cumsum([0.0, *(step_m * np.cos(ways_rad))])
    north_m = 6_672_000 + np.cumsum([0.0, *(step_m * np.sin(ways_rad))])
    motion = pd.DataFrame({"time_s": time_s[1:], "step_m": step_m, "heading_rad": heading_rad})
    places = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m})
    return motion, places[::5]


def twice(motion, later_s):
    again = motion.assign(time_s=motion["time_s"] + later_s)
    return pd.concat([motion, again]).sort_values("time_s", ignore_index=True)


@pytest.mark.parametrize("later_s", [0.01, 0.1, 0.4])
@pytest.mark.parametrize("table", ["gnss", "truth"])
def test_a_log_whose_rows_come_twice_is_read_as_if_once(later_s, table):
    """No factor is named: filters drop every other row, and would go half of the way with it."""
    motion, places = walk()
    log = make_log(CRS, motion=twice(motion, later_s), **{table: places})
    assert len(log.motion) == 2 * COUNT
    assert log.notes == ()
    assert refused_faults(log, ()) == {}
    assert speed_fault(log.motion) == ""


def test_rows_of_turns_and_rests_come_twice_as_well():
    motion, _ = walk()
    turn_rad = np.diff(motion.pop("heading_rad"), prepend=np.nan)
    motion["turn_rad"] = turn_rad
    motion.loc[300:400, ["step_m", "turn_rad"]] = 0.0
    found = once_each(twice(motion, 0.1))
    moved = found[found["step_m"] != 0].reset_index(drop=True)
    pd.testing.assert_frame_equal(moved, motion[motion["step_m"] != 0].reset_index(drop=True))


def test_steps_that_are_counted_twice_are_a_fault_as_before():
    motion, places = walk()
    log = make_log(CRS, motion=motion.assign(step_m=2 * motion["step_m"]), gnss=places)
    assert "counted twice" in refused_faults(log, ())["step_m"].found


def test_what_repeats_otherwise_is_kept():
    """Few pairs, constant speeds, and sensors that are read more often than they measure."""
    motion, _ = walk()
    few = pd.concat([motion, twice(motion[:40], 0.1)[1::2]])
    regular = twice(motion, 0.5)
    constant = regular.assign(step_m=1.4, heading_rad=0.0)
    for one in (motion, few.sort_values("time_s"), regular, constant, motion[:3], motion[:0]):
        assert once_each(one) is one


def test_what_is_too_fast_even_once_is_refused():
    motion, _ = walk()
    with pytest.raises(InputError, match="140 m/s in the median"):
        make_log(CRS, motion=twice(motion.assign(step_m=100 * motion["step_m"]), 0.1))
