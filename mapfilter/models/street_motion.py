"""Motion over a map of streets: dead reckoning with lasting errors.

A hypothesis holds its position, the errors of its headings and steps, and how probably it is off
the map. One step of dead reckoning (Khalaf-Allah 2007, eqs. 3-10) moves it; the map of ways
(:mod:`~mapfilter.models.way_map`) then weighs it by the metre.

Errors of headings have three parts: a *lasting* one of the journey, which drifts, and with a biased
gyroscope grows steadily; a *deviation*,
which is correlated over tens of metres (magnetic disturbances, the way a phone is carried; an
Ornstein-Uhlenbeck process), and now and then jumps to any value within tens of degrees; and white
noise. The logarithm of the step scale has a lasting part and a deviation, too. White noise of
standard deviation σ on headings shortens the mean displacement by exp(-σ²/2), which is put back.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot, pi, radians, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._kernels import cos_sin32, exp32, hashed, normals, uniforms, wrap32
from mapfilter._threads import ONE, Call
from mapfilter._types import Bools, Floats32
from mapfilter.angles import wrap_rad
from mapfilter.options import NotNegative, Options, Positive, Radians, Share

EAST, NORTH, BIAS, LOG_SCALE, OFF, TURN, STRETCH, RATE = range(8)
"""Rows of the state: metres from the frame's origin; lasting heading error (radians) and logarithm
of the step scale; probability of being off the map; deviations of heading and log scale; growth of
the lasting heading error (radians per metre)."""
STATES = 8

_F = np.float32
_HEADING_SD_RAD, _BIAS_SD_RAD, _BIAS_DRIFT_RAD = radians(15.0), radians(10.0), radians(0.3)
_DISTURBED_RAD, _RATE_RAD = radians(40.0), radians(0.15)
_TURNED_RAD = radians(90.0)
"""Lasting heading error from which on a phone is turned, and not its compass off."""


@dataclass(frozen=True, slots=True)
class MotionErrors(Options):
    """Errors of dead reckoning; all but the white ones are estimated with the position.

    Parameters
    ----------
    step_sd_m : float
        White noise of a step of ``typical_step_m``; its variance grows with the length.
    typical_step_m : float
        Length of the step that ``step_sd_m`` is of.
    heading_sd_rad : float
        Standard deviation of a heading: of deviation and white noise together.
    white_share : float
        Share of its variance that is white.
    heading_m : float
        Distance after which the correlation of the deviation is 1/e.
    disturbances_per_m, disturbed_rad : float
        How often the deviation jumps, and the standard deviation of where to.
    remounts_per_m : float
        How often the lasting heading error of a tracked position becomes any other, as a phone is
        turned in its pocket (:func:`remounted`).
    bias_sd_rad : float
        Standard deviation of the lasting heading error at the start.
    bias_drift_rad_per_sqrt_m : float
        Random walk of the lasting heading error.
    rate_rad_per_m : float
        Standard deviation of the steady growth of the lasting heading error, of biased gyroscopes.
    rate_share : float
        Share of journeys with such a gyroscope.
    scale_sd : float
        Standard deviation of the logarithm of the step scale at the start.
    scale_drift_per_sqrt_m : float
        Random walk of that logarithm.
    rescales_per_m, rescaled_sd : float
        How often that logarithm becomes another one, and the standard deviation of that: speeds
        that are no wheels' but sums of accelerations begin anew at each stop, with another error.
    stretch_sd, stretch_m : float
        Standard deviation of the deviation of that logarithm, and its correlation length.
    corners_per_m : float
        How often one that keeps to ways would turn aside where ways lead to all sides; 0 where
        steps without any direction do so (:mod:`mapfilter.models.way_course`).
    rounds_per_m : float
        How often it turns round.
    bend_rad_per_sqrt_m : float
        Random walk of its course between corners.
    """

    step_sd_m: NotNegative = 0.3
    typical_step_m: Positive = 1.4
    heading_sd_rad: Radians = _HEADING_SD_RAD
    white_share: Share = 0.3
    heading_m: Positive = 28.0
    disturbances_per_m: NotNegative = 0.002
    disturbed_rad: Radians = _DISTURBED_RAD
    remounts_per_m: NotNegative = 0.0
    bias_sd_rad: Radians = _BIAS_SD_RAD
    bias_drift_rad_per_sqrt_m: NotNegative = _BIAS_DRIFT_RAD
    rate_rad_per_m: NotNegative = _RATE_RAD
    rate_share: Share = 0.5
    scale_sd: NotNegative = 0.03
    scale_drift_per_sqrt_m: NotNegative = 0.0
    rescales_per_m: NotNegative = 0.0
    rescaled_sd: NotNegative = 0.06
    stretch_sd: NotNegative = 0.08
    stretch_m: Positive = 25.0
    corners_per_m: NotNegative = 0.0
    rounds_per_m: NotNegative = 5e-5
    bend_rad_per_sqrt_m: NotNegative = 0.03

    @property
    def turn_sd_rad(self) -> float:
        """Standard deviation of the heading's deviation."""
        return self.heading_sd_rad * sqrt(1 - self.white_share)

    @property
    def white_rad(self) -> float:
        """Standard deviation of the white noise of a heading."""
        return self.heading_sd_rad * sqrt(self.white_share)

    @property
    def tells_turned(self) -> bool:
        """Whether so large a lasting heading error is that of a turned phone."""
        return 3 * self.bias_sd_rad < _TURNED_RAD


def move(
    state: Floats32,
    step_m: float,
    heading_rad: float,
    errors: MotionErrors,
    key: np.uint64,
    sampling_sd_m: float = 0.0,
    rows: float = 1.0,
) -> Floats32:
    """Return all hypotheses (8 or more, N) after one measured step; further rows stay.

    The errors are added to the heading. A step of length 0 changes nothing. ``key`` is from
    :func:`mapfilter._kernels.draw_key`; ``sampling_sd_m`` is the step's own error, to each side,
    which a step of length 0 does not have, and ``rows`` how many measured steps it is the sum of.
    """
    call, moved = moving(state, step_m, heading_rad, errors, key, sampling_sd_m, rows)
    ONE.over(state.shape[1], call)
    return moved


def moving(
    state: Floats32,
    step_m: float,
    heading_rad: float,
    errors: MotionErrors,
    key: np.uint64,
    sampling_sd_m: float = 0.0,
    rows: float = 1.0,
) -> tuple[Call, Floats32]:
    """Return the call that does what :func:`move` does, and the array that it fills."""
    long_m, length, noise = noise_of_step(step_m, errors, sampling_sd_m, rows)
    moved = np.empty_like(state)
    return (_move, state, long_m, length, heading_rad, noise, key, moved), moved


def noise_of_step(
    step_m: float, errors: MotionErrors, sampling_sd_m: float, rows: float = 1.0
) -> tuple[float, float, StepNoise]:
    """Return the mean step (m), the length travelled (m), and the noise of a step of some rows."""
    length = abs(step_m)
    sampling_sd_m = sampling_sd_m if length > 0 else 0.0
    root = length**0.5
    white_rad = errors.white_rad
    # A step shorter than the typical one is a part of it, with the same noise over its length.
    parts = max(errors.typical_step_m / length, 1.0 / rows) ** 0.5 if length > 0 else 1.0
    turned, stretched = exp(-length / errors.heading_m), exp(-length / errors.stretch_m)
    noise = StepNoise(
        hypot(errors.step_sd_m * (length / errors.typical_step_m) ** 0.5, sampling_sd_m),
        hypot(length * white_rad * parts, sampling_sd_m),
        errors.bias_drift_rad_per_sqrt_m * root,
        errors.scale_drift_per_sqrt_m * root,
        turned,
        errors.turn_sd_rad * (1 - turned**2) ** 0.5,
        stretched,
        errors.stretch_sd * (1 - stretched**2) ** 0.5,
        1 - exp(-errors.disturbances_per_m * length),
        errors.disturbed_rad,
        1 - exp(-errors.rescales_per_m * length),
        errors.rescaled_sd,
        (rows + 1) / (2 * rows),
    )
    return step_m * exp(0.5 * white_rad**2), length, noise


class StepNoise(NamedTuple):
    """Standard deviations and factors of one step.

    ``late`` is the share of a change of the deviations with which the whole step is turned and
    stretched: of one row all of it, of several what their mean has of it.
    """

    along_m: float
    across_m: float
    bias_rad: float
    scale: float
    turn_keep: float
    turn_rad: float
    stretch_keep: float
    stretch: float
    jump: float
    jump_rad: float
    rescale: float
    rescaled: float
    late: float = 1.0


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def _move(
    first: int,
    stop: int,
    state: Floats32,
    step_m: float,
    length_m: float,
    heading_rad: float,
    noise: StepNoise,
    key: np.uint64,
    moved: Floats32,
) -> None:
    long, length, heading = _F(step_m), _F(length_m), _F(heading_rad)
    along_sd, across_sd = _F(noise.along_m), _F(noise.across_m)
    bias_sd, scale_sd = _F(noise.bias_rad), _F(noise.scale)
    turn_keep, turn_sd = _F(noise.turn_keep), _F(noise.turn_rad)
    stretch_keep, stretch_sd = _F(noise.stretch_keep), _F(noise.stretch)
    jump, jump_sd = _F(noise.jump), _F(noise.jump_rad)
    rescale, rescaled_sd = _F(noise.rescale), _F(noise.rescaled)
    late, early = _F(noise.late), _F(1.0 - noise.late)
    east, north = state[0, first:stop], state[1, first:stop]
    bias, scale = state[2, first:stop], state[3, first:stop]
    turn, stretch, rate = state[5, first:stop], state[6, first:stop], state[7, first:stop]
    to_east, to_north = moved[0, first:stop], moved[1, first:stop]
    to_bias, to_scale = moved[2, first:stop], moved[3, first:stop]
    to_turn, to_stretch = moved[5, first:stop], moved[6, first:stop]
    drawn = np.uint64(4 * first)
    for i in range(east.size):
        a, b = normals(hashed(key, drawn + np.uint64(4 * i)))
        c, d = normals(hashed(key, drawn + np.uint64(4 * i + 1)))
        e, f = normals(hashed(key, drawn + np.uint64(4 * i + 2)))
        u, v = uniforms(hashed(key, drawn + np.uint64(4 * i + 3)))
        lasting = wrap32(bias[i] + rate[i] * length + bias_sd * c)
        steady = scale[i] + scale_sd * d
        steady = rescaled_sd * d if _F(v) < rescale else steady
        beside = turn_keep * turn[i] + turn_sd * e
        beside = jump_sd * e if _F(u) < jump else beside
        longer = stretch_keep * stretch[i] + stretch_sd * f
        aside, further = late * beside + early * turn[i], late * longer + early * stretch[i]
        cosine, sine = cos_sin32(wrap32(heading + lasting + aside))
        along = long * exp32(steady + further) + along_sd * a
        across = across_sd * b
        to_bias[i] = lasting
        to_scale[i] = steady
        to_turn[i] = beside
        to_stretch[i] = longer
        to_east[i] = east[i] + (along * cosine - across * sine)
        to_north[i] = north[i] + (along * sine + across * cosine)
    _copy_row(state[OFF, first:stop], moved[OFF, first:stop])
    for r in range(RATE, state.shape[0]):
        _copy_row(state[r, first:stop], moved[r, first:stop])


@njit(inline="always")
def _copy_row(row: Floats32, copy: Floats32) -> None:
    # To assign one part of an array to another takes numba two seconds to compile.
    for i in range(row.size):
        copy[i] = row[i]


def remounted(
    state: Floats32, length_m: float, errors: MotionErrors, rng: np.random.Generator
) -> Floats32:
    """Return hypotheses of which some have another lasting heading error after some metres.

    Half of these point the other way round, as a phone that is held upside down; the others
    anywhere.
    """
    share = 1 - exp(-errors.remounts_per_m * length_m)
    count = int(rng.binomial(state.shape[1], share))
    if count == 0:
        return state
    turned = state.copy()
    chosen = rng.integers(state.shape[1], size=count)
    anywhere_rad = rng.uniform(-pi, pi, count)
    around_rad = wrap_rad(state[BIAS, chosen] + pi)
    turned[BIAS, chosen] = np.where(rng.random(count) < 0.5, around_rad, anywhere_rad)
    return turned


def is_turned(state: Floats32) -> Bools:
    """Return which hypotheses (STATES, N) have a turned phone, by their lasting heading error."""
    return np.asarray(np.abs(wrap_rad(state[BIAS])) > _TURNED_RAD)


def moved_back(state: Floats32, east_m: float, north_m: float) -> Floats32:
    """Return hypotheses where they were before a displacement by dead reckoning.

    It is turned and scaled by each hypothesis's errors as they are now; only positions change.
    """
    turned, stretch = state[BIAS] + state[TURN], np.exp(state[LOG_SCALE] + state[STRETCH])
    cosine, sine = np.cos(turned), np.sin(turned)
    before = state.copy()
    before[EAST] -= stretch * (_F(east_m) * cosine - _F(north_m) * sine)
    before[NORTH] -= stretch * (_F(east_m) * sine + _F(north_m) * cosine)
    return before
