"""The one place where measurement equations and their derivatives are computed.

Every Gaussian measurement of this room is a table of terms, one row for each component of the
reading; :func:`measure`, compiled, goes over it for a block of lanes (states). What the columns
mean depends on the kind of term:

=============== ===== ============= =========================================================
kind            0     1, 2, 3       4 ...
=============== ===== ============= =========================================================
range           0     transmitter   4: 1 where the clock's bias is added
level           1     transmitter   4: constant dB, 5: dB per decade of km, 6: gain's sign,
                                    7: boresight, 8: beamwidth, 9: largest attenuation,
                                    10: first sample of a pattern, 11: number of samples,
                                    12: shortest distance, 13, 14: slots of errors in dB that
                                    are part of the state, plus one; 0 for none
difference      2     station       4, 5, 6: reference station
component       3     –             4: slot
=============== ===== ============= =========================================================

A lane is one state of a batch. The logarithm and the arc tangent are those of FreeBSD's msun
(``e_log.c``, ``s_atan.c``), right to the last digit or two, without branches.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._kernels import MEASURE_SIGNATURE, on_demand
from mapfilter._types import Floats, Ints

COLUMNS = 15
ERROR_SLOTS = slice(13, 15)
RANGE, LEVEL, DIFFERENCE, COMPONENT = 0.0, 1.0, 2.0, 3.0

_LOG10_E = 0.4342944819032518
_TWO_PI = 2 * np.pi
_LN2 = 0.6931471805599453
_SQRT_HALF_BITS = 0x3FE6A09E00000000
_ONE_BITS = 0x3FF0000000000000
_MANTISSA = 0x000FFFFFFFFFFFFF
_TINY = 1e-300

_kernel = njit(cache=True, nogil=True, error_model="numpy")


@_kernel
def log_lanes(value: Floats, out: Floats, scratch: Floats) -> None:
    """Write the natural logarithms of positive normal numbers."""
    bits, reduced_bits = value.view(np.int64), scratch.view(np.int64)
    for w in range(value.size):
        shifted = bits[w] + (_ONE_BITS - _SQRT_HALF_BITS)
        reduced_bits[w] = (shifted & _MANTISSA) + _SQRT_HALF_BITS
        out[w] = np.float64((shifted >> 52) - 1023)
    for w in range(value.size):
        f = scratch[w] - 1.0
        s = f / (2.0 + f)
        z = s * s
        even = z * z
        odd = 0.2857142874366239149 + even * (0.1818357216161805012 + even * 0.1479819860511658591)
        t1 = 0.2222219843214978396 + even * 0.1531383769920937332
        t1 = even * (0.3999999999940941908 + even * t1)
        t2 = z * (0.6666666666666735130 + even * odd)
        half = 0.5 * f * f
        out[w] = out[w] * _LN2 + (f - (half - s * (half + t1 + t2)))


@_kernel
def atan2_lanes(left: Floats, ahead: Floats, out: Floats) -> None:
    """Write the angles of directions, in [-π, π]; 0 where a direction is none."""
    for w in range(left.size):
        high, low = max(abs(left[w]), abs(ahead[w])), min(abs(left[w]), abs(ahead[w]))
        ratio = low / max(high, _TINY)
        steep = ratio > 0.41421356237309503
        t = (ratio - 1.0) / (ratio + 1.0) if steep else ratio
        z = t * t
        u = z * z
        odd = z * (
            0.333333333333329318027
            + u
            * (
                0.142857142725034663711
                + u
                * (
                    0.0909088713343650656196
                    + u
                    * (
                        0.0666107313738753120669
                        + u * (0.0497687799461593236017 + u * 0.0162858201153657823623)
                    )
                )
            )
        )
        even = u * (
            -0.199999999998764832476
            + u
            * (
                -0.111111104054623557880
                + u
                * (
                    -0.0769187620504482999495
                    + u * (-0.0583357013379057348645 + u * -0.0365315727442169155270)
                )
            )
        )
        angle = t - t * (odd + even)
        angle = angle + 0.7853981633974483 if steep else angle
        angle = 1.5707963267948966 - angle if abs(left[w]) > abs(ahead[w]) else angle
        angle = 3.141592653589793 - angle if ahead[w] < 0.0 else angle
        out[w] = -angle if left[w] < 0.0 else angle


@_kernel
def _offsets(
    points: Floats, slots: Ints, x: float, y: float, z: float, delta: Floats, squared: Floats
) -> None:
    """Write the vectors from a place to the receivers and their squared lengths."""
    east, north, up = slots[0], slots[1], slots[2]
    for w in range(points.shape[1]):
        delta[0, w] = points[east, w] - x
        delta[1, w] = points[north, w] - y
    if up >= 0:
        for w in range(points.shape[1]):
            delta[2, w] = points[up, w] - z
    else:
        delta[2, :] = -z
    for w in range(points.shape[1]):
        squared[w] = delta[0, w] ** 2 + delta[1, w] ** 2 + delta[2, w] ** 2


@_kernel
def _add_range(
    points: Floats,
    slots: Ints,
    place: Floats,
    sign: float,
    work: Floats,
    mean: Floats,
    slope: Floats,
    derive: bool,
) -> None:
    """Add a signed distance; its derivative is the unit vector, 0 on the transmitter itself."""
    delta, distance = work[:3], work[3]
    _offsets(points, slots, place[0], place[1], place[2], delta, distance)
    for w in range(mean.size):
        distance[w] = np.sqrt(distance[w])
        mean[w] += sign * distance[w]
    if derive:
        scale = work[4]
        for w in range(mean.size):
            scale[w] = sign / distance[w] if distance[w] > 0.0 else 0.0
        for axis in range(3):
            slot = slots[axis]
            if slot >= 0:
                for w in range(mean.size):
                    slope[slot, w] += delta[axis, w] * scale[w]


@_kernel
def _add_gain(
    row: Floats,
    slots: Ints,
    patterns: Floats,
    work: Floats,
    mean: Floats,
    slope: Floats,
    derive: bool,
) -> None:
    """Add an antenna's gain, by formula or by its samples; work holds the offsets."""
    delta, left, ahead, angle = work[:3], work[4], work[5], work[6]
    sign, cos_boresight, sin_boresight = row[6], np.cos(row[7]), np.sin(row[7])
    for w in range(mean.size):
        ahead[w] = delta[0, w] * cos_boresight + delta[1, w] * sin_boresight
        left[w] = delta[1, w] * cos_boresight - delta[0, w] * sin_boresight
    atan2_lanes(left, ahead, angle)
    per_radian = left
    count = int(row[11])
    if count > 0:
        first, per_sample = int(row[10]), _TWO_PI / count
        for w in range(mean.size):
            place = (angle[w] % _TWO_PI) / per_sample
            below = min(int(place), count - 1)
            low, high = patterns[first + below], patterns[first + (below + 1) % count]
            mean[w] += sign * (low + (place - below) * (high - low))
            per_radian[w] = sign * (high - low) / per_sample
    else:
        curve, most = 12.0 / row[8] ** 2, row[9]
        for w in range(mean.size):
            loss = curve * angle[w] ** 2
            mean[w] -= sign * min(loss, most)
            per_radian[w] = -2.0 * sign * curve * angle[w] if loss < most else 0.0
    if derive:
        east, north = slots[0], slots[1]
        for w in range(mean.size):
            flat = delta[0, w] ** 2 + delta[1, w] ** 2
            turn = per_radian[w] / flat if flat > 0.0 else 0.0
            slope[east, w] -= delta[1, w] * turn
            slope[north, w] += delta[0, w] * turn


@_kernel
def _add_level(
    points: Floats,
    slots: Ints,
    row: Floats,
    patterns: Floats,
    work: Floats,
    mean: Floats,
    slope: Floats,
    derive: bool,
) -> None:
    """Add a level by distance and antenna; nearer than the shortest distance it stays."""
    delta, squared, logarithm = work[:3], work[3], work[4]
    _offsets(points, slots, row[1], row[2], row[3], delta, squared)
    shortest = row[12] * row[12]
    for w in range(mean.size):
        squared[w] = max(squared[w], shortest)
    log_lanes(squared, logarithm, work[5])
    constant, per_log = row[4] - 3.0 * row[5], 0.5 * row[5] * _LOG10_E
    for w in range(mean.size):
        mean[w] += constant + per_log * logarithm[w]
    if derive:
        for axis in range(3):
            slot = slots[axis]
            if slot >= 0:
                for w in range(mean.size):
                    beyond = 2.0 * per_log if squared[w] > shortest else 0.0
                    slope[slot, w] += beyond * delta[axis, w] / squared[w]
    if row[6] != 0.0:
        _add_gain(row, slots, patterns, work, mean, slope, derive)
    for column in range(13, 15):
        error = int(row[column]) - 1
        if error >= 0:
            for w in range(mean.size):
                mean[w] += points[error, w]
            if derive:
                for w in range(mean.size):
                    slope[error, w] = 1.0


def measure(
    points: Floats,
    slots: Ints,
    rows: Floats,
    patterns: Floats,
    mean: Floats,
    slope: Floats,
    derive: bool,
) -> None:
    """Write what is expected of each term in each lane, and the derivatives.

    Parameters
    ----------
    points : (q, W) array
        The components of the state that measurements depend on, for W lanes.
    slots : (4,) integer array
        Rows of ``points`` that hold east, north, up and the clock's bias; -1 for none.
    rows : (m, 15) array
        The terms.
    patterns : (p,) array
        Samples of measured antennas in dB, anticlockwise from boresight.
    mean : (m, W) array
        Written.
    slope : (m, q, W) array
        Written where ``derive``; else left alone.
    """
    work = np.empty((7, points.shape[1]))
    for i in range(rows.shape[0]):
        row, kind = rows[i], rows[i, 0]
        mean[i, :] = 0.0
        if derive:
            slope[i, :, :] = 0.0
        if kind == LEVEL:
            _add_level(points, slots, row, patterns, work, mean[i], slope[i], derive)
        elif kind == COMPONENT:
            slot = int(row[4])
            # A loop: to assign arrays numba compiles a check of their shapes, for two seconds.
            for w in range(points.shape[1]):
                mean[i, w] = points[slot, w]
            if derive:
                slope[i, slot, :] = 1.0
        else:
            _add_range(points, slots, row[1:4], 1.0, work, mean[i], slope[i], derive)
            if kind == DIFFERENCE:
                _add_range(points, slots, row[4:7], -1.0, work, mean[i], slope[i], derive)
            elif row[4] != 0.0:
                clock = slots[3]
                for w in range(points.shape[1]):
                    mean[i, w] += points[clock, w]
                if derive:
                    slope[i, clock, :] = 1.0


measure_kernel = on_demand(MEASURE_SIGNATURE, measure, argument=True)
"""Return :func:`measure`, compiled."""
