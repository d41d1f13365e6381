"""Headings of motion that has turns only: which way it began is found by positions.

Turns add up to headings from an unknown first one. Two fixes that lie far enough apart tell how the
way between them, as reckoned from its turns, is turned on the ground (the coarse alignment of
inertial navigation); from there on its headings have an error as those of a compass have.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, isfinite, nan, radians, sin, sqrt
from typing import NamedTuple

from mapfilter._same import EqualByValue
from mapfilter.angles import wrap_one_rad
from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import headed

_LEAST_M, _DEVIATIONS = 30.0, 8.0
"""Way between two fixes from which on they tell a direction: in m, and in deviations of a fix."""
_AS_LONG = 0.25
"""Share by which its length may differ from that between the fixes."""
_FORGOTTEN_M = 500.0
"""Way after which another fix is the first one, as where a way has led back."""
_LEAST_SD_RAD, _OPEN_RAD = radians(3.0), radians(30.0)
"""Least deviation of a direction that was found; sum of turns that were not measured after which it
has to be found again."""


class Direction(NamedTuple):
    """What is added to headings that turns add up to, and its deviation."""

    turned_rad: float
    sd_rad: float


@dataclass(frozen=True, slots=True, eq=False)
class Alignment(EqualByValue):
    """Headings by turns, and whether their direction on the ground is known.

    Parameters
    ----------
    heading_rad : float
        Sum of turns; NaN before the first one.
    known : bool
        Whether a direction has been found.
    open_rad2 : float
        Variance of turns that were not measured since then.
    east_m, north_m, way_m : float
        Where the way from the first fix has led by its turns, and its length.
    first : (float, float) or None
        That fix, east and north.
    """

    heading_rad: float = nan
    known: bool = False
    open_rad2: float = 0.0
    east_m: float = 0.0
    north_m: float = 0.0
    way_m: float = 0.0
    first: tuple[float, float] | None = None

    def headed(self, step: MotionStep) -> tuple[Alignment, MotionStep]:
        """Return a step with the heading that turns add up to, where their direction is known."""
        if isfinite(step.heading_rad):
            return Alignment() if isfinite(self.heading_rad) else self, step
        if not isfinite(step.turn_rad):
            return self._unmeasured(step), step
        with_heading, heading_rad = headed(step, self.heading_rad)
        after = replace(self, heading_rad=heading_rad)
        if self.known:
            return after, with_heading
        if not isfinite(step.step_m):
            return replace(after, first=None), step
        return replace(
            after,
            east_m=self.east_m + step.step_m * cos(heading_rad),
            north_m=self.north_m + step.step_m * sin(heading_rad),
            way_m=self.way_m + abs(step.step_m),
        ), step

    def at_fix(
        self, east_m: float, north_m: float, sd_m: float
    ) -> tuple[Alignment, Direction | None]:
        """Return it after a fix with a deviation along one axis, and the direction if found now."""
        if self.known or not isfinite(self.heading_rad):
            return self, None
        if self.first is not None and self.way_m < _FORGOTTEN_M:
            gone_m = hypot(self.east_m, self.north_m)
            if gone_m < max(_LEAST_M, _DEVIATIONS * sd_m):
                return self, None
            east, north = east_m - self.first[0], north_m - self.first[1]
            if abs(hypot(east, north) - gone_m) <= _AS_LONG * gone_m:
                turned_rad = wrap_one_rad(atan2(north, east) - atan2(self.north_m, self.east_m))
                sd_rad = hypot(sqrt(2.0) * sd_m / gone_m, _LEAST_SD_RAD)
                found = Alignment(self.heading_rad, known=True)
                return found, Direction(turned_rad, sd_rad)
        return Alignment(self.heading_rad, first=(east_m, north_m)), None

    def _unmeasured(self, step: MotionStep) -> Alignment:
        """Return it after a step whose turn is not known."""
        if not isfinite(self.heading_rad) or step.step_m == 0:
            return self
        open_rad2 = self.open_rad2 + step.turned_sd_rad**2
        is_open = not self.known or not isfinite(step.spread_m) or open_rad2 > _OPEN_RAD**2
        return Alignment(self.heading_rad) if is_open else replace(self, open_rad2=open_rad2)
