"""A belief that goes on without fixes, by dead reckoning alone."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.kalman.lasting import Motion

_TURNED, _SCALE = 2, 3
"""Components that are the heading error and the share by which steps are too short."""


class Coast(NamedTuple):
    """A belief that goes on without fixes.

    Parameters
    ----------
    begun_s : float
    mean, covariance : (n,) and (n, n) array
        In the layout of dead reckoning.
    place_m2 : (2, 2) array
        Covariance of its position when it began.
    times : float
        By which fixes were known to understate their variances then.
    from_m, fix_m : (2,) array
        Its position, and the fix, when it began.
    """

    begun_s: float
    mean: Floats
    covariance: Floats
    place_m2: Floats
    times: float
    from_m: Floats
    fix_m: Floats

    @classmethod
    def of(cls, time_s: float, belief: Gaussian, times: float, fix_m: Floats) -> Coast:
        """Return one that begins as a belief, at a fix."""
        mean, covariance = belief.mean, belief.covariance
        return cls(time_s, mean, covariance, covariance[:2, :2], times, mean[:2], fix_m)

    def moved(self, motion: Motion, about: Floats) -> Coast:
        """Return it after motion that is linear about another mean.

        Where headings seem to have jumped that one may be far: the way is turned and drawn out.
        """
        transition, noise, shift = motion
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

    def off(self, place_m: Floats, stated_m2: Floats) -> tuple[Floats, Floats]:
        """Return how far a fix is from it, and the covariance of that for a right one."""
        return place_m - self.mean[:2], self.covariance[:2, :2] + self.times * stated_m2
