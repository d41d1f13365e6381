"""Positions while steps are fewer than usual: whether the phone is carried on, and how fast.

One cannot get farther than the steps between two positions are long. Where positions that were
measured lie farther apart than that, beyond their errors, and go on from one to the next, a counter
stands still or misses steps. A single jump is none: receivers make these at rest, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import hypot, inf, isfinite, nan, sqrt
from typing import NamedTuple

from mapfilter.positioning.epochs import FIX_SD_M, GnssFix

_APART_S, _LASTS_S = 2.0, 60.0
"""Least time between two positions that are kept, and for how long they are."""
_DEVIATIONS, _LEAST_SD_M = 4.0, 5.0
"""Deviations of the distance of two positions beyond which it is one; the least deviation of a
position, whose errors last."""
_LEAST_INTERVALS, _LEAST_S = 4, 8.0
"""The least that shows a way: intervals between positions, and time."""
_STANDS_S, _SLOWEST_MPS = 40.0, 1.0
"""Time after which positions near each other show that one stands, and the speed of a way that
leaves their errors by then."""
_MOST_OF_ONE, _LEAST_OF_HALVES = 0.5, 0.3
"""Largest share of one interval in the way; least share by which the middles of both halves are
apart, which for a steady one is a half."""


class Place(NamedTuple):
    """A measured position, and the length of the steps until then."""

    time_s: float
    way_m: float
    east_m: float
    north_m: float
    sd_m: float


class Carried(NamedTuple):
    """A way that positions show and steps do not: when it began, and its speed."""

    since_s: float
    speed_mps: float


@dataclass(frozen=True, slots=True)
class Places:
    """Positions since steps became fewer than usual, oldest first.

    ``way_m`` is the length of the steps since then.
    """

    rows: tuple[Place, ...] = ()
    way_m: float = 0.0

    def after(self, time_s: float, fix: GnssFix | None, gone_m: float) -> Places:
        """Return them after steps of a length and, with a new position, that one."""
        way_m = self.way_m + gone_m
        rows = self.rows
        if fix is None or not (isfinite(fix.east_m) and isfinite(fix.north_m)):
            return self if gone_m == 0 else Places(rows, way_m)
        if rows:
            last = rows[-1]
            # A receiver that holds its position has measured it once.
            held = (fix.east_m, fix.north_m) == (last.east_m, last.north_m)
            if held or time_s - last.time_s < _APART_S:
                return self if gone_m == 0 else Places(rows, way_m)
            rows = tuple(row for row in rows if time_s - row.time_s <= _LASTS_S)
        return Places((*rows, _place(time_s, way_m, fix)), way_m)

    def are_left_by(self, fix: GnssFix | None) -> bool:
        """Return whether a position lies farther from one of them than their errors."""
        if fix is None or not self.rows:
            return False
        place = _place(nan, self.way_m, fix)
        return any(_apart_m(row, place) >= _error_m(row, place) for row in self.rows)

    @property
    def standing(self) -> Places | None:
        """The last of them where they show that one stands: near each other, as on no way."""
        for first in range(len(self.rows) - 2, -1, -1):
            start, end = self.rows[first], self.rows[-1]
            error_m = _error_m(start, end)
            if _apart_m(start, end) >= error_m:
                return None
            if end.time_s - start.time_s >= max(_STANDS_S, error_m / _SLOWEST_MPS):
                return Places(self.rows[first:], self.way_m)
        return None

    @property
    def carried(self) -> Carried | None:
        """The latest way that they show and steps do not; None if there is none."""
        rows = self.rows
        for first in range(len(rows) - 1 - _LEAST_INTERVALS, -1, -1):
            some = rows[first:]
            start, end = some[0], some[-1]
            lasted_s = end.time_s - start.time_s
            if lasted_s < _LEAST_S:
                continue
            gone_m = _apart_m(start, end)
            missed_m = gone_m - (end.way_m - start.way_m)
            if missed_m >= _error_m(start, end) and _goes_on(some, gone_m):
                return Carried(start.time_s, gone_m / lasted_s)
        return None


def _place(time_s: float, way_m: float, fix: GnssFix) -> Place:
    variance_m2 = (fix.var_east_m2 + fix.var_north_m2) / 2
    sd_m = sqrt(variance_m2) if 0 < variance_m2 < inf else FIX_SD_M
    return Place(time_s, way_m, fix.east_m, fix.north_m, max(sd_m, _LEAST_SD_M))


def _apart_m(one: Place, other: Place) -> float:
    return hypot(other.east_m - one.east_m, other.north_m - one.north_m)


def _error_m(one: Place, other: Place) -> float:
    """Return the distance of two positions that is none of their errors."""
    return _DEVIATIONS * hypot(one.sd_m, other.sd_m)


def _goes_on(rows: tuple[Place, ...], whole_m: float) -> bool:
    """Return whether a way between positions is one, and no jump."""
    most_m = max(_apart_m(row, after) for row, after in pairwise(rows))
    half = len(rows) // 2
    apart_m = hypot(
        sum(row.east_m for row in rows[-half:]) - sum(row.east_m for row in rows[:half]),
        sum(row.north_m for row in rows[-half:]) - sum(row.north_m for row in rows[:half]),
    )
    return most_m <= _MOST_OF_ONE * whole_m and apart_m >= _LEAST_OF_HALVES * half * whole_m
