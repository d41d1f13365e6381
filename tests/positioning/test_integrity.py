"""Protection levels against integrals of scipy, closed forms and known distributions."""

from copy import deepcopy
from functools import cache
from math import atan2, cos, exp, inf, isnan, log, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats

from mapfilter.errors import ConfigError
from mapfilter.positioning.gaussian_tail import GaussianTail
from mapfilter.positioning.integrity import (
    SampleTail,
    sample_tail,
    usable_risk,
)

MODERATE = [
    ([0.0, 0.0], [[30.0, 4.0], [4.0, 20.0]]),
    ([9.0, -4.0], [[16.0, 0.0], [0.0, 16.0]]),
    ([-3.0, 12.0], [[64.0, -20.0], [-20.0, 12.0]]),
]


def beyond_by_quadrature(radius, mean, covariance):
    """Integrate the density in polar coordinates.

    SciPy's takes fifty times as long for one place as its formula; both agree here.
    """
    (east, both), (_, north) = np.linalg.inv(covariance).tolist()
    scale = 1 / (2 * pi * sqrt(np.linalg.det(covariance)))

    def density(r, angle):
        right, up = r * cos(angle) - mean[0], r * sin(angle) - mean[1]
        return r * scale * exp(-0.5 * (east * right**2 + 2 * both * right * up + north * up**2))

    known = stats.multivariate_normal(mean, covariance).pdf([3.0, 4.0])
    assert density(5.0, atan2(4.0, 3.0)) == pytest.approx(5.0 * known, rel=1e-12)

    far = radius + np.hypot(*mean) + 12 * sqrt(np.linalg.eigvalsh(covariance)[-1])
    whole = integrate.dblquad(density, -pi, pi, radius, far, epsabs=1e-10, epsrel=1e-6)
    return whole[0]


def mixture(parts, weights=None, p_none=0.0):
    weights = np.full(len(parts), 1 / len(parts)) if weights is None else np.array(weights)
    means, covariances = zip(*parts, strict=True)
    return GaussianTail(weights, np.array(means), np.array(covariances), p_none)


def cloud(places, weight=None, p_none=0.0, at=(0.0, 0.0)):
    places = np.asarray(places, dtype=np.float32)
    weight = np.ones(len(places)) if weight is None else np.asarray(weight, dtype=np.float64)
    weight = (weight / weight.sum()).astype(np.float32)
    return sample_tail(places[:, 0], places[:, 1], weight, np.array(at), p_none)


@pytest.mark.parametrize("risk", [0.3, 1e-2, 1e-3, 1e-5, 1e-7])
def test_of_a_round_gaussian_it_is_known(risk):
    tail = mixture([([0.0, 0.0], 49.0 * np.eye(2))])
    assert tail.protection_m(risk) == pytest.approx(7 * sqrt(-2 * log(risk)), rel=1e-4)


@pytest.mark.parametrize("risk", [1e-2, 1e-3, 1e-6])
@pytest.mark.parametrize("off_m", [0.0, 20.0])
def test_of_a_line_it_is_that_of_one_dimension(risk, off_m):
    tail = mixture([([off_m, 0.0], np.diag([100.0, 1e-9]))])
    found = tail.protection_m(risk)
    line = stats.norm(off_m, 10.0)
    assert line.sf(found) + line.cdf(-found) == pytest.approx(risk, rel=0.01)


@pytest.mark.parametrize(("mean", "covariance"), MODERATE)
@pytest.mark.parametrize("radius_m", [4.0, 15.0, 30.0])
def test_shares_beyond_a_radius_are_those_of_quadrature(mean, covariance, radius_m):
    expected = beyond_by_quadrature(radius_m, mean, covariance)
    assert mixture([(mean, covariance)]).outside(radius_m) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("risk", "p_none"), [(1e-2, 0.0), (1e-3, 0.0), (1e-2, 4e-3)])
def test_the_risk_of_a_mixture_is_kept_exactly(risk, p_none):
    weights = [0.7, 0.25, 0.05]
    level_m = mixture(MODERATE, weights, p_none).protection_m(risk)
    parts = zip(weights, MODERATE, strict=True)
    beyond = sum(weight * beyond_by_quadrature(level_m, *part) for weight, part in parts)
    assert p_none + (1 - p_none) * beyond == pytest.approx(risk, rel=1e-3)


def test_radii_of_a_mixture_hold_their_share():
    tail = mixture(MODERATE, [0.7, 0.25, 0.05])
    for share in (0.5, 0.95, 0.99):
        assert tail.outside(tail.radius_m(share)) == pytest.approx(1 - share, rel=1e-3)


@given(st.floats(1e-6, 0.5), st.floats(1e-6, 0.5), st.floats(0, 0.6), st.integers(0, 5))
def test_levels_fall_with_the_risk_and_rise_with_the_doubt(one, other, p_none, seed):
    rng = np.random.default_rng(seed)
    places = rng.standard_normal((200, 2)) * [30.0, 3.0]
    weight = rng.gamma(0.5, size=200)
    low, high = sorted((one, other))
    for tail, sure in (
        (cloud(places, weight, p_none), cloud(places, weight)),
        (mixture(MODERATE, p_none=p_none), mixture(MODERATE)),
    ):
        assert tail.protection_m(low) >= tail.protection_m(high)
        assert tail.protection_m(high) >= sure.protection_m(high)
        assert (tail.protection_m(high) == inf) == (p_none >= high)


@given(st.integers(1, 80), st.integers(0, 1000), st.sampled_from([1e-1, 1e-2, 1e-3, 1e-4]))
def test_no_level_is_below_the_samples_own_quantile(count, seed, risk):
    rng = np.random.default_rng(seed)
    places = rng.standard_t(2, size=(count, 2)) * 10.0
    weight = rng.gamma(0.3, size=count) + 1e-9
    tail = cloud(places, weight)
    away = np.hypot(*places.astype(np.float32).T)
    shares = (weight / weight.sum())[np.argsort(away)]
    beyond = 1 - np.cumsum(shares)
    reached = np.sort(away)[int(np.argmax(beyond <= risk + 1e-6))]
    assert tail.protection_m(risk) >= 0.999 * reached


WAYS = {
    "round": lambda rng, n: rng.standard_normal((n, 2)) * 10.0,
    "street": lambda rng, n: rng.standard_normal((n, 2)) * [10.0, 0.5],
    "two streets": lambda rng, n: (
        rng.standard_normal((n, 2)) * [10.0, 1.0] + np.outer(rng.random(n) < 0.04, [0.0, 300.0])
    ),
    "exponential": lambda rng, n: rng.laplace(size=(n, 2)) * 10.0,
}


@cache
def many(name):
    """Return two million ordered distances, and the generator behind them."""
    rng = np.random.default_rng(7)
    return np.sort(np.hypot(*WAYS[name](rng, 2_000_000).T)), rng


@pytest.mark.parametrize("count", [300, 1000, 5000])
@pytest.mark.parametrize("name", WAYS)
def test_a_thousand_samples_give_a_level_for_one_in_a_thousand(name, count):
    """Over many draws of the samples: nearly always enough, and seldom twice too much."""
    away, rng = many(name)
    rng = deepcopy(rng)
    right_m = away[int(0.999 * away.size)]
    weight = rng.gamma(2.0, size=(60, count))
    levels = np.array([cloud(WAYS[name](rng, count), w).protection_m(1e-3) for w in weight])
    assert np.mean(levels >= right_m) >= (0.65 if name == "exponential" else 0.9)
    assert np.median(levels) <= 1.6 * right_m
    # Where it is not enough, the risk itself is at most a few times what it should be.
    real = 1 - np.searchsorted(away, levels) / away.size
    assert np.mean(real) <= 1e-3


def test_fewer_samples_give_wider_levels():
    rng = np.random.default_rng(3)
    means = [
        np.mean([cloud(WAYS["round"](rng, n)).protection_m(1e-3) for _ in range(40)])
        for n in (50, 400, 3000)
    ]
    assert means[0] > 1.2 * means[1] > 1.3 * means[2]


def test_uneven_weights_are_fewer_samples():
    rng = np.random.default_rng(4)
    places = WAYS["round"](rng, 1000)
    weight = np.where(np.arange(1000) < 30, 1.0, 1e-6)
    assert cloud(places, weight).effective == pytest.approx(30.0, rel=0.01)
    assert cloud(places).effective == pytest.approx(1000.0, rel=1e-3)


def test_distances_are_from_the_reported_position():
    places = np.array([400.0, -300.0]) + np.random.default_rng(5).standard_normal((500, 2))
    near, far = cloud(places, at=(400.0, -300.0)), cloud(places)
    assert near.protection_m(1e-3) < 10.0
    assert far.protection_m(1e-3) > 500.0
    assert far.radius_m(0.5) == pytest.approx(500.0, abs=3.0)
    assert far.outside(490.0) == pytest.approx(1.0)
    assert far.outside(510.0) == 0.0


def test_one_place_alone_has_a_level_of_its_width():
    tail = cloud([[3.0, 4.0]])
    assert 5.0 <= tail.radius_m(0.99) < 5.2
    assert tail.protection_m(1e-3) > 5.0


def test_nothing_has_no_level():
    empty = cloud(np.empty((0, 2)), np.empty(0))
    assert isnan(empty.protection_m(1e-3))
    assert isnan(empty.radius_m(0.5))
    assert SampleTail(np.array([1.0]), np.array([1.0]), 1.0, 1.0, 1.0).protection_m(0.5) == inf


@pytest.mark.parametrize("risk", [0.0, 1.0, -1e-3, float("nan"), inf])
def test_a_risk_is_a_probability(risk):
    with pytest.raises(ConfigError, match="between 0 and 1"):
        usable_risk(risk, 0.0)
    with pytest.raises(ValueError, match="probability"):
        usable_risk(0.5, 1.5)
