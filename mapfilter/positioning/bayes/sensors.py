"""Sensors that no longer measure what they seem to: dead, stuck or stale.

A log goes on after a sensor has died. Motion rows end, steps lack a length, or a counter stands
still while the phone is carried on; a modem repeats its last report. :func:`watched` looks at an
epoch before any evidence is taken from it. For motion that was not measured it puts a step to all
sides into the epoch, as long as one goes in that time, so the belief grows as it must; a report
that stands still while the phone moves is taken out.

Rows that are missing, or lengths of zero, can also be those of a phone that rests, so levels
decide (:mod:`mapfilter.positioning.bayes.rest`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import exp, expm1, isfinite, nan, sqrt
from typing import NamedTuple

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.repeats import MotionRepeats, without_repeats
from mapfilter.positioning.bayes.rest import Rest, levels_of
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.tracks.speeds import walkers_unit_m

_GAP_S, _GAP_INTERVALS, _REGULAR = 5.0, 3.0, 0.02
"""After so long, in seconds and in intervals of the log, motion rows are missing; intervals of rows
at fixed times differ by less than this share."""
_KNOWN_ROWS = 10
_REST_MPS = 0.1
_RECENT_S, _SLOW_SHARE, _SLOWER_SHARE, _WALKERS_MPS = 2.5, 0.3, 0.5, 2.5
"""A walker, who is no faster than this in the mean, and slower for some seconds than the first
share of it, may have a counter that misses steps: levels decide, as at rest. Below the second one,
the speed is not learnt."""
_WALK_MPS = 1.4
"""Speed that is assumed before one is measured."""
_STRAIGHT_S = 60.0
"""Time after which the direction of an unmeasured way is forgotten by 1/e."""

_SPEED_ROWS, _FASTEST_MPS = 30, 9.0
"""Rows by which the mean speed is known; speed of one row that is no walker's in feet either."""

_NATS_PER_M, _MOST_ROWS = 0.12, 3
"""Gain, for each level of at most three, from a report that repeats the last one: by the metres
between them."""
_NATS_PER_REPORT, _NATS_PER_LEVEL = 1.9, 0.9
"""The most that a repeated report gains: of a single level, which a modem that works repeats in one
of seven to ten reports 10 to 20 m apart; several levels may repeat together, as slow modems renew
them together."""
_STALE_NATS = 8.0


@dataclass(frozen=True, slots=True)
class SensorWatch:
    """What is known of the sensors after an epoch.

    Parameters
    ----------
    motion_s : float
        Time of the last motion row; NaN before the first.
    rows : int
        Number of motion rows.
    interval_s, irregular_s : float
        Mean interval of motion rows, and the mean deviation from it.
    rests : bool
        Whether a row has reported that the phone stands.
    speed_mps : float
        Mean speed while it moves.
    moving_s : float
        Time of the last measured step at a walker's pace.
    known_s : float
        Time until which the way is measured, or in the belief as an unmeasured one.
    rest : Rest or None
        Reports since then, while no motion is reported, or little; None while it moves.
    unmeasured_s : float
        Time for which an unmeasured way is in the belief already.
    moved_m : float
        Distance since the last report, as measured.
    recent_mps : float
        Mean speed of the last seconds, in the unit of the steps per second.
    report : tuple of ReportRow
        The last report.
    repeated_nats : float
        How much repeated reports speak for a radio that stands still.
    repeats : MotionRepeats
        How motion rows repeat each other.
    fastest_mps : float
        Largest speed of a row, in the unit of the steps per second.
    """

    motion_s: float = nan
    rows: int = 0
    interval_s: float = 0.0
    irregular_s: float = 0.0
    rests: bool = False
    speed_mps: float = _WALK_MPS
    moving_s: float = nan
    known_s: float = nan
    rest: Rest | None = None
    unmeasured_s: float = 0.0
    moved_m: float = 0.0
    recent_mps: float = _WALK_MPS
    report: tuple[ReportRow, ...] = ()
    repeated_nats: float = 0.0
    repeats: MotionRepeats = field(default_factory=MotionRepeats)
    fastest_mps: float = 0.0

    @property
    def reports_always(self) -> bool:
        """Whether rows come at rest, too, so that missing ones are no rest."""
        if self.rows < _KNOWN_ROWS:
            return False
        return self.rests or self.irregular_s < _REGULAR * self.interval_s

    @property
    def other_unit_m(self) -> float:
        """Unit of steps with which the speed is a walker's where it is not in metres; else 1."""
        if self.rows < _SPEED_ROWS or self.fastest_mps > _FASTEST_MPS:
            return 1.0
        return walkers_unit_m(self.speed_mps)


UNMEASURED = frozenset(
    {Reason.NO_STEP, Reason.MOTION_MISSING, Reason.MOTION_STUCK, Reason.HEADING_STUCK}
)
"""Reasons for which the way of an epoch is not known."""


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
        Of motion and of the report: ``USED``, or ``NO_STEP``, ``MOTION_MISSING``,
        ``MOTION_STUCK``, ``HEADING_STUCK`` or ``DELIVERED_TWICE``, and ``STALE_RADIO``.
    """
    repeats, motion, repeated = without_repeats(
        watch.repeats, epoch.time_s, epoch.motion, step_unit_m
    )
    if motion is not epoch.motion:
        epoch = replace(epoch, motion=motion)
    steps = epoch.motion
    way, epoch, why = _followed(watch, epoch, step_unit_m)
    why = repeated if why is Reason.USED else why
    report, moved_m, nats = watch.report, way.moved_m, watch.repeated_nats
    if epoch.radio:
        nats = _repeated(watch, step_unit_m * moved_m, epoch.radio)
        report, moved_m = epoch.radio, 0.0
    fastest_mps = max(watch.fastest_mps, _row_mps(watch, epoch.time_s, steps))
    way = way._replace(moved_m=moved_m)
    watch = SensorWatch(*way, report, nats, repeats, fastest_mps)
    if epoch.radio and nats >= _STALE_NATS:
        return watch, replace(epoch, radio=()), (why, Reason.STALE_RADIO)
    return watch, epoch, (why, Reason.USED)


class _Way(NamedTuple):
    """What a watch holds of motion, in the order of its fields."""

    motion_s: float
    rows: int
    interval_s: float
    irregular_s: float
    rests: bool
    speed_mps: float
    moving_s: float
    known_s: float
    rest: Rest | None
    unmeasured_s: float
    moved_m: float
    recent_mps: float


def _followed(watch: SensorWatch, epoch: Epoch, step_unit_m: float) -> tuple[_Way, Epoch, Reason]:
    """Follow the motion rows; add the way that they lack."""
    time_s, why = epoch.time_s, Reason.USED
    steps = [abs(step.step_m) for step in epoch.motion]
    measured = [step_m for step_m in steps if isfinite(step_m)]
    gone_m, dt_s = sum(measured), time_s - watch.motion_s
    row_s = _usual_s(watch, dt_s) if isfinite(dt_s) else 0.0
    recent_mps = watch.recent_mps
    # A step after a pause covers the usual interval at most.
    step_s = min(row_s, watch.interval_s) if watch.rows > 1 else row_s
    if measured and step_s > 0:
        recent_mps += -expm1(-step_s / _RECENT_S) * (gone_m / step_s - recent_mps)
    goes = gone_m > _REST_MPS * row_s
    is_walker = watch.rows >= _SPEED_ROWS and step_unit_m * watch.speed_mps <= _WALKERS_MPS
    share = recent_mps / watch.speed_mps if is_walker else 1.0
    moves, usual = goes and share >= _SLOW_SHARE, goes and share >= _SLOWER_SHARE
    stands = bool(measured) and not goes
    way = _timed(watch, time_s, dt_s, gone_m, usual=usual, stands=stands, any_rows=bool(steps))
    way = way._replace(recent_mps=recent_mps)
    if moves:
        moved_m = way.moved_m + gone_m
        way = _Way(*way[:6], time_s, time_s, None, 0.0, moved_m, recent_mps)
        return way, epoch, why
    if not isfinite(way.moving_s):
        return way, epoch, why
    rest = way.rest or Rest(way.moving_s, pace_mps=step_unit_m * way.speed_mps)
    rest = rest.heard(time_s, epoch.radio, step_unit_m * gone_m)
    # A measured rest is none of the way, unless it was a counter that stood still.
    unmeasured_s = way.unmeasured_s + time_s - way.known_s
    if rest.is_carried:
        unmeasured_s = time_s - way.moving_s
    if steps and not measured:
        why = Reason.NO_STEP
    elif not steps and watch.reports_always:
        longest_s = max(_GAP_S, _GAP_INTERVALS * way.interval_s)
        why = Reason.MOTION_MISSING if time_s - way.motion_s > longest_s else Reason.USED
    if why is Reason.USED and rest.is_carried:
        why = Reason.MOTION_STUCK if steps else Reason.MOTION_MISSING
    way = way._replace(moved_m=way.moved_m + gone_m)
    if why is Reason.USED:
        return way._replace(rest=rest, known_s=time_s if measured else way.known_s), epoch, why
    step = _unmeasured(way.speed_mps, way.unmeasured_s, unmeasured_s)
    # Turns count though the length of their step is unknown.
    turned = (step for step in epoch.motion if isfinite(step.step_m) or isfinite(step.turn_rad))
    moved_m = way.moved_m + step.step_m
    way = _Way(*way[:7], time_s, rest, unmeasured_s, moved_m, recent_mps)
    return way, replace(epoch, motion=(*turned, step)), why


def _row_mps(watch: SensorWatch, time_s: float, steps: tuple[MotionStep, ...]) -> float:
    """Return the speed of an epoch's rows; of rows soon after others, over the usual interval."""
    gone_m = sum(abs(step.step_m) for step in steps if isfinite(step.step_m))
    lasted_s = max(time_s - watch.motion_s, watch.interval_s)
    return gone_m / lasted_s if watch.rows > 1 and lasted_s > 0 else 0.0


def _usual_s(watch: SensorWatch, dt_s: float) -> float:
    """Return the time that a row covers: after a rest without rows only the usual interval."""
    return min(dt_s, _GAP_INTERVALS * watch.interval_s) if watch.rows > 1 else dt_s


def _timed(
    watch: SensorWatch,
    time_s: float,
    dt_s: float,
    moved_m: float,
    *,
    usual: bool,
    stands: bool,
    any_rows: bool,
) -> _Way:
    """Learn from an epoch's motion rows how often they come, and how fast one moves."""
    motion_s, rows, moving_s, known_s = watch.motion_s, watch.rows, watch.moving_s, watch.known_s
    interval_s, irregular_s, speed_mps = watch.interval_s, watch.irregular_s, watch.speed_mps
    if any_rows:
        if isfinite(dt_s) and dt_s > 0:
            new = 1 / min(rows, 20)
            # What a gap says of the usual interval is bounded.
            dt_s = min(dt_s, 5 * interval_s) if rows > _KNOWN_ROWS else dt_s
            interval_s += new * (dt_s - interval_s)
            irregular_s += new * (abs(dt_s - interval_s) - irregular_s)
            if usual:
                # By time: of two rows at almost the same one, the speed would be any.
                speed_mps += 0.05 * (moved_m - speed_mps * dt_s) / interval_s
        motion_s, rows = time_s, rows + 1
        moving_s = moving_s if isfinite(moving_s) else time_s
        known_s = known_s if isfinite(known_s) else time_s
    return _Way(
        motion_s,
        rows,
        interval_s,
        irregular_s,
        watch.rests or stands,
        speed_mps,
        moving_s,
        known_s,
        watch.rest,
        watch.unmeasured_s,
        watch.moved_m,
        watch.recent_mps,
    )


def _unmeasured(speed_mps: float, from_s: float, to_s: float) -> MotionStep:
    """Return the step to all sides between two times since the last measured one."""
    more_m2 = spread_m2(speed_mps, to_s) - spread_m2(speed_mps, from_s)
    return MotionStep(speed_mps * (to_s - from_s), nan, nan, sqrt(max(more_m2, 0.0)))


def spread_m2(speed_mps: float, time_s: float) -> float:
    """Return the mean square of the distance of a way that forgets its direction."""
    lasts_s = _STRAIGHT_S
    return 2 * speed_mps**2 * lasts_s * (time_s - lasts_s * (1 - exp(-time_s / lasts_s)))


def _repeated(watch: SensorWatch, moved_m: float, radio: tuple[ReportRow, ...]) -> float:
    """Return how much reports speak for a radio that stands still, some way after the last one."""
    if not _equal(radio, watch.report):
        return 0.0
    # Beyond the end of its scale a level stays the same anywhere.
    levels = min(len(levels_of(radio)), _MOST_ROWS)
    most = max(_NATS_PER_REPORT, _NATS_PER_LEVEL * levels)
    return watch.repeated_nats + min(levels * _NATS_PER_M * moved_m, most) if levels else 0.0


def _equal(report: tuple[ReportRow, ...], before: tuple[ReportRow, ...]) -> bool:
    if len(report) != len(before):
        return False
    for row, other in zip(report, before, strict=True):
        level_dbm, other_dbm = row.level_dbm, other.level_dbm
        # Nearly all pairs differ in the level of their first rows.
        if level_dbm != other_dbm and (isfinite(level_dbm) or isfinite(other_dbm)):
            return False
        if row is not other and _key(row) != _key(other):
            return False
    return True


def _key(row: ReportRow) -> tuple[object, ...]:
    measured = [x if isfinite(x) else None for x in (row.level_dbm, row.timing_advance)]
    return row.role, row.cell, row.arfcn, row.bsic, row.censored, *measured
