"""Steps that wait until they make up a leg, or until something is read of the beliefs.

Between two reports nothing but dead reckoning moves a belief. To move thousands of hypotheses by
four steps in one direction takes four times as long as by their sum, which leads to the same
places: lasting errors turn and stretch the sum as they do each step, and white noise adds up. So
steps wait, for the main belief and all beside it, and the position goes on by dead reckoning.
"""

from __future__ import annotations

from math import atan2, cos, hypot, isfinite, radians, sin
from typing import NamedTuple

from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.models.street_lead import mean_lead
from mapfilter.models.street_motion import EAST, NORTH, moved_back
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning

LEG_M = 8.0
"""Largest length of a leg: that of a pixel or two, within which a map tells little."""
_LEAST_COSINE = cos(radians(45.0))
"""Of the largest difference between the directions of a leg and of a step that goes on with it."""


class Leg(NamedTuple):
    """Measured steps in one direction by which beliefs have not been moved yet.

    Parameters
    ----------
    rows : int
        Their number; 0 where none waits.
    way_m, square_m2 : float
        Sum of their lengths, and of the squares of these, each over the measured steps it is of.
    east_m, north_m : float
        Their sum, as measured.
    sampling_m2 : float
        Sum of the variances of their sampling.
    since : DeadReckoning
        Before the first of them, as the main belief reads it.
    first : MotionStep or None
        The first of them.
    """

    rows: int = 0
    way_m: float = 0.0
    square_m2: float = 0.0
    east_m: float = 0.0
    north_m: float = 0.0
    sampling_m2: float = 0.0
    since: DeadReckoning = DeadReckoning()
    first: MotionStep | None = None

    @property
    def is_whole(self) -> bool:
        """Whether another such step would make it too long."""
        return self.rows > 0 and self.way_m * (1 + 1 / self.rows) > LEG_M

    @property
    def equal_rows(self) -> float:
        """Number of equal steps whose noise it has."""
        return self.way_m**2 / self.square_m2

    @property
    def step(self) -> MotionStep:
        """The leg as a step; of one row, that row as it was measured."""
        if self.rows == 1 and self.first is not None:
            return self.first
        length_m, heading_rad = hypot(self.east_m, self.north_m), atan2(self.north_m, self.east_m)
        sampling_sd_m = self.sampling_m2**0.5
        rows = self.equal_rows
        return MotionStep(length_m, heading_rad, sampling_sd_m=sampling_sd_m, rows=rows)

    def joined(self, step: MotionStep, reckoning: DeadReckoning) -> Leg | None:
        """Return the leg with a step behind it; None where that is too long, or turns aside.

        Parameters
        ----------
        step : MotionStep
            One that may wait, see :func:`may_wait`, as measured.
        reckoning : DeadReckoning
            Before the step, as the main belief reads it.

        Examples
        --------
        >>> leg = NO_LEG.joined(MotionStep(3.0, 0.0), DeadReckoning())
        >>> leg = leg.joined(MotionStep(1.0, 0.5), DeadReckoning(3.0, 3.0))
        >>> leg.rows, round(leg.step.step_m, 2), round(leg.step.heading_rad, 2)
        (2, 3.91, 0.12)
        >>> leg.joined(MotionStep(1.0, 2.0), DeadReckoning(4.0)) is None
        True
        """
        length_m, heading_rad = step.step_m, step.heading_rad
        if length_m == 0:
            return self
        east_m, north_m = length_m * cos(heading_rad), length_m * sin(heading_rad)
        square_m2, sampling_m2 = length_m * length_m / step.rows, step.sampling_sd_m**2
        if not self.rows:
            return Leg(1, length_m, square_m2, east_m, north_m, sampling_m2, reckoning, step)
        if self.way_m + length_m > LEG_M:
            return None
        along_m2 = self.east_m * east_m + self.north_m * north_m
        if along_m2 < _LEAST_COSINE * length_m * hypot(self.east_m, self.north_m):
            return None
        return Leg(
            self.rows + 1,
            self.way_m + length_m,
            self.square_m2 + square_m2,
            self.east_m + east_m,
            self.north_m + north_m,
            self.sampling_m2 + sampling_m2,
            self.since,
            self.first,
        )

    def gone_m(self, reckoning: DeadReckoning) -> tuple[float, float]:
        """Return how far it leads, east and north, as the main belief reads it."""
        return reckoning.east_m - self.since.east_m, reckoning.north_m - self.since.north_m


NO_LEG = Leg()


def may_wait(step: MotionStep) -> bool:
    """Return whether a step may be part of a leg: measured, forwards, and with a direction."""
    is_plain = step.turned_sd_rad == 0 and not isfinite(step.spread_m)
    return is_plain and step.step_m >= 0 and isfinite(step.heading_rad)


class Lead(NamedTuple):
    """How a belief's errors turn and stretch dead reckoning in the mean.

    ``along`` and ``aside`` are the parts of a metre that lead in its direction, and to the left.
    """

    along: float
    aside: float

    @classmethod
    def of(cls, state: Floats32, weight: Floats32, mean: Floats) -> Lead:
        """Return that of the hypotheses near a leading one, whose mean state is given."""
        return cls(*mean_lead(state, weight, float(mean[EAST]), float(mean[NORTH]), NEAR_M))

    def led_m(self, gone_m: tuple[float, float]) -> tuple[float, float]:
        """Return a displacement, east and north, as it is in the mean.

        Examples
        --------
        >>> Lead(0.0, 1.0).led_m((2.0, 0.0))
        (0.0, 2.0)
        """
        east_m, north_m = gone_m
        along, aside = self.along, self.aside
        return along * east_m - aside * north_m, aside * east_m + along * north_m


def moved_on(state: Floats32, gone_m: tuple[float, float]) -> Floats32:
    """Return hypotheses moved by what waits, each as its errors turn and stretch it."""
    east_m, north_m = gone_m
    return moved_back(state, -east_m, -north_m)
