"""Walkers whose rows come each second on the way and not at rest, as levels show once."""

import numpy as np
import pytest
from made_watch import STILL, report, told

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import Epoch

LEVELS_DBM = np.array([-70.0, -75.0, -80.0, -85.0, -90.0])


def way(begin_s, end_s, step_m=1.4):
    return [
        Epoch(float(second), (MotionStep(step_m, 0.0),), heard(second))
        for second in range(begin_s, end_s)
    ]


def heard(second, change_db=0.0):
    """A report each other second, whose levels change by so much."""
    if second % 2:
        return ()
    fading_db = np.random.default_rng(second).normal(0, 2.0, len(LEVELS_DBM))
    return report(np.round(LEVELS_DBM + change_db * np.array([1, -1, 1, -1, 1]) + fading_db))


def gap(begin_s, end_s, db_per_s=0.0, motion=()):
    """Reports alone, of a rest or of one who goes on."""
    return [
        Epoch(float(second), motion, heard(second, db_per_s * (second - begin_s)))
        for second in range(begin_s, end_s)
        if second % 2 == 0
    ]


def reasons_of(found, begin_s, end_s):
    return {why for epoch, why, _ in found if begin_s <= epoch.time_s < end_s}


def journey(first, second, step_m=1.4):
    """A way of two minutes, a gap, another way, and another gap."""
    parts = (way(0, 120, step_m), first, way(210, 360, step_m), second, way(420, 440, step_m))
    return [epoch for part in parts for epoch in part]


def test_once_levels_have_shown_a_rest_without_rows_others_are_rests_too():
    watch, found = told(journey(gap(120, 210), gap(360, 420)))
    # Until then nothing tells a rest from a counter that died.
    assert reasons_of(found, 130, 210) == {Reason.MOTION_MISSING}
    assert reasons_of(found, 360, 440) == {Reason.USED}
    assert watch.pace.rested_silently
    assert not watch.pace.reports_always


@pytest.mark.parametrize(
    ("first", "step_m"),
    [
        # Levels show one who went on.
        (gap(120, 210, db_per_s=0.4), 1.4),
        # Too short for levels to show it for certain.
        ([epoch for epoch in gap(120, 210) if epoch.time_s < 165], 1.4),
        # A vehicle leaves no doubt of a rest, so a dead odometer would look like one.
        (gap(120, 210), 8.0),
    ],
)
def test_other_gaps_leave_rows_that_end_missing(first, step_m):
    sequence = [epoch for epoch in journey(first, gap(360, 420), step_m) if epoch.time_s < 420]
    watch, found = told(sequence)
    assert not watch.pace.rested_silently
    assert reasons_of(found, 370, 420) == {Reason.MOTION_MISSING}


def test_a_row_that_reports_a_rest_tells_that_rows_come_at_rest():
    """Before or after: then a gap is none."""
    still = gap(210, 220, motion=STILL)
    sequence = [*way(0, 120), *gap(120, 210), *still, *way(220, 360), *gap(360, 420)]
    watch, found = told(sequence)
    assert watch.pace.reports_always
    assert reasons_of(found, 370, 420) == {Reason.MOTION_MISSING}
    watch, found = told([*way(0, 60), *gap(60, 70, motion=STILL), *journey_after(70)])
    assert watch.pace.reports_always
    assert reasons_of(found, 370, 420) == {Reason.MOTION_MISSING}


def journey_after(begin_s):
    return [epoch for epoch in journey(gap(120, 210), gap(360, 420)) if epoch.time_s >= begin_s]


def test_a_rest_whose_levels_change_is_missing_motion_all_the_same():
    """Who is carried on without rows is noticed by levels, as with a counter that stands still."""
    _, found = told(journey(gap(120, 210), gap(360, 560, db_per_s=0.2)))
    assert Reason.MOTION_MISSING in reasons_of(found, 380, 560)
