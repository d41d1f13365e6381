"""Exponentials, sines and tails of normal numbers for compiled loops, in double precision.

They are polynomials, because calls to a library of mathematics keep a loop from being vectorised.
Those in single precision are in :mod:`mapfilter._kernels`.
"""

from __future__ import annotations

from math import factorial, floor, log

import numpy as np
from numba import njit

_LN2 = log(2.0)
_LEAST_EXPONENT = -700.0
_E2, _E3, _E4, _E5, _E6, _E7, _E8, _E9 = (1 / factorial(k) for k in range(2, 10))
_S3, _S5, _S7, _S9, _S11, _S13, _S15, _S17 = (
    (-1) ** (k // 2) / factorial(k) for k in range(3, 19, 2)
)
_C2, _C4, _C6, _C8, _C10, _C12, _C14, _C16, _C18 = (
    (-1) ** (k // 2) / factorial(k) for k in range(2, 20, 2)
)
_MIDDLE = 3.5
# Of t = (z - 3.5) / (z + 3.5): the tail of a normal number, times exp(z² / 2) (z + 3.5). The first
# terms of its Chebyshev series, as powers.
_T0, _T1, _T2, _T3 = 0.7444160753036, -0.5655618233193, 0.315424982944, -0.1160507195322
_T4, _T5, _T6 = 0.0174076219826, 0.006474478285438, -0.003187823644134
_T7, _T8, _T9 = -0.0004386794119572, 0.0004729538637578, 5.537890847436e-05
_T10, _T11, _T12 = -7.004339902898e-05, -7.495211583792e-06, 7.373276203163e-06


@njit(inline="always")
def exp64(x: float) -> float:
    """Return the exponential of a number below 700, good to 1e-10; below -700 that of -700."""
    x = max(x, _LEAST_EXPONENT)
    # Of 32 bits, as conversions to 64 do not vectorise everywhere.
    whole = np.int32(floor(x * (1 / _LN2) + 0.5))
    r = x - whole * _LN2
    r2 = r * r
    power = np.int64((np.int64(whole) + np.int64(1023)) << np.int64(52))
    # Products side by side (Estrin's scheme) do not wait for each other.
    high = (_E6 + r * _E7) + r2 * (_E8 + r * _E9)
    series = (1.0 + r) + r2 * ((_E2 + r * _E3) + r2 * (_E4 + r * _E5)) + r2 * r2 * r2 * high
    scale: float = power.view(np.float64)
    return series * scale


@njit(inline="always")
def sin_cos64(angle_rad: float) -> tuple[float, float]:
    """Return sine and cosine of an angle within a quarter of a turn, good to 1e-12."""
    h = angle_rad * angle_rad
    h2 = h * h
    h4 = h2 * h2
    low = (1.0 + h * _S3) + h2 * (_S5 + h * _S7)
    sine = angle_rad * (low + h4 * ((_S9 + h * _S11) + h2 * (_S13 + h * _S15) + h4 * _S17))
    low = (1.0 + h * _C2) + h2 * (_C4 + h * _C6)
    cosine = low + h4 * ((_C8 + h * _C10) + h2 * (_C12 + h * _C14) + h4 * (_C16 + h * _C18))
    return sine, cosine


@njit(inline="always")
def tail64(z: float) -> float:
    """Return the share of a standard normal above z, good to 1e-9 of it up to 37."""
    away = abs(z)
    t = (away - _MIDDLE) / (away + _MIDDLE)
    t2 = t * t
    t4 = t2 * t2
    low = (_T0 + t * _T1) + t2 * (_T2 + t * _T3)
    middle = (_T4 + t * _T5) + t2 * (_T6 + t * _T7)
    high = (_T8 + t * _T9) + t2 * (_T10 + t * _T11) + t4 * _T12
    tail = exp64(-0.5 * away * away) * (low + t4 * (middle + t4 * high)) / (away + _MIDDLE)
    return tail if z >= 0 else 1.0 - tail
