"""Going back along a track: which of the earlier hypotheses a later one may have come from."""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._kernels import cos_sin32, exp32, hashed, uniforms, wrap32
from mapfilter._types import Floats32, Ints32

_F = np.float32
_MOST_SQUARES = 400
_PARTS = 4
_MOST_NATS = 14.0
"""What is farther than this many nats is as good as never drawn."""


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def draw_ancestors(
    later: Floats32,
    earlier: Floats32,
    log_weight: Floats32,
    moved_east_m: float,
    moved_north_m: float,
    place_var_m2: float,
    bias_var_rad2: float,
    scale_var: float,
    log_jump: float,
    key: np.uint64,
    chosen: Ints32,
) -> None:
    """Draw one ancestor of each later hypothesis: backward simulation (Godsill et al. 2004, eq. 6).

    An earlier hypothesis counts by its weight and by how well its own errors of heading and scale
    bring it, over the displacement by dead reckoning, to the later one. They are sorted by place,
    so that each later one looks at those nearby only.

    Parameters
    ----------
    later : ndarray of float32, shape (5, M)
    earlier : ndarray of float32, shape (5, N)
    log_weight : ndarray of float32, shape (N,)
    moved_east_m, moved_north_m : float
        Displacement by dead reckoning in between.
    place_var_m2, bias_var_rad2, scale_var : float
        Of what the motion adds in between.
    log_jump : float
        Log density of an unmeasured displacement: where no ancestor is nearer than that, the
        weights alone decide.
    key : numpy.uint64
    chosen : ndarray of int32, shape (M,)
        Filled.
    """
    count = earlier.shape[1]
    to_east, to_north = np.empty(count, dtype=np.float32), np.empty(count, dtype=np.float32)
    heaviest = np.max(log_weight)
    weight, passed = np.empty(count), np.empty(count)
    me, mn, total = _F(moved_east_m), _F(moved_north_m), 0.0
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
    west_m, north_m, side_m, rows, cols = _squares(to_east, to_north, reach_m / _PARTS)
    start, order = _sorted(to_east, to_north, west_m, north_m, side_m, rows, cols)
    # In the order of the squares they lie side by side in memory.
    to_east, to_north, weight = to_east[order], to_north[order], weight[order]
    bias, scale = earlier[2][order], earlier[3][order]
    per_place, per_bias = _F(-0.5 / place_var_m2), _F(-0.5 / bias_var_rad2)
    per_scale, jump = _F(-0.5 / scale_var), _F(log_jump)
    jumped, around = np.float64(exp32(jump)), int(np.ceil(reach_m / side_m))
    near_by, reached = np.empty(count, dtype=np.int32), np.empty(count)
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


@njit(error_model="numpy", cache=True)
def _squares(
    east_m: Floats32, north_m: Floats32, least_m: float
) -> tuple[float, float, float, int, int]:
    """Lay squares over places: the corner, the side, and how many to the south and the east."""
    west, north = float(east_m.min()), float(north_m.max())
    width, height = float(east_m.max()) - west, north - float(north_m.min())
    side = max(least_m, max(width, height) / _MOST_SQUARES)
    return west, north, side, int(height // side) + 1, int(width // side) + 1


@njit(error_model="numpy", cache=True)
def _sorted(
    east_m: Floats32, north_m: Floats32, west: float, north: float, side_m: float,
    rows: int, cols: int,
) -> tuple[Ints32, Ints32]:  # fmt: skip
    """Sort places by square; those of square q are ``order[start[q]:start[q + 1]]``."""
    square = np.empty(east_m.size, dtype=np.int32)
    start = np.zeros(rows * cols + 1, dtype=np.int32)
    for i in range(east_m.size):
        col = min(int((east_m[i] - west) // side_m), cols - 1)
        row = min(int((north - north_m[i]) // side_m), rows - 1)
        square[i] = row * cols + col
        start[square[i] + 1] += 1
    for q in range(rows * cols):
        start[q + 1] += start[q]
    at, order = start[:-1].copy(), np.empty(east_m.size, dtype=np.int32)
    for i in range(east_m.size):
        order[at[square[i]]] = i
        at[square[i]] += 1
    return start, order
