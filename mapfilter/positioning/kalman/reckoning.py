"""Dead reckoning of a Kalman-type filter whose state is a position: what steps shift and spread."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, inf, isfinite, radians, sin

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.sensors.unmeasured import headless_step
from mapfilter.positioning.sensors.watch import SensorWatch, watched


@dataclass(frozen=True, slots=True)
class Reckoning:
    """What is known of the sensors, and of ways without headings.

    Parameters
    ----------
    watch : SensorWatch
        Of motion rows and reports.
    headless_m : float
        Way without headings since the last heading or fix.
    fixed_s : float
        Time of the last fix that was used.
    """

    watch: SensorWatch = field(default_factory=SensorWatch)
    headless_m: float = 0.0
    fixed_s: float = -inf

    @property
    def may_have_left(self) -> bool:
        """Whether one may have gone on though no step is counted, since the last fix."""
        rest = self.watch.rest
        return rest is not None and rest.is_doubtful and self.fixed_s < rest.since_s

    def watched(self, epoch: Epoch) -> tuple[Reckoning, Epoch, list[UnusedReading]]:
        """Look at the sensors of an epoch (:func:`mapfilter.positioning.sensors.watch.watched`).

        Returns
        -------
        reckoning : Reckoning
        epoch : Epoch
            With a step to all sides for motion that was not measured, without a stale report.
        unused : list of UnusedReading
            Why that is so.
        """
        time_s, heard = epoch.time_s, epoch.radio
        watch, epoch, (motion, radio) = watched(self.watch, epoch)
        unused = []
        if motion is not Reason.USED:
            unused.append(UnusedReading(time_s, "motion", "", motion))
            # Turns alone say nothing of a position.
            known = tuple(step for step in epoch.motion if isfinite(step.step_m))
            epoch = replace(epoch, motion=known)
        if radio is not Reason.USED:
            unused += [UnusedReading(time_s, row.role, row.name, radio) for row in heard]
        return replace(self, watch=watch), epoch, unused

    def moved(
        self, step: MotionStep, options: KalmanOptions
    ) -> tuple[Reckoning, Floats, Floats, Reason]:
        """Read a step.

        Returns
        -------
        reckoning : Reckoning
        shift_m : (2,) array
            East and north; zero without a heading.
        covariance_m2 : (2, 2) array
            Without a heading that of a way to all sides, which is straight for some time.
        reason : Reason
            ``USED``, ``NO_STEP`` or ``NO_HEADING``.
        """
        if not isfinite(step.step_m):
            return self, np.zeros(2), np.zeros((2, 2)), Reason.NO_STEP
        if not isfinite(step.heading_rad):
            after, why = self, Reason.USED
            if not isfinite(step.spread_m):
                step, why = headless_step(step.step_m, self.headless_m), Reason.NO_HEADING
                after = replace(self, headless_m=self.headless_m + abs(step.step_m))
            return after, np.zeros(2), step.all_sides_m**2 / 2 * np.eye(2), why
        along = np.array([cos(step.heading_rad), sin(step.heading_rad)])
        across = np.array([-along[1], along[0]])
        cross_m = step.step_m * radians(options.heading_sd_deg)
        noise = options.step_sd_m**2 * np.outer(along, along)
        noise += step.sampling_sd_m**2 * np.eye(2) if step.step_m != 0 else 0.0
        noise += cross_m**2 * np.outer(across, across)
        after = self if self.headless_m == 0 else replace(self, headless_m=0.0)
        return after, step.step_m * along, noise, Reason.USED

    def fixed(self, time_s: float) -> Reckoning:
        """Return it after a fix was used."""
        return Reckoning(self.watch.positioned(time_s), 0.0, time_s)
