"""How often motion rows come, and how fast one moves: what the rows of a log tell of it.

Speeds are means over time and not over rows: a counter that is read more often than one steps
has rows of zero between, and a step covers the time of these, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, expm1, isfinite, nan
from typing import NamedTuple

from mapfilter._same import EqualByValue
from mapfilter.filters.contract import MotionStep
from mapfilter.tracks.checks.speeds import walkers_unit_m

GAP_INTERVALS = 3.0
"""After so many intervals of the log motion rows are missing."""
_REGULAR, _KNOWN_ROWS = 0.02, 10
"""Intervals of rows at fixed times differ by less than this share; rows by which that is known."""
_REST_MPS = 0.1
"""Speed of a row, in the unit of the steps per second, at or below which it reports a rest."""
_STRIDE_S = 1.6
"""Longest time between two steps of a slow walk; a step after a longer one follows a rest."""
_RECENT_S, _SPEED_S, _SPEED_ROWS = 2.5, 20.0, 30
"""Times in s of the means of the recent and of the usual speed, of rows a second apart or less;
rows by which the latter is known."""
_SLOW_SHARE, _SLOWER_SHARE, WALKERS_MPS = 0.3, 0.5, 2.5
"""A walker, who is no faster than this in m/s in the mean, and slower for some seconds than the
first share of it, may have a counter that misses steps. Below the second one the speed is not
learnt: else a counter that fades out would be followed. Both are readings of the field, chosen on
walks in Helsinki with strolls and with counters that miss steps."""
_LEARNT_SHARE = 0.5
"""Share by which a way that was shown to be slow changes the usual speed."""
_FASTEST_MPS = 9.0
"""Speed of one row that is no walker's in feet either."""
_WALK_MPS = 1.4
_DRIVE_MPS = 7.0
"""Speed that is assumed before one is measured."""


class Going(NamedTuple):
    """What an epoch's motion rows say.

    ``gone_m`` is the length of their steps, in the log's unit; ``measured`` is whether any has one,
    ``moves`` whether it is a walk or drive at the usual pace, and not a rest or far slower, and
    ``slows`` whether that is slow all the same.
    """

    gone_m: float
    measured: bool
    moves: bool
    slows: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Pace(EqualByValue):
    """What is known of a log's motion rows; lengths and speeds are in its unit of steps.

    Parameters
    ----------
    motion_s, stepped_s : float
        Time of the last row, and of the last one with steps; NaN before the first.
    rows : int
        Number of rows.
    interval_s, irregular_s : float
        Mean interval of rows, and the mean deviation from it.
    rests : bool
        Whether a row has reported that the phone stands.
    rested_silently : bool
        Whether rows have ended at a rest, which levels showed, and come again.
    speed_mps, recent_mps : float
        Mean speed while it moves, and that of the last seconds.
    fastest_mps : float
        Largest speed of a row.
    last_mps : float
        Speed of the last row.
    rested_s, at_rest_s : float
        Last interval between two rows of a rest, and the shorter one of the last two; 0 before.
    """

    motion_s: float = nan
    stepped_s: float = nan
    rows: int = 0
    interval_s: float = 0.0
    irregular_s: float = 0.0
    rests: bool = False
    speed_mps: float = _WALK_MPS
    recent_mps: float = _WALK_MPS
    fastest_mps: float = 0.0
    last_mps: float = 0.0
    rested_s: float = 0.0
    at_rest_s: float = 0.0
    rested_silently: bool = False

    @property
    def reports_always(self) -> bool:
        """Whether rows come at rest, too, so that missing ones are no rest."""
        if self.rows < _KNOWN_ROWS:
            return False
        if self.rests or self.rested_silently:
            return self.rests
        return self.irregular_s < _REGULAR * self.interval_s

    @property
    def is_known(self) -> bool:
        """Whether the speed is known: by so many rows, and for so long."""
        return self.rows >= _SPEED_ROWS and self.rows * self.interval_s >= _SPEED_S

    @property
    def other_unit_m(self) -> float:
        """Unit of steps with which the speed is a walker's where it is not in metres; else 1."""
        if not self.is_known or self.fastest_mps > _FASTEST_MPS:
            return 1.0
        return walkers_unit_m(self.speed_mps)

    def read(
        self, time_s: float, motion: tuple[MotionStep, ...], step_unit_m: float
    ) -> tuple[Pace, Going]:
        """Read the motion rows of an epoch, whose steps are in a unit."""
        lengths_m = [abs(step.step_m) for step in motion if isfinite(step.step_m)]
        gone_m, measured, since_s = sum(lengths_m), bool(lengths_m), time_s - self.motion_s
        row_s = self._usual_s(since_s) if isfinite(since_s) else 0.0
        covered_s = self._covered_s(time_s, row_s)
        recent_mps = self.recent_mps
        # A step after a pause covers the usual interval at most.
        step_s = min(row_s, self.interval_s) if self.rows > 1 else row_s
        if not self.reports_always and isfinite(since_s):
            # Where rows are steps, none came in between.
            recent_mps *= exp(-max(since_s - step_s, 0.0) / _RECENT_S)
        if measured and step_s > 0:
            recent_mps += -expm1(-step_s / _RECENT_S) * (gone_m / step_s - recent_mps)
        goes = gone_m > _REST_MPS * row_s
        is_walker = self.is_known and step_unit_m * self.speed_mps <= WALKERS_MPS
        share = recent_mps / self.speed_mps if is_walker else 1.0
        moves = goes and share >= _SLOW_SHARE
        going = Going(gone_m, measured, moves, moves and share < _SLOWER_SHARE)
        if not motion:
            return self, going
        interval_s, irregular_s, speed_mps = self.interval_s, self.irregular_s, self.speed_mps
        if isfinite(since_s) and since_s > 0:
            new = 1 / min(self.rows, 20)
            # What a gap says of the usual interval is bounded.
            lasted_s = min(since_s, 5 * interval_s) if self.rows > _KNOWN_ROWS else since_s
            interval_s += new * (lasted_s - interval_s)
            irregular_s += new * (abs(lasted_s - interval_s) - irregular_s)
            if goes and share >= _SLOWER_SHARE:
                # By time: of two rows at almost the same one, the speed would be any.
                lasted_s = max(lasted_s, covered_s) if covered_s > row_s else lasted_s
                speed_mps += (gone_m - speed_mps * lasted_s) / (_SPEED_S * max(interval_s, 1.0))
        row_mps = self._row_mps(gone_m, since_s, covered_s)
        rested_s, at_rest_s = self.rested_s, self.at_rest_s
        if measured and not goes and self.motion_s != self.stepped_s and since_s > 0:
            rested_s, at_rest_s = since_s, min(since_s, rested_s)
        pace = Pace(
            time_s,
            time_s if goes else self.stepped_s,
            self.rows + 1,
            interval_s,
            irregular_s,
            self.rests or (measured and not goes),
            speed_mps,
            recent_mps,
            max(self.fastest_mps, row_mps),
            row_mps,
            rested_s,
            at_rest_s,
            self.rested_silently,
        )
        return pace, going

    def braked_mps2(self, time_s: float) -> float:
        """Return how a vehicle has braked that rests at a time; 0 from a walker's speed."""
        lasted_s = max(time_s - self.motion_s, self.interval_s)
        return self.last_mps / lasted_s if self.last_mps > WALKERS_MPS and lasted_s > 0 else 0.0

    def slowed(self, strolled_mps: float) -> Pace:
        """Return the pace after a way that was shown to be slow, at a speed."""
        slower_mps = self.speed_mps + _LEARNT_SHARE * (strolled_mps - self.speed_mps)
        return replace(self, speed_mps=slower_mps)

    def silent(self) -> Pace:
        """Return the pace of rows that do not come at rest, unless one has reported a rest."""
        return replace(self, rested_silently=True)

    def _usual_s(self, since_s: float) -> float:
        """Return the time that a row covers: after a rest without rows only the usual interval."""
        return min(since_s, GAP_INTERVALS * self.interval_s) if self.rows > 1 else since_s

    def _covered_s(self, time_s: float, row_s: float) -> float:
        """Return the time of a row's steps: since the ones before, of a walk."""
        since_s = time_s - self.stepped_s
        return since_s if row_s < since_s <= _STRIDE_S else row_s

    def _row_mps(self, gone_m: float, since_s: float, covered_s: float) -> float:
        """Return the speed of an epoch's rows; soon after others, over the usual interval."""
        lasted_s = max(since_s, self.interval_s, covered_s)
        return gone_m / lasted_s if self.rows > 1 and lasted_s > 0 else 0.0


DRIVEN = Pace(speed_mps=_DRIVE_MPS, recent_mps=_DRIVE_MPS)
"""The pace of a vehicle of which no motion was reported yet."""
