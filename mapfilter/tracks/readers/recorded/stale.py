"""Readings that a program repeats without measuring again."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.tracks.joining.position_units import metres_about_middle

_LONG_S = 30.0
_LEAST_ROWS = 3
_FAR_M = 50.0


def repeated_readings(state: Ints, time_s: Floats, lat_deg: Floats, lon_deg: Floats) -> Bools:
    """Return the rows that repeat a reading for long while the position moves on.

    A run of equal readings of more than 30 s, over more than 50 m, counts; its first row is a
    reading, the others are repetitions.

    Parameters
    ----------
    state : (N,) array of int
        Equal numbers where all that was measured is equal.
    time_s, lat_deg, lon_deg : (N,) array
        NaN where missing.

    Examples
    --------
    >>> lat_deg, lon_deg = 50.0 + np.arange(4) / 2000, np.full(4, 8.0)
    >>> state = np.zeros(4, dtype=np.int64)
    >>> repeated_readings(state, np.array([0.0, np.nan, 2.0, 31.0]), lat_deg, lon_deg).tolist()
    [False, True, True, True]
    >>> repeated_readings(state, np.array([0.0, np.nan, 2.0, 3.0]), lat_deg, lon_deg).tolist()
    [False, False, False, False]
    """
    repeated = np.zeros(len(state), dtype=bool)
    if not len(state):
        return repeated
    edges = np.concatenate([[0], np.flatnonzero(np.diff(state)) + 1, [len(state)]])
    long = np.diff(edges) >= _LEAST_ROWS
    for first, last in np.stack([edges[:-1], edges[1:]], axis=1)[long].tolist():
        rows = slice(first, last)
        lat, lon = lat_deg[rows], lon_deg[rows]
        known = np.isfinite(lat) & np.isfinite(lon)
        timed_s = time_s[rows][np.isfinite(time_s[rows])]
        if not known.any() or not timed_s.size or np.ptp(timed_s) <= _LONG_S:
            continue
        east_m, north_m = metres_about_middle(lon[known], lat[known])
        if np.hypot(np.ptp(east_m), np.ptp(north_m)) > _FAR_M:
            repeated[first + 1 : last] = True
    return repeated
