"""Protection levels: radii that are exceeded with at most a stated probability, the risk.

The risk that a position is more than ``R`` off is ``p_none + (1 - p_none) T(R)``: the probability
that no hypothesis is true, and the belief's own tail. The protection level is the smallest ``R`` at
which that is at most the risk; it is infinite where ``p_none`` alone exceeds it. So do receivers of
satellite navigation state theirs (Walter & Enge 1995, *Weighted RAIM for precision approach*, ION
GPS-95), with the mixture of hypotheses in place of a list of faults (Gupta & Gao, *Reliable GNSS
localization against multiple faults using a particle filter framework*, arXiv:2101.06380).

Of Gaussian mixtures the tail is integrated (:mod:`mapfilter.positioning.gaussian_tail`). A cloud of
``n`` samples says nothing of probabilities far below ``1 / n``; three things are done about it:

* each sample is a kernel whose tail is exponential, so that the tail goes on beyond the last
  sample; its width is Silverman's for the distances;
* ``n`` is the effective number ``1 / Σ w²`` (Kish 1965);
* the tail's own sampling error counts: ``T + 1.645 sqrt(T / n)``, a one-sided bound of 95 %, must
  keep the risk.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, inf, pi, sqrt
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from mapfilter._types import Floats, Floats32
from mapfilter._words import number_of
from mapfilter.errors import ConfigError, fail
from mapfilter.filters.hypotheses import RINGS_PER_SQRT_M

DEFAULT_RISK = 1e-3
"""Probability, at each epoch, that the error exceeds the protection level."""

_F = np.float32
_Z_95 = 1.6448536269514722
_RINGS = 4096
_SILVERMAN = 1.06
_HALF_PER_SD = 0.75
"""Half of the samples lie within 0.67 deviations on a line, and 1.18 in the plane."""
_REACH = 45.0
_STEPS = 36


class RadialTail(Protocol):
    """How likely the true position is beyond a distance from the reported one."""

    def outside(self, radius_m: float) -> float:
        """Return the share of the belief beyond a radius, without any correction."""

    def radius_m(self, share: float) -> float:
        """Return the radius that holds a share of the belief, without any correction."""

    def protection_m(self, risk: float) -> float:
        """Return the protection level for a risk; infinite where there is none."""


def check_risk(risk: float) -> None:
    """Check that a risk is a probability between 0 and 1; ConfigError if not."""
    if not 0 < risk < 1:
        raise fail(ConfigError, "risk", "a probability between 0 and 1, such as 1e-3", risk)


def usable_risk(risk: float, p_none: float) -> float:
    """Return the risk that is left for a belief's tail; at most 0 where none is.

    Examples
    --------
    >>> round(usable_risk(1e-3, 2e-4), 7), usable_risk(1e-3, 0.01) < 0
    (0.0008002, True)
    """
    check_risk(risk)
    if not 0 <= p_none <= 1:
        raise ValueError(f"a probability lies in 0..1, got {p_none}")
    return (risk - p_none) / (1 - p_none) if p_none < 1 else -1.0


@dataclass(frozen=True, eq=False, repr=False)
class SampleTail:
    """The tail of a cloud of weighted positions, by distance from the reported position.

    Parameters
    ----------
    distance_m, mass : (k,) arrays
        Ascending distances, and the shares of the belief at each; shares sum to one.
    scale_m : float
        Of the kernels, whose tail is that of the logistic distribution.
    effective : float
        Effective number of samples.
    p_none : float
        Probability that no hypothesis is true.
    """

    distance_m: Floats
    mass: Floats
    scale_m: float
    effective: float
    p_none: float = 0.0

    def __repr__(self) -> str:
        some = number_of(self.mass.size, "distance")
        return f"SampleTail({some}, scale {self.scale_m:.3g} m, p_none {self.p_none:.2g})"

    def outside(self, radius_m: float) -> float:
        """Return the share of the samples beyond a radius."""
        return float(self.mass[self.distance_m > radius_m].sum())

    def radius_m(self, share: float) -> float:
        """Return the smallest distance within which a share of the samples lies."""
        if not self.mass.size:
            return float("nan")
        return float(_held_radius(self.distance_m, self.mass, share))

    def protection_m(self, risk: float) -> float:
        """Return the protection level for a risk; infinite where there is none, NaN if empty."""
        usable = usable_risk(risk, self.p_none)
        if not self.mass.size:
            return float("nan")
        if usable <= 0:
            return inf
        error = _Z_95 / sqrt(self.effective)
        share = ((sqrt(error * error + 4 * usable) - error) / 2) ** 2
        return float(_kernel_radius(self.distance_m, self.mass, self.scale_m, share))


def sample_tail(
    east_m: Floats32, north_m: Floats32, weight: Floats32, at: ArrayLike, p_none: float
) -> SampleTail:
    """Return the tail of weighted positions about a reported one.

    Parameters
    ----------
    east_m, north_m, weight : (n,) arrays
        Hypotheses; weights sum to one.
    at : array_like
        East and north of the reported position, in the same frame; more is left alone.
    p_none : float
        Probability that no hypothesis is true, 0 to 1.
    """
    east_at, north_at = np.asarray(at, dtype=np.float64)[:2]
    distance_m, mass, effective, half_m = _rings(east_m, north_m, weight, east_at, north_at)
    deviation_m = _SILVERMAN * half_m / _HALF_PER_SD * max(effective, 1.0) ** -0.2
    return SampleTail(distance_m, mass, deviation_m * sqrt(3) / pi, effective, p_none)


@njit(error_model="numpy", cache=True)
def _rings(
    east: Floats32, north: Floats32, weight: Floats32, x: float, y: float
) -> tuple[Floats, Floats, float, float]:
    """Return outer edges and shares of rings that hold anything, 1 / Σ w², and the median."""
    count = weight.size
    of_ring, ring_of = np.zeros(_RINGS + 1), np.empty(count, dtype=np.int32)
    squares, total, last = 0.0, 0.0, 0
    cx, cy, per_root, most = _F(x), _F(y), RINGS_PER_SQRT_M, float(_RINGS)
    for i in range(count):
        dx, dy = east[i] - cx, north[i] - cy
        ring = per_root * np.sqrt(np.sqrt(dx * dx + dy * dy))
        ring_of[i] = np.int32(ring if ring < most else most)
    for i in range(count):
        ring, w = ring_of[i], float(weight[i])
        of_ring[ring] += w
        last = max(last, ring)
        squares += w * w
        total += w
    if not total > 0:
        return np.empty(0), np.empty(0), 0.0, 0.0
    rings = 0
    for k in range(last + 1):
        rings += of_ring[k] > 0
    edge, mass, at, held, half = np.empty(rings), np.empty(rings), 0, 0.0, 0.0
    for k in range(last + 1):
        if of_ring[k] > 0:
            edge[at], mass[at] = ((k + 1) / RINGS_PER_SQRT_M) ** 2, of_ring[k] / total
            if held < 0.5:
                half = edge[at]
            held += mass[at]
            at += 1
    return edge, mass, total * total / squares, half


@njit(error_model="numpy", cache=True)
def _held_radius(distance: Floats, mass: Floats, share: float) -> float:
    """Return the first distance within which a share of the mass lies."""
    total = 0.0
    for k in range(mass.size):
        total += mass[k]
    wanted, held, at = share * total * (1 - 1e-9), 0.0, 0
    for k in range(mass.size):
        held += mass[k]
        if held >= wanted:
            break
        at += 1
    return float(distance[min(at, mass.size - 1)])


@njit(error_model="numpy", cache=True)
def _kernel_radius(distance: Floats, mass: Floats, scale: float, share: float) -> float:
    """Return the radius beyond which the kernels have a share; one grid for all shares."""
    low, high = 0.0, float(distance[-1] + _REACH * scale)
    nearer = np.empty(mass.size)
    within = 0.0
    for k in range(mass.size):
        nearer[k] = within
        within += mass[k]
    for _ in range(_STEPS):
        middle, beyond = 0.5 * (low + high), 0.0
        for k in range(mass.size - 1, -1, -1):
            away = (middle - distance[k]) / scale
            if away > _REACH:
                break
            each = 1.0 / (1.0 + exp(away)) if away > -_REACH else 1.0
            beyond += mass[k] * each
            # Nearer samples have less beyond it, each: not enough, or enough already.
            if beyond > share or beyond + nearer[k] * each <= share:
                break
        if beyond > share:
            low = middle
        else:
            high = middle
        if high - low < 1e-3 * high:
            break
    return high
