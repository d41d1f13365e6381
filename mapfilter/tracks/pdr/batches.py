"""Counted steps that come late and many at a time, as phones deliver them: spread over the way."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats

_FEWEST, _FASTEST_HZ, _SLOWEST_HZ = 4.0, 3.0, 1.0
"""Steps of a batch, more of them than are walked in its row; and how slowly they are walked."""
_LONG_S, _PART_S = 2.5, 1.0


def spread(time_s: Floats, counted: Floats) -> tuple[Floats, int]:
    """Return the steps of each row, batches spread over the rows without steps before them.

    A batch has more steps than are walked since the row before. They are those of the time since
    the last step, or of the last seconds, at one step per second, where that is shorter.

    Parameters
    ----------
    time_s : (N,) array
        Times that grow.
    counted : (N,) array
        Steps of each row; NaN where unknown.

    Returns
    -------
    counted : (N,) array
        With the same sum.
    batches : int

    Examples
    --------
    >>> spread(np.arange(6.0), np.array([0.0, 2.0, 0.0, 0.0, 0.0, 8.0]))
    (array([0., 2., 2., 2., 2., 2.]), 1)
    """
    lasted_s = np.diff(time_s, prepend=time_s[0])
    many = (counted >= _FEWEST) & (counted > _FASTEST_HZ * lasted_s)
    # A batch is late by rows without a step.
    many[1:] &= counted[:-1] == 0
    many[:1] = False
    batches = np.flatnonzero(many)
    if not batches.size:
        return counted, 0
    found = counted.copy()
    stepped = np.flatnonzero(counted != 0)
    for k in batches.tolist():
        before = int(np.searchsorted(stepped, k)) - 1
        first = int(stepped[before]) if before >= 0 else 0
        begin_s = max(time_s[first], time_s[k] - counted[k] / _SLOWEST_HZ)
        edges_s = np.maximum(time_s[first : k + 1], begin_s)
        found[first + 1 : k + 1] = counted[k] * np.diff(edges_s) / (time_s[k] - begin_s)
    return found, batches.size


def parted(time_s: Floats, counted: Floats, known_s: Floats) -> tuple[Floats, Floats]:
    """Return times and steps with rows of a second in place of long ones with steps.

    Only where directions are known in each of these. After a rest they are those of the last
    seconds, as of :func:`spread`.

    Parameters
    ----------
    time_s, counted : (N,) array
        As of :func:`spread`.
    known_s : (M,) array
        Times of directions, in rising order.

    Examples
    --------
    >>> parted(np.array([0.0, 1.0, 4.0]), np.array([0.0, 2.0, 6.0]), np.arange(5.0))
    (array([0., 1., 2., 3., 4.]), array([0., 2., 2., 2., 2.]))
    """
    lasted_s = np.diff(time_s, prepend=time_s[0])
    times, steps = [time_s], [counted]
    shares = np.ones(len(time_s))
    for k in np.flatnonzero((lasted_s > _LONG_S) & (counted > 0)).tolist():
        begin_s = max(time_s[k - 1], time_s[k] - counted[k] / _SLOWEST_HZ)
        number = int(np.ceil((time_s[k] - begin_s) / _PART_S))
        edges_s = np.linspace(begin_s, time_s[k], number + 1)
        if number > 1 and (np.diff(np.searchsorted(known_s, edges_s, side="right")) > 0).all():
            rests = bool(begin_s > time_s[k - 1])
            times.append(edges_s[0 if rests else 1 : -1])
            part = counted[k] / number
            steps.append(np.array([0.0] * rests + [part] * (number - 1)))
            shares[k] = 1 / number
    steps[0] = counted * shares
    at_s = np.concatenate(times)
    order = np.argsort(at_s, kind="stable")
    return at_s[order], np.concatenate(steps)[order]
