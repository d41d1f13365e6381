"""Headings that have jumped, as of a phone that is turned in the hand, found by positions.

A Kalman-type filter follows a heading error that drifts; one of 90° at once it takes for noise, and
lags behind its fixes while it states a small radius. Here the fixes z of the recent way are
compared with where its steps have led, q: turned by δ and drawn out by κ, as complex numbers,

    z = p + a q + e,    a = (1 + κ) exp(iδ),

whose least squares are a linear regression. Over each of the last stretches δ is compared with the
error that the belief had at its beginning. Where it is another one, beyond what both may be off,
fixes lie on the way so turned, and the belief has not followed, it is the heading error from there
on: a test of a generalised likelihood ratio over the time of the jump (Willsky & Jones 1976).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, isfinite, radians, sin, sqrt
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.contract import MotionStep
from mapfilter.geodesy import wrap_rad

_MOST_ROWS, _LEAST_ROWS, _APART_M = 30, 6, 5.0
"""Fixes that are kept, those of a stretch at least, and the way between two of them."""
FIX_S = 5.0
"""Time in which a walker goes so far."""
_LEAST_FIX_SD_M = 7.5
"""Fixes between houses are off to one side for a while, beyond what they state."""
_LEAST_TURN_RAD, _FOLLOWED_RAD, _LEAST_NATS = radians(20.0), radians(10.0), 12.0
"""Smallest jump, the difference below which the belief has followed it, and the log-likelihood
ratio at which it is one."""
_SHORTEST, _LONGEST, _MOST_MISFIT = 0.7, 1.4, 2.0
"""Lengths of the way by fixes to that by steps between which they are the same way; largest mean
square of what is left of fixes, in their variances."""
_LEAST_SD_RAD = radians(3.0)


class Turn(NamedTuple):
    """The heading error since a jump, and where that leads: deviations are of one axis."""

    turned_rad: float
    sd_rad: float
    east_m: float
    north_m: float
    sd_m: float


@dataclass(frozen=True, slots=True)
class RecentWay:
    """Fixes, and where steps have led by their headings as measured.

    Parameters
    ----------
    east_m, north_m : float
        Where they have led, from anywhere.
    rows : tuple of tuple of float
        The same at fixes, with east and north of each and its variance along one axis, and the
        heading error that the belief had there and its variance.
    """

    east_m: float = 0.0
    north_m: float = 0.0
    rows: tuple[tuple[float, ...], ...] = ()

    def moved(self, step: MotionStep) -> RecentWay:
        """Add a step; one without a length or heading breaks the way off."""
        if not self.rows or step.step_m == 0:
            return self
        if not (isfinite(step.step_m) and isfinite(step.heading_rad)):
            return RecentWay()
        east_m = self.east_m + step.step_m * cos(step.heading_rad)
        north_m = self.north_m + step.step_m * sin(step.heading_rad)
        return replace(self, east_m=east_m, north_m=north_m)

    def at_fix(
        self, east_m: float, north_m: float, sd_m: float, turned_rad: float, turned_sd_rad: float
    ) -> tuple[RecentWay, Turn | None]:
        """Return it after a fix, and the turn of a jump that the fix has shown.

        Parameters
        ----------
        east_m, north_m, sd_m : float
            Of the fix; its deviation along one axis.
        turned_rad, turned_sd_rad : float
            The heading error that the belief has, and its deviation.
        """
        here = self.east_m, self.north_m
        if self.rows and hypot(here[0] - self.rows[-1][0], here[1] - self.rows[-1][1]) < _APART_M:
            return self, None
        variance_m2 = max(sd_m, _LEAST_FIX_SD_M) ** 2
        row = (*here, east_m, north_m, variance_m2, turned_rad, turned_sd_rad**2)
        rows = (*self.rows, row)[-_MOST_ROWS:]
        after = replace(self, rows=rows)
        if len(rows) < _LEAST_ROWS:
            return after, None
        given = np.array(rows)
        found = _Stretches.of(given)
        turned = np.angle(found.factor)
        off = wrap_rad(turned - given[:, 5])
        nats = off**2 / (2 * (found.sd_rad**2 + given[:, 6]))
        shown = (np.abs(off) >= _LEAST_TURN_RAD) & (nats >= _LEAST_NATS) & found.fits
        shown &= np.abs(wrap_rad(turned - turned_rad)) >= _FOLLOWED_RAD
        if not shown.any():
            return after, None
        best = int(np.argmax(np.where(shown, nats, -1.0)))
        size = given.shape[0] - best
        return replace(after, rows=rows[best:]), found.turn(best, complex(*here), size)


class _Stretches(NamedTuple):
    """Regressions of the fixes from each on to the last.

    Parameters
    ----------
    factor : (N,) complex array
        a.
    mean_way, mean_fix : (N,) complex array
    spread_m2 : (N,) array
        Sum of squares of the way about its mean.
    variance_m2 : (N,) array
        Mean variance of fixes.
    fits : (N,) bool array
        Whether the fixes lie on the way.
    """

    factor: np.ndarray
    mean_way: np.ndarray
    mean_fix: np.ndarray
    spread_m2: Floats
    variance_m2: Floats
    fits: np.ndarray

    @classmethod
    def of(cls, rows: Floats) -> _Stretches:
        # About the last fix: sums of squares of coordinates of a country lose digits.
        about = rows[:, :4] - rows[-1, :4]
        way, fix = about[:, 0] + 1j * about[:, 1], about[:, 2] + 1j * about[:, 3]
        count = np.arange(len(rows), 0, -1.0)
        mean_way, mean_fix = _sums(way) / count, _sums(fix) / count
        spread = _sums(np.abs(way) ** 2) - count * np.abs(mean_way) ** 2
        spread = np.maximum(spread, 1e-6)
        both = _sums(np.conj(way) * fix) - count * np.conj(mean_way) * mean_fix
        left = _sums(np.abs(fix) ** 2) - count * np.abs(mean_fix) ** 2 - np.abs(both) ** 2 / spread
        variance = _sums(rows[:, 4]) / count
        factor = both / spread
        fits = (left <= _MOST_MISFIT * variance * np.maximum(2 * count - 4, 1.0)) & (
            count >= _LEAST_ROWS
        )
        fits &= (np.abs(factor) >= _SHORTEST) & (np.abs(factor) <= _LONGEST)
        last = complex(*rows[-1, :2]), complex(*rows[-1, 2:4])
        return cls(factor, mean_way + last[0], mean_fix + last[1], spread, variance, fits)

    @property
    def sd_rad(self) -> Floats:
        """Deviation of the direction of each."""
        size = np.maximum(np.abs(self.factor), _SHORTEST)
        return np.asarray(np.sqrt(self.variance_m2 / self.spread_m2) / size)

    def turn(self, index: int, here: complex, count: int) -> Turn:
        """Return the turn by one of them, and where it leads."""
        off = here - self.mean_way[index]
        place = self.mean_fix[index] + self.factor[index] * off
        share = 1 / count + abs(off) ** 2 / self.spread_m2[index]
        return Turn(
            float(np.angle(self.factor[index])),
            hypot(float(self.sd_rad[index]), _LEAST_SD_RAD),
            float(place.real),
            float(place.imag),
            sqrt(float(self.variance_m2[index] * share)),
        )


def _sums(values: np.ndarray) -> np.ndarray:
    """Return the sum from each value on to the last."""
    return np.cumsum(values[::-1])[::-1]
