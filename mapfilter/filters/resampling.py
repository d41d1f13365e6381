"""Weights of particles: logarithms that are brought to sum to one, and systematic resampling.

Systematic resampling takes N equally spaced points of the cumulative weights, all shifted by one
uniform number (Kitagawa 1996). The mean number of copies of a particle is N times its weight.
"""

from __future__ import annotations

from math import isfinite

import numpy as np
from numba import njit

from mapfilter._kernels import exp32, hashed, normals
from mapfilter._threads import Threads
from mapfilter._types import Floats, Floats32, Ints, Ints32

_BLOCK = 1024
"""Particles that stay in the cache. Sums over particles are taken by blocks, as these are the same
however many threads share the work: parts of a thread begin at multiples of it."""


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def normalise(log_weight: Floats, weight: Floats32) -> tuple[float, float]:
    """Normalise log weights (N,) in place, and fill the weights (N,), which sum to one.

    Returns
    -------
    log_total, effective : float
        Logarithm of the sum before, and the effective sample size, one over the sum of squares;
        minus infinity and 0 where no weight is left.
    """
    sums = np.empty((3, -(-log_weight.size // _BLOCK)))
    _fill_blocks(0, log_weight.size, log_weight, weight, sums)
    log_total, effective = _joined(sums)
    if effective > 0:
        _scale_blocks(0, log_weight.size, log_weight, weight, sums, log_total)
    return log_total, effective


def normalise_by(threads: Threads, log_weight: Floats, weight: Floats32) -> tuple[float, float]:
    """Do what :func:`normalise` does, divided among threads."""
    count = log_weight.size
    if not threads.divide(count):
        found: tuple[float, float] = normalise(log_weight, weight)
        return found
    sums = np.empty((3, -(-count // _BLOCK)))
    threads.over(count, (_fill_blocks, log_weight, weight, sums))
    log_total, effective = _joined(sums)
    if effective > 0:
        threads.over(count, (_scale_blocks, log_weight, weight, sums, log_total))
    return log_total, effective


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def _fill_blocks(first: int, stop: int, log_weight: Floats, weight: Floats32, sums: Floats) -> None:
    """Fill weights relative to the largest of their block.

    Also fill for each block, (3, B), the logarithm of the largest, the sum of weights and that of
    their squares.
    """
    # Eight side by side: one alone would wait for itself, and lose digits.
    most, total, squares = np.empty(8), np.empty(8), np.empty(8)
    for begin in range(first, stop, _BLOCK):
        end = min(begin + _BLOCK, stop)
        given, found, whole = log_weight[begin:end], weight[begin:end], (end - begin) // 8 * 8
        most[:], total[:], squares[:] = -np.inf, 0.0, 0.0
        for i in range(0, whole, 8):
            for j in range(8):
                most[j] = given[i + j] if given[i + j] > most[j] else most[j]
        for i in range(whole, given.size):
            most[0] = given[i] if given[i] > most[0] else most[0]
        highest = most.max()
        # Without any weight, differences would be no numbers.
        less = highest if np.isfinite(highest) else 0.0
        for i in range(given.size):
            found[i] = exp32(np.float32(given[i] - less))
        for i in range(0, whole, 8):
            for j in range(8):
                w = np.float64(found[i + j])
                total[j] += w
                squares[j] += w * w
        for i in range(whole, given.size):
            w = np.float64(found[i])
            total[0] += w
            squares[0] += w * w
        block = begin // _BLOCK
        sums[0, block], sums[1, block], sums[2, block] = highest, total.sum(), squares.sum()


@njit(error_model="numpy", cache=True)
def _joined(sums: Floats) -> tuple[float, float]:
    """Return what :func:`normalise` does, by the sums of blocks; these become their factors."""
    highest, total, squares = sums[0].max(), 0.0, 0.0
    if not np.isfinite(highest):
        return -np.inf, 0.0
    for b in range(sums.shape[1]):
        share = np.exp(sums[0, b] - highest)
        total += share * sums[1, b]
        squares += share * share * sums[2, b]
        sums[0, b] = share
    for b in range(sums.shape[1]):
        sums[0, b] /= total
    return highest + np.log(total), total * total / squares


@njit(error_model="numpy", cache=True, nogil=True)
def _scale_blocks(
    first: int, stop: int, log_weight: Floats, weight: Floats32, sums: Floats, log_total: float
) -> None:
    """Normalise weights by the factors of their blocks, and log weights, in place."""
    for begin in range(first, stop, _BLOCK):
        end, share = min(begin + _BLOCK, stop), np.float32(sums[0, begin // _BLOCK])
        for i in range(begin, end):
            weight[i] *= share
            log_weight[i] -= log_total


def log_sum(log_weight: Floats) -> float:
    """Return the logarithm of the sum of weights (N,); minus infinity where none is left.

    Examples
    --------
    >>> round(log_sum(np.log([0.5, 0.25, 0.0625])), 6) == round(float(np.log(0.8125)), 6)
    True
    """
    highest = log_weight.max(initial=-np.inf)
    if not isfinite(highest):
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
    passed = np.empty(-(-weight.size // _BLOCK) + 1)
    _sum_blocks(0, weight.size, weight, passed)
    begins = _begins(passed, offset, chosen.size)
    _choose(0, weight.size, weight, passed, begins, offset, chosen)


def systematic_by(threads: Threads, weight: Floats32, offset: float, chosen: Ints32) -> None:
    """Do what :func:`systematic` does, divided among threads."""
    if not threads.divide(weight.size):
        systematic(weight, offset, chosen)
        return
    passed = np.empty(-(-weight.size // _BLOCK) + 1)
    # That takes less time than to divide it.
    _sum_blocks(0, weight.size, weight, passed)
    begins = _begins(passed, offset, chosen.size)
    threads.over(weight.size, (_choose, weight, passed, begins, offset, chosen))


@njit(error_model="numpy", cache=True, nogil=True)
def _sum_blocks(first: int, stop: int, weight: Floats32, passed: Floats) -> None:
    """Fill the sum of each block of weights, behind it."""
    eight = np.empty(8)
    for begin in range(first, stop, _BLOCK):
        end = min(begin + _BLOCK, stop)
        whole = begin + (end - begin) // 8 * 8
        eight[:] = 0.0
        for i in range(begin, whole, 8):
            for j in range(8):
                eight[j] += weight[i + j]
        for i in range(whole, end):
            eight[0] += weight[i]
        passed[begin // _BLOCK + 1] = eight.sum()


@njit(error_model="numpy", cache=True)
def _begins(passed: Floats, offset: float, count: int) -> Ints:
    """Return where the copies of each block begin, and their end; sums become those before it."""
    begins, most = np.zeros(passed.size, dtype=np.int64), np.float64(count)
    passed[0] = 0.0
    for b in range(1, passed.size):
        passed[b] += passed[b - 1]
        end = min(passed[b] * most - offset, most)
        begins[b] = max(int(np.ceil(end)), begins[b - 1])
    # The last particle takes what rounding has left.
    begins[-1] = count
    return begins


@njit(error_model="numpy", cache=True, nogil=True)
def _choose(
    first: int,
    stop: int,
    weight: Floats32,
    passed: Floats,
    begins: Ints,
    offset: float,
    chosen: Ints32,
) -> None:
    """Fill the copies of particles ``first`` to ``stop``, by blocks."""
    count, sums = np.float64(chosen.size), np.empty(_BLOCK)
    ends = np.zeros(_BLOCK + 1, dtype=np.int32)
    for at in range(first, stop, _BLOCK):
        block, size = at // _BLOCK, min(_BLOCK, stop - at)
        begin, copies = begins[block], begins[block + 1] - begins[block]
        if copies == 0:
            continue
        total, least, most = passed[block], np.float64(begin), np.float64(begins[block + 1])
        for j in range(size):
            total += weight[at + j]
            sums[j] = total
        for j in range(size):
            end = sums[j] * count - offset
            end = end if end < most else most
            end = end if end > least else least
            ends[j + 1] = np.int32(np.ceil(end)) - np.int32(begin)
        # What rounding has left is of the last particle.
        ends[size] = copies
        # Four copies are written at once, of which those of the next particle replace what is too
        # many: nothing depends on a comparison that is hard to foresee.
        found = np.empty(copies + 4, dtype=np.int32)
        for j in range(size):
            of, to = at + j, np.uint32(ends[j])
            found[to] = of
            found[to + np.uint32(1)] = of
            found[to + np.uint32(2)] = of
            found[to + np.uint32(3)] = of
            for k in range(ends[j] + 4, ends[j + 1]):
                found[k] = of
        for k in range(copies):
            chosen[begin + k] = found[k]


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
