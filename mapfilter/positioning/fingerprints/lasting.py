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
from mapfilter.positioning.fingerprints.cross_validation import MOST_VALIDATED, folds_of, left_out
from mapfilter.positioning.fingerprints.locating import ReportLocator
from mapfilter.positioning.fingerprints.reports import Reports

_BIN_S, _LONGEST_S = 2.0, 60.0
_LEAST_PAIRS, _LEAST_BINS = 30, 4
_LEAST_STRETCH = 100
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
    tried = _stretches(database, MOST_VALIDATED)
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
    products, counts, lags = _lag_sums(log, time_s, off_m)
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


class _LagSums(NamedTuple):
    """Sums over pairs of errors, by the time between them: bins of 2 s up to 60 s."""

    products: Floats
    counts: Ints
    lags: Floats


def _lag_sums(log: Ints, time_s: Floats, off_m: Floats) -> _LagSums:
    """Return the sums over all pairs of errors of one log, the later one's times the earlier's.

    One error is paired with the next, then with the one after that, and so on: there is never a
    table of all pairs.
    """
    bins = int(_LONGEST_S / _BIN_S)
    products, counts, lags = np.zeros(bins), np.zeros(bins, np.int64), np.zeros(bins)
    for one in np.unique(log):
        own = np.flatnonzero(log == one)
        own = own[np.argsort(time_s[own], kind="stable")]
        earlier, own_s, own_m = np.arange(len(own) - 1), time_s[own], off_m[own]
        for step in range(1, len(own)):
            # Those farther apart than the bins reach are so with any later reading, too.
            earlier = earlier[earlier + step < len(own)]
            apart_s = own_s[earlier + step] - own_s[earlier]
            near = apart_s < _LONGEST_S
            earlier, apart_s = earlier[near], apart_s[near]
            if not len(earlier):
                break
            pairs = apart_s > 0
            at = (apart_s[pairs] / _BIN_S).astype(np.int64)
            product = np.sum(own_m[earlier[pairs]] * own_m[earlier[pairs] + step], axis=1) / 2
            products += np.bincount(at, product, bins)
            lags += np.bincount(at, apart_s[pairs], bins)
            counts += np.bincount(at, minlength=bins)
    return _LagSums(products, counts, lags)


def _stretches(database: Reports, most: int) -> Ints:
    """Return at most so many reports, of evenly taken logs: of each a stretch from its middle.

    A stretch is an even share of ``most``, but at least 100 reports, so that it holds errors as far
    apart as are compared, or the whole log where that is shorter. Of logs that are too many for
    that only some are taken.
    """
    logs, counts = np.unique(database.block, return_counts=True)
    share = max(most // len(logs), min(_LEAST_STRETCH, most))
    lengths = np.minimum(counts, share)
    total = int(lengths.sum())
    places = np.arange(len(logs))
    taken = np.unique(places * min(most, total) // total, return_index=True)[1]
    taken = taken[np.cumsum(lengths[taken]) <= most]
    stretches = []
    for one in logs[taken].tolist():
        own = np.flatnonzero(database.block == one)
        own = own[np.argsort(database.time_s[own], kind="stable")]
        first = max(len(own) - share, 0) // 2
        stretches.append(own[first : first + share])
    return np.sort(np.concatenate(stretches))
