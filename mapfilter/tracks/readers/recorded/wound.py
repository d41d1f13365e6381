"""Headings that go on beyond a turn, as a gyroscope's rate adds up; and degrees, which jump."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats

TURN_RAD, TURN_DEG = 2 * np.pi, 360.0
CAUSE = "unwrapped headings that begin beyond a turn, or degrees given for radians"
_MOST_TURNS = 10
"""To one side."""
_STRAY = {TURN_RAD: 360.0, TURN_DEG: 360.0 * _MOST_TURNS}
"""Larger numbers are neither radians nor degrees, or no degrees."""
_LEAST_ROWS = 3
_JUMPS = 0.05


@dataclass(slots=True)
class Winding:
    """Headings of one column, part of a file by part.

    They change by at most half a turn from one row to the next where they were unwrapped, and those
    in radians begin within a turn: degrees given for them do not. These jump at corners and at
    north, or are whole numbers.

    Parameters
    ----------
    turn : float
        A turn in their unit: 2π or 360.
    last : float
        The last one so far; NaN before the first.
    wound : bool
        Whether all of them so far can be unwrapped headings.
    rows, jumps : int
        How many rows there are beside another one, and how many of them differ by more than half a
        turn.
    whole : bool
        Whether all are whole numbers.
    """

    turn: float = TURN_RAD
    last: float = np.nan
    wound: bool = True
    rows: int = 0
    jumps: int = 0
    whole: bool = True

    def unwound(self, heading: Floats, outside: Bools) -> Floats:
        """Return headings in which unwrapped ones that are out of range are wrapped.

        Examples
        --------
        >>> heading = np.array([5.0, 6.1, 7.2])
        >>> Winding().unwound(heading, heading > 6.3).round(3).tolist()
        [5.0, 6.1, 0.917]
        >>> heading = np.array([730.5, 715.0, 880.25])
        >>> Winding(TURN_DEG).unwound(heading, heading > 360.0).tolist()
        [10.5, -5.0, 160.25]
        """
        known = heading[np.abs(heading) <= _STRAY[self.turn]]
        if not known.size:
            return heading
        first, most = np.isnan(self.last), _MOST_TURNS * self.turn
        change = np.abs(np.diff(known, prepend=known[0] if first else self.last))
        self.wound &= bool((change <= self.turn / 2).all() and np.abs(known).max() <= most)
        if first and self.turn == TURN_RAD:
            self.wound &= bool(abs(known[0]) <= TURN_RAD)
        self.rows += known.size
        self.jumps += int(np.count_nonzero(change > self.turn / 2))
        self.whole &= bool((known % 1 == 0).all())
        self.last = float(known[-1])
        if not self.wound or self.whole or not outside.any():
            return heading
        wrapped = heading - self.turn * np.round(heading / self.turn)
        return np.where(outside & (np.abs(heading) <= most), wrapped, heading)

    @property
    def doubtful(self) -> bool:
        """Whether headings out of range may be radians: they hardly jump, and are no whole numbers.

        Few rows do not tell.
        """
        jump = self.jumps >= max(_LEAST_ROWS, _JUMPS * self.rows)
        sure = self.rows >= _LEAST_ROWS and (jump or self.whole)
        return self.turn == TURN_RAD and not sure
