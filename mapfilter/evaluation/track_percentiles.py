"""Percentiles of errors over several tracks, with confidence intervals.

Errors of one track are correlated, so that its epochs are not independent samples: whole tracks are
resampled (Davison & Hinkley, *Bootstrap Methods and their Application*, 1997, section
3.8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.errors import InputError, fail

RESAMPLES = 500
_SEED = 1997


@dataclass(frozen=True, slots=True)
class Percentile:
    """A percentile, or a ratio of two, and its interval.

    Parameters
    ----------
    value : float
        NaN where nothing counts, or so much fails that there is none.
    low, high : float
        95 % interval over tracks; NaN likewise.
    epochs : int
        How many count.
    """

    value: float
    low: float
    high: float
    epochs: int


def percentile_of_tracks(errors_m: Floats, counted: Bools, share: float) -> Percentile:
    """Return the smallest error that a share of the epochs does not exceed.

    Parameters
    ----------
    errors_m : (T, K) array
        By track and epoch; NaN is worse than any error.
    counted : (T, K) array of bool
        Epochs that count.

    Raises
    ------
    InputError
        Shapes differ, or the share is not within 0..1.

    Examples
    --------
    >>> errors = np.arange(1.0, 11.0).reshape(2, 5)
    >>> percentile_of_tracks(errors, errors > 0, 0.9)
    Percentile(value=9.0, low=5.0, high=10.0, epochs=10)
    """
    return _found(_drawn(errors_m, counted, share), counted)


def ratio_of_tracks(one_m: Floats, other_m: Floats, counted: Bools, share: float) -> Percentile:
    """Return the ratio of two percentiles on the same epochs; tracks are drawn for both at once.

    Raises
    ------
    InputError
        As for :func:`percentile_of_tracks`.
    """
    with np.errstate(invalid="ignore"):
        ratio = _drawn(one_m, counted, share) / _drawn(other_m, counted, share)
    return _found(ratio, counted)


def _drawn(errors_m: Floats, counted: Bools, share: float) -> Floats:
    """Return the percentile of all tracks, then those of tracks drawn anew; failures infinite."""
    if errors_m.ndim != 2 or errors_m.shape != counted.shape:
        got = f"{errors_m.shape} and {counted.shape}"
        raise fail(InputError, "errors_m", "tracks by epochs, as counted is", got)
    if not 0 < share <= 1:
        raise fail(InputError, "share", "a share in 0..1", share)
    tracks = len(errors_m)
    times = np.ones((1 + RESAMPLES, tracks))
    rng = np.random.default_rng(_SEED)
    times[1:] = rng.multinomial(tracks, np.full(tracks, 1 / tracks), RESAMPLES)
    track = np.nonzero(counted)[0]
    errors = np.where(np.isnan(errors_m), np.inf, errors_m)[counted]
    order = np.argsort(errors, kind="stable")
    errors, track = errors[order], track[order]
    found = np.full(1 + RESAMPLES, np.nan)
    for index, weight in enumerate(times):
        below = np.cumsum(weight[track])
        if below.size and below[-1] > 0:
            at = int(np.searchsorted(below, share * below[-1] - 1e-9))
            found[index] = errors[at]
    return found


def _found(drawn: Floats, counted: Bools) -> Percentile:
    """Return the first one with the interval of the others."""
    known = drawn[1:][~np.isnan(drawn[1:])]
    ends = np.quantile(known, [0.025, 0.975], method="inverted_cdf") if known.size else [np.nan] * 2
    value, low, high = (
        float(one) if np.isfinite(one) else float("nan") for one in (drawn[0], *ends)
    )
    return Percentile(value, low, high, int(counted.sum()))
