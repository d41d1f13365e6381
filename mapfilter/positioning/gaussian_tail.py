"""Tails of Gaussian mixtures about a reported position, integrated."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, erfc, exp, inf, isfinite, log, pi, sin, sqrt

import numpy as np
from numba import njit

from mapfilter._types import Floats
from mapfilter.positioning.integrity import usable_risk

_STEPS = 36
_FAR = 9.0
"""Deviations beyond which a Gaussian has 1e-19."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)


@dataclass(frozen=True, eq=False)
class GaussianTail:
    """The tail of a Gaussian mixture about a reported position.

    Parameters
    ----------
    weights : (c,) array
        Of the parts; they sum to one.
    offsets_m : (c, 2) array
        East and north of the parts' means from the reported position.
    covariances_m2 : (c, 2, 2) array
        Of east and north.
    p_none : float
        Probability that no part is true.

    Examples
    --------
    >>> round_belief = GaussianTail(np.ones(1), np.zeros((1, 2)), 25.0 * np.eye(2)[np.newaxis])
    >>> round(round_belief.protection_m(1e-3), 3), round(float(5 * (2 * np.log(1e3)) ** 0.5), 3)
    (18.585, 18.585)
    """

    weights: Floats
    offsets_m: Floats
    covariances_m2: Floats
    p_none: float = 0.0

    def outside(self, radius_m: float) -> float:
        """Return the share of the mixture beyond a radius."""
        return float(_mixture_outside(radius_m, *self._parts))

    def radius_m(self, share: float) -> float:
        """Return the radius that holds a share of the mixture."""
        return float(_mixture_radius(1 - share, *self._parts))

    def protection_m(self, risk: float) -> float:
        """Return the protection level for a risk; infinite where there is none."""
        usable = usable_risk(risk, self.p_none)
        return float(_mixture_radius(usable, *self._parts)) if usable > 0 else inf

    @property
    def _parts(self) -> tuple[Floats, Floats, Floats]:
        """Weights, and means and deviations along the parts' own axes, the longer one first."""
        values, axes = np.linalg.eigh(self.covariances_m2)
        long_m = np.sqrt(np.maximum(values[:, 1], 1e-6))
        # A part that is thinner than this is a line for any radius.
        short_m = np.maximum(np.sqrt(np.maximum(values[:, 0], 0.0)), 0.01 * long_m)
        turned = np.einsum("ci,cij->cj", self.offsets_m, axes)[:, ::-1]
        return self.weights, np.abs(turned), np.stack([long_m, short_m], axis=1)


@njit(error_model="numpy", cache=True)
def _upper(z: float) -> float:
    """Return the share of a standard normal above z."""
    return 0.5 * erfc(z / sqrt(2.0))


@njit(error_model="numpy", cache=True)
def _outside(radius: float, along: float, across: float, long: float, short: float) -> float:
    """Return the share of a Gaussian beyond a radius, its mean and deviations on its axes."""
    away = sqrt(along * along + across * across)
    if away + _FAR * long <= radius:
        return 0.0
    if away - _FAR * long >= radius:
        return 1.0
    beyond: float = _upper((radius - along) / long) + _upper((radius + along) / long)
    # Where the circle is as far from the axis as the mean, the inner integral is a step.
    step = sqrt(max(radius * radius - across * across, 0.0))
    edges = (-radius, -step, step, radius)
    for panel in range(3):
        low = max(edges[panel], along - _FAR * long, -radius)
        high = min(edges[panel + 1], along + _FAR * long, radius)
        if not high > low:
            continue
        from_, to = np.arcsin(low / radius), np.arcsin(high / radius)
        half, middle = 0.5 * (to - from_), 0.5 * (to + from_)
        for k in range(_NODES.size):
            angle = middle + half * _NODES[k]
            away, up = radius * sin(angle), radius * cos(angle)
            z = (away - along) / long
            density = exp(-0.5 * z * z) / (long * sqrt(2.0 * pi)) * up
            tail = _upper((up - across) / short) + _upper((up + across) / short)
            beyond += half * _WEIGHTS[k] * density * tail
    return beyond


@njit(error_model="numpy", cache=True)
def _mixture_outside(radius: float, weight: Floats, mean: Floats, deviation: Floats) -> float:
    if radius <= 0:
        return 1.0
    beyond = 0.0
    for c in range(weight.size):
        place = mean[c, 0], mean[c, 1], deviation[c, 0], deviation[c, 1]
        beyond += weight[c] * _outside(radius, *place)
    return beyond


@njit(error_model="numpy", cache=True)
def _is_within(
    radius: float, share: float, weight: Floats, mean: Floats, deviation: Floats
) -> bool:
    """Return whether no more than a share of the mixture lies beyond a radius above 0."""
    beyond, left = 0.0, weight.sum()
    for c in range(weight.size):
        place = mean[c, 0], mean[c, 1], deviation[c, 0], deviation[c, 1]
        beyond += weight[c] * _outside(radius, *place)
        left -= weight[c]
        if beyond > share:
            return False
        # Where sums are rounded, a part too many is harmless.
        if beyond + left <= share * (1 - 1e-9):
            break
    return beyond <= share


@njit(error_model="numpy", cache=True)
def _mixture_radius(share: float, weight: Floats, mean: Floats, deviation: Floats) -> float:
    """Return the radius beyond which the mixture has a share."""
    if not isfinite(weight.sum() + mean.sum() + deviation.sum()):
        return np.nan
    reach = sqrt(2.0 * log(2.0 * weight.size / share)) + 1.0
    low = high = 0.0
    for c in range(weight.size):
        high = max(high, sqrt(mean[c, 0] ** 2 + mean[c, 1] ** 2) + reach * deviation[c, 0])
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        if _is_within(middle, share, weight, mean, deviation):
            high = middle
        else:
            low = middle
        if high - low < 1e-5 * high:
            break
    return high
