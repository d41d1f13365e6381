"""Levels that are only bounds, as phones show at the ends of their scales (bars, RXLEV)."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats, Ints8, Ints32
from mapfilter.positioning.fingerprints.reports import Reports


class Bounds(NamedTuple):
    """Ends of a scale: weaker and stronger levels are reported as these.

    Parameters
    ----------
    low_dbm, high_dbm : float
        Infinite where the scale does not end.
    """

    low_dbm: float = -inf
    high_dbm: float = inf


OPEN = Bounds()
"""No end."""

_BEYOND = 0.05
"""Most readings beyond the end of a scale, as a share: more, and it is not the end of all."""


def bounds_of(reports: Reports) -> Bounds:
    """Return the narrowest ends of the scales by which reports were made.

    An end counts where at most 5 % of the readings that are no bounds lie beyond it: an odd row
    such as "above -105 dBm" is not the end of a scale. Technologies have scales of their own; where
    the weakest of one is stronger than the strongest of another, the lower end is left open.
    """
    known = np.isfinite(reports.level_dbm)
    level_dbm, censored = reports.level_dbm[known], reports.censored[known]
    plain_dbm = np.sort(level_dbm[censored == 0])
    most = _BEYOND * len(plain_dbm)
    lows, highs = level_dbm[censored < 0], level_dbm[censored > 0]
    low = lows[np.searchsorted(plain_dbm, lows) <= most].max(initial=-inf)
    above = len(plain_dbm) - np.searchsorted(plain_dbm, highs, "right")
    high = highs[above <= most].min(initial=inf)
    return Bounds(float(low) if low < high else -inf, float(high))


def bounded(reports: Reports, bounds: Bounds) -> Reports:
    """Return reports as a scale with these ends would have shown them."""
    level_dbm, censored = reports.level_dbm, reports.censored.copy()
    # Comparisons with missing levels are false.
    under, over = level_dbm < bounds.low_dbm, level_dbm > bounds.high_dbm
    censored[under], censored[over] = -1, 1
    shown_dbm = np.where(under, bounds.low_dbm, np.where(over, bounds.high_dbm, level_dbm))
    return replace(reports, level_dbm=shown_dbm, censored=censored)


def likely(level_dbm: Floats, censored: Ints8 | None, cell: Ints32, usual_dbm: Floats) -> Floats:
    """Return a level for each reading: the usual one of its cell where it is missing or a bound.

    A usual level beyond the bound is taken, the bound itself otherwise.

    Parameters
    ----------
    censored : (N,) array or None
        -1: the level is below, 1: above; None for none.
    usual_dbm : (C,) array
        Of each cell.

    Examples
    --------
    >>> level_dbm, usual_dbm = np.array([np.nan, -85.0, -85.0, -70.0]), np.array([-60.0, -90.0])
    >>> cell, censored = np.array([0, 0, 1, 0]), np.array([0, 1, 1, 0])
    >>> likely(level_dbm, censored, cell, usual_dbm).tolist()
    [-60.0, -60.0, -85.0, -70.0]
    """
    usual = usual_dbm[cell]
    found = np.where(np.isnan(level_dbm), usual, level_dbm)
    if censored is None:
        return found
    found = np.where(censored > 0, np.maximum(found, usual), found)
    return np.asarray(np.where(censored < 0, np.minimum(found, usual), found))
