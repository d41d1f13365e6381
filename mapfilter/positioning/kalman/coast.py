"""A belief by which fixes may be wrong: it goes on by dead reckoning, and uses only their way.

Fixes that a spoofer leads away still move as one moves, but for the speed by which they are led; so
do those of a receiver that has come back aside. Both are unknown, and components of the state:

    z = p + c u + v,

u the speed by which fixes are led, and c the time since they may have been, or u how far they lie
aside, and c = 1. Turns tell u from errors of headings and lengths, as these turn with the way and u
does not. That fixes are right is u = 0, so the odds of both are those of the densities of u = 0 by
what was known of u before them and after (the Savage-Dickey ratio; Dickey 1971).
"""

from __future__ import annotations

from math import cos, inf, log, sin
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.kalman.lasting import Motion

_TURNED, _SCALE, _OWN = 2, 3, slice(0, 5)
"""Components that are the heading error and the share by which steps are too short, and those of
dead reckoning."""
_BY = slice(5, 7)
"""Components that are u."""
_LED_MPS, _ASIDE_M = 1.0, 60.0
"""Deviation of u along each axis, of fixes that are led and of ones that come back aside: drags are
of some m/s, as receivers lose what jumps (Humphreys 2013)."""
_WALK_MPS_PER_SQRT_S = 0.01
"""Random walk of the speed by which fixes are led."""
_LIMIT = 13.8
"""Squared distance in deviations that one in a thousand fixes exceeds."""
_PLANE = np.eye(2)


class Coast(NamedTuple):
    """A belief by which fixes may be wrong.

    Parameters
    ----------
    begun_s : float
    mean, covariance : (7,) and (7, 7) array
        In the layout of dead reckoning, and u.
    place_m2 : (2, 2) array
        Covariance of its position when it began.
    times : float
        By which fixes were known to understate their variances then.
    from_m, fix_m : (2,) array
        Its position, and the fix, when it began.
    is_aside : bool
        Whether fixes may have come back aside when it began, and not be led since then.
    heard_s : float
        Time of the last fix whose way is in it; minus infinity before the first.
    """

    begun_s: float
    mean: Floats
    covariance: Floats
    place_m2: Floats
    times: float
    from_m: Floats
    fix_m: Floats
    is_aside: bool = False
    heard_s: float = -inf

    @classmethod
    def of(
        cls,
        time_s: float,
        belief: Gaussian,
        times: float,
        fix_m: Floats,
        *,
        is_aside: bool = False,
    ) -> Coast:
        """Return one that begins as a belief, at a fix."""
        mean, covariance = np.zeros(_BY.stop), np.zeros((_BY.stop, _BY.stop))
        mean[_OWN], covariance[_OWN, _OWN] = belief.mean, belief.covariance
        covariance[_BY, _BY] = (_ASIDE_M if is_aside else _LED_MPS) ** 2 * _PLANE
        place_m2 = belief.covariance[:2, :2]
        return cls(time_s, mean, covariance, place_m2, times, mean[:2], fix_m, is_aside)

    @property
    def heading_rad2(self) -> float:
        """Variance of the heading error."""
        return float(self.covariance[_TURNED, _TURNED])

    def moved(self, motion: Motion, about: Floats) -> Coast:
        """Return it after motion that is linear about another mean.

        Where headings seem to have jumped that one may be far: the way is turned and drawn out.
        """
        transition, noise, shift = (_wide(one) for one in motion)
        about = _wide(about)
        transition[_BY, _BY] = _PLANE
        after, other = transition @ self.mean + shift, transition @ about + shift
        by_rad, longer = (
            after[_TURNED] - other[_TURNED],
            (1 + self.mean[_SCALE]) / (1 + about[_SCALE]),
        )
        east, north = longer * cos(by_rad), longer * sin(by_rad)
        turned = np.eye(self.mean.size)
        turned[:2, :2] = [[east, -north], [north, east]]
        after[:2] = self.mean[:2] + turned[:2, :2] @ (other - about)[:2]
        own = transition.copy()
        own[:2, 2:] = turned[:2, :2] @ transition[:2, 2:]
        covariance = own @ self.covariance @ own.T + turned @ noise @ turned.T
        return self._replace(mean=after, covariance=covariance)

    def beside(self, place_m: Floats) -> tuple[Floats, Floats]:
        """Return how far the way to a fix is from that of motion, and the covariance of motion."""
        values, axes = np.linalg.eigh(self.covariance[:2, :2] - self.place_m2)
        off_m = (place_m - self.fix_m) - (self.mean[:2] - self.from_m)
        return off_m, axes * np.maximum(values, 0.0) @ axes.T

    def heard(self, time_s: float, place_m: Floats, stated_m2: Floats) -> Coast:
        """Return it after a fix that is led, or lies aside, by as much as it may."""
        covariance, row = self.covariance.copy(), self._row(time_s)
        if not self.is_aside:
            elapsed_s = time_s - max(self.heard_s, self.begun_s)
            covariance[_BY, _BY] += _WALK_MPS_PER_SQRT_S**2 * elapsed_s * _PLANE
        seen = row @ covariance
        gain = np.linalg.solve(seen @ row.T + self.times * stated_m2, seen).T
        mean = self.mean + gain @ (place_m - row @ self.mean)
        covariance -= gain @ seen
        covariance = 0.5 * (covariance + covariance.T)
        return self._replace(mean=mean, covariance=covariance, heard_s=time_s)

    def is_beyond(self, time_s: float, place_m: Floats, stated_m2: Floats) -> bool:
        """Return whether a fix is farther away than one may be led, by what is known of that."""
        row = self._row(time_s)
        off_m = place_m - row @ self.mean
        whole_m2 = row @ self.covariance @ row.T + self.times * stated_m2
        return float(off_m @ np.linalg.solve(whole_m2, off_m)) > _LIMIT

    @property
    def nats(self) -> float:
        """Logarithm of the odds that fixes are wrong, before the prior ones, at the last fix."""
        by, by2 = self.mean[_BY], self.covariance[_BY, _BY]
        first = _ASIDE_M**2
        if not self.is_aside:
            first = _LED_MPS**2 + _WALK_MPS_PER_SQRT_S**2 * max(self.heard_s - self.begun_s, 0.0)
        squared = float(by @ np.linalg.solve(by2, by))
        return 0.5 * squared + 0.5 * log(float(np.linalg.det(by2)) / first**2)

    def _row(self, time_s: float) -> Floats:
        """Return what a fix measures of it."""
        row = np.zeros((2, _BY.stop))
        row[:, :2] = _PLANE
        row[:, _BY] = (1.0 if self.is_aside else time_s - self.begun_s) * _PLANE
        return row

    def off(self, place_m: Floats, stated_m2: Floats) -> tuple[Floats, Floats]:
        """Return how far a fix is from it, and the covariance of that for a right one."""
        return place_m - self.mean[:2], self.covariance[:2, :2] + self.times * stated_m2


def _wide(values: Floats) -> Floats:
    """Return a vector or a matrix of dead reckoning with zeros for u."""
    wide = np.zeros([_BY.stop] * values.ndim)
    wide[(_OWN,) * values.ndim] = values
    return wide
