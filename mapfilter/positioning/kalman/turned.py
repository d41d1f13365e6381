"""Headings that have jumped, as of a phone that is turned in the hand, found by positions.

A Kalman-type filter follows a heading error that drifts; one of 90° at once it takes for noise, and
lags behind its fixes while it states a small radius. Here the fixes z of the recent way are
compared with where its steps have led, q: turned by δ and drawn out by κ, as complex numbers,

    z = p + a q + e,    a = (1 + κ) exp(iδ),

whose least squares are a linear regression. Over each of the last stretches δ is compared with the
error that the belief had at its beginning; q has what the belief knows of a rate of turns. Where δ
is another one, beyond what both may be off, fixes lie on the way so turned, and the belief has not
followed, it is the heading error from there on: a test of a generalised likelihood ratio over the
time of the jump (Willsky & Jones 1976). Errors of steps and of headings, one by one, are small
beside those of fixes, and left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, isfinite, radians, sin, sqrt
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.kalman.stretches import (
    LEAST_FIX_SD_M,
    LEAST_ROWS,
    Stretches,
    WayFix,
    led_by,
)

_MOST_ROWS, _APART_M = 30, 5.0
"""Fixes that are kept, and the way between two of them."""
_LATE_S = 2.0
"""Time by which a receiver may be late: fixes are off by its way, which a corner would turn."""
_LEAST_TURN_RAD, _FOLLOWED_RAD, _LEAST_NATS = radians(20.0), radians(10.0), 12.0
"""Smallest jump, the difference below which the belief has followed it, and the log-likelihood
ratio at which it is one."""
_LEAST_SD_RAD, _FOUND_RAD = radians(3.0), radians(6.0)
"""Least deviation of an angle, and that from which on it is left to the filter."""


class Turn(NamedTuple):
    """The heading error since a jump, and where that leads; ``sd_m`` is of one axis.

    ``shared_m_rad`` is the covariance of east and of north with the angle. It is new where it is
    not a better one of the same jump.
    """

    turned_rad: float
    sd_rad: float
    east_m: float
    north_m: float
    sd_m: float
    shared_m_rad: tuple[float, float] = (0.0, 0.0)
    is_new: bool = True


class Lasting(NamedTuple):
    """Parts of a fix's error that last for a time; what several share in it counts once.

    Parameters
    ----------
    usual_m, beyond_m : float
        Deviations along one axis: of a usual fix, and of what is known to last beyond that.
    memory_s : float
    """

    usual_m: float
    beyond_m: float
    memory_s: float


@dataclass(frozen=True, slots=True)
class RecentWay:
    """Fixes, and where steps have led by their headings as measured.

    Parameters
    ----------
    east_m, north_m : float
        Where they have led, from anywhere.
    by_rate_rad : float
        What a lasting error of the rate of turns, as the belief has it, has added to headings.
    rows : tuple of WayFix
        The fixes.
    is_turning : bool
        Whether a jump was found whose angle is not known well yet.
    is_led : bool
        Whether the last fix showed a jump but for a way that is drawn out: steps do not tell the
        way of the fixes by any angle.
    """

    east_m: float = 0.0
    north_m: float = 0.0
    by_rate_rad: float = 0.0
    rows: tuple[WayFix, ...] = ()
    is_turning: bool = False
    is_led: bool = False

    def moved(self, step: MotionStep, by_rate_rad: float) -> RecentWay:
        """Add a step, and what a rate of turns adds to headings over its time.

        A step without a length or heading breaks the way off.
        """
        if not self.rows or (step.step_m == 0 and by_rate_rad == 0):
            return self
        if step.step_m != 0 and not (isfinite(step.step_m) and isfinite(step.heading_rad)):
            return RecentWay()
        by_rate_rad += self.by_rate_rad
        east_m, north_m = self.east_m, self.north_m
        if step.step_m != 0:
            east_m += step.step_m * cos(step.heading_rad + by_rate_rad)
            north_m += step.step_m * sin(step.heading_rad + by_rate_rad)
        return RecentWay(east_m, north_m, by_rate_rad, self.rows, self.is_turning)

    def at_fix(
        self,
        time_s: float,
        place: tuple[float, float, float],
        turned: tuple[float, float],
        lasting: Lasting,
    ) -> tuple[RecentWay, Turn | None]:
        """Return it after a fix, and the turn of a jump that the fix has shown.

        What usually lasts does not count until a jump is found: with it that would be half a minute
        later, and false ones as many. It counts for what is known of it then.

        Parameters
        ----------
        time_s : float
        place : (float, float, float)
            East and north of the fix in m, and its variance along one axis.
        turned : (float, float)
            The heading error that the belief has, and its variance.
        lasting : Lasting
            What lasts of its error.
        """
        east_m, north_m, variance_m2 = place
        gone_m = mps = 0.0
        if self.rows:
            last = self.rows[-1]
            gone_m = hypot(self.east_m - last.way_east_m, self.north_m - last.way_north_m)
            if gone_m < _APART_M:
                return replace(self, is_led=False) if self.is_led else self, None
            mps = gone_m / max(time_s - last.time_s, 1e-3)
        stated_m = sqrt(variance_m2)
        variance_m2 = max(variance_m2, LEAST_FIX_SD_M**2) + (_LATE_S * mps) ** 2
        now_rad = turned[0] - self.by_rate_rad
        row = WayFix(
            *(time_s, self.east_m, self.north_m, east_m, north_m, variance_m2),
            *(lasting.usual_m, lasting.beyond_m, now_rad, turned[1], stated_m),
        )
        rows = (*self.rows, row)[-_MOST_ROWS:]
        after = replace(self, rows=rows, is_led=False)
        if len(rows) < LEAST_ROWS:
            return after, None
        given = np.array(rows)
        found = Stretches.of(given, lasting.memory_s)
        turns = np.angle(found.factor)
        off = wrap_rad(turns - [one.turned_rad for one in rows])
        nats = found.nats(off, np.array([one.turned_rad2 for one in rows]))
        shown = (np.abs(off) >= _LEAST_TURN_RAD) & (nats >= _LEAST_NATS) & found.fits
        if not self.is_turning:
            shown &= np.abs(wrap_rad(turns - now_rad)) >= _FOLLOWED_RAD
        if not (shown & ~found.drawn_out).any():
            after = replace(after, is_led=bool(shown.any()))
            # Fixes that all lie on one way as the belief has it leave nothing to be found.
            return replace(after, is_turning=self.is_turning and not found.fits[0]), None
        # A stretch that has shown it may have begun before the jump.
        left_m2 = np.where(
            found.fits & ~found.drawn_out, found.residual_m2 + _followed_m2(given), np.inf
        )
        best = int(np.argmin(left_m2))
        led = led_by(given[best:], complex(self.east_m, self.north_m), lasting.memory_s)
        turned_rad, sd_rad = float(turns[best]), hypot(led.sd_rad, _LEAST_SD_RAD)
        is_found = float(found.sd_rad[best]) <= _FOUND_RAD
        if is_found:
            # What the belief had before is no longer compared with.
            told = {"turned_rad": turned_rad, "turned_rad2": sd_rad**2}
            rows = tuple(one._replace(**told) for one in rows[best:])
        turned_rad = float(wrap_rad(turned_rad + self.by_rate_rad))
        turn = Turn(turned_rad, sd_rad, *led[1:], is_new=not self.is_turning)
        return replace(after, rows=rows, is_turning=not is_found), turn


def _followed_m2(rows: Floats) -> Floats:
    """Return what is left of the fixes before each, as the belief had headings at the first."""
    off = rows[:, 3] + 1j * rows[:, 4] - (rows[0, 3] + 1j * rows[0, 4])
    off -= np.exp(1j * rows[0, 8]) * (rows[:, 1] + 1j * rows[:, 2] - complex(*rows[0, 1:3]))
    sums, squares = np.cumsum(off), np.cumsum(np.abs(off) ** 2)
    left = squares - np.abs(sums) ** 2 / np.arange(1.0, len(rows) + 1)
    return np.concatenate([[0.0], left[:-1]])
