"""Dead reckoning since a start, and the path of the last metres."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import atan2, ceil, cos, isfinite, pi, radians, sin

import numpy as np

from mapfilter._types import Floats32
from mapfilter.angles import wrap_one_rad
from mapfilter.filters.contract import MotionStep

LEG_M = 5.0
"""Distance between two points of a path."""
PATH_M = 50.0
"""Length of a path that a belief starts with."""
_BEND_RAD = radians(3.0)
_LEAST_TURNED_RAD = 1.5 * pi
"""A leg that bends by less is straight; so much turning, as of three right angles, makes a path
distinctive."""

_AWAY_M = 10.0
"""Way for which steps without a heading lead to one side."""


def _spread_m2(step: MotionStep) -> float:
    """Return the mean square by which a step without a heading adds to those before."""
    length_m = abs(step.step_m)
    return step.spread_m**2 if isfinite(step.spread_m) else length_m * max(length_m, _AWAY_M)


@dataclass(frozen=True, slots=True)
class DeadReckoning:
    """Distance and displacement since the start, in the frame of the headings.

    ``sampling_m2`` is the sum of the variances that steps have by their sampling, or as they lead
    to all sides, ``gaps`` how often the direction or the length of a way was not measured.
    """

    travelled_m: float = 0.0
    east_m: float = 0.0
    north_m: float = 0.0
    sampling_m2: float = 0.0
    gaps: int = 0

    def moved(self, step: MotionStep) -> DeadReckoning:
        """Add a step; without a heading the displacement stays, at rest all of it."""
        if step.step_m == 0 and not isfinite(step.spread_m):
            return self
        if not isfinite(step.step_m):
            return replace(self, gaps=self.gaps + 1)
        if not isfinite(step.heading_rad):
            return replace(
                self,
                travelled_m=self.travelled_m + abs(step.step_m),
                sampling_m2=self.sampling_m2 + _spread_m2(step) / 2,
                gaps=self.gaps + 1,
            )
        heading, sampling_m2 = step.heading_rad, self.sampling_m2 + step.sampling_sd_m**2
        return DeadReckoning(
            self.travelled_m + abs(step.step_m),
            self.east_m + step.step_m * cos(heading),
            self.north_m + step.step_m * sin(heading),
            sampling_m2,
            self.gaps,
        )


@dataclass(frozen=True, slots=True)
class RecentPath:
    """The last metres by dead reckoning, in the frame of its headings.

    Parameters
    ----------
    here : DeadReckoning
        Since the path began.
    points : tuple of DeadReckoning
        Oldest first, one leg apart.
    turned_rad : float
        Sum of all bends between legs since the path began.
    """

    here: DeadReckoning = field(default_factory=DeadReckoning)
    points: tuple[DeadReckoning, ...] = (DeadReckoning(),)
    turned_rad: float = 0.0

    def moved(self, step: MotionStep) -> RecentPath:
        """Add a step; one without a length or heading ends the path, and another begins."""
        if step.step_m == 0:
            return self
        if not (isfinite(step.step_m) and isfinite(step.heading_rad)):
            return RecentPath()
        here = self.here.moved(step)
        if here.travelled_m - self.points[-1].travelled_m < LEG_M:
            return replace(self, here=here)
        bend_rad = _bend_rad(self.points[-2], self.points[-1], here) if len(self.points) > 1 else 0
        points = (*self.points, here)[-ceil(PATH_M / LEG_M) - 1 :]
        return RecentPath(here, points, self.turned_rad + max(bend_rad - _BEND_RAD, 0.0))

    @property
    def whole(self) -> bool:
        """Whether it is long enough for a belief to start with."""
        return self.here.travelled_m - self.points[0].travelled_m >= PATH_M

    @property
    def is_distinctive(self) -> bool:
        """Whether it has turned so much that the map alone can tell where it lies.

        A long straight, or the wide curves of a motorway, fit many roads and the gaps of a map.
        """
        return self.turned_rad >= _LEAST_TURNED_RAD

    @property
    def mirrored(self) -> RecentPath:
        """The same path with left and right exchanged."""
        points = tuple(replace(point, north_m=-point.north_m) for point in self.points)
        return replace(self, here=replace(self.here, north_m=-self.here.north_m), points=points)

    @property
    def earlier_m(self) -> Floats32:
        """East and north of the points relative to the end, shape (K, 2)."""
        here = self.here
        return np.array(
            [(point.east_m - here.east_m, point.north_m - here.north_m) for point in self.points],
            dtype=np.float32,
        )


def _bend_rad(first: DeadReckoning, middle: DeadReckoning, last: DeadReckoning) -> float:
    """Return the angle between two legs."""
    before = atan2(middle.north_m - first.north_m, middle.east_m - first.east_m)
    after = atan2(last.north_m - middle.north_m, last.east_m - middle.east_m)
    return abs(wrap_one_rad(after - before))
