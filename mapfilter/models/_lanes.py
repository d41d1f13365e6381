"""Elementary functions over lanes, written so that compilers vectorise them.

A lane is one state of a batch. The logarithm and the arc tangent are those of FreeBSD's msun
(``e_log.c``, ``s_atan.c``), right to the last digit or two, without branches.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._types import Floats

_LN2 = 0.6931471805599453
_SQRT_HALF_BITS = 0x3FE6A09E00000000
_ONE_BITS = 0x3FF0000000000000
_MANTISSA = 0x000FFFFFFFFFFFFF
_TINY = 1e-300


@njit(cache=True, nogil=True, error_model="numpy")
def log_lanes(value: Floats, out: Floats, scratch: Floats) -> None:  # pragma: no cover
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
        t1 = even * (
            0.3999999999940941908 + even * (0.2222219843214978396 + even * 0.1531383769920937332)
        )
        t2 = z * (
            0.6666666666666735130
            + even
            * (
                0.2857142874366239149
                + even * (0.1818357216161805012 + even * 0.1479819860511658591)
            )
        )
        half = 0.5 * f * f
        out[w] = out[w] * _LN2 + (f - (half - s * (half + t1 + t2)))


@njit(cache=True, nogil=True, error_model="numpy")
def atan2_lanes(left: Floats, ahead: Floats, out: Floats) -> None:  # pragma: no cover
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
