"""One epoch of a Kalman-type filter over sites: first move, then measure, then the status."""

from __future__ import annotations

from cmath import exp
from collections.abc import Mapping, Sequence
from math import isfinite, nan

import numpy as np

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.gaussian import Method
from mapfilter.models.gaussian import GaussianTerms
from mapfilter.models.motion import constant_velocity
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gaussian_tail import GaussianTail
from mapfilter.positioning.kalman.alignment import Direction
from mapfilter.positioning.kalman.disputed import Ruling
from mapfilter.positioning.kalman.fixing import FixWeighing
from mapfilter.positioning.kalman.lasting import Motion, extended_belief, extended_motion
from mapfilter.positioning.kalman.level_errors import with_own_spread
from mapfilter.positioning.kalman.models import SiteModels, compiled
from mapfilter.positioning.kalman.passing import as_time_passes
from mapfilter.positioning.kalman.place import (
    WITHIN_M,
    belief_tail,
    mixture_radii_m,
    place_of,
    share_within,
    spread_of,
)
from mapfilter.positioning.kalman.proof import Doubt
from mapfilter.positioning.kalman.readings import SiteReadings, fix_covariance_m2, site_readings
from mapfilter.positioning.kalman.reckoning import (
    ERRORS,
    RATE,
    RECKONED,
    TURNED,
    after_each_other,
    at_rest,
)
from mapfilter.positioning.kalman.redirected import jump_to, turned_to, turns_in_doubt
from mapfilter.positioning.kalman.report_model import report_model
from mapfilter.positioning.kalman.start import first_belief
from mapfilter.positioning.kalman.state import KalmanState
from mapfilter.positioning.kalman.turned import Turn
from mapfilter.positioning.step_output import Fix, UnusedReading

_LOST_NIS, _WINDOW = 5.0, 10
_WALK_MPS = 1.5


class KalmanStep:
    """One epoch in work: the state is replaced by parts."""

    def __init__(self, sites: SiteModels, method: Method, state: KalmanState) -> None:
        self.sites, self.options = sites, sites.options
        self.layout, self.belief, self.time_s = state.layout, state.belief, state.time_s
        self.lasts, self.fixes = self.options.has_lasting_fixes, state.fixes
        # With a rate behind each coordinate north is the third component.
        self.own = MOVING if state.layout.north == MOVING.north else RECKONED
        self.where = [self.layout.east, self.layout.north]
        # Behind these components are errors that last.
        self.compared = self.own.size if self.own is MOVING else len(self.where)
        self.method = with_own_spread(method, self.layout.size - self.compared)
        self.moved_m, self.status = state.moved_m, state.status
        self.recent_nis = list(state.recent_nis)
        self.motion, self.last_fix, self.slots = state.motion, state.last_fix, state.slots
        self.reckoning = state.reckoning
        self.growth: Mapping[str, float] = {}
        self.unused: list[UnusedReading] = []

    @property
    def state(self) -> KalmanState:
        """The state after the epoch."""
        return KalmanState(
            self.layout,
            self.belief,
            self.time_s,
            self.moved_m,
            self.status,
            tuple(self.recent_nis),
            self.motion,
            self.last_fix,
            self.fixes,
            self.slots,
            self.reckoning,
        )

    @property
    def tail(self) -> GaussianTail | None:
        """The belief's tail about its mean."""
        if self.belief is None:
            return None
        return belief_tail(self.belief, self.where, self.fixes.coasting.apart)

    def take(self, epoch: Epoch) -> Fix:
        """Move, then measure; return the epoch's fix."""
        heard = epoch.radio
        if self.own is RECKONED:
            # With a velocity in the state, nothing but what is weighed tells of motion.
            self.reckoning, epoch, unused = self.reckoning.watched(epoch)
            self.unused += unused if self.belief is not None else []
        given, self.fixes = site_readings(self.sites, epoch), self.fixes.at_time(epoch.time_s)
        self.motion = self._move(epoch, given.cells)
        reason = self._measure(epoch, given)
        if reason is Reason.NO_READING and heard and not epoch.radio:
            reason = Reason.STALE_RADIO
        self.time_s = epoch.time_s
        return self._fix(epoch.time_s, reason)

    def _move(self, epoch: Epoch, names: Sequence[str]) -> Motion:
        """Predict, up to a report of cells; return the transition, the noise and the shift."""
        elapsed_s = max(epoch.time_s - self.time_s, 0.0) if isfinite(self.time_s) else 0.0
        motion, moved_m = self._own_motion(epoch, elapsed_s)
        self.moved_m += moved_m
        options = self.options
        if self.lasts:
            lasting = self.fixes.lasting_m, self.fixes.lasting_s(options.fix_lasting_s)
            motion = extended_motion(motion, self.own, *lasting, elapsed_s)
        if self.slots.size:
            self.slots, self.growth, renewed = self.slots.after_report(
                names, moved_m, options.level_memory_m
            )
            motion = options.lasting_levels.extended_motion(motion, self.slots, renewed, moved_m)
        if self.belief is not None:
            self.belief = self.belief.predict(*motion)
        return motion

    def _own_motion(self, epoch: Epoch, elapsed_s: float) -> tuple[Motion, float]:
        """Return motion of the state without errors that last, and the distance travelled."""
        motion, moved_m = at_rest(self.own), 0.0
        if self.belief is None:
            self._label(epoch, epoch.motion, Reason.NOT_STARTED)
            return motion, 0.0
        if self.own is MOVING:
            if not elapsed_s > 0:
                return motion, 0.0
            root = self.options.acceleration_mps_per_sqrt_s
            moving = constant_velocity(elapsed_s, root, noise="continuous")
            return (moving.transition, moving.noise, motion[2]), self._speed_mps() * elapsed_s
        moments, options, gaps = self.belief.moments, self.options, 0
        mean = moments.mean
        motion = as_time_passes(options, elapsed_s, float(moments.covariance[RATE, RATE]))
        for step in epoch.motion:
            self.reckoning, own, why = self.reckoning.moved(
                step, epoch.time_s, options, mean[ERRORS]
            )
            if why is not Reason.USED:
                self._label(epoch, (step,), why)
            gaps += isfinite(step.spread_m) or (why is not Reason.USED and step.step_m != 0)
            motion = after_each_other(motion, own)
            moved_m += abs(step.step_m) if isfinite(step.step_m) else 0.0
        if epoch.motion:
            mean = mean[: self.own.size]
            after = motion[0] @ mean + motion[2]
            gone = complex(*(after - mean)[self.where]) * exp(-1j * after[TURNED])
            self.fixes = self.fixes.moved(gone.real, gone.imag, gaps)
        self.fixes = self.fixes.coasted(motion, moments.mean[: self.own.size], gaps)
        return motion, moved_m

    def _speed_mps(self) -> float:
        """Return the estimated speed, at least that of a walk."""
        if self.belief is None:
            raise AssertionError("asked once started")
        mean = self.belief.moments.mean
        return max(float(np.hypot(*mean[list(self.layout.velocity)])), _WALK_MPS)

    def _measure(self, epoch: Epoch, given: SiteReadings) -> Reason:
        self.unused += given.unused
        fix = epoch.gnss
        if fix is not None and not (isfinite(fix.east_m) and isfinite(fix.north_m)):
            self.unused.append(UnusedReading(epoch.time_s, "gnss", "", Reason.NO_READING))
            fix = None
        # With a velocity, nothing but fixes tells that one stands: the estimate would coast on.
        if fix is not None and self.own is not MOVING and fix.repeats(self.last_fix):
            self.unused.append(UnusedReading(epoch.time_s, "gnss", "", Reason.REPEATED_FIX))
            fix = None
        self.last_fix = fix or self.last_fix
        if fix is None and not given.cells and not given.timed:
            return Reason.UNKNOWN_CELL if epoch.radio else Reason.NO_READING
        if self.belief is None:
            self.belief = first_belief(self.sites, self.own, fix, given)
            if self.lasts:
                lasting_m = self.options.lasting_fix_m(self.options.fix_sd_m**2)
                self.belief = extended_belief(self.belief, self.own, lasting_m)
                self.fixes = self.fixes._replace(lasting_m=lasting_m)
            if self.slots.size:
                lasting = self.options.lasting_levels
                self.belief = lasting.extended_belief(self.belief, self.slots)
        why = Reason.UPDATE_FAILED if fix is None else self._update_fix(fix, epoch.time_s)
        if given.cells or given.timed:
            step_m = self.options.timing_step_m
            reading = [*given.levels_dbm, *((steps + 0.5) * step_m for steps in given.steps)]
            known = self.sites, self.layout, given, self.slots, self.growth
            if self._update(report_model(*known, self.moved_m), reading):
                self.moved_m, why = 0.0, Reason.USED
        return why

    def _update_fix(self, fix: GnssFix, time_s: float) -> Reason:
        if self.belief is None:
            raise AssertionError("started before it measures")
        noise, layout = fix_covariance_m2(fix, self.options.fix_sd_m), self.layout
        if self.own is RECKONED:
            moments, options = self.belief.moments, self.options
            lasting = self.fixes.lasting(float(np.trace(noise)) / 2, options)
            self.reckoning, found = self.reckoning.fixed(time_s, fix, noise, moments, lasting)
            self.fixes = self.fixes.led() if self.reckoning.recent.is_led else self.fixes
            if isinstance(found, Turn):
                self.reckoning = self.reckoning.positioned(time_s)
                self._jump(jump_to(found, layout, self.fixes.lasting_m if self.lasts else None))
                if found.is_new:
                    self.unused.append(UnusedReading(time_s, "motion", "", Reason.PHONE_TURNED))
                return Reason.USED
        rest, since_s = self.reckoning.watch.rest, nan
        if self.own is RECKONED and rest is not None and not rest.is_carried:
            since_s = rest.since_s
        how = FixWeighing(self.options, self.own, layout, self.method, self.compared)
        doubted = self.own is RECKONED and self.reckoning.may_have_left
        turns = isfinite(self.reckoning.turned_s)
        drift_deg = (
            self.options.turn_drift_deg_per_sqrt_m if turns else self.options.drift_deg_per_sqrt_m
        )
        after = how.weighed(
            self.belief,
            self.fixes,
            fix,
            time_s,
            drift_deg_per_sqrt_m=drift_deg,
            rests_since_s=since_s,
            is_doubted=doubted,
            astray_m2=self.reckoning.astray_m2(fix, float(np.trace(noise)) / 2),
        )
        self.belief, self.fixes = after.belief, after.errors
        motion = after.motion
        # One fix that contradicts a belief may be an outlier; steps that are wrong do so again.
        again = after.ruling is Ruling.EITHER and after.errors.record.is_lost
        if (after.ruling is Ruling.ANEW or again) and self.reckoning.alignment.known:
            doubt = turns_in_doubt(layout)
            self.belief, motion = self.belief.predict(*doubt), after_each_other(motion, doubt)
        if self.own is RECKONED and isinstance(found, Direction):
            turned = turned_to(found, layout)
            self.fixes = self.fixes._replace(coasting=self.fixes.coasting.begun_anew())
            self.belief, motion = self.belief.predict(*turned), after_each_other(motion, turned)
        if self.motion is not None:
            self.motion = after_each_other(self.motion, motion)
        self.recent_nis = [] if after.ruling.begins else self._with_nis(after.nis)
        if after.used:
            self.reckoning = self.reckoning.positioned(time_s)
            if after.ruling.begins and not after.drifted:
                self.reckoning = self.reckoning.begun()
            if after.ruling is Ruling.CARRIED:
                self.reckoning = self.reckoning.carried()
            return Reason.USED
        if after.ruling is Ruling.OUTLIER:
            self.unused.append(UnusedReading(time_s, "gnss", "", Reason.REJECTED_BY_EVIDENCE))
            return Reason.REJECTED_BY_EVIDENCE
        return Reason.UPDATE_FAILED

    def _jump(self, motion: Motion) -> None:
        """Move on by a jump of headings: what was measured before it said nothing of a loss."""
        if self.belief is None or self.motion is None:
            raise AssertionError("moved before it measures")
        self.belief = self.belief.predict(*motion)
        self.motion, self.recent_nis = after_each_other(self.motion, motion), []
        self.fixes = self.fixes.after_a_jump()

    def _with_nis(self, nis: float) -> list[float]:
        """Return the last normalised innovations with one more, if it is known."""
        return [*self.recent_nis, nis][-_WINDOW:] if isfinite(nis) else self.recent_nis

    def _update(self, model: GaussianTerms, reading: Sequence[float]) -> bool:
        """Update with a measurement; return whether that could be done."""
        if self.belief is None:
            raise AssertionError("started before it measures")
        self.belief, info = self.belief.update(compiled(model), reading, self.method, self.compared)
        if info.used:
            self.recent_nis = self._with_nis(info.nis / len(reading))
        return info.used

    def _label(self, epoch: Epoch, steps: Sequence[MotionStep], reason: Reason) -> None:
        self.unused += [UnusedReading(epoch.time_s, "motion", "", reason) for _ in steps]

    def _fix(self, time_s: float, reason: Reason) -> Fix:
        if self.belief is None:
            return Fix.nowhere(time_s, self.status, reason)
        place = place_of(self.belief.moments, self.where)
        # Parts far from the mean count by their variance, so that a claim waits for them.
        self._set_status(float(place["radii_m"][2]))
        count, apart = self.belief.weights.size, self.fixes.coasting.apart
        if apart.coast is not None:
            here_m = self.belief.moments.mean[self.where]
            if apart.leaves_too_little(here_m):
                claims = self.status in (Status.CONVERGED, Status.TRACKING)
                self.status = Status.UNCERTAIN if claims else self.status
                reason = Reason.ON_PROBATION if reason is Reason.USED else reason
            place |= spread_of(belief_tail(self.belief, self.where, apart))
        elif count > 1:
            lead = self.belief.leading.covariance[np.ix_(self.where, self.where)]
            place["mass_50m"] = share_within(lead, WITHIN_M) * float(self.belief.weights.max())
            place["radii_m"] = mixture_radii_m(self.belief, self.where)
        return Fix(time_s, **place, status=self.status, hypotheses=count, reason=reason)

    def _set_status(self, radius_m: float) -> None:
        """Update the status: converged by the radius, lost by the innovations."""
        lost = len(self.recent_nis) == _WINDOW and float(np.mean(self.recent_nis)) > _LOST_NIS
        if self.status is Status.SEARCHING:
            if radius_m <= self.options.converged_radius_m:
                self.status = Status.CONVERGED
        else:
            lost = lost or self.reckoning.may_have_left or self.fixes.record.is_lost
            near = radius_m <= self.options.converged_radius_m
            claimed = near and self.fixes.doubt is not Doubt.UNTIL_PROVEN
            self.status = Status.TRACKING if claimed else Status.UNCERTAIN
            if lost:
                self.status = Status.LOST
