"""Directions of rows of steps: the mean of a compass's since the row before."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.tracks.pdr.step_counts import LATE_S, PAUSE_S

NEAR_S = 2.0
"""How far from a row an azimuth may be."""
_TURNED = 0.9


def mean_direction(time_s: Floats, at_s: Floats, azimuth_deg: Floats) -> tuple[Floats, Floats]:
    """Return the mean azimuth of each row (degrees), and the chord of its way over its length.

    The mean is that of the time since the row before, of at most 30 s, or the nearest azimuth
    within 2 s; NaN without one. Where the walker turned, the chord is shorter than the way.

    Parameters
    ----------
    time_s : (N,) array
        Of the rows, in rising order.
    at_s, azimuth_deg : (M,) array
        Of a compass, in any order; NaN where missing.

    Examples
    --------
    >>> mean_direction(np.array([1.0, 2.0, 9.0]), np.array([0.5, 1.5]), np.array([80.0, 90.0]))[0]
    array([80., 90., nan])
    """
    known = np.flatnonzero(np.isfinite(azimuth_deg))
    known = known[np.argsort(at_s[known], kind="stable")]
    at_s, turn = at_s[known], np.radians(azimuth_deg[known])
    if not at_s.size:
        return np.full(len(time_s), np.nan), np.ones(len(time_s))
    sums = np.concatenate([np.zeros((1, 2)), np.cumsum([np.cos(turn), np.sin(turn)], axis=1).T])
    begin_s = np.concatenate([time_s[:1] - NEAR_S, time_s[:-1]])
    lasted_s = time_s - begin_s
    begin_s = np.where(lasted_s > PAUSE_S, time_s - LATE_S, begin_s)
    first, last = (np.searchsorted(at_s, edge_s, side="right") for edge_s in (begin_s, time_s))
    inside = sums[last] - sums[first]
    mean = np.degrees(np.arctan2(inside[:, 1], inside[:, 0]))
    chord = np.hypot(inside[:, 0], inside[:, 1]) / np.maximum(last - first, 1)
    nearest = _nearest(at_s, time_s)
    near = np.abs(at_s[nearest] - time_s) <= NEAR_S
    alone = np.where(near, np.degrees(turn[nearest]), np.nan)
    # Noise of the compass shortens a mean vector, too.
    turned = (last - first > 2) & (chord < _TURNED)
    return np.where(last > first, mean, alone), np.where(turned, chord, 1.0)


def _nearest(known_s: Floats, time_s: Floats) -> Ints:
    after = np.minimum(np.searchsorted(known_s, time_s), len(known_s) - 1)
    before = np.maximum(after - 1, 0)
    is_before = np.abs(known_s[before] - time_s) <= np.abs(known_s[after] - time_s)
    return np.where(is_before, before, after)
