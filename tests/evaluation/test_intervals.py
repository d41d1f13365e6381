"""Intervals over journeys: against scipy's bootstrap and Poisson limits, and by simulation."""

from math import isnan

import numpy as np
import pytest
from scipy import stats

from mapfilter.evaluation.intervals import (
    pooled_interval,
    rate_interval,
    ratio_interval,
    share_interval,
    statistic_interval,
)
from mapfilter.evaluation.success import wilson_interval_of_routes

RNG = np.random.default_rng(5)
WHOLES = RNG.integers(50, 2000, 60)
PARTS = RNG.binomial(WHOLES, RNG.beta(6, 2, 60))


def by_scipy(samples, statistic, seed=1):
    found = stats.bootstrap(
        samples, statistic, paired=True, vectorized=True, n_resamples=6000, method="percentile",
        rng=np.random.default_rng(seed),
    ).confidence_interval  # fmt: skip
    return found.low, found.high


def test_shares_are_those_of_scipys_bootstrap():
    def share(parts, wholes, axis):
        return parts.sum(axis=axis) / wholes.sum(axis=axis)

    expected = by_scipy((PARTS.astype(float), WHOLES.astype(float)), share)
    assert share_interval(PARTS, WHOLES) == pytest.approx(expected, abs=0.004)
    assert ratio_interval(PARTS, WHOLES) == share_interval(PARTS, WHOLES)


@pytest.mark.parametrize(("name", "function"), [("mean", np.mean), ("median", np.median)])
def test_means_and_medians_are_those_of_scipys_bootstrap(name, function):
    values = np.random.default_rng(9).gamma(2.0, 5.0, 80)
    expected = by_scipy((values,), lambda x, axis: function(x, axis=axis))
    assert statistic_interval(values, name) == pytest.approx(expected, abs=0.25)


def test_epochs_of_a_journey_are_no_independent_epochs():
    """Ten times as many epochs in each journey say nothing more."""
    narrow = stats.binomtest(int(PARTS.sum()), int(WHOLES.sum())).proportion_ci(method="wilson")
    low, high = share_interval(PARTS, WHOLES)
    assert high - low > 4 * (narrow.high - narrow.low)
    assert share_interval(10 * PARTS, 10 * WHOLES) == pytest.approx((low, high))


def test_they_hold_the_truth_in_nineteen_of_twenty_samples():
    rng, held = np.random.default_rng(3), 0
    for _ in range(300):
        wholes = rng.integers(200, 1500, 40)
        parts = rng.binomial(wholes, rng.beta(16, 4, 40))
        low, high = share_interval(parts, wholes)
        held += low <= 0.8 <= high
    assert 0.90 <= held / 300 <= 0.98


def test_shares_of_nought_and_one_have_an_interval_too():
    wholes = np.full(60, 500)
    for parts, at in ((np.zeros(60), 0.0), (wholes, 1.0)):
        low, high = share_interval(parts, wholes)
        assert (low, high) == wilson_interval_of_routes(parts, wholes)
        assert low <= at <= high
        assert 0.05 < high - low < 0.07


def test_few_journeys_have_wilsons_interval():
    assert share_interval([5, 9], [10, 10]) == wilson_interval_of_routes([5, 9], [10, 10])
    assert all(map(isnan, share_interval([5], [10])))
    assert share_interval([], []) == (0.0, 1.0)
    assert share_interval([0, 3, 4], [0, 5, 5]) == share_interval([3, 4], [5, 5])


def test_events_that_never_happened_are_bounded_by_poisson():
    low, high = rate_interval(np.zeros(60), np.full(60, 1.9))
    assert low == 0.0
    # No event is observed with a probability of 2.5 % at this rate.
    assert stats.poisson.pmf(0, high * 60 * 1.9) == pytest.approx(0.025)


def test_events_of_few_journeys_are_bounded_by_poisson():
    low, high = rate_interval([2, 1, 0], [1.0, 2.0, 1.0])
    assert stats.poisson.cdf(3, high * 4.0) == pytest.approx(0.025)
    assert stats.poisson.sf(2, low * 4.0) == pytest.approx(0.025)


def test_events_that_come_together_have_a_wider_interval():
    km = np.full(50, 2.0)
    spread = np.tile([1, 0, 0, 0, 0], 10)
    together = np.zeros(50)
    together[0] = spread.sum()
    assert rate_interval(together, km)[1] > 1.5 * rate_interval(spread, km)[1]


def test_one_value_has_no_interval():
    assert all(map(isnan, statistic_interval([4.0])))
    assert all(map(isnan, ratio_interval([1.0], [2.0])))
    assert rate_interval([], []) == (0.0, float("inf"))


@pytest.mark.parametrize(("name", "function"), [("mean", np.mean), ("median", np.median)])
def test_pooled_values_are_drawn_by_whole_journeys(name, function):
    rng = np.random.default_rng(12)
    groups = [rng.normal(middle, 1.0, rng.integers(1, 40)) for middle in rng.normal(20.0, 5.0, 30)]
    draws = [
        function(np.concatenate([groups[i] for i in rng.integers(0, 30, 30)])) for _ in range(4000)
    ]
    found = pooled_interval(groups, name)
    assert found == pytest.approx(np.percentile(draws, (2.5, 97.5)), abs=0.5)
    # Values of a journey are no independent ones: as many single values are known much better.
    single = pooled_interval(np.concatenate(groups)[:, None], name)
    assert found[1] - found[0] > 2 * (single[1] - single[0])


def test_pooled_values_of_few_journeys_and_infinite_ones():
    assert all(isnan(end) for end in pooled_interval([[1.0, 2.0], [3.0], []]))
    assert pooled_interval([[5.0], [5.0], [5.0, 5.0]]) == (5.0, 5.0)
    low, high = pooled_interval([[1.0], [2.0], [np.inf], [np.inf]])
    assert (low, high) == (1.0, np.inf)
