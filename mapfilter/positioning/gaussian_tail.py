"""Tails of Gaussian mixtures about a reported position, integrated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, log, nan, pi, sqrt

import numpy as np
from numba import njit

from mapfilter._types import Floats
from mapfilter.positioning.integrity import usable_risk
from mapfilter.positioning.normal_kernels import exp64, sin_cos64, tail64

_STEPS = 36
_FAR = 9.0
"""Deviations beyond which a Gaussian has 1e-19."""
_RULE = np.array(np.polynomial.legendre.leggauss(40))
_COARSE_RULE = np.array(np.polynomial.legendre.leggauss(6))
"""Nodes and weights of the integral, and of its first estimates."""
_COARSE, _CLOSE, _SURE = 1e-2, 1e-5, 1e-6
"""Change of logarithms at the last step of a search with either rule; distance from the radius so
found, relative to it, beyond which it decides."""
_MOST_STEPS, _LEAST = 12, 1e-300


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
        return float(_mixture_outside(radius_m, *self._parts, _RULE))

    def radius_m(self, share: float) -> float:
        """Return the radius that holds a share of the mixture."""
        return float(_mixture_radius(1 - share, *self._parts))

    def protection_m(self, risk: float) -> float:
        """Return the protection level for a risk; infinite where there is none."""
        usable = usable_risk(risk, self.p_none)
        return float(_mixture_radius(usable, *self._parts)) if usable > 0 else inf

    @cached_property
    def _parts(self) -> tuple[Floats, Floats, Floats]:
        """Weights, and means and deviations along the parts' own axes, the longer one first."""
        values, axes = np.linalg.eigh(self.covariances_m2)
        long_m = np.sqrt(np.maximum(values[:, 1], 1e-6))
        # A part that is thinner than this is a line for any radius.
        short_m = np.maximum(np.sqrt(np.maximum(values[:, 0], 0.0)), 0.01 * long_m)
        turned = np.einsum("ci,cij->cj", self.offsets_m, axes)[:, ::-1]
        return self.weights, np.abs(turned), np.stack([long_m, short_m], axis=1)


@njit(error_model="numpy", fastmath={"contract", "reassoc"}, cache=True)
def _outside(
    radius: float, along: float, across: float, long: float, short: float, rule: Floats
) -> float:
    """Return the share of a Gaussian beyond a radius, its mean and deviations on its axes.

    ``rule`` (2, k) are nodes and weights of each of three panels.
    """
    away = sqrt(along * along + across * across)
    if away + _FAR * long <= radius:
        return 0.0
    if away - _FAR * long >= radius:
        return 1.0
    beyond: float = tail64((radius - along) / long) + tail64((radius + along) / long)
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
        integral = 0.0
        for k in range(rule.shape[1]):
            sine, cosine = sin_cos64(middle + half * rule[0, k])
            z, up = (radius * sine - along) / long, radius * cosine
            sides = tail64((up - across) / short) + tail64((up + across) / short)
            integral += rule[1, k] * exp64(-0.5 * z * z) * up * sides
        beyond += half / (long * sqrt(2.0 * pi)) * integral
    return beyond


@njit(error_model="numpy", cache=True)
def _mixture_outside(
    radius: float, weight: Floats, mean: Floats, deviation: Floats, rule: Floats
) -> float:
    if radius <= 0:
        return 1.0
    beyond = 0.0
    for c in range(weight.size):
        place = mean[c, 0], mean[c, 1], deviation[c, 0], deviation[c, 1]
        beyond += weight[c] * _outside(radius, *place, rule)
    return beyond


@njit(error_model="numpy", cache=True)
def _is_within(
    radius: float, share: float, weight: Floats, mean: Floats, deviation: Floats
) -> bool:
    """Return whether no more than a share of the mixture lies beyond a radius above 0."""
    beyond, left = 0.0, weight.sum()
    for c in range(weight.size):
        place = mean[c, 0], mean[c, 1], deviation[c, 0], deviation[c, 1]
        beyond += weight[c] * _outside(radius, *place, _RULE)
        left -= weight[c]
        if beyond > share:
            return False
        # Where sums are rounded, a part too many is harmless.
        if beyond + left <= share * (1 - 1e-9):
            break
    return beyond <= share


@njit(error_model="numpy", cache=True)
def _searched(
    square: float,
    slope: float,
    share: float,
    parts: tuple[Floats, Floats, Floats],
    rule: Floats,
    close: float,
) -> tuple[float, float]:
    """Return the squared radius beyond which there is a share, NaN if not found, and a slope.

    That is by secants of the logarithm of what lies beyond, which is nearly a line.
    """
    last = last_beyond = 0.0
    for count in range(_MOST_STEPS):
        beyond = log(max(_mixture_outside(sqrt(square), *parts, rule), _LEAST))
        if count > 0:
            slope = (beyond - last_beyond) / (square - last)
        lacking = log(share) - beyond
        step = lacking / slope
        last, last_beyond = square, beyond
        square = min(max(square + step, 0.25 * square), 4.0 * square)
        if abs(step) < close * square and abs(lacking) < close:
            return square, slope
    return nan, slope


@njit(error_model="numpy", cache=True)
def _mixture_radius(share: float, weight: Floats, mean: Floats, deviation: Floats) -> float:
    """Return the radius beyond which the mixture has a share.

    By bisection, whose radii are compared with that of a search; those next to it are looked at.
    """
    if not isfinite(weight.sum() + mean.sum() + deviation.sum()):
        return np.nan
    parts = weight, mean, deviation
    reach = sqrt(2.0 * log(2.0 * weight.size / share)) + 1.0
    low = high = moment = 0.0
    for c in range(weight.size):
        away2 = mean[c, 0] ** 2 + mean[c, 1] ** 2
        high = max(high, sqrt(away2) + reach * deviation[c, 0])
        moment += weight[c] * (away2 + deviation[c, 0] ** 2 + deviation[c, 1] ** 2)
    # As if it were round.
    square, slope = -log(share) * moment, -1.0 / moment
    square, slope = _searched(square, slope, share, parts, _COARSE_RULE, _COARSE)
    square, _ = _searched(square, slope, share, parts, _RULE, _CLOSE)
    found = sqrt(square)
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        if abs(middle - found) > _SURE * found:
            is_within = middle > found
        else:
            is_within = _is_within(middle, share, *parts)
        if is_within:
            high = middle
        else:
            low = middle
        if high - low < 1e-5 * high:
            break
    return high
