"""Motion and the map of ways on a graphics processor: kernels with a thread for each hypothesis.

They are those of :mod:`mapfilter.models.street_motion` and :mod:`mapfilter.models.way_map`, with
the same random numbers and elementary functions; results differ by rounding.
"""

from __future__ import annotations

from math import isnan
from typing import Any

import numpy as np
from numba import cuda

from mapfilter import _cuda
from mapfilter._kernels import cos_sin32, exp32, hashed, log32, normals, uniforms, wrap32
from mapfilter.models.street_motion import MotionErrors, noise_of_step
from mapfilter.models.way_map import MapFactors

_F = np.float32
_ZERO, _ONE = _F(0.0), _F(1.0)


def move(
    state: Any,
    step_m: float,
    heading_rad: float,
    errors: MotionErrors,
    key: np.uint64,
    moved: Any,
    sampling_sd_m: float = 0.0,
    rows: float = 1.0,
) -> None:
    """Fill all hypotheses (R, N) after one measured step, as :func:`street_motion.move` does."""
    long_m, length_m, noise = noise_of_step(step_m, errors, sampling_sd_m, rows)
    given = state, long_m, length_m, heading_rad, noise, key, moved
    _cuda.start(_move, state.shape[1], *given)


def weigh_by_ways(
    moved: Any,
    log_map: Any,
    pixel_m: float,
    size_m: tuple[float, float],
    factors: MapFactors,
    beyond: float,
    log_weight: Any,
) -> None:
    """Weigh by the map, and update the probability of being off it, in place.

    As :func:`mapfilter.models.way_map.weigh_by_ways`, for an area of ``size_m``, east and north.
    """
    given = moved, log_map, pixel_m, size_m, factors, beyond, log_weight
    _cuda.start(_weigh_by_ways, moved.shape[1], *given)


@cuda.jit
def _move(state, step_m, length_m, heading_rad, noise, key, moved):  # type: ignore[no-untyped-def]
    i = cuda.grid(1)
    if i >= state.shape[1]:
        return
    # In the simulator the hash is a whole number of Python.
    a, b = normals(np.uint64(hashed(key, np.uint64(4 * i))))
    c, d = normals(np.uint64(hashed(key, np.uint64(4 * i + 1))))
    e, f = normals(np.uint64(hashed(key, np.uint64(4 * i + 2))))
    u, v = uniforms(np.uint64(hashed(key, np.uint64(4 * i + 3))))
    lasting = wrap32(state[2, i] + state[7, i] * _F(length_m) + _F(noise.bias_rad) * c)
    steady = state[3, i] + _F(noise.scale) * d
    steady = _F(noise.rescaled) * d if _F(v) < _F(noise.rescale) else steady
    beside = _F(noise.turn_keep) * state[5, i] + _F(noise.turn_rad) * e
    beside = _F(noise.jump_rad) * e if _F(u) < _F(noise.jump) else beside
    longer = _F(noise.stretch_keep) * state[6, i] + _F(noise.stretch) * f
    late, early = _F(noise.late), _F(1.0 - noise.late)
    aside, further = late * beside + early * state[5, i], late * longer + early * state[6, i]
    cosine, sine = cos_sin32(wrap32(_F(heading_rad) + lasting + aside))
    along = _F(step_m) * exp32(steady + further) + _F(noise.along_m) * a
    across = _F(noise.across_m) * b
    moved[0, i] = state[0, i] + (along * cosine - across * sine)
    moved[1, i] = state[1, i] + (along * sine + across * cosine)
    moved[2, i] = lasting
    moved[3, i] = steady
    moved[4, i] = state[4, i]
    moved[5, i] = beside
    moved[6, i] = longer
    for r in range(7, state.shape[0]):
        moved[r, i] = state[r, i]


@cuda.jit
def _weigh_by_ways(moved, log_map, pixel_m, size_m, factors, beyond, log_weight):  # type: ignore[no-untyped-def]
    i = cuda.grid(1)
    if i >= moved.shape[1]:
        return
    east, north = moved[0, i], moved[1, i]
    outside = (east < _ZERO) or (east > _F(size_m[0]))
    outside = outside or (north < _ZERO) or (north > _F(size_m[1]))
    # NaN stands for the map's log-likelihood at the edge.
    if outside and not isnan(beyond):
        found = _F(beyond)
    else:
        rows, cols = log_map.shape
        middle, per_m = _F(pixel_m / 2), _F(1 / pixel_m)
        x = (east - middle) * per_m
        y = (_F((rows - 0.5) * pixel_m) - north) * per_m
        x = x if x > _ZERO else _ZERO
        y = y if y > _ZERO else _ZERO
        col, row = min(np.int32(x), np.int32(cols - 2)), min(np.int32(y), np.int32(rows - 2))
        u, v = x - _F(col), y - _F(row)
        u = u if u < _ONE else _ONE
        v = v if v < _ONE else _ONE
        upper = log_map[row, col] + u * (log_map[row, col + 1] - log_map[row, col])
        under = log_map[row + 1, col] + u * (log_map[row + 1, col + 1] - log_map[row + 1, col])
        found = upper + v * (under - upper)
    on = exp32(_F(factors.exponent) * found)
    off, off_cost = moved[4, i], _F(factors.off)
    away = off * (_ONE - _F(factors.come_back)) + (_ONE - off) * _F(factors.leave)
    total = away * off_cost + (_ONE - away) * on
    moved[4, i] = away * off_cost / total
    log_weight[i] += log32(total)
