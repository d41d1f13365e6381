"""Compiled arithmetic of :mod:`mapfilter.models.level_memory`: small matrices, once per report.

Sums and products are taken in the order of the formulas, without fused operations, so that results
are those of the same formulas over arrays, to the last bit.
"""

from __future__ import annotations

from math import log

import numpy as np
from numba import njit

from mapfilter._types import Floats, Floats32, Ints32


@njit(error_model="numpy", cache=True)
def aged(
    covariance: Floats,
    prior: Floats,
    slow: float,
    fast: float,
    level: tuple[Floats, float, float],
    variance: tuple[Floats, float, float],
) -> tuple[Floats, Floats32, Floats, Floats]:
    """Return a covariance (2S + 1, 2S + 1) whose errors decay towards the prior one.

    Parameters
    ----------
    slow, fast : float
        Factors of slow and fast errors; that of the device stays.
    level, variance : tuple
        Values (S,), what they decay to, and the factor of the difference.

    Returns
    -------
    covariance, factors, level, variance : ndarray
        Factors of all errors are in single precision.
    """
    size, slots = covariance.shape[0], level[0].size
    decay, now = np.ones(size, dtype=np.float32), np.empty((size, size))
    other_dbm, other_db2 = np.empty(slots), np.empty(slots)
    for k in range(slots):
        decay[k], decay[slots + k] = slow, fast
        other_dbm[k] = level[1] + (level[0][k] - level[1]) * level[2]
        other_db2[k] = variance[1] + (variance[0][k] - variance[1]) * variance[2]
    for i in range(size):
        own = slow if i < slots else (fast if i < 2 * slots else 1.0)
        for j in range(size):
            both = own * (slow if j < slots else (fast if j < 2 * slots else 1.0))
            now[i, j] = covariance[i, j] * both + prior[i, j] * (1.0 - both)
    return now, decay, other_dbm, other_db2


@njit(error_model="numpy", cache=True)
def sequential_updates(
    covariance: Floats,
    slot: Ints32,
    level_dbm: Floats32,
    white_db2: float,
    other_white_db2: Floats,
    other_dbm: Floats,
    other_db2: Floats,
    negligible: float,
) -> tuple[Floats32, Floats32, Floats32]:
    """Update a covariance (2S + 1, 2S + 1) by levels (K,), one after the other, in place.

    So are ``other_dbm`` and ``other_db2`` (S,), mean and variance of the next level of a cell that
    the prediction is wrong about, to whose variance ``other_white_db2`` (K,) is added.

    Returns
    -------
    gain, variance_db2, other : ndarray of float32, shapes (K, 2S + 1), (K,) and (K,)
        Gains, where not negligible, variances of innovations, and log-likelihoods of the levels if
        the prediction is wrong.
    """
    count, size = slot.size, covariance.shape[0]
    slots, last = (size - 1) // 2, size - 1
    gains = np.zeros((count, size), dtype=np.float32)
    variances = np.empty(count, dtype=np.float32)
    others = np.empty(count, dtype=np.float32)
    column, gain = np.empty(size), np.empty(size)
    for k in range(count):
        s = slot[k]
        for i in range(size):
            column[i] = covariance[i, s] + covariance[i, slots + s] + covariance[i, last]
        variance = column[s] + column[slots + s] + column[last] + white_db2
        variances[k] = np.float32(variance)
        for i in range(size):
            gain[i] = column[i] / variance
            if not abs(gain[i]) < negligible:
                gains[k, i] = np.float32(gain[i])
        for i in range(size):
            for j in range(size):
                covariance[i, j] -= gain[i] * column[j]
        off_dbm = np.float64(level_dbm[k]) - other_dbm[s]
        off_db2 = other_db2[s] + other_white_db2[k]
        others[k] = np.float32(-0.5 * (off_dbm * off_dbm) / off_db2 - 0.5 * log(off_db2))
        other_dbm[s] += other_db2[s] / off_db2 * off_dbm
        other_db2[s] *= 1.0 - other_db2[s] / off_db2
    return gains, variances, others


@njit(error_model="numpy", cache=True)
def absence_gains(
    covariance: Floats, slot: Ints32, more_db2: float, negligible: float
) -> tuple[Floats32, Floats32]:
    """Return gains (K, 2S + 1), where not negligible, and variances (K,) of absent cells."""
    count, size = slot.size, covariance.shape[0]
    slots, last = (size - 1) // 2, size - 1
    gains = np.zeros((count, size), dtype=np.float32)
    variances = np.empty(count, dtype=np.float32)
    column = np.empty(size)
    for k in range(count):
        s = slot[k]
        for i in range(size):
            column[i] = covariance[i, s] + covariance[i, slots + s] + covariance[i, last]
        variance = column[s] + column[slots + s] + column[last] + more_db2
        variances[k] = np.float32(variance)
        for i in range(size):
            gain = column[i] / variance
            if not abs(gain) < negligible:
                gains[k, i] = np.float32(gain)
    return gains, variances
