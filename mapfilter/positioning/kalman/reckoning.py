"""Dead reckoning of a Kalman-type filter: what steps shift and spread, and what they lack.

A compass that is mounted askew, or beside iron, is off by as much for long, and so is the length of
steps. Taken as noise of each step, a hundred of them would lead astray by a tenth of that. So the
heading error b, a random walk over the way, and the share k by which steps are too short are
components of the state:

    p' = p + s (1 + k) u(ψ + b) + w,

linear about the mean of b and k. Headings that turns add up to are also off by a lasting error of
their rate, r, such as a gyroscope's bias, which is a third component: b' = b + r Δt. Positions that
are measured find them, and are followed by better dead reckoning. The noise w is of each step
alone; the rate wanders as time passes (:mod:`mapfilter.positioning.kalman.passing`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, hypot, inf, isfinite, nan, radians, sin, sqrt

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter._types import Floats
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.gaussian import Gaussian
from mapfilter.models.state import StateLayout
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.alignment import Alignment, Direction
from mapfilter.positioning.kalman.lasting import Motion
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.turned import Lasting, RecentWay, Turn
from mapfilter.positioning.sensors.pace import WALKERS_MPS
from mapfilter.positioning.sensors.unmeasured import common_way_m2, headless_step, missed_step
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched
from mapfilter.positioning.step_output import UnusedReading

RECKONED = StateLayout(5, 0, 1)
"""East, north, the heading error in rad, the share by which steps are too short, and the error of
the rate of turns in rad/s."""
ERRORS = slice(2, 5)
"""Components that are errors of dead reckoning."""
TURNED, _SCALE, RATE, _LEAST = 2, 3, 4, 1e-6
_PLANE = np.eye(2)
_TURNS_SD_RAD = radians(2.0)
"""White error of headings that turns add up to, at most: a compass is read again and again, among
iron."""
_FARTHER, _FARTHER_SD = 1.5, 4.0
"""How much longer than the way fixes may go without contradicting it, and deviations of these."""


def at_rest(layout: StateLayout) -> Motion:
    """Return transition, noise and shift of no motion."""
    size = layout.size
    return np.eye(size), np.zeros((size, size)), np.zeros(size)


def first_deviations(options: KalmanOptions) -> Floats:
    """Return the deviations of the errors before any position; sigma points need some."""
    rate_radps = radians(options.turn_rate_sd_deg_per_s)
    return np.maximum([radians(options.bias_sd_deg), options.scale, rate_radps], _LEAST)


def after_each_other(first: Motion, second: Motion) -> Motion:
    """Return two motions as one."""
    transition, noise, shift = second
    return (
        transition @ first[0],
        transition @ first[1] @ transition.T + noise,
        transition @ first[2] + shift,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Reckoning(EqualByValue):
    """What is known of the sensors, and of ways without headings.

    Parameters
    ----------
    watch : SensorWatch
        Of motion rows and reports.
    headless_m : float
        Way without headings since the last heading or fix.
    before_m : float
        Way without headings before that fix, since the last heading.
    origin : tuple of float or None
        Place of the first fix on that way, and the way before it.
    fixed_s : float
        Time of the last fix that was used.
    alignment : Alignment
        Of motion that has turns only.
    turned_s : float
        Time of the last turn that was measured; NaN before the first.
    recent : RecentWay
        By which headings that have jumped are found.
    """

    watch: SensorWatch = field(default_factory=SensorWatch)
    headless_m: float = 0.0
    before_m: float = 0.0
    origin: tuple[float, float, float] | None = None
    fixed_s: float = -inf
    alignment: Alignment = field(default_factory=Alignment)
    turned_s: float = nan
    recent: RecentWay = field(default_factory=RecentWay)

    def astray_m2(self, fix: GnssFix, variance_m2: float) -> float:
        """Return the variance along one axis by which a belief may lag behind a fix.

        Ways without headings go on and on, each taken for one to any side: fixes that are all ahead
        would be taken for errors that last. Where turns are measured fixes soon tell the direction,
        and fixes that go farther than the way contradict it.

        Parameters
        ----------
        fix : GnssFix
        variance_m2 : float
            Of the fix, along one axis.
        """
        if isfinite(self.turned_s) or self.origin is None:
            return 0.0
        east_m, north_m, way_m = self.origin
        gone_m = hypot(fix.east_m - east_m, fix.north_m - north_m)
        most_m = _FARTHER * (self.before_m + self.headless_m - way_m)
        if gone_m > most_m + _FARTHER_SD * sqrt(variance_m2):
            return 0.0
        return common_way_m2(self.headless_m, self.before_m)

    @property
    def may_have_left(self) -> bool:
        """Whether a walker may have gone on though no step is counted, since the last fix.

        Wheels that stand still are no counter that misses steps.
        """
        rest = self.watch.rest
        if rest is None or not rest.is_doubtful or rest.pace_mps > WALKERS_MPS:
            return False
        return self.fixed_s < rest.since_s

    def watched(self, epoch: Epoch) -> tuple[Reckoning, Epoch, list[UnusedReading]]:
        """Look at the sensors of an epoch (:func:`mapfilter.positioning.sensors.watching.watched`).

        Returns
        -------
        reckoning : Reckoning
        epoch : Epoch
            With a step to all sides for motion that was not measured, or that may have been missed
            before steps are counted again; without a stale report.
        unused : list of UnusedReading
            Why that is so.
        """
        time_s, heard, rested = epoch.time_s, epoch.radio, self.watch.rest
        watch, epoch, (motion, radio) = watched(self.watch, epoch)
        after = replace(self, watch=watch)
        if motion is Reason.USED and after.may_have_left:
            motion = Reason.MOTION_STUCK
        unused = []
        if motion is not Reason.USED:
            unused.append(UnusedReading(time_s, "motion", "", motion))
            # Turns of rows whose length is not known still turn.
            measured = (
                one if isfinite(one.step_m) else replace(one, step_m=0.0) for one in epoch.motion
            )
            epoch = replace(epoch, motion=tuple(measured))
        if radio is not Reason.USED:
            unused += [UnusedReading(time_s, row.role, row.name, radio) for row in heard]
        if rested is not None and watch.rest is None and self.may_have_left:
            epoch = replace(epoch, motion=(missed_step(rested, time_s), *epoch.motion))
        return after, epoch, unused

    def positioned(self, time_s: float) -> Reckoning:
        """Return it after a fix that was used."""
        watch = self.watch.positioned(time_s)
        before_m = self.before_m + self.headless_m
        return replace(self, watch=watch, headless_m=0.0, before_m=before_m, fixed_s=time_s)

    def begun(self) -> Reckoning:
        """Return it where the belief has begun anew with a fix: the way counts from the next one.

        The first place may have been as wrong as the belief, and so may this one. Where fixes have
        drifted away lengths may be wrong, and the way still counts from there.
        """
        return replace(self, headless_m=0.0, before_m=0.0, origin=None)

    def carried(self) -> Reckoning:
        """Return it where positions have shown that one goes on though no step is counted."""
        return replace(self, watch=self.watch.carried())

    def moved(
        self, step: MotionStep, time_s: float, options: KalmanOptions, errors: Floats
    ) -> tuple[Reckoning, Motion, Reason]:
        """Read a step.

        Parameters
        ----------
        step : MotionStep
        time_s : float
            When it ended.
        options : KalmanOptions
        errors : (3,) array
            Heading error (rad), share of the scale and error of the rate of turns (rad/s), about
            which motion is linear.

        Returns
        -------
        reckoning : Reckoning
        motion : tuple of arrays
            Transition, noise and shift of :data:`RECKONED`. Without a heading that of a way to all
            sides, which is straight for some time.
        reason : Reason
            ``USED``, ``NO_STEP`` or ``NO_HEADING``.
        """
        transition, noise, shift = at_rest(RECKONED)
        turned_s = time_s if isfinite(step.turn_rad) else self.turned_s
        # Who stands without any turn has none: nothing was read of a gyroscope.
        by_turns = not isfinite(step.heading_rad)
        by_rate = by_turns and (step.step_m != 0 or step.turn_rad != 0)
        alignment, step = self.alignment.headed(step)
        if by_rate and isfinite(self.turned_s) and alignment.known:
            transition[TURNED, RATE] = turned_s - self.turned_s
        # Nobody turns the gyroscope of a vehicle in the hand: what contradicts it is no jump.
        driven = by_turns and self.watch.pace.speed_mps > WALKERS_MPS
        by_rate_rad = float(transition[TURNED, RATE] * errors[2])
        recent = RecentWay() if driven else self.recent.moved(step, by_rate_rad)
        after = replace(self, alignment=alignment, turned_s=turned_s, recent=recent)
        if not isfinite(step.step_m):
            return after, (transition, noise, shift), Reason.NO_STEP
        drift_deg = options.turn_drift_deg_per_sqrt_m if by_turns else options.drift_deg_per_sqrt_m
        drift_rad = radians(drift_deg)
        noise[TURNED, TURNED] = drift_rad**2 * abs(step.step_m)
        if not isfinite(step.heading_rad):
            why = Reason.USED
            if not isfinite(step.spread_m):
                step, why = headless_step(step.step_m, self.headless_m), Reason.NO_HEADING
                after = replace(after, headless_m=self.headless_m + abs(step.step_m))
            noise[:2, :2] = step.all_sides_m**2 / 2 * _PLANE
            if alignment.known:
                noise[TURNED, TURNED] += step.turned_sd_rad**2
            return after, (transition, noise, shift), why
        turned_rad, scale = float(transition[TURNED, 2:] @ errors), float(errors[1])
        heading_rad, length_m = step.heading_rad + turned_rad, step.step_m * (1 + scale)
        along = np.array([cos(heading_rad), sin(heading_rad)])
        across = np.array([-along[1], along[0]])
        transition[:2, 2:] = (length_m * across)[:, None] * transition[TURNED, 2:]
        transition[:2, _SCALE] = step.step_m * along
        shift[:2] = length_m * along - transition[:2, 2:] @ errors
        white_rad = radians(options.heading_sd_deg)
        cross_m = step.step_m * (min(white_rad, _TURNS_SD_RAD) if by_turns else white_rad)
        noise[:2, :2] = step.rows * options.step_sd_m**2 * (along[:, None] * along)
        noise[:2, :2] += step.sampling_sd_m**2 * _PLANE if step.step_m != 0 else 0.0
        noise[:2, :2] += cross_m**2 / step.rows * (across[:, None] * across)
        if self.headless_m or self.before_m or self.origin is not None:
            after = replace(after, headless_m=0.0, before_m=0.0, origin=None)
        return after, (transition, noise, shift), Reason.USED

    def fixed(
        self,
        time_s: float,
        fix: GnssFix,
        covariance_m2: Floats,
        belief: Gaussian,
        lasting: Lasting,
    ) -> tuple[Reckoning, Direction | Turn | None]:
        """Return it with a fix of a covariance, used or not, and what that has found of headings.

        It is the direction of turns, or the jump of headings by which the belief is off.

        Parameters
        ----------
        time_s : float
        fix : GnssFix
        covariance_m2 : (2, 2) array
            Of the fix.
        belief : Gaussian
            Moments of the belief before it, in the layout :data:`RECKONED` and what is behind it.
        lasting : Lasting
            What lasts of its error.
        """
        variance_m2 = float(np.trace(covariance_m2)) / 2
        alignment, found = self.alignment.at_fix(fix.east_m, fix.north_m, sqrt(variance_m2))
        turned = float(belief.mean[TURNED]), float(belief.covariance[TURNED, TURNED])
        place = fix.east_m, fix.north_m, variance_m2
        recent, jump = self.recent.at_fix(time_s, place, turned, lasting)
        after = replace(
            self,
            alignment=alignment,
            recent=recent if found is None else RecentWay(),
            origin=self.origin or (fix.east_m, fix.north_m, self.before_m + self.headless_m),
        )
        return after, found or jump
