"""The motion of an epoch: beliefs, dead reckoning and the recent path moved by its steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite, nan

import numpy as np

from mapfilter._changes import changed
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.beliefs.belief_changes import carried_on
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.belief_set import BeliefSet
from mapfilter.positioning.bayes.beliefs.legs import NO_LEG, Leg, may_wait
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning, RecentPath
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.rivals.bends import NO_DIRECTION, Straight
from mapfilter.positioning.bayes.rivals.held import as_measured, jumps
from mapfilter.positioning.bayes.rivals.own_draws import OwnDraws
from mapfilter.positioning.bayes.rivals.unaided import without_positions
from mapfilter.positioning.bayes.rivals.uncounted import walked_on
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch, headed
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.step_output import UnusedReading


def moved(
    filters: BeliefFilters,
    state: BayesState,
    watch: SensorWatch,
    epoch: Epoch,
    rng: np.random.Generator,
    waits: Callable[[float], bool] | None = None,
) -> tuple[BayesState, list[UnusedReading]]:
    """Move the beliefs by an epoch's dead reckoning, unless its steps wait for others.

    Parameters
    ----------
    filters : BeliefFilters
        Filters of single beliefs.
    state : BayesState
        After the epoch before.
    watch : SensorWatch
        After this epoch's readings.
    epoch : Epoch
        With a step to all sides for motion that was not measured.
    rng : numpy.random.Generator
    waits : callable
        Returns whether beliefs may wait, by the distance travelled after the motion. Without it
        each row moves them by itself.

    Returns
    -------
    state : BayesState
    unused : list of UnusedReading
        Motion that was not used.
    """
    rested = state.watch.rest if watch.rest is None else None
    if filters.may_be_anywhere(state, watch, epoch.time_s):
        state = state.begun_anew()
    move = _Move.of(filters, state, epoch, rng, gathers=waits is not None)
    move.begin_rivals()
    if rested is not None:
        move.carry_on(rested)
    for row in epoch.motion:
        move.by_row(row)
    if waits is None or move.leg.is_whole or not waits(move.reckoning.travelled_m):
        move.finish_leg()
    return move.after(watch), move.unused


@dataclass(slots=True)
class _Move:
    """What the motion of an epoch changes, row by row; ``state`` is that before the motion."""

    filters: BeliefFilters
    state: BayesState
    epoch: Epoch
    rng: np.random.Generator
    own: OwnDraws
    gathers: bool
    ranged: bool
    positioned: bool
    by_course: bool
    beliefs: BeliefSet
    leg: Leg
    reckoning: DeadReckoning
    path: RecentPath
    heading_rad: float
    walking_rad: float
    straight: Straight
    compass: bool
    unused: list[UnusedReading]

    @classmethod
    def of(
        cls,
        filters: BeliefFilters,
        state: BayesState,
        epoch: Epoch,
        rng: np.random.Generator,
        *,
        gathers: bool,
    ) -> _Move:
        """Return the motion of an epoch before its first row; ``gathers`` is whether rows wait."""
        ranged = any(isfinite(one.pseudorange_m) for one in epoch.pseudoranges)
        stood_s = epoch.time_s - state.watch.pace.stepped_s
        return cls(
            filters=filters,
            state=state,
            epoch=epoch,
            rng=rng,
            own=OwnDraws(epoch.time_s),
            gathers=gathers,
            ranged=ranged,
            positioned=epoch.gnss is not None or ranged,
            # Courses along ways count from a heading of 0, those of a compass from its headings.
            by_course=filters.followed_ways(state),
            beliefs=BeliefSet.of(state),
            leg=state.leg,
            reckoning=state.reckoning,
            path=state.path,
            heading_rad=state.heading_rad,
            # Who stood may have turned there.
            walking_rad=state.walking_rad if stood_s <= filters.holds.longest_pause_s else nan,
            straight=state.straight,
            compass=state.compass,
            unused=[],
        )

    def begin_rivals(self) -> None:
        """Begin beliefs beside the main one that this epoch's positions call for."""
        hold, gone_m = self.state.hold, self.reckoning.travelled_m
        if self.ranged:
            # Pseudoranges are compared with the main belief alone: headings leave no doubt.
            as_is = (one for one in self.beliefs.held if one.hold.is_as_measured)
            self.beliefs = replace(self.beliefs, held=() if hold.is_as_measured else tuple(as_is))
            self.straight = NO_DIRECTION
        if self.positioned:
            self.finish_leg()
        filters, null, rivals = self.filters, self.state.null, self.beliefs
        belief, held = rivals.main, rivals.held
        if not self.positioned or not isinstance(belief, ParticleBelief):
            return
        # Positions tell whether headings are still read rightly.
        plain = hold.is_as_measured or any(one.hold.is_as_measured for one in held)
        if not plain and self.state.status is belief.status is Status.TRACKING:
            white_rad, own = filters.model.motion.white_rad, self.own.forking
            plainly = as_measured(filters.holds, belief, null, hold, gone_m, white_rad, own)
            self.beliefs = replace(self.beliefs, held=(*held, plainly))
        if filters.positions_lead(self.state):
            own = self.own.beginning
            alone = without_positions(filters.pulls, belief, null, hold, gone_m, own)
            self.beliefs = replace(self.beliefs, unaided=(*self.beliefs.unaided, alone))

    def carry_on(self, rested: Rest) -> None:
        """Take a rest that has ended for a way where it may have been one.

        If levels leave it in doubt, the belief is spread, else a rival goes on from there.
        """
        filters, state, time_s = self.filters, self.state, self.epoch.time_s
        doubtful, share = filters.may_have_left(state), filters.left_share(state, state.watch)
        if self.beliefs.main is None or not (doubtful or share > 0):
            return
        self.finish_leg()
        main, own = self.beliefs.main, self.own.carrying
        if doubtful:
            gone = carried_on(main, rested, time_s - rested.since_s, own)
            self.beliefs = replace(self.beliefs, main=gone)
        elif isinstance(main, ParticleBelief) and state.status is main.status is Status.TRACKING:
            predict = filters.moving_filter(state, compass=self.compass).predict
            known, gone_m = (main, state.null, state.hold), self.reckoning.travelled_m
            rival = walked_on(filters.holds, *known, rested, time_s, share, gone_m, predict, own)
            self.beliefs = replace(self.beliefs, held=(*self.beliefs.held, rival))

    def by_row(self, row: MotionStep) -> None:
        """Move everything by one row of motion."""
        if self.by_course and self.beliefs.main is not None and isfinite(row.heading_rad):
            self.by_course = False
            self.beliefs = replace(self.beliefs, held=(), unaided=())
            # What waits is part of the course.
            self.finish_leg()
            self.beliefs = self.beliefs.counted_from(row.heading_rad)
        measured, self.heading_rad = headed(row, self.heading_rad)
        if self.compass and measured.turned_sd_rad > 0:
            # A compass tells where the phone points afterwards.
            measured = replace(measured, turned_sd_rad=0.0)
        step = self.state.hold.read(measured)
        why = Reason.NOT_STARTED
        if self.filters.map_may_start:
            known = isfinite(row.heading_rad) == self.compass or not self.path.here.travelled_m
            self.path = (self.path if known else RecentPath()).moved(step)
            why = Reason.USED if isfinite(step.step_m) else Reason.NO_STEP
        if self.beliefs.main is not None:
            why = self._move_beliefs(self.beliefs.main, row, measured, step)
        elif not isfinite(row.spread_m):
            # An unmeasured way says nothing of the compass.
            self.compass = isfinite(row.heading_rad)
        self.straight = self.straight.after(measured, self.state.hold.step_unit_m)
        if isfinite(row.heading_rad) and row.step_m > 0:
            self.walking_rad = row.heading_rad
        elif isfinite(row.spread_m):
            self.walking_rad = nan
        if why is not Reason.USED:
            self.unused.append(UnusedReading(self.epoch.time_s, "motion", "", why))

    def _move_beliefs(
        self, belief: MapBelief, row: MotionStep, measured: MotionStep, step: MotionStep
    ) -> Reason:
        """Move the main belief by a step as it reads it, and all beside it as they do."""
        turned = isfinite(row.heading_rad) or isfinite(row.spread_m)
        if self.compass and not turned and self.reckoning.travelled_m == 0:
            # Nothing has moved yet, so headings can still be relative to the first one.
            self.compass, belief = False, self.filters.without_compass(belief, self.rng)
            # What began beside it has headings of a compass.
            self.beliefs = replace(self.beliefs, main=belief, unaided=())
        holds, unit_m = self.filters.holds, self.state.hold.step_unit_m
        watches = self.compass and not self.ranged
        if watches and jumps(self.walking_rad, row, holds, unit_m):
            self.finish_leg()
            jump_rad, gone_m = (self.walking_rad, row.heading_rad), self.reckoning.travelled_m
            known = self.filters, self.state, jump_rad, gone_m, self.own
            self.beliefs = self.beliefs.at_jump(*known, positioned=self.positioned)
            self.straight = NO_DIRECTION
        elif watches and self.straight.bends(measured, holds):
            self.finish_leg()
            before_rad, gone_m = self.straight.heading_rad, self.reckoning.travelled_m
            # Who turns right round goes back the same way, whatever the phone does.
            if not holds.is_around(measured.heading_rad - before_rad):
                self.beliefs = self.beliefs.at_bend(
                    self.filters, self.state, before_rad, gone_m, self.own
                )
            self.straight = NO_DIRECTION
        before, self.reckoning = self.reckoning, self.reckoning.moved(step)
        if self.gathers and isinstance(belief, ParticleBelief) and may_wait(measured):
            self._join(measured, before)
            return Reason.USED
        self.finish_leg()
        return self._take(measured)

    def _join(self, measured: MotionStep, before: DeadReckoning) -> None:
        """Let a step wait, with those that lead to the same side."""
        joined = self.leg.joined(measured, before)
        if joined is None:
            self.finish_leg()
            joined = self.leg.joined(measured, before)
        assert joined is not None, "a leg begins with any step"
        self.leg = joined

    def finish_leg(self) -> None:
        """Move the beliefs by what waits."""
        leg, self.leg = self.leg, NO_LEG
        if leg.rows:
            self._take(leg.step)

    def _take(self, measured: MotionStep) -> Reason:
        known = self.filters, self.state, measured, self.own, self.rng
        self.beliefs, why = self.beliefs.by_step(*known, compass=self.compass)
        return why

    def after(self, watch: SensorWatch) -> BayesState:
        """Return the state after the motion, with that of the sensors."""
        return changed(
            self.state,
            belief=self.beliefs.main,
            reckoning=self.reckoning,
            heading_rad=self.heading_rad,
            compass=self.compass,
            alternative=self.beliefs.alternative,
            path=self.path,
            watch=watch,
            twin=self.beliefs.twin,
            walking_rad=self.walking_rad,
            straight=self.straight,
            held=self.beliefs.held,
            half_turns=self.beliefs.half_turns,
            unaided=self.beliefs.unaided,
            leg=self.leg,
        )
