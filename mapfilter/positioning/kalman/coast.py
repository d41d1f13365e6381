"""A belief that goes on without fixes, by dead reckoning alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.kalman.lasting import Motion


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

    def moved(self, motion: Motion) -> Coast:
        """Return it after motion of dead reckoning."""
        transition, noise, shift = motion
        return self._replace(
            mean=transition @ self.mean + shift,
            covariance=transition @ self.covariance @ transition.T + noise,
        )

    def beside(self, place_m: Floats) -> tuple[Floats, Floats]:
        """Return how far the way to a fix is from that of motion, and the covariance of motion."""
        values, axes = np.linalg.eigh(self.covariance[:2, :2] - self.place_m2)
        off_m = (place_m - self.fix_m) - (self.mean[:2] - self.from_m)
        return off_m, axes * np.maximum(values, 0.0) @ axes.T

    def off(self, place_m: Floats, stated_m2: Floats) -> tuple[Floats, Floats]:
        """Return how far a fix is from it, and the covariance of that for a right one."""
        return place_m - self.mean[:2], self.covariance[:2, :2] + self.times * stated_m2
