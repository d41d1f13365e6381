"""Intervals of figures over journeys: whole journeys are drawn again, never single epochs.

The epochs of a journey are alike, so that a share over 100 000 epochs of 60 journeys is known as
well as 60 numbers tell. The intervals of shares, means and medians are the percentile bootstrap's
over journeys (Efron & Tibshirani 1993, chapter 13). Where that says nothing, because there are few
journeys, or all have the same share, intervals of known form hold: Wilson's over journeys for
shares, Garwood's (1936) for events that never happened.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaincinv

from mapfilter._types import Floats, Ints
from mapfilter.evaluation.success import wilson_interval_of_routes

LEAST_JOURNEYS = 10
"""With fewer, the interval of a share is Wilson's over journeys."""
LEAST_POOLED = 3
"""With fewer, drawing journeys again says nothing of a median or a mean."""

_DRAWS, _SEED = 2000, 20231
_ENDS = (2.5, 97.5)
Statistic = Literal["mean", "median"]


def ratio_interval(parts: ArrayLike, wholes: ArrayLike) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of ``Σ parts / Σ wholes`` over journeys.

    Parameters
    ----------
    parts, wholes : array_like, shape (journeys,)
        Of each journey, such as metres and epochs.

    Returns
    -------
    low, high : float
        NaN without two journeys whose whole is above zero.

    Examples
    --------
    >>> low, high = ratio_interval([10, 0, 5, 9] * 5, [10, 10, 10, 10] * 5)
    >>> low < 0.6 < high
    True
    """
    of = np.asarray(wholes, dtype=np.float64)
    known = of > 0
    part, whole = np.asarray(parts, dtype=np.float64)[known], of[known]
    if part.size < 2:
        return float("nan"), float("nan")
    drawn = _drawn(part.size)
    low, high = np.percentile(part[drawn].sum(axis=1) / whole[drawn].sum(axis=1), _ENDS)
    return float(low), float(high)


def share_interval(parts: ArrayLike, wholes: ArrayLike) -> tuple[float, float]:
    """Return the 95 % interval of a share over journeys, which lies in 0..1.

    Wilson's over journeys (:func:`mapfilter.evaluation.success.wilson_interval_of_routes`) where
    there are fewer than ten journeys, or all have a share of 0, or all of 1.

    Parameters
    ----------
    parts, wholes : array_like of int, shape (journeys,)
        Of each journey: epochs that count, and all epochs. Journeys without any are left out.

    Returns
    -------
    low, high : float
        0 and 1 without any epoch, NaN for a single journey.
    """
    part, whole = np.asarray(parts, dtype=np.float64), np.asarray(wholes, dtype=np.float64)
    part, whole = part[whole > 0], whole[whole > 0]
    if not whole.size:
        return 0.0, 1.0
    if whole.size < LEAST_JOURNEYS or part.sum() in (0.0, whole.sum()):
        return wilson_interval_of_routes(part, whole)
    return ratio_interval(part, whole)


def rate_interval(events: ArrayLike, km: ArrayLike) -> tuple[float, float]:
    """Return the 95 % interval of events per kilometre over journeys.

    Parameters
    ----------
    events, km : array_like, shape (journeys,)

    Returns
    -------
    low, high : float
        With no event at all, 0 and Garwood's bound, 3.7 divided by all kilometres.

    Examples
    --------
    >>> low, high = rate_interval([0, 0, 0], [10.0, 10.0, 10.0])
    >>> low, round(high, 3)
    (0.0, 0.123)
    """
    count, length = np.asarray(events, dtype=np.float64), np.asarray(km, dtype=np.float64)
    if not length.sum() > 0:
        return 0.0, float("inf")
    if count.size < LEAST_JOURNEYS or not count.any():
        return _garwood(float(count.sum()), float(length.sum()))
    return ratio_interval(count, length)


def statistic_interval(values: ArrayLike, statistic: Statistic = "mean") -> tuple[float, float]:
    """Return the 95 % bootstrap interval of a mean or a median; NaN below two values.

    Examples
    --------
    >>> low, high = statistic_interval([1.0, 2.0, 3.0, 4.0, 10.0])
    >>> low < 4.0 < high
    True
    """
    given = np.asarray(values, dtype=np.float64)
    if given.size < 2:
        return float("nan"), float("nan")
    drawn = given[_drawn(given.size)]
    found: Floats = drawn.mean(axis=1) if statistic == "mean" else np.median(drawn, axis=1)
    low, high = np.percentile(found, _ENDS)
    return float(low), float(high)


def pooled_interval(
    groups: Sequence[ArrayLike], statistic: Statistic = "median"
) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of a mean or median of all values of some journeys.

    Journeys are drawn again with all of their values. Of three to ten journeys the interval is too
    narrow, as few others were seen.

    Parameters
    ----------
    groups : sequence of array_like
        Values of each journey; journeys without any are left out. Infinite ones are allowed for
        the median.

    Returns
    -------
    low, high : float
        NaN below three journeys with values.

    Examples
    --------
    >>> low, high = pooled_interval([[1.0, 2.0], [2.0, 3.0], [4.0, 9.0], [5.0, 5.0]])
    >>> low < 3.5 < high
    True
    """
    filled = [np.asarray(one, dtype=np.float64) for one in groups if np.size(one)]
    if len(filled) < LEAST_POOLED:
        return float("nan"), float("nan")
    sizes = np.array([one.size for one in filled])
    values = np.concatenate(filled)
    order = np.argsort(values, kind="stable")
    ascending, of = values[order], np.repeat(np.arange(sizes.size), sizes)[order]
    sums = np.array([one.sum() for one in filled])
    found = np.empty(_DRAWS)
    for number, drawn in enumerate(_drawn(sizes.size)):
        times = np.bincount(drawn, minlength=sizes.size)
        if statistic == "mean":
            found[number] = times @ sums / (times @ sizes)
        else:
            reached = np.cumsum(times[of])
            middle = np.array([(reached[-1] - 1) // 2, reached[-1] // 2])
            found[number] = ascending[np.searchsorted(reached, middle, side="right")].mean()
    low, high = _ENDS
    # Between a finite and an infinite value there is no interpolation.
    return (
        float(np.percentile(found, low, method="lower")),
        float(np.percentile(found, high, method="higher")),
    )


def _drawn(count: int) -> Ints:
    """Return which journeys are drawn, the same at each call."""
    return np.random.default_rng(_SEED).integers(0, count, (_DRAWS, count))


def _garwood(events: float, km: float) -> tuple[float, float]:
    # Quantiles of chi square, halved; scipy.stats takes half a second to import.
    low = gammaincinv(events, 0.025) if events else 0.0
    return float(low / km), float(gammaincinv(events + 1, 0.975) / km)
