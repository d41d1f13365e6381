"""Courses of a vehicle whose directions nothing measures: along the ways, at a corner any of them.

Each hypothesis has a course of its own. A vehicle keeps it but for the bends of its road, takes
other ways at corners, and seldom turns round. Where its next leg may lead is what is usual for a
vehicle times how well the leg, a little extended, lies on ways, divided by the sum of that over all
courses: a bend costs nothing, a corner no more than the choice among the ways that meet there. So
straight roads are not preferred to winding ones. A spread to all sides instead forgets after each
step where the vehicle came from: after a kilometre without a corner it is still where it was.
"""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, exp, pi, radians

import numpy as np
from numba import njit

from mapfilter._kernels import cos_sin32, exp32, hashed, normals, uniforms, wrap32
from mapfilter._types import Floats32
from mapfilter.models.street_motion import BIAS, NORTH, RATE, TURN, MotionErrors

_F = np.float32
_SALT = np.uint64(0x9E3779B97F4A7C15)
"""Draws of courses differ from those of the step that follows with the same key."""
_BENDS, _SIDE, _AROUND = 5, 4, 1
"""Courses drawn for each hypothesis: on along the road, to each side, and back."""
_COURSES = _BENDS + 2 * _SIDE + _AROUND
_DRAWS = _COURSES + 1
_LEAST_TURN_RAD, _MOST_TURN_RAD = radians(20), radians(120)
_AHEAD_M, _LEAST = 25.0, -6.0
"""Least length that is looked at; least logarithm of how well a course lies on ways."""
_SHARPNESS = 3.0
"""Factor of the latter: who turns off does so where a way is."""


def with_courses(
    state: Floats32,
    length_m: float,
    errors: MotionErrors,
    log_map_at: Callable[[Floats32], Floats32],
    key: np.uint64,
) -> Floats32:
    """Return hypotheses with the courses of their next leg.

    Parameters
    ----------
    state : ndarray of float32, shape (8 or more, N)
        The lasting error of headings is the course: it counts from a heading of 0.
    length_m : float
        Of the leg; backwards below 0.
    errors : MotionErrors
        ``bend_rad_per_sqrt_m``, ``corners_per_m`` and ``rounds_per_m``.
    log_map_at : callable
        Returns the map's log-likelihood at places (2, M).
    key : numpy.uint64
        From :func:`mapfilter._kernels.draw_key`.
    """
    count, key = state.shape[1], key ^ _SALT
    aside, around = (
        1 - exp(-rate * abs(length_m)) for rate in (errors.corners_per_m, errors.rounds_per_m)
    )
    bend_rad = errors.bend_rad_per_sqrt_m * abs(length_m) ** 0.5
    ahead_m = copysign(max(abs(length_m), _AHEAD_M), length_m)
    course = np.empty((count, _COURSES), dtype=np.float32)
    ahead = np.empty((2, 2 * course.size), dtype=np.float32)
    _draw(state[: NORTH + 1], state[BIAS], bend_rad, ahead_m, key, course, ahead)
    headed = state.copy()
    _choose(course, log_map_at(ahead), aside, around, key, headed[BIAS])
    headed[[TURN, RATE]] = 0.0
    return headed


@njit(error_model="numpy", cache=True)
def _draw(
    place: Floats32,
    before: Floats32,
    bend_rad: float,
    ahead_m: float,
    key: np.uint64,
    course: Floats32,
    ahead: Floats32,
) -> None:
    """Draw courses (N, K), and the places (2, 2 N K) half and all the way ahead on each."""
    bend, far, half = _F(bend_rad), _F(ahead_m), _F(0.5 * ahead_m)
    least, width = _F(_LEAST_TURN_RAD), _F((_MOST_TURN_RAD - _LEAST_TURN_RAD) / _SIDE)
    number = 0
    for i in range(before.size):
        for k in range(_COURSES):
            drawn = hashed(key, np.uint64(i * _DRAWS + k))
            if k >= _BENDS and k < _BENDS + 2 * _SIDE:
                uniform, _ = uniforms(drawn)
                turned = least + width * (_F((k - _BENDS) // 2) + _F(uniform))
                turned = turned if k % 2 == 0 else -turned
            else:
                normal, _ = normals(drawn)
                turned = bend * normal
                turned = turned if k < _BENDS else turned + _F(pi)
            one = wrap32(before[i] + turned)
            course[i, k] = one
            cosine, sine = cos_sin32(one)
            ahead[0, number] = place[0, i] + half * cosine
            ahead[1, number] = place[1, i] + half * sine
            ahead[0, number + 1] = place[0, i] + far * cosine
            ahead[1, number + 1] = place[1, i] + far * sine
            number += 2


@njit(error_model="numpy", cache=True)
def _choose(
    course: Floats32,
    log_map: Floats32,
    aside: float,
    around: float,
    key: np.uint64,
    chosen: Floats32,
) -> None:
    """Take one of the courses (N, K) for each hypothesis, (N,)."""
    ahead = _F((1 - aside) * (1 - around) / _BENDS)
    turned = _F(aside / (2 * _SIDE))
    back = _F((1 - aside) * around / _AROUND)
    least, half, number, sharp = _F(_LEAST), _F(0.5), 0, _F(_SHARPNESS)
    for i in range(chosen.size):
        drawn, _ = uniforms(hashed(key, np.uint64(i * _DRAWS + _COURSES)))
        total, left = _F(0.0), _F(drawn)
        for k in range(_COURSES):
            fit = half * (log_map[number] + log_map[number + 1])
            number += 2
            usual = ahead if k < _BENDS else (turned if k < _BENDS + 2 * _SIDE else back)
            weight = usual * exp32(sharp * (fit if fit > least else least))
            total += weight
            # Each is taken with its share of those so far; what is left of the draw is uniform.
            share = weight / total
            if left < share:
                chosen[i] = course[i, k]
                left = left / share
            else:
                left = (left - share) / (_F(1.0) - share)
