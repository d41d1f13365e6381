"""Shares of thin Gaussians beyond a radius, whose inner integral is nearly a step."""

from itertools import pairwise
from math import exp, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtr

from mapfilter.positioning.gaussian_tail import GaussianTail


def share_beyond(radius_m, along_m, across_m, long_m, short_m):
    """By quadrature, cut where the circle meets the middle of the belief."""

    def inside(x):
        half_m = sqrt(max(radius_m**2 - x**2, 0.0))
        held = ndtr((half_m - across_m) / short_m) - ndtr((-half_m - across_m) / short_m)
        return held * exp(-0.5 * ((x - along_m) / long_m) ** 2) / (long_m * sqrt(2 * pi))

    step_m = np.sqrt(max(radius_m**2 - across_m**2, 0.0))
    near = [s * step_m + k * short_m for s in (-1, 1) for k in (-40, -10, -3, -1, 0, 1, 3, 10, 40)]
    edges = np.unique(np.clip([-radius_m, *near, along_m, radius_m], -radius_m, radius_m))
    parts = pairwise(edges)
    return 1 - sum(quad(inside, a, b, epsabs=1e-12, epsrel=1e-10, limit=200)[0] for a, b in parts)


@pytest.mark.parametrize("radius_m", [9.0, 10.5, 12.0, 20.0, 45.0])
@pytest.mark.parametrize(("along_m", "across_m"), [(0.0, 10.0), (6.0, 10.0), (15.0, 4.0)])
@pytest.mark.parametrize("thin", [0.01, 0.03])
def test_thin_beliefs_beside_the_position(radius_m, along_m, across_m, thin):
    long_m = 12.0
    short_m = thin * long_m
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    covariance = turn @ np.diag([long_m**2, short_m**2]) @ turn.T
    offset = turn @ np.array([along_m, -across_m])
    tail = GaussianTail(np.ones(1), offset[np.newaxis], covariance[np.newaxis])
    expected = share_beyond(radius_m, along_m, across_m, long_m, short_m)
    assert tail.outside(radius_m) == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize(
    "place",
    [
        # Less than a metre, beside a belief of decimetres.
        (0.9, 0.6, 0.7, 0.3, 0.003),
        (0.7, 0.0, 0.5, 0.3, 0.003),
        # Short beside their distance: all of them lies at a few angles.
        (67.5, 64.8, 27.4, 5.1, 0.051),
        (60.6, 48.2, 36.2, 0.5, 0.015),
    ],
)
def test_thin_beliefs_near_the_circle(place):
    """Radius, mean and deviations along and across."""
    radius_m, along_m, across_m, long_m, short_m = place
    covariance = np.diag([long_m**2, short_m**2])
    tail = GaussianTail(np.ones(1), np.array([[along_m, across_m]]), covariance[np.newaxis])
    assert tail.outside(radius_m) == pytest.approx(share_beyond(*place), abs=5e-5)
