"""Steps to all sides, where neither direction nor way was measured: along the ways that there are.

Who walks on unseen keeps to ways, but that says nothing for or against a place. So the map is a
prior of where such a step leads, not evidence: on the map a hypothesis moves to a place x' with
the density ``N(x' - x) m(x') / Z(x)``, m the map's likelihood and Z its mean over where the step
may lead; off it, with ``N(x' - x)``. After many such steps one is at x with the density ``m Z``:
that of m across ways, which are narrow against a step, and about its square beyond the area, which
is wide. So m is the root of the prior density there, and a few of a hundred come to lie beyond;
where steps are short against the width of ways, it is the root of the map's likelihood, too.

Were hypotheses drawn to all sides and then weighed by the map, each of them would pay for streets
that its random way misses, and what lies beyond the area, where nobody knows the ways, would soon
be more probable than any place in it.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np
from numba import njit

from mapfilter._kernels import exp32, hashed, normals, uniforms
from mapfilter._types import Floats32
from mapfilter.models.street_motion import EAST, NORTH, OFF
from mapfilter.models.way_map import MapWeights

_F = np.float32
_SALT = np.uint64(0xD1B54A32D192ED03)
"""Draws differ from those of the step that follows with the same key."""
_PLACES = 8
"""Places drawn for each hypothesis."""
_DRAWS = _PLACES + 1
_APART_M = 12.0
"""Way after which the offset from a way is another one: one look at the map."""
_WIDE_M = 10.0
"""Deviation of a step that is long against the width of ways."""
LEAST_LOG = -25.0
"""Least logarithm of a density, so that none becomes 0 far from all ways, or from the area."""


def spread_along_ways(
    state: Floats32,
    all_sides_m: float,
    length_m: float,
    weights: MapWeights,
    log_map_at: Callable[[Floats32], Floats32],
    size_m: tuple[float, float],
    beyond: tuple[float, float],
    key: np.uint64,
) -> Floats32:
    """Return hypotheses (8 or more, N) after a step to all sides; further rows stay.

    Parameters
    ----------
    state : ndarray of float32, shape (8 or more, N)
        Position and the probability of being off the map change.
    all_sides_m : float
        Root of the mean square of the distance.
    length_m : float
        Of the way, after which some have left the map and others have come back.
    weights : MapWeights
    log_map_at : callable
        Returns the map's log-likelihood at places (2, M).
    size_m : (float, float)
        Width and height of the area, whose south-western corner is at 0.
    beyond : (float, float)
        Probability density beyond the area, at its edge, relative to that in it, and the distance
        in metres in which it falls to 1/e.
    key : numpy.uint64
        From :func:`mapfilter._kernels.draw_key`.
    """
    count, key = state.shape[1], key ^ _SALT
    places = np.empty((2, count * _PLACES), dtype=np.float32)
    _draw(state[: NORTH + 1], all_sides_m / sqrt(2.0), key, places)
    over, spread = weights.over(abs(length_m)), state.copy()
    exponent = ways_exponent(weights, all_sides_m)
    rates = (over.leave, over.come_back)
    _choose(places, log_map_at(places), exponent, rates, size_m, beyond, key, spread)
    return spread


def ways_exponent(weights: MapWeights, all_sides_m: float) -> float:
    """Return the power of the map's likelihood that draws a step to all sides to ways.

    It is a half for steps that are short against the width of ways, so that after many of them one
    is across a way as the likelihood is.

    Examples
    --------
    >>> from mapfilter.models.way_map import MapWeights
    >>> [round(ways_exponent(MapWeights(), sides_m), 2) for sides_m in (0.1, 1000.0)]
    [0.5, 1.0]
    """
    long = all_sides_m**2 / (all_sides_m**2 + 2 * _WIDE_M**2)
    return weights.weight_per_m * _APART_M * (1 + long) / 2


def density_beyond(size_m: tuple[float, float], share: float, falls_m: float) -> float:
    """Return the density beyond an area, relative to that in it, that makes up a share of all.

    It falls to 1/e in ``falls_m`` from the edge.

    Examples
    --------
    >>> round(density_beyond((900.0, 900.0), 0.02, 300.0), 4)
    0.01
    """
    width_m, height_m = size_m
    around_m2 = 2 * falls_m * (width_m + height_m) + 2 * np.pi * falls_m**2
    return share / (1 - share) * width_m * height_m / float(around_m2)


@njit(error_model="numpy", cache=True)
def _draw(place: Floats32, sd_m: float, key: np.uint64, places: Floats32) -> None:
    """Draw places (2, N K) about those of hypotheses (2, N)."""
    sd, number = _F(sd_m), 0
    for i in range(place.shape[1]):
        for k in range(_PLACES):
            east, north = normals(hashed(key, np.uint64(i * _DRAWS + k)))
            places[0, number] = place[0, i] + sd * east
            places[1, number] = place[1, i] + sd * north
            number += 1


@njit(error_model="numpy", cache=True)
def _choose(
    places: Floats32,
    log_map: Floats32,
    exponent: float,
    rates: tuple[float, float],
    size_m: tuple[float, float],
    beyond: tuple[float, float],
    key: np.uint64,
    state: Floats32,
) -> None:
    """Move each hypothesis to one of its places (2, N K), in place."""
    zero, one, power, per_m = _F(0.0), _F(1.0), _F(exponent), _F(1.0 / beyond[1])
    wide, high, edge, half = _F(size_m[0]), _F(size_m[1]), _F(sqrt(beyond[0])), _F(0.5)
    leave, come_back, least = _F(rates[0]), _F(rates[1]), _F(LEAST_LOG)
    fit, weight = np.empty(_PLACES, dtype=np.float32), np.empty(_PLACES, dtype=np.float32)
    for i in range(state.shape[1]):
        first, total, inside = i * _PLACES, zero, zero
        for k in range(_PLACES):
            east, north = places[0, first + k], places[1, first + k]
            aside, ahead = max(-east, east - wide, zero), max(-north, north - high, zero)
            far = np.sqrt(aside * aside + ahead * ahead)
            # Of the density beyond the root, as steps there are short against its extent.
            log_fit = power * log_map[first + k] if far == zero else -half * far * per_m
            fit[k] = exp32(max(log_fit, least))
            if far == zero:
                total += fit[k]
                inside += one
            else:
                # As a sign of places beyond the area.
                fit[k] = -fit[k]
        mean = total / inside if inside > zero else one
        before = state[OFF, i]
        away = before * (one - come_back) + (one - before) * leave
        sum_of_all = zero
        for k in range(_PLACES):
            if fit[k] < zero:
                weight[k] = -edge * fit[k]
            else:
                weight[k] = (one - away) * fit[k] / mean + away
            sum_of_all += weight[k]
        drawn, _ = uniforms(hashed(key, np.uint64(i * _DRAWS + _PLACES)))
        left, chosen = _F(drawn) * sum_of_all, _PLACES - 1
        for k in range(_PLACES):
            left -= weight[k]
            if left < zero:
                chosen = k
                break
        state[EAST, i], state[NORTH, i] = places[0, first + chosen], places[1, first + chosen]
        state[OFF, i] = away if fit[chosen] < zero else away / weight[chosen]
