"""The motion of an epoch: beliefs, dead reckoning and the recent path moved by its steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite, nan
from typing import Any

import numpy as np

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.alternative import MapBelief
from mapfilter.positioning.bayes.belief_changes import (
    carried_on,
    counted_from,
    remounted,
    turned_at_jump,
)
from mapfilter.positioning.bayes.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.held import (
    HeldOtherwise,
    as_measured,
    forked,
    jumps,
    own_rng,
    still_open,
)
from mapfilter.positioning.bayes.mirrored import mirrored_step
from mapfilter.positioning.bayes.path import RecentPath
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.bayes.unaided import without_positions
from mapfilter.positioning.epochs import Epoch, headed
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.step_output import UnusedReading

_FORKED, _MOVED, _AWAY = 1, 2, 4
"""Salts of the draws of beliefs in which the phone was turned, and of hypotheses carried on."""
_BEGUN, _UNAIDED = 5, 7
"""Salts of the draws of the belief without positions."""


@dataclass(frozen=True)
class _OwnDraws:
    """Generators of an epoch for rivals of the belief.

    Each is made when it is first asked for, which few epochs do: it takes 10 µs.
    """

    time_s: float

    @cached_property
    def forking(self) -> np.random.Generator:
        """For beliefs that begin."""
        return own_rng(self.time_s, _FORKED)

    @cached_property
    def beginning(self) -> np.random.Generator:
        """For a belief without positions that begins."""
        return own_rng(self.time_s, _BEGUN)

    @cached_property
    def unaided(self) -> np.random.Generator:
        """For one that moves."""
        return own_rng(self.time_s, _UNAIDED)

    @cached_property
    def moving(self) -> np.random.Generator:
        """For beliefs that move."""
        return own_rng(self.time_s, _MOVED)


def moved(
    beliefs: BeliefFilters,
    state: BayesState,
    watch: SensorWatch,
    epoch: Epoch,
    rng: np.random.Generator,
) -> tuple[BayesState, list[UnusedReading]]:
    """Move the beliefs by an epoch's dead reckoning.

    Parameters
    ----------
    beliefs : BeliefFilters
        Filters of single beliefs.
    state : BayesState
        After the epoch before.
    watch : SensorWatch
        After this epoch's readings.
    epoch : Epoch
        With a step to all sides for motion that was not measured.
    rng : numpy.random.Generator

    Returns
    -------
    state : BayesState
    unused : list of UnusedReading
        Motion that was not used.
    """
    unused: list[UnusedReading] = []
    rested = state.watch.rest if watch.rest is None else None
    if beliefs.may_be_anywhere(state, watch, epoch.time_s):
        state = state.begun_anew()
    belief, compass, alternative = state.belief, state.compass, state.alternative
    reckoning, path, heading_rad = state.reckoning, state.path, state.heading_rad
    twin = state.twin
    hold, walking_rad, rules = state.hold, state.walking_rad, beliefs.holds
    held = state.held
    ranged = any(isfinite(one.range_m) for one in epoch.ranges)
    positioned = epoch.fix is not None or ranged
    if ranged:
        # Pseudoranges are compared with the main belief alone, so there is no doubt of a jump.
        as_is = (one for one in held if one.hold.is_as_measured)
        held = () if hold.is_as_measured else tuple(as_is)
    if not epoch.time_s - state.watch.pace.stepped_s <= rules.longest_pause_s:
        # Who stood may have turned there.
        walking_rad = nan
    own = _OwnDraws(epoch.time_s)
    # Positions tell whether headings are still read rightly.
    plain = hold.is_as_measured or any(one.hold.is_as_measured for one in held)
    if positioned and not plain and isinstance(belief, ParticleBelief):
        gone_m, white_rad = reckoning.travelled_m, beliefs.model.motion.white_rad
        if state.status is belief.status is Status.TRACKING:
            plainly = as_measured(rules, belief, state.null, hold, gone_m, white_rad, own.forking)
            held = (*held, plainly)
    unaided = state.unaided
    if positioned and isinstance(belief, ParticleBelief) and beliefs.positions_lead(state):
        gone_m, pulls = reckoning.travelled_m, beliefs.pulls
        alone = without_positions(pulls, belief, state.null, hold, gone_m, own.beginning)
        unaided = (*unaided, alone)
    if belief is not None and rested is not None and beliefs.may_have_left(state):
        gone_s = epoch.time_s - rested.since_s
        belief = carried_on(belief, rested, gone_s, own_rng(epoch.time_s, _AWAY))
    # Courses along the ways count from a heading of 0, those of a compass from its headings.
    by_course = beliefs.followed_ways(state)
    for raw in epoch.motion:
        if by_course and belief is not None and isfinite(raw.heading_rad):
            by_course, held, unaided = False, (), ()
            belief = counted_from(belief, raw.heading_rad)
            if alternative is not None:
                other = counted_from(alternative.belief, raw.heading_rad)
                alternative = replace(alternative, belief=other)
        step, heading_rad = headed(raw, heading_rad)
        if compass and step.turned_sd_rad > 0:
            # A compass tells where the phone points afterwards.
            step = replace(step, turned_sd_rad=0.0)
        measured = step
        step = hold.read(measured)
        why = Reason.NOT_STARTED
        if beliefs.map_may_start:
            known = isfinite(raw.heading_rad) == compass or not path.here.travelled_m
            path = (path if known else RecentPath()).moved(step)
            why = Reason.USED if isfinite(step.step_m) else Reason.NO_STEP
        if belief is None:
            # An unmeasured way says nothing of the compass.
            compass = compass if isfinite(raw.spread_m) else isfinite(raw.heading_rad)
        else:
            turned = isfinite(raw.heading_rad) or isfinite(raw.spread_m)
            if compass and not turned and reckoning.travelled_m == 0:
                # Nothing has moved yet, so headings can still be relative to the first one.
                compass, belief = False, beliefs.without_compass(belief, rng)
                # What began beside it has headings of a compass.
                unaided = ()
            predict = beliefs.moving_filter(state, compass=compass).predict
            tracked = state.status is Status.TRACKING and belief.status is Status.TRACKING
            jumped = compass and not ranged and jumps(walking_rad, raw, rules)
            if jumped and not positioned and belief.status is Status.SEARCHING:
                changed_rad = raw.heading_rad - walking_rad
                belief = turned_at_jump(belief, rules, hold.sign * changed_rad, own.forking)
            if tracked and jumped and isinstance(belief, ParticleBelief):
                more = forked(
                    rules,
                    belief,
                    state.null,
                    hold,
                    (walking_rad, raw.heading_rad),
                    reckoning.travelled_m,
                    beliefs.model.motion.white_rad,
                    own.forking,
                )
                held = still_open(rules, (*held, *more), belief, reckoning.travelled_m)
            if held:
                held = tuple(_moved_as_read(one, predict, measured, own.moving) for one in held)
            if unaided:
                unaided = tuple(
                    _moved_as_read(one, predict, measured, own.unaided) for one in unaided
                )
            belief, why = predict(belief, _assumed(step, belief), rng)
            belief = remounted(belief, beliefs.model.motion, abs(step.step_m), rng)
            reckoning = reckoning.moved(step)
            if alternative is not None:
                other = alternative.belief
                as_read = alternative.hold.read(measured)
                other, _ = predict(other, _assumed(as_read, other), rng)
                alternative = replace(alternative, belief=other)
            if twin is not None:
                other = twin.belief
                other, _ = predict(other, _assumed(mirrored_step(step), other), rng)
                twin = replace(twin, belief=other)
        if isfinite(raw.heading_rad) and raw.step_m > 0:
            walking_rad = raw.heading_rad
        elif isfinite(raw.spread_m):
            walking_rad = nan
        if why is not Reason.USED:
            unused.append(UnusedReading(epoch.time_s, "motion", "", why))
    return BayesState(
        belief=belief,
        status=state.status,
        contested=state.contested,
        sources=state.sources,
        reckoning=reckoning,
        heading_rad=heading_rad,
        compass=compass,
        null=state.null,
        alternative=alternative,
        takeovers=state.takeovers,
        path=path,
        reported=state.reported,
        watch=watch,
        last_fix=state.last_fix,
        recovery=state.recovery,
        twin=twin,
        hold=hold,
        walking_rad=walking_rad,
        held=held,
        alternatives=state.alternatives,
        unaided=unaided,
        proven=state.proven,
        alone_from_m=state.alone_from_m,
        area=state.area,
    ), unused


def _moved_as_read(
    one: HeldOtherwise, predict: Callable[..., Any], measured: MotionStep, rng: np.random.Generator
) -> HeldOtherwise:
    """Return a belief beside the main one, moved by a step as it reads it."""
    as_read = one.hold.read(measured)
    return replace(one, belief=predict(one.belief, _assumed(as_read, one.belief), rng)[0])


def _assumed(step: MotionStep, belief: MapBelief) -> MotionStep:
    """Return a step with the errors that a belief assumes: that of its sampling once it is tracked.

    With it a belief that still searches would be too wide to be in one place for some way.
    """
    if step.sampling_sd_m == 0 or belief.status is Status.TRACKING:
        return step
    return replace(step, sampling_sd_m=0.0)
