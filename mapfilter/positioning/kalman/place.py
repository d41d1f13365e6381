"""Position of a belief: its covariance, the radii that hold shares of it, and its tail."""

from __future__ import annotations

from math import exp, log, nan
from typing import Any

import numpy as np
from numba import njit

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.gaussian_tail import GaussianTail
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.coasting import Separation

WITHIN_M = 50.0
"""Distance from the position within which the share of a belief is reported."""
_COS_SQUARED = np.cos(np.pi * (np.arange(128) + 0.5) / 256) ** 2
"""At angles over a quarter of a turn; the other quarters are like it."""
_SHARES = np.array([0.50, 0.67, 0.95])
_LINE_SQUARED = np.array([0.454936423119572, 0.9488978454795189, 3.841458820694124])
"""Squares of the radii that hold these shares of a normal number, in its variances."""
_NEWTON_STEPS = 20


def place_of(belief: Gaussian, where: list[int]) -> dict[str, Any]:
    """Return the position of a belief as fields of a fix; ``where`` are east and north."""
    covariance = belief.covariance[where][:, where]
    radii, mass = gaussian_radii_m(covariance, WITHIN_M)
    east_m, north_m = (float(value) for value in belief.mean[where])
    return {
        "east_m": east_m,
        "north_m": north_m,
        "covariance_m2": covariance,
        "radii_m": radii,
        "mass_50m": mass,
        "way_id": 0,
        "way_probability": nan,
    }


def belief_tail(
    belief: SumBelief, where: list[int], apart: Separation | None = None
) -> GaussianTail:
    """Return the tail of a Gaussian sum about its mean; ``where`` are east and north.

    A belief without fixes beside it is a further part.
    """
    weights, means = belief.weights, belief.means[:, where]
    covariances_m2 = belief.covariances[:, where][:, :, where]
    if apart is None or apart.coast is None:
        return GaussianTail(weights, means - belief.moments.mean[where], covariances_m2)
    weights = np.append((1 - apart.probability) * weights, apart.probability)
    means = np.vstack([means, apart.coast.mean[:2]]) - belief.moments.mean[where]
    covariances_m2 = np.concatenate([covariances_m2, apart.coast.covariance[None, :2, :2]])
    return GaussianTail(weights, means, covariances_m2)


def spread_of(tail: GaussianTail) -> dict[str, Any]:
    """Return what is reported of the parts of a tail about a position, as fields of a fix."""
    off_m = tail.offsets_m
    moments_m2 = tail.covariances_m2 + off_m[:, :, None] * off_m[:, None, :]
    return {
        "covariance_m2": np.einsum("c,cij->ij", tail.weights, moments_m2),
        "radii_m": np.array([tail.radius_m(share) for share in _SHARES.tolist()]),
        "mass_50m": 1 - tail.outside(WITHIN_M),
    }


def mixture_radii_m(belief: SumBelief, where: list[int]) -> Floats:
    """Return the radii about its mean that hold 50, 67 and 95 % of a Gaussian sum.

    Examples
    --------
    >>> east_m, north_m = 3000 * np.cos([0, 1.6, 3.1, 4.7]), 3000 * np.sin([0, 1.6, 3.1, 4.7])
    >>> ring = SumBelief.around(np.zeros(2), np.diag([9e4, 9e4]), {0: east_m, 1: north_m})
    >>> mixture_radii_m(ring, [0, 1]).round(-2).tolist()
    [3000.0, 3100.0, 3500.0]
    """
    tail = belief_tail(belief, where)
    return np.array([tail.radius_m(share) for share in _SHARES.tolist()])


def gaussian_radii_m(covariance_m2: Floats, within_m: float) -> tuple[Floats, float]:
    """Return the radii that hold 50, 67 and 95 %, and the share within a distance.

    ``P(r > R) = 1/π ∫ exp(-R² / 2v) dφ`` over half a turn, ``v = a cos²φ + b sin²φ``, with the
    eigenvalues a and b of the covariance: polar coordinates, with ``tan φ = sqrt(a/b) tan θ``.

    Examples
    --------
    >>> radii, share = gaussian_radii_m(np.diag([100.0, 100.0]), 20.0)
    >>> radii.round(2).tolist(), round(share, 4)
    ([11.77, 14.89, 24.48], 0.8647)
    """
    high_m, variances = _spread(covariance_m2)
    radii_m = high_m * np.sqrt(_squared_radii(variances))
    return radii_m, _share(high_m, variances, within_m)


@njit(error_model="numpy", cache=True)
def _squared_radii(variances: Floats) -> Floats:
    """Return the squares of the radii that hold 50, 67 and 95 %; the largest variance is 1."""
    # The logarithm of what lies beyond is a convex function of the squared radius (the hazard of a
    # sum of two squared normal numbers never grows). So Newton's steps, which begin where the
    # belief is a line, come from below and never pass the root.
    squared, rate = _LINE_SQUARED.copy(), -0.5 / variances
    for k in range(squared.size):
        for _ in range(_NEWTON_STEPS):
            beyond = slope = 0.0
            for i in range(rate.size):
                decay = exp(squared[k] * rate[i])
                beyond += decay
                slope += decay * rate[i]
            step = log((1 - _SHARES[k]) * rate.size / beyond) * beyond / slope
            squared[k] += step
            if abs(step) <= 1e-12 * squared[k]:
                break
    return squared


def share_within(covariance_m2: Floats, within_m: float) -> float:
    """Return the share of a normal belief within a distance of its mean.

    Examples
    --------
    >>> round(share_within(np.diag([100.0, 100.0]), 20.0), 4)
    0.8647
    """
    return _share(*_spread(covariance_m2), within_m)


def _share(high_m: float, variances: Floats, within_m: float) -> float:
    return float(1 - np.exp(-0.5 * (within_m / high_m) ** 2 / variances).mean())


def _spread(covariance_m2: Floats) -> tuple[float, Floats]:
    """Return the largest standard deviation, and v in :func:`gaussian_radii_m`, with ``a = 1``."""
    low, high = np.maximum(np.linalg.eigvalsh(covariance_m2), 1e-6)
    return float(np.sqrt(high)), _COS_SQUARED + (1 - _COS_SQUARED) * (low / high)
