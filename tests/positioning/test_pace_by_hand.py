"""How often motion rows come and how fast one moves: limits and means, by hand."""

import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.bayes.pace import Pace


def after(pace, time_s, *lengths_m, unit_m=1.0):
    found, _ = pace.read(time_s, tuple(MotionStep(length_m, 0.1) for length_m in lengths_m), unit_m)
    return found


def test_nothing_is_known_before_the_first_row():
    pace = Pace()
    assert (pace.rows, pace.interval_s, pace.irregular_s, pace.rests) == (0, 0.0, 0.0, False)
    assert (pace.speed_mps, pace.recent_mps, pace.fastest_mps) == (1.4, 1.4, 0.0)
    assert not pace.reports_always
    assert not pace.is_known


@pytest.mark.parametrize(
    ("interval_s", "irregular_s", "always"),
    [(1.0, 0.019, True), (1.0, 0.02, False), (2.0, 0.039, True), (0.5, 0.011, False)],
)
def test_rows_at_fixed_times_differ_by_less_than_a_fiftieth(interval_s, irregular_s, always):
    pace = Pace(rows=10, interval_s=interval_s, irregular_s=irregular_s)
    assert pace.reports_always == always


@pytest.mark.parametrize(
    ("rows", "interval_s", "known"),
    [(30, 1.0, True), (29, 1.0, False), (40, 0.5, True), (39, 0.5, False), (30, 0.6, False)],
)
def test_a_speed_is_known_after_thirty_rows_and_twenty_seconds(rows, interval_s, known):
    assert Pace(rows=rows, interval_s=interval_s).is_known == known


@pytest.mark.parametrize(
    ("rows", "fastest_mps", "unit_m"),
    [(30, 0.0, 0.3048), (30, 9.0, 0.3048), (30, 9.1, 1.0), (29, 0.0, 1.0), (29, 9.1, 1.0)],
)
def test_steps_may_be_in_feet_where_no_row_is_too_fast_for_a_walker(rows, fastest_mps, unit_m):
    pace = Pace(rows=rows, interval_s=1.0, speed_mps=4.6, fastest_mps=fastest_mps)
    assert pace.other_unit_m == unit_m


@pytest.mark.parametrize(
    ("stepped_s", "fastest_mps"), [(0.0, 2.0), (1.0, 3.2 / 0.6), (-0.01, 6.4), (1.2, 6.4)]
)
def test_a_step_covers_the_time_since_the_last_one_of_a_walk(stepped_s, fastest_mps):
    """Up to 1.6 s; after a longer time it follows a rest, and covers the time of its row."""
    pace = Pace(motion_s=1.1, stepped_s=stepped_s, rows=5, interval_s=0.5)
    assert after(pace, 1.6, 3.2).fastest_mps == pytest.approx(fastest_mps)
