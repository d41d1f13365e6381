"""Arbitrary strength units (ASU) in columns of levels, and levels that have lost their sign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats

LARGEST_ASU = 97
"""Of GSM, UMTS and LTE: 3GPP TS 27.007, +CESQ; units of NR go up to 126, and are not judged."""
LOST_SIGN = "a lost sign (70 for -70 dBm)"
LARGEST_LOSS_DB = 200
UNKNOWN_ASU = (99, 255)
"""Units that mean an unknown level."""
_STRONGEST_DBM = -50
_LEAST_ABOVE, _MOST_BELOW = 0.05, 0.25


@dataclass(slots=True)
class Signs:
    """Counts of levels of a column without their sign, or in ASU, but not of NR.

    Parameters
    ----------
    levels, positive : int
        How many there are, and how many of them are positive.
    above, below : int
        Positive ones too large for an ASU, and those that would be stronger than -50 dBm.
    """

    levels: int = 0
    positive: int = 0
    above: int = 0
    below: int = 0

    def add(self, levels: Floats) -> None:
        """Count levels; NaN is none."""
        self.levels += int(np.count_nonzero(~np.isnan(levels)))
        positive = levels[levels > 0]
        self.positive += positive.size
        self.below += int(np.count_nonzero(positive < -_STRONGEST_DBM))
        above = (positive > LARGEST_ASU) & (positive <= LARGEST_LOSS_DB)
        self.above += int(np.count_nonzero(above & ~np.isin(positive, UNKNOWN_ASU)))

    @property
    def lost(self) -> bool:
        """Whether positive levels are no ASU, but dBm without their sign.

        Some must be too large for an ASU, more than stray values would be, and few so small that
        they were hardly ever received as dBm.

        Examples
        --------
        >>> signs = Signs()
        >>> signs.add(np.array([70.0, 82.0, 95.0, 104.0]))
        >>> signs.lost
        True
        >>> signs.add(np.array([20.0, 31.0, 45.0]))
        >>> signs.lost
        False
        """
        most = self.positive > self.levels / 2
        many = self.above > 0 and self.above >= _LEAST_ABOVE * self.positive
        return most and many and self.below <= _MOST_BELOW * self.positive


def is_above_asu(level: float) -> bool:
    """Return whether a positive level is too large for an ASU, and could be a dBm without sign.

    Examples
    --------
    >>> [is_above_asu(level) for level in (68.0, 99.0, 104.0, 2147483647.0)]
    [False, False, True, False]
    """
    return LARGEST_ASU < level <= LARGEST_LOSS_DB and level not in UNKNOWN_ASU
