"""Motion without any direction: speeds or step counts alone, or a compass that has died.

The map filters spread a step without a heading to all sides, each on its own. Of one that is right;
of many, which go the same way mostly, the sum would be a rest with a small radius, and positions
that are all ahead of it would contradict it in the end. So a direction holds for some metres; from
there on, or after a position where there was none, steps are parts of one way, which goes on and
on, and positions that are too near to the last one are left out. A vehicle without any direction
follows the ways of the map instead, leg by leg. It is the same live and in a replay, as only the
past is asked.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite, nan, sqrt
from operator import is_not
from typing import NamedTuple

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import FIX_SD_M, Epoch, GnssFix
from mapfilter.positioning.sensors.unmeasured import headless_step
from mapfilter.positioning.step_output import UnusedReading

APART_SD, APART_M = 2.5, 25.0
"""Way between positions that are used, in deviations of these, at most: fixes nearer to each other
are all ahead of a belief that spreads to all sides from each of them, and contradict it in the
end."""
LEG_M, _NEAR_POSITION_M = 8.0, 200.0
"""Least length of a leg along the ways; way since a position up to which each step is a leg."""
_NEAR_M = 30.0
"""Nearer positions are used if the next one seems to come after a longer way than this."""


_FEW_M = 10.0
"""Way for which the last direction holds: rows of steps are often more than those of a compass."""


class UndirectedWay(NamedTuple):
    """What is known of the directions of steps, and the way without any.

    Parameters
    ----------
    rows : bool
        Whether there was a row of motion.
    directed : bool
        Whether a row had a heading, or one after the first a turn.
    since_m : float
        Way to all sides since the last position that was used, or since directions ended; NaN
        before there is a position or a direction.
    seen_m : float
        The same since the last position that was reported.
    gone_m : float
        Way without directions since the last one; without any, since the first position.
    heading_rad : float
        Of the last row with a direction; NaN where that was a turn.
    is_unmeasured : bool
        Whether some of the way since the last position that was used was not measured.
    waiting_m : float
        Way that waits until it makes a leg along the ways.
    """

    rows: bool = False
    directed: bool = False
    since_m: float = nan
    seen_m: float = 0.0
    gone_m: float = 0.0
    heading_rad: float = nan
    is_unmeasured: bool = False
    waiting_m: float = 0.0

    @property
    def is_blind(self) -> bool:
        """Whether one moves, and nothing but positions and reports tells where to."""
        return self.gone_m > (_FEW_M if self.directed else 0.0)

    def spread(
        self, epoch: Epoch, *, is_measured: bool = True, by_ways: bool = False
    ) -> tuple[UndirectedWay, Epoch, list[UnusedReading]]:
        """Return it after an epoch, and the epoch with steps that are parts of one way.

        A position that is too near to the last one is left out of it, and returned as unused.

        Parameters
        ----------
        epoch : Epoch
        is_measured : bool
            Whether its motion was: without, a position may be far from the last one.
        by_ways : bool
            Whether the belief follows the ways without directions, so that no step is spread and no
            position left out: steps become legs of some metres.
        """
        after, steps, given = self, [], epoch.motion
        if not is_measured and not self.is_unmeasured:
            after = self._replace(is_unmeasured=True)
        ranged = any(isfinite(one.pseudorange_m) for one in epoch.pseudoranges)
        leg_m = inf
        if by_ways:
            # Near positions what waits would be an error of the position.
            near = epoch.gnss is not None or ranged or self.since_m < _NEAR_POSITION_M
            leg_m = 0.0 if near else LEG_M
        for step in given:
            after, one = after._after(step, leg_m)
            steps.append(one)
        if leg_m == 0 and after.waiting_m != 0:
            steps.append(MotionStep(after.waiting_m, nan))
            after = after._replace(waiting_m=0.0)
        if len(steps) > len(given) or any(map(is_not, steps, given)):
            epoch = replace(epoch, motion=tuple(steps))
        if (
            (by_ways and not after.directed)
            or not after.is_blind
            or (epoch.gnss is None and not ranged)
        ):
            return after, epoch, []
        # Who comes as far again until the next one had better take this one.
        next_m, after = after.since_m + after.seen_m, after._replace(seen_m=0.0)
        is_far = after.since_m >= _apart_m(epoch.gnss) or next_m > _NEAR_M
        if is_far or after.is_unmeasured:
            return after, epoch, []
        left = [("gnss", "")] if epoch.gnss is not None else []
        left += [("pseudorange", one.satellite) for one in epoch.pseudoranges]
        unused = [UnusedReading(epoch.time_s, *one, Reason.NOT_MOVED_ENOUGH) for one in left]
        return after, replace(epoch, gnss=None, pseudoranges=()), unused

    def positioned(self) -> UndirectedWay:
        """Return it after a position that was used."""
        if self.since_m == 0 and not self.is_unmeasured:
            return self
        return self._replace(since_m=0.0, is_unmeasured=False)

    def _after(self, step: MotionStep, leg_m: float) -> tuple[UndirectedWay, MotionStep]:
        """Return it after a step, and the step as a part of the way.

        ``leg_m`` is the least length of a leg along the ways; infinite where it is spread.
        """
        turns = isfinite(step.turn_rad)
        # The first row turns by nothing.
        if isfinite(step.heading_rad) or (turns and self.rows):
            if self.waiting_m != 0:
                step = replace(step, step_m=step.step_m + self.waiting_m)
            heading_rad = step.heading_rad
            way = UndirectedWay(rows=True, directed=True, since_m=0.0, heading_rad=heading_rad)
            return way, step
        way_m = abs(step.step_m)
        known = self.directed or turns or isfinite(step.spread_m)
        if isfinite(leg_m) and not known and way_m > 0:
            waiting_m = self.waiting_m + step.step_m
            is_leg = abs(waiting_m) >= leg_m
            after = self._replace(
                rows=True,
                since_m=self.since_m + way_m,
                gone_m=self.gone_m + way_m,
                waiting_m=0.0 if is_leg else waiting_m,
            )
            return after, replace(step, step_m=waiting_m if is_leg else 0.0)
        if turns or not (isfinite(self.since_m) and way_m > 0):
            return self if self.rows else self._replace(rows=True), step
        if self.directed and self.gone_m + way_m <= _FEW_M and not isfinite(step.spread_m):
            # Rows of other times than those of the compass, or a few that it lacks.
            ahead = replace(step, heading_rad=self.heading_rad, turn_rad=0.0)
            return self._replace(gone_m=self.gone_m + way_m), ahead
        if not isfinite(step.spread_m):
            step = headless_step(step.step_m, self.since_m)
        since_m, seen_m, gone_m = self.since_m + way_m, self.seen_m + way_m, self.gone_m + way_m
        after = self._replace(rows=True, since_m=since_m, seen_m=seen_m, gone_m=gone_m)
        return after, step


def _apart_m(fix: GnssFix | None) -> float:
    """Return how long the way to a position has to be since the last one that was used."""
    variance_m2 = nan if fix is None else (fix.var_east_m2 + fix.var_north_m2) / 2
    sd_m = sqrt(variance_m2) if variance_m2 > 0 else FIX_SD_M
    return min(APART_SD * sd_m, APART_M)
