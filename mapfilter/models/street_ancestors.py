"""Ancestors of hypotheses over a map of streets, for smoothing by backward simulation.

Earlier hypotheses, led on by their own errors, are compared with later ones (Godsill, Doucet & West
2004); the motion is that of :mod:`mapfilter.models.street_motion`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._kernels import cos_sin32, exp32, hashed, uniforms, wrap32
from mapfilter._types import Floats32, Ints32

_F = np.float32
_MOST_SQUARES = 400
_PARTS = 4
_MOST_NATS = 14.0
"""Hypotheses that are less likely than by this many nats are not compared."""


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def draw_ancestors(
    later: Floats32,
    earlier: Floats32,
    log_weight: Floats32,
    moved_m: tuple[float, float],
    variances: tuple[float, float, float],
    log_jump: float,
    key: np.uint64,
) -> Ints32:
    """Draw one ancestor of each later hypothesis: backward simulation (Godsill et al. 2004, eq. 6).

    An earlier hypothesis is weighed by how well its own errors of heading and scale lead it, over
    the displacement by dead reckoning, to the later one. Hypotheses are sorted by place, and only
    those nearby are compared.

    Parameters
    ----------
    later, earlier : ndarray of float32, shape (5, M) and (5, N)
        Hypotheses.
    log_weight : ndarray of float32, shape (N,)
        Of the earlier ones.
    moved_m : (float, float)
        Displacement east and north by dead reckoning in between.
    variances : (float, float, float)
        Of place (m²), heading error (rad²) and log scale that the motion adds in between.
    log_jump : float
        Log density of an unmeasured displacement: where no ancestor is nearer than that, the
        weights alone decide.

    Returns
    -------
    ndarray of int32, shape (M,)
        Indices of the ancestors.
    """
    place_var_m2, bias_var_rad2, scale_var = variances
    count = earlier.shape[1]
    to_east, to_north = np.empty(count, dtype=np.float32), np.empty(count, dtype=np.float32)
    heaviest = np.max(log_weight)
    weight, passed = np.empty(count), np.empty(count)
    me, mn, total = _F(moved_m[0]), _F(moved_m[1]), 0.0
    for i in range(count):
        cosine, sine = cos_sin32(earlier[2, i])
        stretch = exp32(earlier[3, i])
        to_east[i] = earlier[0, i] + stretch * (me * cosine - mn * sine)
        to_north[i] = earlier[1, i] + stretch * (me * sine + mn * cosine)
        weight[i] = exp32(log_weight[i] - heaviest)
        total += weight[i]
        passed[i] = total
    # Only what is nearer than this is looked at: beyond, the displacement is likelier.
    reach_m = np.sqrt(2.0 * min(-log_jump, _MOST_NATS) * place_var_m2)
    corner_m, side_m, (rows, cols), start, order = _squares(to_east, to_north, reach_m / _PARTS)
    west_m, north_m = corner_m
    # In the order of the squares they lie side by side in memory.
    to_east, to_north, weight = to_east[order], to_north[order], weight[order]
    bias, scale = earlier[2][order], earlier[3][order]
    per_place, per_bias = _F(-0.5 / place_var_m2), _F(-0.5 / bias_var_rad2)
    per_scale, jump = _F(-0.5 / scale_var), _F(log_jump)
    jumped, around = np.float64(exp32(jump)), int(np.ceil(reach_m / side_m))
    near_by, reached = np.empty(count, dtype=np.int32), np.empty(count)
    chosen = np.empty(later.shape[1], dtype=np.int32)
    for j in range(later.shape[1]):
        x, y, b, s = later[0, j], later[1, j], later[2, j], later[3, j]
        col, row = int((x - west_m) // side_m), int((north_m - y) // side_m)
        found, gone = 0, 0.0
        left, right = max(col - around, 0), min(col + around + 1, cols)
        for r in range(max(row - around, 0), min(row + around + 1, rows)):
            if left >= right:
                break
            for i in range(start[r * cols + left], start[r * cols + right]):
                dx, dy = x - to_east[i], y - to_north[i]
                near = per_place * (dx * dx + dy * dy)
                if near <= jump:
                    continue
                db, ds = wrap32(b - bias[i]), s - scale[i]
                near += per_bias * db * db + per_scale * ds * ds
                if near > jump:
                    gone += weight[i] * (np.float64(exp32(near)) - jumped)
                    near_by[found], reached[found] = i, gone
                    found += 1
        place, _ = uniforms(hashed(key, np.uint64(j)))
        goal = place * (gone + jumped * total)
        if goal < gone:
            chosen[j] = order[near_by[np.searchsorted(reached[:found], goal)]]
        else:
            chosen[j] = min(np.searchsorted(passed, (goal - gone) / jumped), count - 1)
    return chosen


@njit(error_model="numpy", cache=True)
def _squares(
    east_m: Floats32, north_m: Floats32, least_m: float
) -> tuple[tuple[float, float], float, tuple[int, int], Ints32, Ints32]:
    """Sort places by squares of a side of ``least_m`` or more.

    Returns the north-western corner, the side, the numbers of rows and columns, and ``start`` and
    ``order``: the places in square q are ``order[start[q]:start[q + 1]]``.
    """
    west, north = float(east_m.min()), float(north_m.max())
    width, height = float(east_m.max()) - west, north - float(north_m.min())
    side_m = max(least_m, max(width, height) / _MOST_SQUARES)
    rows, cols = int(height // side_m) + 1, int(width // side_m) + 1
    square = np.empty(east_m.size, dtype=np.int32)
    start = np.zeros(rows * cols + 1, dtype=np.int32)
    for i in range(east_m.size):
        row, col = int((north - north_m[i]) // side_m), int((east_m[i] - west) // side_m)
        square[i] = row * cols + col
        start[square[i] + 1] += 1
    for q in range(rows * cols):
        start[q + 1] += start[q]
    at, order = start[:-1].copy(), np.empty(east_m.size, dtype=np.int32)
    for i in range(east_m.size):
        order[at[square[i]]] = i
        at[square[i]] += 1
    return (west, north), side_m, (rows, cols), start, order
