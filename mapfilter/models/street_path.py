"""How well a path of dead reckoning fits the streets that it would end on.

From an unknown start, a path of some tens of metres is laid through every place of the map, in
every direction. Each time it is weighed, leg by leg, by the map of ways that hypotheses are
weighed by (:mod:`mapfilter.models.way_map`), including the probability of being off it, which is
carried from one leg to the next.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._kernels import log32
from mapfilter._types import Floats32
from mapfilter.models.way_map import MapFactors

_F = np.float32


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_path(
    ends_m: Floats32,
    earlier_m: Floats32,
    turned_rad: float,
    on_map: Floats32,
    resolution_m: float,
    factors: MapFactors,
    log_likelihood: Floats32,
    off: Floats32,
) -> None:
    """Fill the log-likelihood of a path at each of its possible ends, and of being off there.

    Parameters
    ----------
    ends_m : ndarray of float32, shape (2, P)
        East and north of the ends in the frame of ``on_map``, whose origin is its south-western
        corner.
    earlier_m : ndarray of float32, shape (K, 2)
        East and north of earlier points relative to the end, by dead reckoning; oldest first, one
        leg apart.
    turned_rad : float
        Angle that is added to the headings of dead reckoning.
    on_map : ndarray of float32, shape (rows, cols)
        Likelihood of one leg on the map: the exponential of
        :func:`~mapfilter.models.way_map.map_log_likelihood` times the factors' exponent.
    resolution_m : float
        Side of its pixels; each point takes the value of the pixel that holds it.
    factors : MapFactors
        Of one leg.
    log_likelihood, off : ndarray of float32, shape (P,)
        Filled. ``off`` is the probability that the path has ended off the map; before the path it
        is that given.
    """
    rows, cols = on_map.shape
    cosine, sine, per_m = np.cos(turned_rad), np.sin(turned_rad), _F(1.0 / resolution_m)
    count = len(earlier_m)
    east_m, north_m = np.empty(count + 1, np.float32), np.empty(count + 1, np.float32)
    for k in range(count):
        east_m[k] = _F(earlier_m[k, 0] * cosine - earlier_m[k, 1] * sine)
        north_m[k] = _F(earlier_m[k, 0] * sine + earlier_m[k, 1] * cosine)
    east_m[count], north_m[count] = _F(0.0), _F(0.0)
    one, off_cost = _F(1.0), _F(factors.off)
    leave, come_back = _F(factors.leave), _F(factors.come_back)
    stay, keep = one - leave, one - come_back
    zero, last_col, last_row = np.int32(0), np.int32(cols - 1), np.int32(rows - 1)
    for i in range(ends_m.shape[1]):
        # Likelihoods of both modes, not normalised before the end.
        away, on = off[i], one - off[i]
        for k in range(count + 1):
            col = np.int32((ends_m[0, i] + east_m[k]) * per_m)
            row = last_row - np.int32((ends_m[1, i] + north_m[k]) * per_m)
            col = min(max(col, zero), last_col)
            row = min(max(row, zero), last_row)
            left = away * keep + on * leave
            on = (away * come_back + on * stay) * on_map[row, col]
            away = left * off_cost
        total = on + away
        log_likelihood[i] = log32(total)
        off[i] = away / total
