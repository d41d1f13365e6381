"""Whether a filter is as sure as it should be."""

import numpy as np
import pytest

from mapfilter.evaluation.consistency import (
    coverage,
    hpd_rank,
    nees,
    nees_interval,
    reliability,
    uniformity,
)

RNG = np.random.default_rng(11)
SD = 4.0
OFF = SD * RNG.standard_normal((4000, 2))
ERRORS = np.hypot(*OFF.T)


def test_a_calibrated_radius_covers_its_share():
    for share in (0.5, 0.67, 0.95):
        found = coverage(ERRORS, SD * np.sqrt(-2 * np.log(1 - share)), share)
        assert found.cases == 4000
        assert found.low <= share <= found.high


def test_what_is_unknown_is_left_out():
    found = coverage([1.0, np.nan, 3.0], [2.0, 2.0, np.nan], 0.95)
    assert (found.cases, found.inside) == (1, 1)
    assert np.isnan(coverage([], [], 0.95).covered)


def test_a_calibrated_probability_comes_true_as_often():
    said = RNG.random(20_000)
    points = reliability(said, RNG.random(20_000) < said)
    assert sum(point.cases for point in points) == 20_000
    # Of ten intervals of 95 % one may miss.
    assert sum(point.low <= point.predicted <= point.high for point in points) >= 9


def test_overconfidence_shows():
    (point,) = reliability(np.full(200, 0.99), np.arange(200) < 150)
    assert point.high < 0.99


def test_ranks_of_a_calibrated_belief_are_uniform():
    ranks = []
    for off in OFF[:300]:
        cloud = SD * RNG.standard_normal((2000, 2))
        density = np.exp(-0.5 * (cloud**2).sum(axis=1) / SD**2)
        at_truth = np.exp(-0.5 * (off**2).sum() / SD**2)
        ranks.append(hpd_rank(density, np.full(2000, 1 / 2000), at_truth))
    assert uniformity(ranks) > 0.01
    assert uniformity(np.array(ranks) ** 2) < 1e-6


def test_nees_of_normal_errors_lies_in_its_band():
    covariance = np.tile(np.diag([SD**2, SD**2]), (4000, 1, 1))
    found = nees(*OFF.T, covariance)
    low, high = nees_interval(4000)
    assert low <= found.mean() <= high
    covariance[0], covariance[1] = np.nan, 0.0
    assert np.isnan(nees(*OFF.T, covariance)[:2]).all()
    assert nees(*OFF.T, covariance / 4)[2:].mean() == pytest.approx(8.0, rel=0.1)
    assert np.isnan(nees_interval(0)).all()
