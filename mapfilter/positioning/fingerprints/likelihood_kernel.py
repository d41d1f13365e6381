"""Compiled kernel of :mod:`mapfilter.positioning.fingerprints.likelihoods`."""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._types import Floats, Ints


@njit(error_model="numpy", cache=True)
def add_reading(
    report: Ints,
    loss: Floats,
    level_dbm: Floats,
    variance_db2: Floats,
    log_variance: Floats,
    reading: tuple[float, float, float],
    received: Floats,
    sums: Floats,
) -> None:
    """Compare one reading with those of its cell, in place.

    Parameters
    ----------
    report, loss, level_dbm, variance_db2, log_variance : ndarray, shape (N,)
        The readings of the cell; missing levels are NaN.
    reading : tuple of float
        Level in dBm; whether it is a bound from above (-1), from below (1) or none (0); its loss of
        log-likelihood if the cell is not received.
    received : ndarray, shape (R,)
        By which cells they have, for each report.
    sums : ndarray, shape (4, R)
        Of the inverse variances, of differences and their squares by the variances, and of the
        logarithms of variances.
    """
    dbm, end, own_loss = reading
    for i in range(report.size):
        r = report[i]
        received[r] += loss[i] + own_loss
        apart_db = dbm - level_dbm[i]
        if not np.isfinite(apart_db) or (end != 0 and not apart_db * end > 0):
            continue
        variance = variance_db2[i]
        sums[0, r] += 1 / variance
        sums[1, r] += apart_db / variance
        sums[2, r] += apart_db * apart_db / variance
        sums[3, r] += log_variance[i]
