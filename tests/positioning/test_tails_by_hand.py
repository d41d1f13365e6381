"""Tails of samples and of Gaussians by hand: rings, kernels, and levels in closed form."""

from dataclasses import replace
from math import exp, inf, isnan, log, nan, pi, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

from mapfilter.positioning.gaussian_tail import GaussianTail
from mapfilter.positioning.integrity import (
    DEFAULT_RISK,
    SampleTail,
    sample_tail,
    usable_risk,
)


def edge_m(ring):
    """The outer edge of a ring: 30 of them to the root of a metre."""
    return ((ring + 1) / 30.0) ** 2


def tail_of(distances_m, weights, p_none=0.0):
    """Samples in all directions about a place at 100 m east and 200 m north."""
    angle = 0.3 + np.arange(len(distances_m))
    east = 100.0 + np.array(distances_m) * np.cos(angle)
    north = 200.0 + np.array(distances_m) * np.sin(angle)
    weight = np.array(weights, dtype=np.float32)
    at = (100.0, 200.0, 7.0)
    return sample_tail(east.astype("f4"), north.astype("f4"), weight, at, p_none)


@pytest.mark.parametrize(
    ("weights", "half_ring"),
    [((0.5, 0.25, 0.25), 55), ((0.49, 0.26, 0.25), 83), ((0.2, 0.2, 0.6), 110),
     ((0.25, 0.25, 0.5), 83)],
)  # fmt: skip
def test_rings_hold_the_weights_at_their_outer_edges(weights, half_ring):
    """30 sqrt(d) is 55.8, 83.8 and 110.6 at these distances."""
    found = tail_of([3.46, 7.8, 13.6], weights, 0.125)
    np.testing.assert_allclose(found.distance_m, [edge_m(55), edge_m(83), edge_m(110)])
    np.testing.assert_allclose(found.mass, weights, rtol=1e-6)
    effective = 1 / sum(w * w for w in weights)
    assert found.effective == pytest.approx(effective, rel=1e-6)
    assert found.p_none == 0.125
    # Silverman's width of as many samples, by their median: 0.75 of it is a deviation.
    deviation_m = 1.06 * edge_m(half_ring) / 0.75 * effective**-0.2
    assert found.scale_m == pytest.approx(deviation_m * sqrt(3) / pi, rel=1e-6)


def test_weights_need_not_sum_to_one_and_share_rings():
    found = tail_of([7.8, 3.46, 3.47, 7.8], [2.0, 1.0, 3.0, 2.0])
    np.testing.assert_allclose(found.distance_m, [edge_m(55), edge_m(83)])
    np.testing.assert_allclose(found.mass, [0.5, 0.5])
    assert found.effective == pytest.approx(64 / (4 + 1 + 9 + 4))
    here = tail_of([0.0], [1.0])
    np.testing.assert_allclose(here.distance_m, [edge_m(0)])


def test_beyond_the_last_ring_all_is_as_far():
    """18.6 km."""
    found = tail_of([18_600.0, 2e5], [0.5, 0.5])
    np.testing.assert_allclose(found.distance_m, [edge_m(4091), edge_m(4096)])


def test_nothing_and_weights_of_nothing_have_no_tail():
    for found in (tail_of([], []), tail_of([3.0], [0.0])):
        assert found.distance_m.size == found.mass.size == 0
        assert isnan(found.radius_m(0.5))
        assert isnan(found.protection_m(0.5))
        assert found.effective == found.scale_m == 0.0


def test_a_single_sample_is_one_not_less():
    """Its median is its own distance; 1 to the power of -0.2 is 1."""
    found = tail_of([7.8], [0.3])
    assert found.scale_m == pytest.approx(1.06 * edge_m(83) / 0.75 * sqrt(3) / pi, rel=1e-6)


SAMPLES = SampleTail(np.array([1.0, 4.0, 9.0]), np.array([0.5, 0.3, 0.2]), 0.1, 40.0)


@pytest.mark.parametrize(
    ("share", "radius_m"),
    [(0.0, 1.0), (0.5, 1.0), (0.501, 4.0), (0.8, 4.0), (0.801, 9.0), (1.0, 9.0)],
)
def test_the_radius_that_holds_a_share_of_the_samples(share, radius_m):
    assert SAMPLES.radius_m(share) == radius_m


def test_shares_of_samples_are_those_of_their_sum_but_for_rounding():
    """A part in a thousand million is rounding."""
    double = replace(SAMPLES, mass=2 * SAMPLES.mass)
    for share in (0.3, 0.501, 0.9):
        assert double.radius_m(share) == SAMPLES.radius_m(share)
    assert SAMPLES.radius_m(0.5 * (1 + 0.5e-9)) == 1.0
    assert SAMPLES.radius_m(0.5 * (1 + 1.5e-9)) == 4.0
    least = 0.5 * (1 - 1e-9)
    assert SampleTail(np.array([1.0, 2.0]), np.array([least, 1 - least]), 0.1, 9.0).radius_m(
        0.5
    ) == 1.0  # fmt: skip
    # More than all are not within any.
    assert SAMPLES.radius_m(1.1) == 9.0


def test_no_level_is_beyond_45_widths():
    """Of a risk of 1e-40 it would be 92."""
    tail = SampleTail(np.array([20.0]), np.array([1.0]), 3.0, 1e9)
    assert tail.protection_m(1e-40) == pytest.approx(20.0 + 45 * 3.0)


def test_levels_are_searched_for_by_36_halvings():
    """Half of it lies within nothing; the rest is as far as a quarter of the Earth's girth."""
    tail = SampleTail(np.array([0.0, 1e7]), np.array([0.7, 0.3]), 1e-9, 1e9)
    assert tail.protection_m(0.5) == pytest.approx(1e7 / 2**36)


def bounded(risk, effective, p_none=0.0):
    """The share T for which T + 1.645 sqrt(T / n) is the risk that is left."""
    usable = (risk - p_none) / (1 - p_none)
    return brentq(lambda t: t + 1.6448536 * sqrt(t / effective) - usable, 0.0, usable)


@pytest.mark.parametrize(("risk", "p_none"), [(0.2, 0.0), (0.01, 0.0), (1e-3, 0.0), (0.01, 0.004)])
@pytest.mark.parametrize("effective", [10.0, 4000.0])
def test_the_level_of_one_place_is_that_of_its_kernel(risk, p_none, effective):
    """Of a logistic kernel a share T lies beyond d + s log((1 - T) / T)."""
    share = bounded(risk, effective, p_none)
    tail = SampleTail(np.array([20.0]), np.array([1.0]), 3.0, effective, p_none)
    expected = 20.0 + 3.0 * log((1 - share) / share)
    assert tail.protection_m(risk) == pytest.approx(expected, rel=1.1e-3)
    assert tail.protection_m(risk) >= expected * (1 - 1e-6)


@pytest.mark.parametrize("risk", [0.3, 0.05, 1e-3, 1e-6])
@pytest.mark.parametrize("scale_m", [0.05, 1.0, 20.0])
def test_the_level_of_several_places_is_that_of_their_kernels(risk, scale_m):
    distance_m, mass = np.array([1.0, 4.0, 9.0, 60.0]), np.array([0.5, 0.3, 0.19, 0.01])
    share = bounded(risk, 500.0)

    def beyond(radius_m):
        away = np.clip((radius_m - distance_m) / scale_m, -700.0, 700.0)
        return mass @ (1 / (1 + np.exp(away))) - share

    expected = brentq(beyond, 0.0, 60.0 + 45.0 * scale_m)
    tail = SampleTail(distance_m, mass, scale_m, 500.0)
    assert tail.protection_m(risk) == pytest.approx(expected, rel=1.1e-3)


def test_levels_are_never_too_small_and_at_most_a_part_in_a_thousand_too_large():
    tail, over = SampleTail(np.array([20.0]), np.array([1.0]), 3.0, 4000.0), []
    for risk in np.geomspace(1e-6, 0.3, 60):
        share = bounded(risk, 4000.0)
        over.append(tail.protection_m(risk) / (20.0 + 3.0 * log((1 - share) / share)) - 1)
        near = replace(tail, distance_m=np.array([0.01]), scale_m=0.002)
        over.append(near.protection_m(risk) / (0.01 + 0.002 * log((1 - share) / share)) - 1)
    assert min(over) > -1e-9
    assert max(over) <= 1e-3


def test_a_risk_that_no_hypothesis_leaves_has_no_level():
    tail = SampleTail(np.array([20.0]), np.array([1.0]), 3.0, 50.0, 0.01)
    assert tail.protection_m(0.01) == tail.protection_m(0.005) == inf
    assert usable_risk(0.5, 1.0) == -1.0
    assert usable_risk(0.01, 0.0) == 0.01
    assert usable_risk(0.3, 0.2) == pytest.approx(0.125)
    assert DEFAULT_RISK == 1e-3


@pytest.mark.parametrize("share", [0.5, 0.9, 0.999, 1 - 1e-7])
def test_radii_of_gaussians_that_lie_on_one_another(share):
    """Of a round one exp(-R² / 2 v) lies beyond R; of two the weighted mean."""
    weights, variances = np.array([0.7, 0.3]), np.array([25.0, 400.0])
    covariances = variances[:, None, None] * np.eye(2)
    tail = GaussianTail(weights, np.zeros((2, 2)), covariances)
    expected = brentq(
        lambda r: weights @ np.exp(-(r**2) / (2 * variances)) - (1 - share), 0.0, 1000.0
    )
    assert tail.radius_m(share) == pytest.approx(expected, rel=2e-5)
    assert tail.outside(12.0) == pytest.approx(
        0.7 * exp(-144 / 50.0) + 0.3 * exp(-144 / 800.0), rel=1e-6
    )


def test_many_parts_on_one_another_are_as_one():
    tail = GaussianTail(np.full(10, 0.1), np.zeros((10, 2)), np.tile(25.0 * np.eye(2), (10, 1, 1)))
    for share in (0.05, 0.5, 0.999):
        assert tail.radius_m(share) == pytest.approx(5 * sqrt(-2 * log(1 - share)), rel=2e-5)


@pytest.mark.parametrize("offset_m", [(0.9, 0.0), (0.0, 0.9)])
def test_the_radius_of_a_place_beside_the_reported_one(offset_m):
    """Known to a centimetre, it is 0.9 m off: half of it lies within that."""
    tail = GaussianTail(np.ones(1), np.array([offset_m]), 1e-4 * np.eye(2)[None])
    assert tail.radius_m(0.5) == pytest.approx(0.9, abs=2e-4)


def test_radii_are_never_too_small_and_at_most_a_part_in_a_hundred_thousand_too_large():
    tail = GaussianTail(np.ones(1), np.zeros((1, 2)), 49.0 * np.eye(2)[None])
    shares = np.linspace(0.3, 0.999, 40)
    exact_m = 7.0 * np.sqrt(-2 * np.log(1 - shares))
    over = np.array([tail.radius_m(share) for share in shares]) / exact_m - 1
    assert over.min() > -1e-9
    assert over.max() <= 1e-5


def test_a_gaussian_without_numbers_has_no_radius():
    tail = GaussianTail(np.ones(1), np.array([[nan, 0.0]]), np.eye(2)[None])
    assert isnan(tail.radius_m(0.5))
    assert isnan(tail.protection_m(0.5))
    sure = GaussianTail(np.ones(1), np.array([[3.0, 4.0]]), np.zeros((1, 2, 2)))
    # A risk that is used up has no level, whatever the belief.
    assert replace(tail, p_none=0.01).protection_m(0.01) == inf
    # A place that is known to a millimetre along a line.
    assert sure.radius_m(0.99) == pytest.approx(5.0, abs=0.01)
    here = GaussianTail(np.ones(1), np.zeros((1, 2)), np.zeros((1, 2, 2)))
    assert here.radius_m(0.95) == pytest.approx(1.96e-3, rel=0.01)


@pytest.mark.parametrize("angle_rad", [0.0, 0.7, 2.0])
@pytest.mark.parametrize("across_m", [-30.0, 30.0])
def test_the_sides_of_a_long_part_are_alike(angle_rad, across_m):
    """Its mean to the left or right of its axis, however it is turned."""
    turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad)],
                     [np.sin(angle_rad), np.cos(angle_rad)]])  # fmt: skip
    covariance = turn @ np.diag([400.0, 25.0]) @ turn.T
    tail = GaussianTail(np.ones(1), (turn @ [10.0, across_m])[None], covariance[None])
    rng = np.random.default_rng(1)
    drawn = np.array([10.0, across_m]) + rng.standard_normal((200_000, 2)) * [20.0, 5.0]
    away_m = np.hypot(*drawn.T)
    for radius_m in (25.0, 35.0, 50.0):
        assert tail.outside(radius_m) == pytest.approx(np.mean(away_m > radius_m), abs=5e-3)


@pytest.mark.parametrize("share", [0.3, 0.05, 0.01, 1e-3, 1e-6])
@pytest.mark.parametrize("thin", [1.0, 0.3, 0.01])
@pytest.mark.parametrize(
    "weights",
    [
        (1.0, 0.0, 0.0),
        (0.6, 0.3, 0.1),
        # What lies beyond hardly changes between two parts that are far from each other.
        (0.94, 0.0497, 0.0103),
        (0.989, 0.0099, 0.0011),
    ],
)
def test_radius_of_a_mixture_is_where_its_share_lies_beyond(weights, thin, share):
    """As by plain bisection, whatever search narrows it."""
    means_m = np.array([[0.0, 0.0], [300.0, 40.0], [-2000.0, 900.0]])
    spread_m2 = np.diag([400.0, 400.0 * thin**2])[np.newaxis].repeat(3, axis=0)
    tail = GaussianTail(np.array(weights), means_m, spread_m2)
    low_m, high_m = 0.0, 1e4
    while high_m - low_m > 1e-7 * high_m:
        middle_m = 0.5 * (low_m + high_m)
        is_within = tail.outside(middle_m) <= share
        low_m, high_m = (low_m, middle_m) if is_within else (middle_m, high_m)
    # The radius is taken too large by 1e-5 of it at most.
    assert high_m * (1 - 1e-6) <= tail.radius_m(1 - share) <= high_m * (1 + 1.2e-5)


def test_a_tail_is_shown_in_a_line():
    """The output of a step showed two arrays of hundreds of numbers."""
    shown = repr(tail_of([1.0, 5.0, 9.0], [0.5, 0.25, 0.25], 1e-4))
    assert shown.startswith("SampleTail(3 distances, scale ")
    assert shown.endswith(" m, p_none 0.0001)")
