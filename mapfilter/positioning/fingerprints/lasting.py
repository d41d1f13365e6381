"""How far, and for how long, positions of single reports stay beside the truth, to the same side.

Reports of a way share their errors: the database is wrong at a place, and a body shades the same
transmitters from one scan to the next. A filter that takes positions as fixes has to know that part
of their error (:attr:`mapfilter.positioning.kalman.models.KalmanOptions.fix_lasting_m`). It is
found where the logs of a database are left out in turn: the mean product of two errors of one log,
by the time between them, falls off as ``B² exp(-t / T)``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.positioning.fingerprints.locating import (
    MOST_VALIDATED,
    ReportLocator,
    folds_of,
    left_out,
)
from mapfilter.positioning.fingerprints.reports import Reports

_BIN_S, _LONGEST_S = 2.0, 60.0
_LEAST_PAIRS, _LEAST_BINS = 30, 4
_TIMES_S = np.geomspace(2.0, 200.0, 60)


class LastingError(NamedTuple):
    """The part of positions' errors that lasts.

    Parameters
    ----------
    sd_m : float
        B: deviation along one axis; 0 where none is found.
    memory_s : float
        T: time after which its correlation is 1/e.
    """

    sd_m: float
    memory_s: float


def lasting_error(fitted: ReportLocator) -> LastingError | None:
    """Return the lasting part of the errors of a method, by its database alone.

    Parameters
    ----------
    fitted : ReportLocator
        Its database is of measured reports of several logs.

    Returns
    -------
    LastingError or None
        None where the database has no two logs, or too few reports in a row.
    """
    database = fitted.database
    fold, blocks = folds_of(database)
    if database.predicted or blocks != "logs":
        return None
    tried = _whole_logs(database, MOST_VALIDATED)
    parts = list(left_out(database, fitted.method, fold, tried))
    if not parts:
        return None
    log = np.concatenate([part.reports.block for part in parts])
    time_s = np.concatenate([part.reports.time_s for part in parts])
    off_m = np.concatenate([part.off_m for part in parts])
    return fit_lasting(log, time_s, off_m)


def fit_lasting(log: Ints, time_s: Floats, off_m: Floats) -> LastingError | None:
    """Return the lasting part of errors of positions.

    Parameters
    ----------
    log : (N,) array
        Errors of different logs are not compared.
    time_s : (N,) array
    off_m : (N, 2) array
        Errors east and north.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> lasting, log = np.zeros((2000, 2)), np.repeat(np.arange(20), 100)
    >>> for i in range(1, 2000):
    ...     lasting[i] = 0.9 * lasting[i - 1] + 0.19**0.5 * 5.0 * rng.standard_normal(2)
    >>> found = fit_lasting(log, 2.0 * np.arange(2000), lasting + rng.normal(0, 4, (2000, 2)))
    >>> 4 < found.sd_m < 6, 12 < found.memory_s < 30
    (True, True)
    """
    if not len(log):
        return None
    bins = int(_LONGEST_S / _BIN_S)
    products, counts, lags = np.zeros(bins), np.zeros(bins), np.zeros(bins)
    for one in np.unique(log):
        own = np.flatnonzero(log == one)
        apart_s = time_s[own][:, None] - time_s[own][None, :]
        pairs = (apart_s > 0) & (apart_s < _LONGEST_S)
        at = (apart_s[pairs] / _BIN_S).astype(np.int64)
        product = (off_m[own] @ off_m[own].T / 2)[pairs]
        products += np.bincount(at, product, bins)
        lags += np.bincount(at, apart_s[pairs], bins)
        counts += np.bincount(at, minlength=bins)
    enough = counts >= _LEAST_PAIRS
    if enough.sum() < _LEAST_BINS:
        return None
    weight = counts[enough]
    mean_m2, lag_s = products[enough] / weight, lags[enough] / weight
    shape = np.exp(-lag_s / _TIMES_S[:, None])
    lasting_m2 = np.maximum((weight * shape) @ mean_m2 / np.sum(weight * shape**2, axis=1), 0.0)
    misfit = np.sum(weight * (mean_m2 - lasting_m2[:, None] * shape) ** 2, axis=1)
    best = int(np.argmin(misfit))
    return LastingError(float(np.sqrt(lasting_m2[best])), float(_TIMES_S[best]))


def _whole_logs(database: Reports, most: int) -> Ints:
    """Return the reports of evenly taken logs, until there are so many."""
    names, counts = np.unique(database.block, return_counts=True)
    share = min(1.0, most / int(counts.sum()))
    taken = names[np.unique((np.arange(len(names)) * share).astype(np.int64), return_index=True)[1]]
    return np.flatnonzero(np.isin(database.block, taken))
