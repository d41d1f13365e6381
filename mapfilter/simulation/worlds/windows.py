"""When a fault of a sensor begins and ends."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools

AT_ONCE, TO_THE_END = 0.2, 0.5
"""Shares of the faults that are there from the beginning, and that last to the end."""

_EARLIEST, _LATEST = 0.4, 0.7
_SHORTEST_S, _LONGEST_S = 60.0, 300.0


@dataclass(frozen=True, slots=True)
class Window:
    """Time in which a fault holds: from ``begin_s`` to before ``end_s``.

    Parameters
    ----------
    begin_s, end_s : float
        Seconds of the log; infinite where the fault lasts to the end.
    """

    begin_s: float
    end_s: float = inf

    def holds(self, time_s: ArrayLike) -> Bools:
        """Return at which times the fault holds."""
        at_s = np.asarray(time_s, dtype=np.float64)
        return np.asarray((at_s >= self.begin_s) & (at_s < self.end_s))

    def ended(self, time_s: ArrayLike) -> Bools:
        """Return at which times the fault is over."""
        return np.asarray(np.asarray(time_s, dtype=np.float64) >= self.end_s)


def drawn_window(first_s: float, last_s: float, rng: np.random.Generator) -> Window:
    """Draw when a fault holds in a walk.

    One fault in five is there from the beginning. The others begin when a position is likely to
    have been found, after 40 to 70 % of the walk. Half of all last to the end, the others for 1 to
    5 minutes.

    Parameters
    ----------
    first_s, last_s : float
        Begin and end of the walk.
    """
    at_once, lasting = rng.random(2) < (AT_ONCE, TO_THE_END)
    share, lasts_s = rng.uniform(_EARLIEST, _LATEST), rng.uniform(_SHORTEST_S, _LONGEST_S)
    begin_s = first_s if at_once else first_s + share * (last_s - first_s)
    return Window(float(begin_s), inf if lasting else float(begin_s + lasts_s))
