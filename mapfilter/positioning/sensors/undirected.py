"""Motion of which no direction is known at all: speeds or step counts alone.

The map filters spread a step without a heading to all sides, each on its own. Of one that is right;
of many, which go the same way mostly, the sum would be a rest with a small radius, and positions
that are all ahead of it would contradict it in the end. So where no row has had a direction, steps
after a position are parts of one way, which goes on and on, and positions that are too near to the
last one are left out. It is the same live and in a replay, as only the past is asked.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, nan, sqrt
from typing import NamedTuple

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.positioning.sensors.unmeasured import headless_step

APART_SD, APART_M, _FIX_SD_M = 2.5, 25.0, 10.0
"""Way between positions that are used, in deviations of these, at most, and the deviation of those
that state none: fixes nearer to each other are all ahead of a belief that spreads to all sides from
each of them, and contradict it in the end."""
_NEAR_M = 30.0
"""Nearer positions are used if the next one seems to come after a longer way than this."""


class UndirectedWay(NamedTuple):
    """What is known of the directions of steps, and the way since a position.

    Parameters
    ----------
    rows : bool
        Whether there was a row of motion.
    directed : bool
        Whether a row had a heading, or one after the first a turn.
    since_m : float
        Way since the last position that was used; NaN before there is one.
    seen_m : float
        Way since the last position that was reported.
    gone_m : float
        Way without directions since the first position.
    """

    rows: bool = False
    directed: bool = False
    since_m: float = nan
    seen_m: float = 0.0
    gone_m: float = 0.0

    @property
    def is_blind(self) -> bool:
        """Whether one moves, and nothing but positions and reports tells where to."""
        return self.gone_m > 0 and not self.directed

    def spread(self, epoch: Epoch) -> tuple[UndirectedWay, Epoch, list[UnusedReading]]:
        """Return it after an epoch, and the epoch with steps that are parts of one way.

        A position that is too near to the last one is left out of it, and returned as unused.
        """
        if self.directed:
            return self, epoch, []
        after, steps = self, []
        for step in epoch.motion:
            after, one = after._after(step)
            steps.append(one)
        if not after.directed and after.gone_m > self.gone_m:
            epoch = replace(epoch, motion=tuple(steps))
        elif after.directed:
            return after, epoch, []
        ranged = any(isfinite(one.range_m) for one in epoch.ranges)
        if not after.gone_m or (epoch.fix is None and not ranged):
            return after, epoch, []
        # Who comes as far again until the next one had better take this one.
        next_m, after = after.since_m + after.seen_m, after._replace(seen_m=0.0)
        if after.since_m >= _apart_m(epoch.fix) or next_m > _NEAR_M:
            return after, epoch, []
        left = [("gnss", "")] if epoch.fix is not None else []
        left += [("pseudorange", one.satellite) for one in epoch.ranges]
        unused = [UnusedReading(epoch.time_s, *one, Reason.NOT_MOVED_ENOUGH) for one in left]
        return after, replace(epoch, fix=None, ranges=()), unused

    def positioned(self) -> UndirectedWay:
        """Return it after a position that was used."""
        return self if self.directed else self._replace(since_m=0.0)

    def _after(self, step: MotionStep) -> tuple[UndirectedWay, MotionStep]:
        """Return it after a step, and the step as a part of the way since the last position."""
        turns = isfinite(step.turn_rad)
        # The first row turns by nothing.
        if self.directed or isfinite(step.heading_rad) or (turns and self.rows):
            return UndirectedWay(directed=True), step
        way_m = abs(step.step_m)
        if turns or not (isfinite(self.since_m) and way_m > 0):
            return self._replace(rows=True), step
        if not isfinite(step.spread_m):
            step = headless_step(step.step_m, self.since_m)
        gone = (one + way_m for one in (self.since_m, self.seen_m, self.gone_m))
        return UndirectedWay(True, False, *gone), step


def _apart_m(fix: GnssFix | None) -> float:
    """Return how long the way to a position has to be since the last one that was used."""
    variance_m2 = nan if fix is None else (fix.var_east_m2 + fix.var_north_m2) / 2
    sd_m = sqrt(variance_m2) if variance_m2 > 0 else _FIX_SD_M
    return min(APART_SD * sd_m, APART_M)
