"""Columns taken for levels that hold another quantity: qualities in dB, such as RSRQ and SNR."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.radio.asu import LARGEST_LOSS_DB, LOST_SIGN
from mapfilter.radio.rxlev import LARGEST_RXLEV

LEVELS_EXPECTED = "levels in dBm, such as RSRP in -140..-44 or RxLev in -110..-47"
TENTHS = "tenths of a dB (-780 for -78 dBm); divide by 10"
"""The likely mistake behind levels far below all that are received."""
QUALITY = "a quality in dB, such as RSRQ (-20 to -3)"

_LEAST_DBM, _LEAST_TENTHS = -200.0, -2000.0
_BEST_DB, _WORST_DB = 0.0, -30.0
_SHARE, _FEWEST = 0.9, 10
_RXLEV, _OFFSET = "raw RXLEV given for dBm", "a strong level plus an offset"


def are_tenths(low: float, high: float) -> bool:
    """Return whether numbers between two, all too low for dBm, are levels in tenths of a dB.

    Examples
    --------
    >>> are_tenths(-1086.0, -694.0), are_tenths(-9999.0, -694.0), are_tenths(-1086.0, 70.0)
    (True, False, False)
    """
    return low >= _LEAST_TENTHS and high < _LEAST_DBM


def likely_of_positive(levels: Floats) -> str:
    """Return the likely mistake behind levels above 0 dBm, by all levels of their column.

    Raw RXLEV are whole numbers in 0..63. Among negative levels positive ones are none, but levels
    to which an offset was added.

    Parameters
    ----------
    levels : (N,) array
        NaN is none.

    Examples
    --------
    >>> likely_of_positive(np.array([20.0, 35.0])), likely_of_positive(np.array([88.0, 71.0]))
    ('raw RXLEV given for dBm', 'a lost sign (70 for -70 dBm)')
    >>> likely_of_positive(np.array([-61.2, 3.8, -70.0]))
    'a strong level plus an offset'
    """
    known = levels[np.isfinite(levels)]
    if not known.size:
        return ""
    least, most = float(known.min()), float(known.max())
    if least >= 0 and most <= LARGEST_RXLEV and (known % 1 == 0).all():
        return _RXLEV
    if least >= -_WORST_DB and most <= LARGEST_LOSS_DB:
        return LOST_SIGN
    return _OFFSET if most < -_WORST_DB else ""


@dataclass(slots=True)
class LevelCounts:
    """Counts of the levels of a column, and of those that only a quality has.

    Parameters
    ----------
    levels, qualities : int
        How many there are, and how many of them are between -30 and 0: levels that no phone and
        hardly a scanner reports.
    low, high : float
        The least and the largest of the latter.
    """

    levels: int = 0
    qualities: int = 0
    low: float = np.inf
    high: float = -np.inf

    def add(self, levels: Floats) -> None:
        """Count levels; NaN is none."""
        self.levels += int(np.count_nonzero(~np.isnan(levels)))
        found = levels[(levels >= _WORST_DB) & (levels < _BEST_DB)]
        self.qualities += found.size
        if found.size:
            self.low = min(self.low, float(found.min()))
            self.high = max(self.high, float(found.max()))

    @property
    def are_qualities(self) -> bool:
        """Whether nearly all are such, of ten or more.

        Examples
        --------
        >>> counts = LevelCounts()
        >>> counts.add(np.linspace(-19.5, -6.0, 28))
        >>> counts.are_qualities, str(counts)
        (True, '28 of 28 values from -19.5 to -6')
        >>> counts.add(np.array([-87.0, -91.0, -99.0, -104.0]))
        >>> counts.are_qualities
        False
        """
        return self.levels >= _FEWEST and self.qualities >= _SHARE * self.levels

    def __str__(self) -> str:
        return f"{self.qualities} of {self.levels} values from {self.low:g} to {self.high:g}"
