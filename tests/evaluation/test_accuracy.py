"""Accuracy, worked by hand."""

from fractions import Fraction
from math import ceil, isnan, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.evaluation.accuracy import (
    accuracy,
    held_by_radius_95,
    mean_of,
    percentile_m,
    position_errors_m,
)
from mapfilter.evaluation.truth import Truth
from mapfilter.evaluation.truth_notes import truth_notes
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix

S, C, T, L = Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.LOST


def estimate(rows):
    """Make an estimate of (time, east, north, status)."""
    unknown = np.full((2, 2), nan), np.full(3, nan)
    fixes = [
        Fix(time, east, north, *unknown, status, 1, nan, 0, nan, Reason.USED)
        for time, east, north, status in rows
    ]
    return TrackEstimate.of_fixes("EPSG:32629", "candidate", fixes)


# 10 m east each second for 10 s, then 10 m north each second for 10 s.
TRUTH = Truth(np.array([0.0, 10.0, 20.0]), np.array([0.0, 100, 100]), np.array([0.0, 0, 100]))


def test_truth_between_at_and_outside_its_record():
    east, north = TRUTH.at([-0.1, 0.0, 2.5, 10.0, 15.0, 20.0, 20.1])
    assert np.array_equal(east, [nan, 0, 25, 100, 100, 100, nan], equal_nan=True)
    assert np.array_equal(north, [nan, 0, 0, 0, 50, 100, nan], equal_nan=True)
    assert TRUTH.distance_at([0.0, 5.0, 12.0, 99.0]).tolist() == [0.0, 50.0, 120.0, 200.0]


def test_errors_are_horizontal_distances():
    found = estimate([(0, nan, nan, S), (5, 53, 4, C), (15, 100, 50, T), (30, 0, 0, T)])
    errors = position_errors_m(found, TRUTH)
    assert np.array_equal(errors, [nan, 5.0, 0.0, nan], equal_nan=True)


@pytest.mark.parametrize(
    ("share", "expected"), [(0.5, 2), (0.67, 3), (0.75, 3), (0.751, 4), (0.95, 4), (1, 4), (0, 1)]
)
def test_percentiles_of_four_errors(share, expected):
    assert percentile_m(np.array([3.0, 1.0, 4.0, 2.0]), share) == expected


@given(st.integers(1, 3000), st.sampled_from(["0.5", "0.67", "0.95"]))
def test_percentiles_are_the_smallest_error_that_the_share_does_not_exceed(count, share):
    rank = ceil(Fraction(share) * count)
    assert percentile_m(np.arange(1.0, count + 1), float(share)) == rank


def test_a_share_that_floating_point_puts_a_hair_too_high():
    assert 0.67 * 1500 > 1005
    assert percentile_m(np.arange(1.0, 1501), 0.67) == 1005
    assert isnan(percentile_m(np.array([]), 0.67))


def test_a_track_scored_by_hand():
    found = estimate(
        [
            (0, nan, nan, S),
            (4, nan, nan, S),
            (5, 53, 4, C),  # 5 m off after 50 m
            (6, 60, 1, T),  # 1 m
            (7, nan, nan, T),  # not located: does not count
            (10, 100, 3, T),  # 3 m
            (15, 98, 50, T),  # 2 m
            (25, 0, 0, T),  # after the truth ends: does not count
        ]
    )
    score = accuracy(found, TRUTH)
    assert (score.switched, score.success) == (True, True)
    assert (score.switch_time_s, score.switch_distance_m, score.error_at_switch_m) == (5, 50, 5)
    assert score.error_mean_m == pytest.approx(11 / 4)
    assert (score.error_67_m, score.error_95_m, score.scored_epochs) == (3.0, 5.0, 4)


def test_the_share_within_the_radius_is_of_scored_epochs_with_one():
    rows = [(4, -400, 0, S), (5, 53, 4, C), (6, 60, 1, T), (10, 100, 3, T), (15, 98, 50, T)]
    found = estimate([*rows, (16, 100, 60, T), (25, 0, 0, T)])
    # Before the switch; 5 m in 5 m; 1 m in 2 m; 3 m in 2 m; 2 m without a radius; held; no truth.
    found.radii_m[:, -1] = [9.0, 5.0, 2.0, 2.0, nan, 1.0, 1e9]
    assert held_by_radius_95(found, TRUTH).tolist() == [True, True, False, True]
    assert mean_of(held_by_radius_95(found, TRUTH)) == 0.75
    assert isnan(mean_of(held_by_radius_95(estimate(rows[:1]), TRUTH)))


def test_positions_before_the_switch_do_not_count():
    # A filter that holds a belief has a position from its first epoch: 400, 300 and 200 m off.
    found = estimate(
        [
            (0, -400, 0, S),
            (1, 310, 0, S),
            (2, 20, 200, S),
            (3, 30, 8, C),
            (4, 40, 4, T),
            (5, 50, 0, T),
        ]
    )
    score = accuracy(found, TRUTH)
    assert (score.switch_time_s, score.error_at_switch_m, score.success) == (3, 8, True)
    assert (score.error_mean_m, score.error_67_m, score.error_95_m) == (4, 8, 8)
    assert score.scored_epochs == 3


@pytest.mark.parametrize(("off", "success"), [(49.99, True), (50.0, True), (50.01, False)])
def test_fifty_metres_at_the_switch_are_the_limit(off, success):
    score = accuracy(estimate([(0, nan, nan, S), (10, 100, off, C), (20, 100, 100, T)]), TRUTH)
    assert score.success is success
    assert score.error_at_switch_m == pytest.approx(off)
    assert score.error_mean_m == pytest.approx(off / 2), "what comes after counts all the same"


@pytest.mark.parametrize("statuses", [[], [S, S], [S, L]])
def test_never_switching_is_a_failure_without_figures(statuses):
    score = accuracy(estimate([(i, nan, nan, s) for i, s in enumerate(statuses)]), TRUTH)
    assert (score.switched, score.success, score.scored_epochs) == (False, False, 0)
    assert isnan(score.switch_time_s)
    assert isnan(score.switch_distance_m)
    assert isnan(score.error_at_switch_m)
    assert isnan(score.error_mean_m)
    assert isnan(score.error_67_m)
    assert isnan(score.error_95_m)


def test_the_first_switch_counts():
    score = accuracy(estimate([(1, 10, 0, C), (2, nan, nan, L), (3, 200, 0, C)]), TRUTH)
    assert (score.switch_time_s, score.error_at_switch_m) == (1, 0)


@pytest.mark.parametrize("at_s", [-1, 30])
def test_a_switch_outside_the_truth_is_neither_right_nor_wrong(at_s):
    score = accuracy(estimate([(at_s, 100, 100, C)]), TRUTH)
    assert (score.switched, score.success, score.scored_epochs) == (True, None, 0)
    assert (score.switch_time_s, isnan(score.switch_distance_m)) == (at_s, True)
    assert isnan(score.error_at_switch_m)
    assert isnan(score.error_67_m)


# A position each 10 s, then none for 40 s in which 60 m are walked, then a rest of 40 s, then 31 s
# and 49 m, 30 s and 300 m.
GAPS = Truth(
    np.array([0.0, 10.0, 50.0, 90.0, 121.0, 151.0]),
    np.array([0.0, 15.0, 75.0, 75.0, 124.0, 424.0]),
    np.zeros(6),
)


def test_between_true_positions_far_apart_in_time_and_place_nobody_knows_the_way():
    at_s = [0, 5, 10, 10.1, 30, 49.9, 50, 70, 100, 130, 151, 151.1]
    told = [True] * 3 + [False] * 3 + [True] * 5 + [False]
    assert GAPS.tells(at_s).tolist() == told
    assert isinstance(bool(GAPS.tells(30.0)), bool)
    found = estimate([(time, 15.0, 0.0, T) for time in at_s])
    assert np.isfinite(position_errors_m(found, GAPS)).tolist() == told


def test_a_truth_of_one_position_or_without_numbers_tells_what_it_has():
    one = Truth(np.array([5.0]), np.array([1.0]), np.array([2.0]))
    assert one.tells([4.0, 5.0, 6.0]).tolist() == [False, True, False]
    holed = Truth(np.arange(4.0), np.array([0.0, nan, 2.0, 3.0]), np.zeros(4))
    assert holed.tells([0.0, 0.5, 1.0, 1.5, 2.0, 2.5]).tolist() == [
        *(True, False, False, False, True, True)
    ]


def test_a_switch_without_a_position_is_a_failure_where_the_truth_is_known():
    score = accuracy(estimate([(5, nan, nan, C), (6, 60, 0, T)]), TRUTH)
    assert (score.switched, score.success, score.switch_distance_m) == (True, False, 50.0)
    assert isnan(score.error_at_switch_m)


def test_what_lies_in_a_gap_of_the_truth_is_not_scored():
    score = accuracy(estimate([(10, 15, 4, C), (30, 0, 900, T), (60, 75, 2, T)]), GAPS)
    assert (score.success, score.error_at_switch_m, score.error_mean_m) == (True, 4.0, 3.0)
    assert score.scored_epochs == 2
    score = accuracy(estimate([(30, 45, 0, C), (60, 75, 2, T)]), GAPS)
    assert (score.success, isnan(score.switch_distance_m)) == (None, True)
    assert (score.error_mean_m, score.scored_epochs) == (2.0, 1)


def test_what_the_truth_does_not_tell_is_noted():
    at_switch = "the ground truth has no position at the switch ({} s): whether that was right is "
    at_switch += "not known, and counts neither as right nor as wrong"
    gaps = "{} in gaps of the ground truth (over 30 s and 50 m), and {} not scored"
    for rows, notes in (
        ([(10, 15, 4, C), (60, 75, 2, T)], ()),
        ([(-5, 0, 0, S), (10, 15, 4, C), (200, 0, 0, T)], ()),
        ([(-5, 0, 0, C), (10, 15, 4, T)], (at_switch.format(-5),)),
        ([(10, 15, 4, C), (20, 0, 0, T)], (gaps.format("1 epoch lies", "is"),)),
        (
            [(20, 0, 0, C), (30, 0, 0, T)],
            (at_switch.format(20), gaps.format("2 epochs lie", "are")),
        ),
        (
            [(1000, 0, 0, C), (1200, 0, 0, T)],
            (
                "the ground truth (0 to 151 s) covers no epoch of the log (1000 to 1200 s): "
                "another clock or time zone?",
            ),
        ),
    ):
        assert truth_notes(estimate(rows), GAPS) == notes
    assert truth_notes(estimate([]), GAPS) == ()


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
def test_moving_estimate_and_truth_alike_changes_no_error(east, north):
    rows = [(1, 12.0, 3.0, C), (5, 40.0, -7.0, T), (15, 99.0, 55.0, T)]
    moved = [(t, e + east, n + north, s) for t, e, n, s in rows]
    truth = Truth(TRUTH.time_s, TRUTH.east_m + east, TRUTH.north_m + north)
    assert position_errors_m(estimate(moved), truth) == pytest.approx(
        position_errors_m(estimate(rows), TRUTH), abs=1e-9
    )
