"""Which fixes in a row show a belief to be wrong: lines, ways and their limits by hand."""

from math import sqrt

import numpy as np
import pytest

from mapfilter.positioning.kalman.disputed import ComparedFix, FixRecord, Patience, Ruling

WAITS = Patience(30.0, 120.0)
AGREED = FixRecord(agreed=40, agreed_from_s=0.0)
"""Of a belief that fixes have agreed with, up to now."""
ASIDE = np.array([0.6, 0.8])


def at_fix(record, time_s, off_m, stated_m2=100.0, *, rests=False, predicted_m2=None):
    predicted_m2 = np.eye(2) if predicted_m2 is None else predicted_m2
    off_m, stated_m2 = np.array(off_m, dtype=float), stated_m2 * np.eye(2)
    fix = ComparedFix(time_s, off_m, predicted_m2, stated_m2, rests, False, 0.0)
    return record.at_fix(fix, WAITS)


def after(times_s, off_m, stated_m2=100.0, *, record=AGREED, rests=False):
    """Return the record after fixes in a row, and what the last of them means."""
    stated_m2 = np.broadcast_to(stated_m2, len(times_s))
    found = None
    for row in zip(times_s, off_m, stated_m2, strict=True):
        assert found is None or found.ruling is Ruling.OUTLIER
        record, found = at_fix(record, *row, rests=rests)
    return record, found


EVERY_8_S = 8.0 * np.arange(5)
STATED_M2 = np.array([60.0, 140.0, 100.0, 80.0, 120.0])
"""Variances of 100 m² in the mean."""


def beside_a_line(shape, size):
    """Return places that go east at 1 m/s from 60 m on, and lie aside by so many times a shape."""
    return np.outer(60.0 + EVERY_8_S, [1.0, 0.0]) + size * np.outer(shape, ASIDE)


@pytest.mark.parametrize(
    ("shape", "limit_m"),
    [
        # Orthogonal to each line. Their squares add up to 70, of which each of 2 * 5 - 4 has 2.
        ([1.0, -4.0, 6.0, -4.0, 1.0], sqrt(2 * 100 * 6 / 70)),
        # A bow, whose second differences are 2 thrice: six variances of both axes are 12 for each.
        ([2.0, -1.0, -2.0, -1.0, 2.0], sqrt(2 * 100 * 36 / 12)),
    ],
)
def test_fixes_show_a_way_where_they_lie_on_a_line_or_a_smooth_bow(shape, limit_m):
    for size, ruling in ((0.99 * limit_m, Ruling.ANEW), (1.01 * limit_m, Ruling.OUTLIER)):
        record, found = after(EVERY_8_S, beside_a_line(shape, size), STATED_M2)
        assert found.ruling is ruling
        assert len(record.rows) == (0 if ruling is Ruling.ANEW else 5)


def test_the_least_error_of_a_fix_beside_a_way_is_that_between_houses():
    """7.5 m, whatever is stated."""
    limit_m = sqrt(2 * 7.5**2 * 6 / 70)
    for size, ruling in ((0.99 * limit_m, Ruling.ANEW), (1.01 * limit_m, Ruling.OUTLIER)):
        places = beside_a_line([1.0, -4.0, 6.0, -4.0, 1.0], size)
        assert after(EVERY_8_S, places, 4.0)[1].ruling is ruling


@pytest.mark.parametrize(("begun", "waits_s"), [(0, 30), (1, 15), (2, 10), (5, 10)])
def test_a_belief_that_began_anew_before_is_given_up_sooner(begun, waits_s):
    record = FixRecord(excess=1.25, agreed=40, agreed_from_s=0.0, begun=begun)
    for second in range(waits_s + 1):
        record, found = at_fix(record, float(second), [60.0, 0.0])
        assert found.ruling is (Ruling.ANEW if second == waits_s else Ruling.OUTLIER)
    assert found.squared == pytest.approx(3600 / 101 / 2)
    assert (found.larger, found.drifted) == (1.0, True)
    assert record == FixRecord(excess=1.25, begun=begun + 1)


@pytest.mark.parametrize(
    ("times_s", "ruling"),
    [
        ([0.0, 30.0, 60.0], Ruling.ANEW),
        ([0.0, 30.0, 59.9], Ruling.OUTLIER),
        ([0.0, 60.0], Ruling.OUTLIER),
        ([0.0, 10.0, 20.0, 30.0], Ruling.OUTLIER),
        ([0.0, 7.0, 15.0, 23.0, 30.0], Ruling.ANEW),
        ([0.0, 7.0, 15.0, 23.0, 29.9], Ruling.OUTLIER),
    ],
)
def test_five_fixes_show_it_or_three_over_twice_the_time(times_s, ruling):
    assert after(times_s, [[60.0, 0.0]] * len(times_s))[1].ruling is ruling


@pytest.mark.parametrize(
    ("every_s", "kept"),
    # Up to twice half a minute, and five at least.
    [(10.0, 7), (9.9, 7), (10.1, 6), (20.0, 5), (40.0, 5)],
)
def test_fixes_count_for_twice_the_time_that_they_have(every_s, kept):
    scattered = [[60.0, 40.0 * (-1) ** (k // 2)] for k in range(12)]
    record, found = after(every_s * np.arange(12), scattered)
    assert found.ruling is Ruling.OUTLIER
    assert [row.time_s for row in record.rows] == pytest.approx(every_s * np.arange(12 - kept, 12))


WINDING_M = np.array([40.0, -40.0, 40.0, -40.0, 40.0])
"""North, from one fix to the next: no line, and no smooth way."""


@pytest.mark.parametrize(
    ("east_m", "ruling"),
    [
        ([40.0, 60.0, 80.0, 100.0, 110.0], Ruling.CARRIED),
        # One of them is no farther along than the one before.
        ([40.0, 60.0, 60.0, 100.0, 110.0], Ruling.OUTLIER),
        ([40.0, 60.0, 50.0, 100.0, 110.0], Ruling.OUTLIER),
        # 24 m in 8 s are a way, and 23.9 m are none.
        ([40.0, 46.0, 52.0, 58.0, 64.0], Ruling.CARRIED),
        ([40.0, 46.0, 52.0, 58.0, 63.9], Ruling.OUTLIER),
    ],
)
def test_while_one_stands_fixes_that_go_on_are_a_way(east_m, ruling):
    places, times_s = np.column_stack([east_m, WINDING_M]), 2.0 * np.arange(5)
    assert after(times_s, places, 16.0, rests=True)[1].ruling is ruling
    assert after(times_s, places, 16.0)[1].ruling is Ruling.OUTLIER


def test_three_that_go_on_are_none_unless_they_lie_on_a_line():
    times_s, east_m = [0.0, 5.0, 10.0], [40.0, 60.0, 80.0]
    winding = np.column_stack([east_m, [0.0, 40.0, 0.0]])
    assert after(times_s, winding, 16.0, rests=True)[1].ruling is Ruling.OUTLIER
    straight = np.column_stack([east_m, np.zeros(3)])
    assert after(times_s, straight, 16.0, rests=True)[1].ruling is Ruling.CARRIED


@pytest.mark.parametrize(
    ("every_s", "speed_mps", "ruling"),
    [
        (2.5, 1.51, Ruling.CARRIED), (2.5, 1.49, Ruling.OUTLIER),
        # For less than ten seconds twice as fast.
        (2.4, 3.01, Ruling.CARRIED), (2.4, 2.99, Ruling.OUTLIER),
        (1.25, 3.01, Ruling.CARRIED), (1.2, 9.0, Ruling.OUTLIER),
    ],
)  # fmt: skip
def test_how_fast_fixes_on_a_line_are_while_one_stands(every_s, speed_mps, ruling):
    times_s = every_s * np.arange(5)
    places = 50.0 * ASIDE + np.outer(speed_mps * times_s, ASIDE)
    assert after(times_s, places, 16.0, rests=True)[1].ruling is ruling


def test_an_outlier_is_as_imprecise_as_it_lies_away():
    """225 m² at 13.8 of 4 and 12 f m²."""
    found = at_fix(AGREED, 0.0, [9.0, 12.0], 12.0, predicted_m2=4.0 * np.eye(2))[1]
    assert found.ruling is Ruling.OUTLIER
    assert found.larger == pytest.approx((225 / 13.8 - 4) / 12)
    assert found.squared == pytest.approx(225 / 16 / 2)
    # Along the way to it the prediction alone may be off by as much.
    found = at_fix(AGREED, 0.0, [30.0, 30.0], 12.0, predicted_m2=np.diag([400.0, 1.0]))[1]
    assert (found.ruling, found.larger) == (Ruling.OUTLIER, 1.0)


def test_of_two_that_may_be_wrong_either_is():
    record, found = at_fix(FixRecord(excess=2.0, agreed=2, begun=1), 0.0, [40.0, 0.0], 12.0)
    assert (found.ruling, found.squared) == (Ruling.EITHER, pytest.approx(1600 / 25 / 2))
    assert record == FixRecord(excess=2.0, begun=2)
    fix = ComparedFix(0.0, np.array([40.0, 0.0]), np.eye(2), 12.0 * np.eye(2), False, True, 0.0)
    record, found = FixRecord(excess=2.0, agreed=30, begun=1).at_fix(fix, WAITS)
    assert (found.ruling, found.squared) == (Ruling.EITHER, pytest.approx(1600 / 25 / 2))
    assert record == FixRecord(excess=2.0, begun=1)


@pytest.mark.parametrize(
    ("excess", "off_m", "rests", "expected"),
    [
        # By a twentieth towards half of 144 / 16, 0 and, at most, 9.
        (1.0, 12.0, False, 1 + (4.5 - 1) / 20),
        (1.0, 12.0, True, 1.0),
        (2.0, 0.0, True, 1.9),
        (4.0, 26.0, False, 4 + (9.0 - 4.0) / 20),
    ],
)
def test_how_imprecise_fixes_are_is_followed(excess, off_m, rests, expected):
    given = [off_m, 0.0], 12.0
    record, found = at_fix(
        FixRecord(excess=excess, agreed=20), 0.0, *given, rests=rests, predicted_m2=4.0 * np.eye(2)
    )
    assert found.ruling is Ruling.AGREES
    assert record.excess == pytest.approx(expected)


@pytest.mark.parametrize(("excess", "times"), [(1.49, 1.0), (1.5, 1.5), (7.0, 7.0)])
def test_variances_are_raised_from_one_and_a_half_times_on(excess, times):
    assert FixRecord(excess=excess).understated == times


def test_fixes_have_agreed_since_the_first_of_them():
    record = FixRecord()
    for time_s in (5.0, 6.0, 9.0):
        record, _ = at_fix(record, time_s, [1.0, 0.0])
        assert record.agreed_from_s == 5.0
    assert record.agreed == 3


@pytest.mark.parametrize(("lasted_s", "is_over"), [(15.0, True), (15.1, False)])
def test_a_burst_lasts_a_quarter_of_a_minute_at_most(lasted_s, is_over):
    record, _ = after([0.0, 14.0, lasted_s], [[60.0, 0.0]] * 3)
    assert record.is_lost
    assert not record.at_time(lasted_s + 60.0).is_over
    assert record.at_time(lasted_s + 60.1).is_over is is_over
    assert record.at_time(lasted_s + 60.1).is_lost is not is_over


def test_the_least_speed_of_fixes_that_go_on_is_one_of_them():
    """1.5 m/s east, by numbers that have no rounding errors."""
    times_s = 2.5 * np.arange(5)
    places = np.column_stack([50.0 + 1.5 * times_s, np.zeros(5)])
    assert after(times_s, places, 16.0, rests=True)[1].ruling is Ruling.CARRIED


@pytest.mark.parametrize(
    ("stated_m2", "gone_m", "far_m"),
    # 55 squared deviations: of 10 m, of the least of 7.5 m, and beyond twice the way since then.
    [(100.0, 0.0, sqrt(5500.0)), (1.0, 0.0, sqrt(55.0) * 7.5), (100.0, 20.0, sqrt(5500.0) + 40.0)],
)
def test_how_far_a_fix_is_that_has_jumped(stated_m2, gone_m, far_m):
    for off_m, jumped in ((far_m - 0.1, False), (far_m + 0.1, True)):
        given = np.array([0.6, -0.8]) * off_m, np.eye(2), stated_m2 * np.eye(2)
        record, found = AGREED.at_fix(ComparedFix(1.0, *given, False, False, gone_m), WAITS)
        assert found.ruling is Ruling.OUTLIER
        assert record.rows[0].has_jumped is jumped


def test_fixes_that_contradict_are_no_burst_until_it_is_over():
    assert not FixRecord().is_over
    record, _ = after(range(3), [[200.0, 0.0]] * 3)
    assert (record.is_over, record.is_lost) == (False, True)
    later = record.at_time(2.0 + 60.1)
    assert (later.is_over, later.is_lost) == (True, False)
    assert FixRecord(rows=record.rows).is_lost
