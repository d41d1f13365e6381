"""Steps of each row of a step counter, by what it counts."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats

STEPS_PER_S = 5.0
"""More than these nobody walks or runs."""
LATE_S, _JITTER = 10.0, 20.0
"""Counters are read up to so many seconds late; falls of fewer steps are of rows out of order."""
_FALLING = 0.5
_LATEST_S = 300.0
"""Batches come at most so late: what a counter grows by after a longer rest is not of all of it."""
PAUSE_S = 30.0
"""Time without a row after which steps are unknown."""
_OWN_COUNTS = "counted in each row"


def are_own_counts(time_s: Floats, count: Floats) -> bool:
    """Return whether counts are the steps of each row, and not those since some start.

    They fall, and are those of a walk: each, or in the mean where they fall nearly as often as they
    rise, as steps that come in batches do. A counter that begins anew now and then mostly rises.

    Parameters
    ----------
    time_s, count : (N,) array

    Examples
    --------
    >>> are_own_counts(np.arange(6.0), np.array([9.0, 0.0, 0.0, 9.0, 0.0, 0.0]))
    True
    >>> are_own_counts(np.arange(6.0), np.array([8.0, 9.0, 0.0, 1.0, 3.0, 4.0]))
    False
    """
    change = np.diff(count)
    if not (change < 0).any():
        return False
    most = STEPS_PER_S * max(float(np.median(np.diff(time_s))), 1.0)
    batches = np.sum(change < 0) >= _FALLING * np.sum(change > 0)
    return bool(count.max() <= most or (batches and count.mean() <= most))


def counted_steps(time_s: Floats, count: Floats) -> tuple[Floats, Floats, str]:
    """Return different times, the steps of each (NaN where unknown), and what the counts are.

    Parameters
    ----------
    time_s, count : (N,) array
        In the order of times. Of one time counts of each row add up; a counter's last one is taken.

    Examples
    --------
    >>> counted_steps(np.array([0.0, 0.0, 1.0, 1.0]), np.array([1.0, 0.0, 1.0, 0.0]))
    (array([0., 1.]), array([1., 1.]), 'counted in each row')
    """
    is_own = are_own_counts(time_s, count)
    time_s, first = np.unique(time_s, return_index=True)
    if is_own:
        count = np.add.reduceat(count, first)
        change, how = count[1:], _OWN_COUNTS
    else:
        count = count[np.append(first[1:], count.size) - 1]
        # A counter begins anew when a phone is started.
        change, how = np.diff(_without_jitter(count)), "by a counter"
    lasted_s = np.diff(time_s)
    # Phones deliver batches: the steps are those of the time since the last ones.
    most = STEPS_PER_S * np.clip(_since_steps_s(time_s, change), LATE_S, _LATEST_S)
    walkable = (change >= 0) & (change <= most)
    # Where a counter is written only when it grows, a few steps end a long rest.
    paused = (lasted_s > PAUSE_S) & (change > _JITTER)
    steps = np.where(walkable & ~paused, change, np.nan)
    return time_s, np.concatenate([count[:1] if is_own else [0.0], steps]), how


def _since_steps_s(time_s: Floats, change: Floats) -> Floats:
    """Return the time since the last row with steps, else since the first row."""
    stepped = np.where(change != 0, np.arange(1, time_s.size), 0)
    last = np.maximum.accumulate(np.concatenate([[0], stepped]))
    return time_s[1:] - time_s[last[:-1]]


def _without_jitter(count: Floats) -> Floats:
    """Return a counter that grows: small falls are of rows out of order, large ones stay."""
    begins = np.concatenate([[True], np.diff(count) < -_JITTER])
    grown = [np.maximum.accumulate(part) for part in np.split(count, np.flatnonzero(begins)[1:])]
    return np.concatenate(grown)
