"""Headings that go on beyond a turn, as a gyroscope's rate adds up; and degrees, which jump."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.geodesy import wrap_rad

_MOST_RAD = 63.0
"""Of ten turns to one side."""
_STRAY = 360.0
"""Larger numbers are neither radians nor degrees."""
_LEAST_ROWS = 3
_JUMPS = 0.05


@dataclass(slots=True)
class Winding:
    """Headings in radians of one column, part of a file by part.

    They begin within a turn, and change by at most π from one row to the next where they were
    unwrapped. Degrees jump at corners and at north, or are whole numbers.

    Parameters
    ----------
    last_rad : float
        The last one so far; NaN before the first.
    wound : bool
        Whether all of them so far can be unwrapped radians.
    rows, jumps : int
        How many rows there are beside another one, and how many of them differ by more than π.
    whole : bool
        Whether all are whole numbers.
    """

    last_rad: float = np.nan
    wound: bool = True
    rows: int = 0
    jumps: int = 0
    whole: bool = True

    def unwound(self, heading_rad: Floats, outside: Bools) -> Floats:
        """Return headings in which unwrapped ones that are out of range are wrapped.

        Examples
        --------
        >>> heading = np.array([5.0, 6.1, 7.2])
        >>> Winding().unwound(heading, heading > 6.3).round(3).tolist()
        [5.0, 6.1, 0.917]
        """
        known = heading_rad[np.abs(heading_rad) <= _STRAY]
        if not known.size:
            return heading_rad
        first = np.isnan(self.last_rad)
        change = np.abs(np.diff(known, prepend=known[0] if first else self.last_rad))
        self.wound &= bool((change <= np.pi).all() and np.abs(known).max() <= _MOST_RAD)
        if first:
            self.wound &= bool(abs(known[0]) <= 2 * np.pi)
        self.rows += known.size
        self.jumps += int(np.count_nonzero(change > np.pi))
        self.whole &= bool((known % 1 == 0).all())
        self.last_rad = float(known[-1])
        if not self.wound or self.whole or not outside.any():
            return heading_rad
        wound = outside & (np.abs(heading_rad) <= _MOST_RAD)
        return np.where(wound, wrap_rad(heading_rad), heading_rad)

    @property
    def degrees(self) -> bool:
        """Whether headings out of range can be no radians: they jump, or are whole numbers."""
        jump = self.jumps >= max(_LEAST_ROWS, _JUMPS * self.rows)
        return self.rows >= _LEAST_ROWS and (jump or self.whole)
