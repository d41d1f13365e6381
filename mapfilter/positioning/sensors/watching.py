"""Sensors that no longer measure what they seem to: dead, stuck or stale.

A log goes on after a sensor has died. Motion rows end, steps lack a length or have one that nothing
can have gone, or a counter stands still, or misses most steps, while the phone is carried on; a
modem repeats its last report. :func:`watched` looks at an epoch before any evidence is taken from
it. For motion that was not measured it puts a step to all sides into the epoch, as long as one goes
in that time, so the belief grows as it must; a report that stands still while the phone moves is
taken out.

Rows that are missing, or lengths of zero, can also be those of a phone that rests, and short ones
those of a stroll, so levels decide (:mod:`mapfilter.positioning.sensors.rest`), or the turns of a
vehicle.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.sensors import unheard
from mapfilter.positioning.sensors.impossible_steps import without_impossible
from mapfilter.positioning.sensors.pace import WALKERS_MPS, Going, Pace
from mapfilter.positioning.sensors.pauses import longest_s, unrecorded_s
from mapfilter.positioning.sensors.places import Carried, Places
from mapfilter.positioning.sensors.repeats import without_repeats
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.stale_radio import STALE_NATS, repeated_nats
from mapfilter.positioning.sensors.unmeasured import unmeasured_step
from mapfilter.positioning.sensors.watch import SensorWatch

_STRETCH_M = 60.0
"""Way as measured after which levels that agree with it have shown a stroll."""


def watched(
    watch: SensorWatch, epoch: Epoch, step_unit_m: float = 1.0
) -> tuple[SensorWatch, Epoch, tuple[Reason, Reason]]:
    """Look at the sensors of an epoch, whose steps are read in a unit.

    Returns
    -------
    watch : SensorWatch
    epoch : Epoch
        With a step to all sides for motion that was not measured, without a report that is stale.
    reasons : tuple of Reason
        Of motion and of the report: ``USED``, or ``NO_STEP``, ``IMPOSSIBLE_STEP``,
        ``MOTION_MISSING``, ``MOTION_STUCK``, ``HEADING_STUCK`` or ``DELIVERED_TWICE``, and
        ``STALE_RADIO``.
    """
    before, given = watch, epoch.motion
    possible = without_impossible(watch.pace, epoch.time_s, given, step_unit_m)
    repeats, motion, repeated = without_repeats(watch.repeats, epoch.time_s, possible, step_unit_m)
    if motion is not given:
        epoch = replace(epoch, motion=motion)
    watch, epoch, why = _followed(watch, epoch, step_unit_m)
    if possible is not given and why in (Reason.USED, Reason.NO_STEP):
        why = Reason.IMPOSSIBLE_STEP
    why = repeated if why is Reason.USED else why
    report, moved_m, nats = before.report, watch.moved_m, before.repeated_nats
    stepped_m, rode = watch.stepped_m, False
    if epoch.radio:
        nats = repeated_nats(nats, report, epoch.radio, step_unit_m * moved_m)
        heard = report, epoch.radio
        rode = unheard.was_ride(
            before.pace, before.times, epoch.time_s, stepped_m, heard, step_unit_m
        )
        report, moved_m, stepped_m = epoch.radio, 0.0, 0.0
    watch = watch._replace(
        moved_m=moved_m,
        report=report,
        repeated_nats=nats,
        repeats=repeats,
        stepped_m=stepped_m,
        rode_unheard=rode,
    )
    if epoch.radio and nats >= STALE_NATS:
        return watch, replace(epoch, radio=()), (why, Reason.STALE_RADIO)
    return watch, epoch, (why, Reason.USED)


def _followed(
    watch: SensorWatch, epoch: Epoch, step_unit_m: float
) -> tuple[SensorWatch, Epoch, Reason]:
    """Follow the motion rows; add the way that they lack."""
    time_s, steps = epoch.time_s, epoch.motion
    known, times, before_m = watch.pace, watch.times, watch.moved_m
    pace, going = known.read(time_s, steps, step_unit_m)
    if going.moves and _has_rested_silently(watch, time_s, step_unit_m):
        pace = pace.silent()
    watch = watch._replace(
        pace=pace,
        moved_m=before_m + going.gone_m,
        has_motion=watch.has_motion or bool(steps),
        stepped_m=watch.stepped_m + going.gone_m,
        times=times.read(time_s, has_report=bool(epoch.radio)),
    )
    if isfinite(watch.moving_s):
        rested = watch.rest is not None
        paused_s = unrecorded_s(known, times, time_s, going, watch.known_s, rested=rested)
        if paused_s > 0:
            return _after_a_pause(watch, epoch, paused_s, known.speed_mps, going)
    if going.moves and not going.slows:
        watch = watch._replace(places=Places()) if watch.places.rows else watch
        return watch.after_way(time_s), epoch, Reason.USED
    if not isfinite(watch.moving_s):
        watch = watch.after_way(time_s)
    watch, found = _among_places(watch, epoch, step_unit_m * going.gone_m)
    was_shown = watch.rest is not None and watch.rest.carried_mps > 0
    if going.moves and found is None and not was_shown:
        return watch.after_way(time_s), epoch, Reason.USED
    rest = watch.rest or Rest(
        watch.known_s,
        pace_mps=step_unit_m * pace.speed_mps,
        braked_mps2=known.braked_mps2(time_s) if going.measured else 0.0,
    )
    if found is not None and rest.may_be_carried_at(found.speed_mps):
        if not rest.is_carried:
            # The way is measured up to where it began.
            watch = watch._replace(moving_s=found.since_s, known_s=found.since_s, unmeasured_s=0.0)
            rest = replace(rest, since_s=found.since_s, measured_m=0.0)
        rest = rest.carried(found.speed_mps)
    was_carried = rest.is_carried
    rest = rest.heard(time_s, epoch.radio, step_unit_m * going.gone_m).turned(time_s, steps)
    if rest.is_carried and not was_carried:
        watch = watch._replace(places=Places())
    why = _why_unmeasured(watch, rest, epoch, going)
    if why is Reason.USED:
        return _at_rest(watch, rest, time_s, going, step_unit_m), epoch, why
    way = _unmeasured(watch, rest, epoch, before_m, step_unit_m, was_carried=was_carried)
    return *way, why


def _among_places(
    watch: SensorWatch, epoch: Epoch, gone_m: float
) -> tuple[SensorWatch, Carried | None]:
    """Compare a position with those before; return the way that they show beyond the steps."""
    time_s = epoch.time_s
    if not watch.pace.rows and watch.places.are_left_by(epoch.gnss):
        watch = watch._replace(has_motion=False)
    if watch.are_astray:
        return watch, None
    places = watch.places.after(time_s, epoch.gnss, gone_m)
    found = places.carried if places is not watch.places else None
    if watch.rest is not None and watch.rest.is_carried and (standing := places.standing):
        # The ride has ended.
        watch, places, found = watch.after_way(time_s), standing, None
    return watch._replace(places=places), found


def _why_unmeasured(watch: SensorWatch, rest: Rest, epoch: Epoch, going: Going) -> Reason:
    """Return why the way of an epoch is not known; ``USED`` if it is, or may be a rest."""
    if epoch.motion and not going.measured:
        return Reason.NO_STEP
    if not watch.has_motion:
        return Reason.MOTION_MISSING
    if not epoch.motion and _are_missing(watch.pace, epoch.time_s):
        return Reason.MOTION_MISSING
    if rest.is_carried:
        return Reason.MOTION_STUCK if epoch.motion else Reason.MOTION_MISSING
    return Reason.USED


def _are_missing(pace: Pace, time_s: float) -> bool:
    """Return whether motion rows that come all the time have ended."""
    return pace.reports_always and time_s - pace.motion_s > longest_s(pace)


def _has_rested_silently(watch: SensorWatch, time_s: float, step_unit_m: float) -> bool:
    """Return whether a walker's rows, taken for missing, had ended at a rest that levels show."""
    if watch.rest is None or not watch.rest.is_clear or not _are_missing(watch.pace, time_s):
        return False
    return step_unit_m * watch.pace.speed_mps <= WALKERS_MPS


def _at_rest(
    watch: SensorWatch, rest: Rest, time_s: float, going: Going, step_unit_m: float
) -> SensorWatch:
    """Return the watch of what rests, or strolls, where levels have shown that."""
    rested_s = time_s - rest.since_s
    if rest.measured_m >= _STRETCH_M and not rest.is_doubtful and rested_s > 0:
        strolled_mps = rest.measured_m / step_unit_m / rested_s
        return watch._replace(pace=watch.pace.slowed(strolled_mps)).after_way(time_s)
    return watch._replace(rest=rest, known_s=time_s if going.measured else watch.known_s)


def _unmeasured(
    watch: SensorWatch,
    rest: Rest,
    epoch: Epoch,
    before_m: float,
    step_unit_m: float,
    *,
    was_carried: bool,
) -> tuple[SensorWatch, Epoch]:
    """Put a step to all sides into an epoch for the way that is not known.

    ``before_m`` is the way since the last report before this epoch.
    """
    time_s, steps = epoch.time_s, epoch.motion
    # A measured rest is none of the way, unless it was a counter that stood still.
    to_s = watch.unmeasured_s + time_s - watch.known_s
    missed = 1.0
    if rest.is_carried:
        to_s, rested_s = time_s - watch.moving_s, time_s - rest.since_s
        if not was_carried and rested_s > 0:
            # What the counter did not miss is in the belief already.
            missed = max(1 - rest.measured_m / (rest.pace_mps * rested_s), 0.0)
    speed_mps = missed * watch.pace.speed_mps
    if rest.carried_mps > 0:
        speed_mps = rest.carried_mps / step_unit_m
    step = unmeasured_step(speed_mps, watch.unmeasured_s, to_s)
    if any(isfinite(one.turn_rad) for one in steps):
        step = replace(step, turned_sd_rad=0.0)
    moved_m = before_m + step.step_m
    watch = watch._replace(known_s=time_s, rest=rest, unmeasured_s=to_s, moved_m=moved_m)
    return watch, replace(epoch, motion=(*_turns_of(steps), step))


def _after_a_pause(
    watch: SensorWatch, epoch: Epoch, paused_s: float, speed_mps: float, going: Going
) -> tuple[SensorWatch, Epoch, Reason]:
    """Add the way of a pause of the recording before an epoch's own motion."""
    to_s = watch.unmeasured_s + paused_s
    step = unmeasured_step(speed_mps, watch.unmeasured_s, to_s)
    # What was gone in it is in no position's way.
    moved_m = watch.moved_m + step.step_m
    watch = watch.after_way(epoch.time_s)._replace(moved_m=moved_m, places=Places())
    if not going.measured:
        # The way may go on, with the direction that it has.
        watch = watch._replace(moving_s=epoch.time_s - to_s, unmeasured_s=to_s)
    return watch, replace(epoch, motion=(step, *epoch.motion)), Reason.MOTION_MISSING


def _turns_of(steps: tuple[MotionStep, ...]) -> tuple[MotionStep, ...]:
    """Return the steps without their lengths, which an unmeasured way has in their place."""
    return tuple(
        replace(step, step_m=0.0) if isfinite(step.step_m) else step
        for step in steps
        if isfinite(step.step_m) or isfinite(step.turn_rad)
    )
