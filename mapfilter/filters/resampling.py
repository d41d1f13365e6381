"""Weights of particles: logarithms that are brought to sum to one, and systematic resampling.

Systematic resampling takes N equally spaced points of the cumulative weights, all shifted by one
uniform number (Kitagawa 1996). The mean number of copies of a particle is N times its weight.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._kernels import exp32, hashed, normals
from mapfilter._types import Floats, Floats32, Ints32

_BLOCK = 1024
"""Copies that are made at a time, which stay in the cache."""


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def normalise(log_weight: Floats, weight: Floats32) -> tuple[float, float]:
    """Normalise log weights (N,) in place, and fill the weights (N,), which sum to one.

    Returns
    -------
    log_total, effective : float
        Logarithm of the sum before, and the effective sample size, one over the sum of squares;
        minus infinity and 0 where no weight is left.
    """
    # Eight side by side, as below.
    most, whole = np.full(8, -np.inf), log_weight.size // 8 * 8
    for i in range(0, whole, 8):
        for j in range(8):
            most[j] = log_weight[i + j] if log_weight[i + j] > most[j] else most[j]
    for i in range(whole, log_weight.size):
        most[0] = log_weight[i] if log_weight[i] > most[0] else most[0]
    highest = most.max()
    if not np.isfinite(highest):
        return -np.inf, 0.0
    for i in range(log_weight.size):
        weight[i] = exp32(np.float32(log_weight[i] - highest))
    # Eight sums side by side: one alone would wait for itself, and lose digits.
    sums, squares = np.zeros(8), np.zeros(8)
    for i in range(0, whole, 8):
        for j in range(8):
            w = np.float64(weight[i + j])
            sums[j] += w
            squares[j] += w * w
    for i in range(whole, log_weight.size):
        w = np.float64(weight[i])
        sums[0] += w
        squares[0] += w * w
    total = sums.sum()
    log_total = highest + np.log(total)
    share = np.float32(1.0 / total)
    for i in range(log_weight.size):
        weight[i] *= share
        log_weight[i] -= log_total
    return log_total, total * total / squares.sum()


def log_sum(log_weight: Floats) -> float:
    """Return the logarithm of the sum of weights (N,); minus infinity where none is left.

    Examples
    --------
    >>> round(log_sum(np.log([0.5, 0.25, 0.0625])), 6) == round(float(np.log(0.8125)), 6)
    True
    """
    highest = log_weight.max(initial=-np.inf)
    if not np.isfinite(highest):
        return float(highest)
    return float(highest + np.log(np.exp(log_weight - highest).sum()))


@njit(error_model="numpy", cache=True)
def systematic(weight: Floats32, offset: float, chosen: Ints32) -> None:
    """Fill the indices of the particles that M new ones copy, ascending.

    Weights sum to one; ``offset`` is drawn uniformly from [0, 1).

    Examples
    --------
    >>> chosen = np.empty(4, dtype=np.int32)
    >>> systematic(np.float32([0.5, 0.125, 0.375]), 0.5, chosen)
    >>> chosen.tolist()
    [0, 0, 2, 2]
    """
    count, last = chosen.size, weight.size - 1
    if not count:
        return
    chosen[:] = 0
    # Each particle is written where its copies begin, over those before it that have none: nothing
    # depends on a comparison that is hard to foresee.
    passed, begin, most = 0.0, 0, np.float64(count)
    for i in range(last):
        chosen[begin] = i
        passed += weight[i]
        end = passed * most - offset
        end = end if end < most else most
        begin = max(int(np.ceil(end)), begin)
        if begin == count:
            break
    if begin < count:
        chosen[begin] = last
    for j in range(1, count):
        chosen[j] = max(chosen[j], chosen[j - 1])


@njit(error_model="numpy", cache=True, nogil=True)
def taken(
    first: int,
    stop: int,
    log_weight: Floats,
    weight: Floats32,
    chosen: Ints32,
    log_of: Floats,
    weight_of: Floats32,
) -> None:
    """Fill ``log_of`` and ``weight_of`` (M,) with the weights of the chosen particles.

    As below, ``first`` and ``stop`` are the part of the M copies that is filled.
    """
    at, log_of, weight_of = chosen[first:stop], log_of[first:stop], weight_of[first:stop]
    for j in range(at.size):
        i = np.uint32(at[j])
        log_of[j] = log_weight[i]
        weight_of[j] = weight[i]


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def copy_with_jitter(
    first: int,
    stop: int,
    state: Floats32,
    chosen: Ints32,
    jitter: Floats32,
    key: np.uint64,
    copies: Floats32,
) -> None:
    """Copy the chosen particles of ``state`` (R, N) and move each copy by normal noise.

    ``jitter`` has the standard deviation for each row; rows of 0, and rows beyond, are copied as
    they are. The noise is drawn from ``key``.
    """
    rows = state.shape[0]
    for begin in range(first, stop, _BLOCK):
        end = min(begin + _BLOCK, stop)
        at = chosen[begin:end]
        for r in range(0, rows, 2):
            # Normal numbers come in pairs: one for each of two rows.
            one, other = state[r], state[min(r + 1, rows - 1)]
            to_one, to_other = copies[r, begin:end], copies[min(r + 1, rows - 1), begin:end]
            sd = jitter[r] if r < jitter.size else np.float32(0.0)
            other_sd = jitter[r + 1] if r + 1 < min(rows, jitter.size) else np.float32(0.0)
            for j in range(at.size):
                to_one[j] = one[np.uint32(at[j])]
                to_other[j] = other[np.uint32(at[j])]
            drawn = (np.uint64(r) << np.uint64(40)) + np.uint64(begin)
            if sd > 0 or other_sd > 0:
                for j in range(at.size):
                    a, b = normals(hashed(key, drawn + np.uint64(j)))
                    to_one[j] += sd * a
                    to_other[j] += other_sd * b
