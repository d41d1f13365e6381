"""The map of ways as hypotheses are weighed by it after a step, in one compiled call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._kernels import exp32, log32
from mapfilter._types import Bools, Floats, Floats32
from mapfilter.models.street_motion import OFF, MapFactors

_F = np.float32
_BLOCK = 4096


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
