"""Ancestors of hypotheses over a map of streets, for smoothing by backward simulation.

Earlier hypotheses, led on by their own errors, are compared with later ones (Godsill, Doucet & West
2004), most of them by rejection sampling (Douc, Garivier, Moulines & Olsson 2011); the motion is
that of :mod:`mapfilter.models.street_motion`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._kernels import cos_sin32, exp32, hashed, uniforms, wrap32
from mapfilter._types import Floats, Floats32, Ints32

_F = np.float32
_MOST_SQUARES = 400
_PARTS = 4
_MOST_NATS = 14.0
"""Hypotheses that are less likely than by this many nats are not compared."""
_PAIRS_A_TRY, _MOST_TRIES = 16, 256
"""One candidate is drawn for so many hypotheses nearby, as it takes about as long as to compare 10
to 20 of them; and the most candidates."""


class _Led(NamedTuple):
    """Earlier hypotheses where their own errors lead them, in the order of their squares."""

    east_m: Floats32
    north_m: Floats32
    bias_rad: Floats32
    log_scale: Floats32
    weight: Floats


class _Near(NamedTuple):
    """The squares around a later hypothesis, of all that have ``cols`` columns.

    Rows are from ``first`` to before ``last``, columns from ``left`` to before ``right``. Those in
    square (r, c) lie in order from ``start[r * cols + c]``. Its entry of ``most``, an upper bound
    of their likelihood, and of ``masses``, the sum of weights times bounds up to it, is
    ``corner + r * across + c``.
    """

    first: int
    last: int
    left: int
    right: int
    corner: int
    across: int
    cols: int
    start: Ints32
    most: Floats
    masses: Floats


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
    those nearby are compared: a candidate is drawn by its weight times an upper bound of its
    likelihood, and taken by the ratio of its likelihood to that bound. Where a limited number of
    candidates is refused, all nearby are weighed. Both draw from the same distribution.

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
    led = _Led(to_east[order], to_north[order], earlier[2][order], earlier[3][order], weight[order])
    before = np.zeros(count + 1)
    for i in range(count):
        before[i + 1] = before[i] + led.weight[i]
    per = _F(-0.5 / place_var_m2), _F(-0.5 / bias_var_rad2), _F(-0.5 / scale_var)
    jump = _F(log_jump)
    jumped, around = np.float64(exp32(jump)), int(np.ceil(reach_m / side_m))
    most = _most_likely(around, np.float64(per[0]) * side_m**2)
    masses, across = np.zeros(most.size), 2 * around + 1
    near_by, reached = np.empty(count, dtype=np.int32), np.empty(count)
    chosen = np.empty(later.shape[1], dtype=np.int32)
    for j in range(later.shape[1]):
        place = later[0, j], later[1, j], later[2, j], later[3, j]
        col, row = int((place[0] - west_m) // side_m), int((north_m - place[1]) // side_m)
        left, right = max(col - around, 0), min(col + around + 1, cols)
        first, last = max(row - around, 0), min(row + around + 1, rows)
        if left >= right:
            last = first
        corner = (around - row) * across + around - col
        near = _Near(first, last, left, right, corner, across, cols, start, most, masses)
        mass, nearby = _summed(near, before)
        chosen[j] = -1
        for t in range(min(nearby // _PAIRS_A_TRY, _MOST_TRIES)):
            one, other = uniforms(hashed(key, np.uint64(later.shape[1] + j * _MOST_TRIES + t)))
            # Of 24 bits each: probabilities are resolved to 2**-24 over the share that is accepted.
            goal, accept = np.float64(one) * (mass + jumped * total), np.float64(other)
            # Also where a weight is no number.
            if not goal < mass:
                chosen[j] = np.searchsorted(passed, accept * total)
                break
            i, most_likely = _drawn(near, before, goal)
            log_led = _log_led(place, led, i, per)
            if log_led > jump and accept * most_likely < np.float64(exp32(log_led)) - jumped:
                chosen[j] = order[i]
                break
        if chosen[j] >= 0:
            continue
        found, gone = 0, 0.0
        for r in range(first, last):
            for i in range(start[r * cols + left], start[r * cols + right]):
                log_led = _log_led(place, led, i, per)
                if log_led > jump:
                    gone += led.weight[i] * (np.float64(exp32(log_led)) - jumped)
                    near_by[found], reached[found] = i, gone
                    found += 1
        goal = np.float64(uniforms(hashed(key, np.uint64(j)))[0]) * (gone + jumped * total)
        if goal < gone:
            chosen[j] = order[near_by[np.searchsorted(reached[:found], goal)]]
        else:
            chosen[j] = min(np.searchsorted(passed, (goal - gone) / jumped), count - 1)
    return chosen


@njit(inline="always")
def _log_led(
    place: tuple[np.float32, np.float32, np.float32, np.float32],
    led: _Led,
    i: int,
    per: tuple[np.float32, np.float32, np.float32],
) -> np.float32:
    """Return the log-likelihood of an earlier hypothesis having been led to a later one."""
    dx, dy = place[0] - led.east_m[i], place[1] - led.north_m[i]
    db, ds = wrap32(place[2] - led.bias_rad[i]), place[3] - led.log_scale[i]
    return _F(per[0] * (dx * dx + dy * dy) + per[1] * db * db + per[2] * ds * ds)


@njit(error_model="numpy", cache=True)
def _most_likely(around: int, per_square: float) -> Floats:
    """Return upper bounds of the likelihood of places in the squares around that of a place."""
    across = 2 * around + 1
    most = np.empty(across * across)
    for r in range(across):
        for c in range(across):
            apart = max(abs(r - around) - 1, 0) ** 2 + max(abs(c - around) - 1, 0) ** 2
            most[r * across + c] = np.exp(per_square * apart)
    return most


@njit(inline="always")
def _summed(near: _Near, before: Floats) -> tuple[float, int]:
    """Fill in the masses; return their sum, and the number of hypotheses nearby."""
    mass, nearby = 0.0, 0
    for r in range(near.first, near.last):
        at = near.corner + r * near.across
        for c in range(near.left, near.right):
            low, high = near.start[r * near.cols + c], near.start[r * near.cols + c + 1]
            nearby += high - low
            mass += (before[high] - before[low]) * near.most[at + c]
            near.masses[at + c] = mass
    return mass, nearby


@njit(inline="always")
def _drawn(near: _Near, before: Floats, goal: float) -> tuple[int, float]:
    """Return the hypothesis at which the masses exceed a number, and its likelihood's bound."""
    r = near.first
    while near.masses[near.corner + r * near.across + near.right - 1] <= goal:
        r += 1
    at, c = near.corner + r * near.across, near.left
    while near.masses[at + c] <= goal:
        c += 1
    low, high = near.start[r * near.cols + c], near.start[r * near.cols + c + 1]
    most = near.most[at + c]
    # From the end of the square back, by what is left of its mass.
    weighed = before[high] - (near.masses[at + c] - goal) / most
    while high - low > 1:
        middle = (low + high) // 2
        if before[middle] <= weighed:
            low = middle
        else:
            high = middle
    return low, most


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
