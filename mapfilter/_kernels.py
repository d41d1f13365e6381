"""Shared by compiled kernels: counter-based random numbers, elementary functions that vectorise.

A kernel is handed one 64-bit key; the numbers of its i-th element are a hash of key and i, so that
the order of the work changes nothing. Functions are polynomials in single precision, good to about
1e-6, because calls to a library of mathematics keep a loop from being vectorised.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import pi, sqrt
from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, void

MEASURE_SIGNATURE = void(
    float64[:, ::1],
    int64[::1],
    float64[:, ::1],
    float64[::1],
    float64[:, ::1],
    float64[:, :, ::1],
    boolean,
)
"""Arguments of a compiled measurement: points (q, W), slots (4,), rows (m, c), patterns (p,), mean
(m, W) and slope (m, q, W) to be written, and whether the slope is wanted."""

_F = np.float32
_TWO_PI = _F(2 * pi)
_INVERSE_TWO_PI = _F(1 / (2 * pi))
_ROUNDING = _F(1.5 * 2.0**23)
_ONE = _F(1.0)
_HALF = _F(0.5)
_LN2 = _F(np.log(2.0))
_INVERSE_LN2 = _F(1 / np.log(2.0))
_LOWEST_EXPONENT = _F(-80.0)
_UNIT = _F(2.0**-24)
_HALF_UNIT = _F(2.0**-25)
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_MANTISSA = np.int32(0x007FFFFF)
_EXPONENT_OF_ONE = np.int32(0x3F800000)
_S3, _S5, _S7, _S9 = (_F(v) for v in (-1 / 6, 1 / 120, -1 / 5040, 1 / 362880))
_C2, _C4, _C6, _C8, _C10 = (_F(v) for v in (-1 / 2, 1 / 24, -1 / 720, 1 / 40320, -1 / 3628800))
_ROOT_TWO = _F(2.0**0.5)
_L3, _L4, _L5 = _F(3.3333331174e-1), _F(-2.4999993993e-1), _F(2.0000714765e-1)
_L6, _L7, _L8 = _F(-1.6668057665e-1), _F(1.4249322787e-1), _F(-1.2420140846e-1)
_L9, _L10, _L11 = _F(1.1676998740e-1), _F(-1.1514610310e-1), _F(7.0376836292e-2)
_E2, _E3, _E4, _E5 = (_F(v) for v in (0.5, 1 / 6, 1 / 24, 1 / 120))


def on_demand(
    signature: Any, function: Callable[..., Any], *, contract: bool = False, argument: bool = False
) -> Callable[[], Callable[..., Any]]:
    """Return a function that returns a kernel of one signature, compiled at the first call of it.

    With its signature in a decorator a kernel is compiled on import, for seconds, by every command
    that imports its module. ``contract`` allows fused products and sums; ``argument`` says that it
    is an argument of other kernels (:func:`as_argument`).
    """

    @cache
    def kernel() -> Callable[..., Any]:
        fast = {"contract"} if contract else False
        compiled: Callable[..., Any] = njit(
            [signature], cache=True, nogil=True, error_model="numpy", fastmath=fast
        )(function)
        return as_argument(compiled, signature) if argument else compiled

    return kernel


def as_argument(compiled: Any, signature: Any) -> Callable[..., Any]:
    """Return a kernel whose addresses are looked up once, for calls of kernels that it is given to.

    Else numba compares its types and asks for both addresses at each call, which takes as long as
    a Kalman update. A function that was not compiled (``NUMBA_DISABLE_JIT``) is returned as it is.
    """
    if not hasattr(compiled, "get_compile_result"):
        plain: Callable[..., Any] = compiled
        return plain
    look_up = compiled.get_compile_result
    found = look_up(signature)
    found.library.get_pointer_to_function = cache(found.library.get_pointer_to_function)
    compiled.get_compile_result = lambda sought: found if sought == signature else look_up(sought)
    kernel: Callable[..., Any] = compiled
    return kernel


def draw_key(rng: np.random.Generator) -> np.uint64:
    """Draw the key of one kernel call."""
    bits = rng.bit_generator
    if isinstance(bits, np.random.PCG64):
        # The same number in a quarter of the time.
        return np.uint64(bits.random_raw())
    key: np.uint64 = rng.integers(0, 2**64, dtype=np.uint64)
    return key


@njit(inline="always")
def hashed(key: np.uint64, index: np.uint64) -> np.uint64:
    """Return 64 random bits: SplitMix64 (Steele, Lea & Flood 2014) at a place of its sequence."""
    z = key + (index + np.uint64(1)) * _GOLDEN
    z = (z ^ (z >> np.uint64(30))) * _MIX_1
    z = (z ^ (z >> np.uint64(27))) * _MIX_2
    return z ^ (z >> np.uint64(31))


@njit(inline="always")
def uniforms(bits: np.uint64) -> tuple[np.float32, np.float32]:
    """Return two numbers above 0 and at most 1, of 24 bits each."""
    high = np.int32(bits >> np.uint64(40))
    low = np.int32(bits & np.uint64(0xFFFFFF))
    return _F(high) * _UNIT + _HALF_UNIT, _F(low) * _UNIT + _HALF_UNIT


@njit(inline="always")
def log32(x: np.float32) -> np.float32:
    """Return the natural logarithm of a positive normal number."""
    bits = _F(x).view(np.int32)
    exponent = np.int32(np.int32(bits >> np.int32(23)) - np.int32(127))
    m = np.int32(np.int32(bits & _MANTISSA) | _EXPONENT_OF_ONE).view(np.float32)
    # A polynomial between 0.71 and 1.42 (Cephes, logf): a division takes as long as ten products.
    high = m > _ROOT_TWO
    m = m * _HALF if high else m
    exponent = np.int32(exponent + np.int32(1)) if high else exponent
    t = m - _ONE
    t2 = t * t
    t4 = t2 * t2
    # Products side by side (Estrin's scheme) do not wait for each other.
    low = (_L3 + t * _L4) + t2 * (_L5 + t * _L6)
    high_powers = (_L7 + t * _L8) + t2 * ((_L9 + t * _L10) + t2 * _L11)
    series = low + t4 * high_powers
    return _F(exponent) * _LN2 + (t + t2 * (t * series - _HALF))


@njit(inline="always")
def exp32(x: np.float32) -> np.float32:
    """Return the exponential of a number below 80; below -80 that of -80."""
    x = max(_F(x), _LOWEST_EXPONENT)
    scaled = x * _INVERSE_LN2
    whole = (scaled + _ROUNDING) - _ROUNDING
    r = x - whole * _LN2
    power = np.int32(np.int32(np.int32(whole) + np.int32(127)) << np.int32(23))
    r2 = r * r
    series = (_ONE + r) + r2 * ((_E2 + r * _E3) + r2 * (_E4 + r * _E5))
    return series * power.view(np.float32)


@njit(inline="always")
def wrap32(angle_rad: np.float32) -> np.float32:
    """Return an angle in [-π, π], the next one to it that means the same."""
    turns = (angle_rad * _INVERSE_TWO_PI + _ROUNDING) - _ROUNDING
    return angle_rad - turns * _TWO_PI


@njit(inline="always")
def cos_sin32(angle_rad: np.float32) -> tuple[np.float32, np.float32]:
    """Return cosine and sine of an angle in [-π, π]."""
    # The half angle lies where both polynomials are good; the doubling formulas give it back.
    half = angle_rad * _HALF
    h2 = half * half
    s = half * (_ONE + h2 * (_S3 + h2 * (_S5 + h2 * (_S7 + h2 * _S9))))
    c = _ONE + h2 * (_C2 + h2 * (_C4 + h2 * (_C6 + h2 * (_C8 + h2 * _C10))))
    return _ONE - _F(2.0) * s * s, _F(2.0) * s * c


@njit(inline="always")
def normals(bits: np.uint64) -> tuple[np.float32, np.float32]:
    """Return two standard normal numbers by Box and Muller (1958)."""
    u, v = uniforms(bits)
    radius = sqrt(_F(-2.0) * log32(u))
    c, s = cos_sin32((v - _HALF) * _TWO_PI)
    return radius * c, radius * s
