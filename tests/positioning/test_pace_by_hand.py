"""How often motion rows come and how fast one moves: limits and means, by hand."""

from dataclasses import replace
from math import exp, nan

import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.sensors.pace import Pace


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


def test_a_first_row_covers_no_time_and_is_a_walk_however_short():
    pace, going = Pace().read(7.0, (MotionStep(0.05, 0.1),), 1.0)
    assert going == (0.05, True, True, False)
    assert (pace.motion_s, pace.stepped_s, pace.rows, pace.rests) == (7.0, 7.0, 1, False)
    assert (pace.recent_mps, pace.speed_mps, pace.interval_s) == (1.4, 1.4, 0.0)


@pytest.mark.parametrize(("rows", "step_s"), [(1, 2.5), (2, 1.0), (3, 1.0)])
def test_a_step_after_a_pause_counts_for_the_usual_interval(rows, step_s):
    """The second row has no usual interval yet. Before it the walker stood."""
    pace = Pace(motion_s=0.0, rows=rows, interval_s=1.0)
    before_mps = 1.4 * exp(-(2.5 - step_s) / 2.5)
    gained = (1 - exp(-step_s / 2.5)) * (2.0 / step_s - before_mps)
    assert after(pace, 2.5, 2.0).recent_mps == pytest.approx(before_mps + gained)


@pytest.mark.parametrize(("rests", "moving"), [(False, [False, True, True]), (True, [True] * 3)])
def test_in_a_log_of_steps_a_single_one_after_a_pause_is_no_walk(rests, moving):
    """Where rows come at rest, too, a pause is one of the recording."""
    pace = Pace(motion_s=0.0, rows=50, interval_s=0.5, irregular_s=0.1, rests=rests)
    found = []
    for k in range(3):
        pace, going = pace.read(60.0 + 0.5 * k, (MotionStep(0.7, 0.1),), 1.0)
        found.append(going.moves)
    assert found == moving


def test_a_row_at_a_tenth_of_a_metre_a_second_is_a_rest():
    pace = Pace(motion_s=0.0, stepped_s=-3.0, rows=29, interval_s=2.0)
    rest = after(pace, 2.0, 0.2)
    assert rest.rests
    assert (rest.motion_s, rest.stepped_s, rest.speed_mps) == (2.0, -3.0, 1.4)
    # Rows without a length, and at the time of the last one, are none.
    assert not after(pace, 2.0, nan).rests
    assert not after(pace, 0.0, 0.01).rests
    assert after(pace, 0.0, 0.0).rests


@pytest.mark.parametrize(
    ("speed_mps", "recent_mps", "moves"),
    [(1.0, 0.3, True), (1.0, 0.29, False), (2.5, 0.5, False), (2.51, 0.5, True)],
)
def test_a_walker_slower_than_three_tenths_of_before_does_not_move(speed_mps, recent_mps, moves):
    pace = Pace(0.0, rows=30, interval_s=1.0, speed_mps=speed_mps, recent_mps=recent_mps)
    for unit_m in (1.0, 0.5):
        scaled = replace(pace, speed_mps=speed_mps / unit_m, recent_mps=recent_mps / unit_m)
        steps = (MotionStep(recent_mps / unit_m, 0.1),)
        _, going = scaled.read(1.0, steps, unit_m)
        assert going.moves == moves
        assert going.gone_m == recent_mps / unit_m


@pytest.mark.parametrize(("recent_mps", "learnt"), [(0.5, True), (0.49, False)])
def test_the_speed_of_a_walker_is_learnt_from_half_of_it_on(recent_mps, learnt):
    pace = Pace(0.0, rows=30, interval_s=1.0, speed_mps=1.0, recent_mps=recent_mps)
    expected = 1.0 + (recent_mps - 1.0) / 20 if learnt else 1.0
    assert after(pace, 1.0, recent_mps).speed_mps == pytest.approx(expected)


def test_of_rows_more_often_than_once_a_second_each_counts_a_twentieth_of_its_way():
    pace = Pace(9.5, 9.5, rows=100, interval_s=0.5, speed_mps=1.0, recent_mps=1.0)
    assert after(pace, 10.0, 1.5).speed_mps == pytest.approx(1.0 + (1.5 - 0.5) / 20)
    # A step covers the time since the last one.
    stepped = replace(pace, stepped_s=9.0)
    assert after(stepped, 10.0, 0.8).speed_mps == pytest.approx(1.0 + (0.8 - 1.0) / 20)


def test_rows_at_one_time_say_nothing_of_intervals_and_usual_speeds():
    pace = Pace(10.0, 10.0, rows=50, interval_s=0.5, irregular_s=0.1, fastest_mps=2.0)
    found = after(pace, 10.0, 0.7)
    assert found == replace(pace, rows=51, last_mps=0.7 / 0.5)


def test_means_of_intervals_are_those_of_all_rows_up_to_twenty():
    for rows, share in ((2, 1 / 2), (19, 1 / 19), (20, 1 / 20), (21, 1 / 20)):
        pace = Pace(0.0, 0.0, rows, 1.0, 0.3)
        found = after(pace, 2.0, 1.0)
        assert found.interval_s == pytest.approx(1.0 + share)
        # The deviation is that from the mean with the row itself.
        assert found.irregular_s == pytest.approx(0.3 + share * ((1.0 - share) - 0.3))


def test_what_a_slow_way_teaches_is_half():
    assert Pace(speed_mps=1.2).slowed(0.4).speed_mps == pytest.approx(0.8)


def test_a_gap_counts_as_five_usual_intervals():
    found = after(Pace(0.0, 0.0, rows=11, interval_s=2.0), 100.0, 1.0)
    assert found.interval_s == pytest.approx(2.0 + (5 * 2.0 - 2.0) / 11)


@pytest.mark.parametrize(("rows", "least_m"), [(1, 0.7), (2, 0.3), (5, 0.3)])
def test_after_a_pause_a_row_covers_three_usual_intervals(rows, least_m):
    """The second row has no usual interval yet, and covers all of it."""
    pace = Pace(0.0, 0.0, rows, interval_s=1.0)
    assert after(pace, 7.0, least_m - 0.01).rests
    assert not after(pace, 7.0, least_m + 0.01).rests


def test_rows_without_any_time_have_no_speed():
    assert after(Pace(1.0, 1.0, rows=2), 1.0, 5.0).fastest_mps == 0.0


def test_rows_come_at_rest_as_often_as_the_last_two_intervals_say():
    """The shorter one counts: a recording may have paused for the other. Steps change nothing."""
    pace = Pace(motion_s=0.0, stepped_s=0.0, rows=50, interval_s=1.0)
    found = []
    for time_s in (9.0, 19.0, 29.0, 89.0, 149.0):
        pace = after(pace, time_s, 0.0)
        found.append(pace.at_rest_s)
    assert found == [0.0, 0.0, 10.0, 10.0, 60.0]
    walked = after(pace, 150.0, 1.4)
    assert after(walked, 190.0, 0.0).at_rest_s == 60.0
    # A row without a length tells of no rest, and one at the same time of no interval.
    assert after(pace, 152.0, nan).at_rest_s == 60.0
    assert after(pace, 149.0, 0.0).at_rest_s == 60.0
