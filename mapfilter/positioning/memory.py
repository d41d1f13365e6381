"""What is kept from one report to the next: dead reckoning, and the levels heard last."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf, isfinite, nan, sin

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.contract import MotionStep


@dataclass(frozen=True, eq=False)
class Memory:
    """What is kept from one report to the next.

    Parameters
    ----------
    travelled_m, east_m, north_m : float
        By dead reckoning since the start; east and north in the frame of its headings.
    used_at_m : float
        Distance at the last report that was used; minus infinity before the first.
    back_east_m, back_north_m : float
        Displacement since then.
    level_dbm, heard_at_m : ndarray, shape (C,)
        Level of each cell when it was last heard inside the scale, and the distance then.
    """

    level_dbm: Floats
    heard_at_m: Floats
    travelled_m: float = 0.0
    east_m: float = 0.0
    north_m: float = 0.0
    used_at_m: float = -inf
    back_east_m: float = 0.0
    back_north_m: float = 0.0

    @classmethod
    def empty(cls, cells: int) -> Memory:
        """Return the memory of one who has heard nothing."""
        return cls(np.full(cells, nan), np.full(cells, -inf))

    def moved(self, step: MotionStep) -> Memory:
        """Return the memory after a step."""
        if not isfinite(step.step_m):
            return self
        heading = step.heading_rad if isfinite(step.heading_rad) else 0.0
        east_m, north_m = step.step_m * cos(heading), step.step_m * sin(heading)
        return Memory(
            self.level_dbm,
            self.heard_at_m,
            self.travelled_m + abs(step.step_m),
            self.east_m + east_m,
            self.north_m + north_m,
            self.used_at_m,
            self.back_east_m + east_m,
            self.back_north_m + north_m,
        )
