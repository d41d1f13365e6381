"""Which cell serves a phone on its way: means of levels, and handover with hysteresis."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools, Floats, Ints


def running_mean_db(level_dbm: Floats, count: int) -> Floats:
    """Return the mean, in dB, of the last ``count`` reports, or of as many as there are.

    Parameters
    ----------
    level_dbm : ndarray, shape (N, cells)
    count : int

    Examples
    --------
    >>> running_mean_db(np.array([[-60.0], [-70.0], [-90.0]]), 2).ravel().tolist()
    [-60.0, -65.0, -80.0]
    """
    total = level_dbm.copy()
    for back in range(1, min(count, len(total))):
        total[back:] += level_dbm[:-back]
    return np.asarray(total / np.minimum(np.arange(len(total)) + 1, count)[:, np.newaxis])


def serving_cells(mean_dbm: Floats, heard: Bools, hysteresis_db: float) -> Ints:
    """Return which cell serves at each report: handover with hysteresis.

    A cell serves until the strongest heard one is more than ``hysteresis_db`` above it, or until
    it is not heard any more; then the strongest takes over (the first of equals).

    Parameters
    ----------
    mean_dbm : ndarray, shape (N, cells)
    heard : ndarray of bool, shape (N, cells)
    hysteresis_db : float

    Returns
    -------
    serving : ndarray of int64, shape (N,)
        Column of the cell, or -1 when none is heard.

    Examples
    --------
    >>> mean_dbm = np.array([[-70.0, -80.0], [-80.0, -77.0], [-80.0, -75.0], [-80.0, -82.0]])
    >>> serving_cells(mean_dbm, np.ones((4, 2), dtype=bool), 4.0).tolist()
    [0, 0, 1, 1]
    """
    audible = np.where(heard, mean_dbm, -np.inf)
    serving = np.full(len(audible), -1, dtype=np.int64)
    if not audible.size:
        return serving
    best = np.argmax(audible, axis=1)
    now = -1
    for i, strongest in enumerate(best):
        lost = now < 0 or not heard[i, now]
        if lost or audible[i, strongest] > audible[i, now] + hysteresis_db:
            now = int(strongest) if heard[i, strongest] else -1
        serving[i] = now
    return serving
