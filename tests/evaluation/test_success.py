"""Success rates: Wilson's interval against SciPy, summaries by hand."""

from math import isnan, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from mapfilter.evaluation.accuracy import Accuracy
from mapfilter.evaluation.success import summarise, wilson_interval


@given(st.integers(1, 5000), st.floats(0, 1))
def test_wilson_against_scipy(runs, share):
    successes = round(share * runs)
    reference = binomtest(successes, runs).proportion_ci(0.95, method="wilson")
    low, high = wilson_interval(successes, runs)
    assert (low, high) == pytest.approx((reference.low, reference.high), abs=1e-12)
    assert 0.0 <= low <= successes / runs <= high <= 1.0


def test_wilson_of_another_confidence():
    reference = binomtest(7, 20).proportion_ci(0.99, method="wilson")
    assert wilson_interval(7, 20, z=2.5758293035489004) == pytest.approx(tuple(reference))


def test_wilson_at_the_ends():
    low, high = wilson_interval(0, 10)
    assert (low, round(high, 4)) == (0.0, 0.2775)
    low, high = wilson_interval(10, 10)
    assert (round(low, 4), high) == (0.7225, 1.0)
    assert wilson_interval(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize(("successes", "runs"), [(-1, 5), (6, 5), (1, 0), (0, -1)])
def test_wilson_of_impossible_counts(successes, runs):
    with pytest.raises(ValueError, match="successes"):
        wilson_interval(successes, runs)


def score(error_at_switch_m, distance_m=100.0, mean_m=4.0, share_67_m=5.0, share_95_m=9.0):
    right = None if isnan(error_at_switch_m) else error_at_switch_m <= 50
    return Accuracy(
        True, right, 60.0, distance_m, error_at_switch_m,
        mean_m, share_67_m, share_95_m, 10,
    )  # fmt: skip


NEVER = Accuracy(False, False, nan, nan, nan, nan, nan, nan, 0)


def test_a_summary_by_hand():
    summary = summarise(
        [
            score(5.0, 100.0, 4.0, 5.0, 9.0),
            score(50.0, 300.0, 6.0, 9.0, 11.0),
            score(50.1, 500.0, 900.0, 900.0, 900.0),
            NEVER,
            NEVER,
        ]
    )
    assert (summary.runs, summary.switched, summary.successes) == (5, 3, 2)
    assert (summary.success, summary.wrong) == (0.4, 0.2)
    assert (summary.success_low, summary.success_high) == wilson_interval(2, 5)
    assert summary.switch_distance_m == 300.0, "over the runs that switched"
    assert (summary.error_mean_m, summary.error_67_m, summary.error_95_m) == (5.0, 7.0, 10.0)


def test_a_switch_where_the_truth_is_unknown_is_neither_right_nor_wrong():
    summary = summarise([score(nan, nan, 900.0), score(1.0), score(51.0), score(nan)])
    assert (summary.runs, summary.switched, summary.successes) == (2, 2, 1)
    assert (summary.success, summary.wrong) == (0.5, 0.5)
    assert (summary.success_low, summary.success_high) == wilson_interval(1, 2)
    assert (summary.switch_distance_m, summary.error_mean_m) == (100.0, 4.0)
    nothing = summarise([score(nan)], ["a"])
    assert (nothing.runs, isnan(nothing.success)) == (0, True)


def test_routes_are_those_of_the_runs_that_are_told():
    scores = [score(nan), score(1.0), score(60.0), score(1.0)]
    found = summarise(scores, ["a", "b", "b", "c"])
    assert found == summarise(scores[1:], ["b", "b", "c"])


def test_a_summary_of_nothing_and_of_failures():
    empty = summarise([])
    assert (empty.runs, empty.success_low, empty.success_high) == (0, 0.0, 1.0)
    assert isnan(empty.success)
    assert isnan(empty.wrong)
    failed = summarise([NEVER] * 3)
    assert (failed.success, failed.wrong, failed.switched) == (0.0, 0.0, 0)
    assert isnan(failed.switch_distance_m)
    assert isnan(failed.error_67_m)
