"""The map of ways, and how hypotheses are weighed by it after a step, in one compiled call.

The map is a hidden Markov model of two modes. *On* it, a position d metres beside the nearest way
(0 within the way's width) costs ``-log(0.97 exp(-d²/2s²) + 0.03 exp(-d/30 m))`` times a weight for
each metre travelled; the weight is small, because the offset lasts for tens of metres. *Off* it,
where ways are missing, each metre costs the same everywhere. The probability of being off is kept
for each hypothesis and summed out exactly, so that no hypotheses are spent on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp
from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._kernels import exp32, log32
from mapfilter._types import Bools, Floats, Floats32
from mapfilter.models.street_motion import OFF
from mapfilter.options import NotNegative, Options, Positive

_F = np.float32
_BLOCK = 4096


class MapFactors(NamedTuple):
    """Effect of the map on a belief over some length.

    These are the exponent of the map's likelihood, the likelihood off the map, and the
    probabilities of leaving the map and of coming back.
    """

    exponent: float
    off: float
    leave: float
    come_back: float


@dataclass(frozen=True, slots=True)
class MapWeights(Options):
    """Weight of the map in the likelihood.

    Parameters
    ----------
    sd_m : float
        Standard deviation of the offset from the way's edge, for those on the map beside it.
    weight_per_m : float
        Exponent of the map's likelihood for each metre travelled.
    off_cost_per_m : float
        Negative log-likelihood of each metre off the map.
    leave_per_m, return_per_m : float
        Rates of leaving the map and of coming back.
    """

    sd_m: Positive = 3.0
    weight_per_m: NotNegative = 1 / 12
    off_cost_per_m: NotNegative = 0.04
    leave_per_m: NotNegative = 1e-3
    return_per_m: NotNegative = 1e-2

    def over(self, length_m: float) -> MapFactors:
        """Return the factors for a length travelled."""
        return MapFactors(
            self.weight_per_m * length_m,
            exp(-self.off_cost_per_m * length_m),
            1 - exp(-self.leave_per_m * length_m),
            1 - exp(-self.return_per_m * length_m),
        )


def map_log_likelihood(distance_m: Floats32, sd_m: float) -> Floats32:
    """Return the logarithm of the map's likelihood at distances from the edge of the nearest way.

    Examples
    --------
    >>> [f"{value:.2f}" for value in map_log_likelihood(np.float32([0, 5, 60]), 5.0)]
    ['0.00', '-0.49', '-5.51']
    """
    d = np.asarray(distance_m, dtype=np.float64)
    near, far = 0.97 * np.exp(-0.5 * (d / sd_m) ** 2), 0.03 * np.exp(-d / 30.0)
    return np.log(near + far).astype(np.float32)


class WayMap(NamedTuple):
    """The map's log-likelihood over an area, in a frame with its south-western corner at 0.

    Parameters
    ----------
    log_likelihood : ndarray of float32, shape (rows, cols)
        Of each pixel.
    pixel_m : float
        Side of a pixel.
    width_m, height_m : float
        Extent of the area.
    """

    log_likelihood: Floats32
    pixel_m: float
    width_m: float
    height_m: float


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def interpolate(
    east: Floats32, north: Floats32, raster: Floats32, west_m: float, north_m: float, per_m: float
) -> Floats32:
    """Return a raster's values at places (N,), in metres, bilinear between the pixels' centres.

    ``west_m`` and ``north_m`` are the centre of the first pixel, ``per_m`` the pixels per metre.
    Beyond the raster's edge values are those of the edge.
    """
    rows, cols = raster.shape
    flat, count = raster.ravel(), east.size
    zero, one = _F(0.0), _F(1.0)
    west, top, k = _F(west_m), _F(north_m), _F(per_m)
    last_col, last_row = np.int32(cols - 2), np.int32(rows - 2)
    below, width = np.uint32(cols), np.int32(cols)
    first = np.empty(count, dtype=np.int32)
    along, down = np.empty(count, dtype=np.float32), np.empty(count, dtype=np.float32)
    found = np.empty(count, dtype=np.float32)
    # Loops that look up are apart from the one that computes, which is vectorised.
    for i in range(count):
        # Plain comparisons vectorise; min and max, which care for NaN, do not.
        x = (east[i] - west) * k
        y = (top - north[i]) * k
        x = x if x > zero else zero
        y = y if y > zero else zero
        col, row = np.int32(x), np.int32(y)
        col = col if col < last_col else last_col
        row = row if row < last_row else last_row
        u, v = x - _F(col), y - _F(row)
        along[i] = u if u < one else one
        down[i] = v if v < one else one
        first[i] = np.int32(row * width) + col
    for i in range(count):
        at, u = np.uint32(first[i]), along[i]
        upper = flat[at] + u * (flat[at + np.uint32(1)] - flat[at])
        under = flat[at + below] + u * (flat[at + below + np.uint32(1)] - flat[at + below])
        found[i] = upper + down[i] * (under - upper)
    return found


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_by_map(log_map: Floats32, off: Floats32, factors: MapFactors, log_weight: Floats) -> None:
    """Add the map's log-likelihood to weights and update the probability of being off, in place.

    ``log_map`` is the map's log-likelihood at the hypotheses; the factors are those of the length
    of the step.
    """
    one, weight, off_cost = _F(1.0), _F(factors.exponent), _F(factors.off)
    leave, come_back = _F(factors.leave), _F(factors.come_back)
    for i in range(off.size):
        on = exp32(weight * log_map[i])
        before = off[i]
        away = before * (one - come_back) + (one - before) * leave
        total = away * off_cost + (one - away) * on
        off[i] = away * off_cost / total
        log_weight[i] += log32(total)


@njit(error_model="numpy", cache=True)
def places_beyond(east: Floats32, north: Floats32, width_m: float, height_m: float) -> Bools:
    """Return whether each place (N,), in metres, lies beyond an area, (N,)."""
    wide, high, zero = _F(width_m), _F(height_m), _F(0.0)
    found = np.empty(east.size, dtype=np.bool_)
    for i in range(found.size):
        aside = (east[i] < zero) | (east[i] > wide)
        found[i] = aside | (north[i] < zero) | (north[i] > high)
    return found


@njit(error_model="numpy", cache=True)
def all_inside(east_m: Floats32, north_m: Floats32, width_m: float, height_m: float) -> bool:
    """Return whether all places (N,) lie in an area; those without a position do not."""
    wide, high, zero, inside = _F(width_m), _F(height_m), _F(0.0), True
    for i in range(east_m.size):
        along = (east_m[i] >= zero) & (east_m[i] <= wide)
        inside &= along & (north_m[i] >= zero) & (north_m[i] <= high)
    return inside


@njit(error_model="numpy", cache=True)
def weight_inside(
    east_m: Floats32, north_m: Floats32, weight: Floats32, width_m: float, height_m: float
) -> float:
    """Return the sum of the weights (N,) of the places that lie in an area."""
    wide, high, zero, total = _F(width_m), _F(height_m), _F(0.0), 0.0
    for i in range(weight.size):
        along = (east_m[i] >= zero) & (east_m[i] <= wide)
        inside = along & (north_m[i] >= zero) & (north_m[i] <= high)
        total += float(weight[i]) if inside else 0.0
    return total


@njit(error_model="numpy", cache=True, nogil=True)
def weigh_by_ways(
    first: int,
    stop: int,
    moved: Floats32,
    ways: WayMap,
    factors: MapFactors,
    beyond: float,
    log_weight: Floats,
    weighed: Floats,
) -> None:
    """Fill log weights (N,) after a step, and update the probability of being off in ``moved``.

    That is done for hypotheses ``first`` to ``stop``. ``beyond`` is the map's log-likelihood beyond
    the area; NaN for that of the area's edge.
    """
    for begin in range(first, stop, _BLOCK):
        end = min(begin + _BLOCK, stop)
        _weigh_block(begin, end, moved, ways, factors, beyond, log_weight, weighed)


@njit(error_model="numpy", cache=True, nogil=True)
def _weigh_block(
    first: int,
    stop: int,
    moved: Floats32,
    ways: WayMap,
    factors: MapFactors,
    beyond: float,
    log_weight: Floats,
    weighed: Floats,
) -> None:
    """Do what :func:`weigh_by_ways` does for hypotheses that stay in the cache."""
    east, north = moved[0, first:stop], moved[1, first:stop]
    rows, pixel_m = ways.log_likelihood.shape[0], ways.pixel_m
    first_m, north_m = pixel_m / 2, (rows - 0.5) * pixel_m
    found = interpolate(east, north, ways.log_likelihood, first_m, north_m, 1 / pixel_m)
    if not np.isnan(beyond):
        outside, instead = places_beyond(east, north, ways.width_m, ways.height_m), _F(beyond)
        for i in range(found.size):
            found[i] = instead if outside[i] else found[i]
    before, after = log_weight[first:stop], weighed[first:stop]
    for i in range(found.size):
        after[i] = before[i]
    weigh_by_map(found, moved[OFF, first:stop], factors, after)


@njit(error_model="numpy", cache=True)
def weighed_at_places(
    moved: Floats32,
    log_likelihood: Floats32,
    size_m: tuple[float, float],
    factors: MapFactors,
    beyond: float,
    log_weight: Floats,
) -> Floats:
    """Return log weights as :func:`weigh_by_ways` fills them, where the map's were looked up, (N,).

    Those of hypotheses beyond the area are replaced in place.
    """
    if not np.isnan(beyond):
        outside, instead = places_beyond(moved[0], moved[1], size_m[0], size_m[1]), _F(beyond)
        for i in range(log_likelihood.size):
            log_likelihood[i] = instead if outside[i] else log_likelihood[i]
    weighed = log_weight.copy()
    weigh_by_map(log_likelihood, moved[OFF], factors, weighed)
    return weighed
