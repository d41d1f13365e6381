"""Accuracy, worked by hand."""

from fractions import Fraction
from math import ceil, isnan, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.evaluation.accuracy import Truth, accuracy, percentile_m, position_errors_m
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import Fix, TrackEstimate

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


def test_a_switch_outside_the_truth_is_no_success():
    score = accuracy(estimate([(30, 100, 100, C)]), TRUTH)
    assert (score.switched, score.success, score.scored_epochs) == (True, False, 0)
    assert isnan(score.error_at_switch_m)
    assert isnan(score.error_67_m)


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
def test_moving_estimate_and_truth_alike_changes_no_error(east, north):
    rows = [(1, 12.0, 3.0, C), (5, 40.0, -7.0, T), (15, 99.0, 55.0, T)]
    moved = [(t, e + east, n + north, s) for t, e, n, s in rows]
    truth = Truth(TRUTH.time_s, TRUTH.east_m + east, TRUTH.north_m + north)
    assert position_errors_m(estimate(moved), truth) == pytest.approx(
        position_errors_m(estimate(rows), TRUTH), abs=1e-9
    )
