"""Contract suites: what every filter promises, for filters that users write.

Import :func:`check_filter` into a test of your own and hand it your filter, a database and a log::

    def test_my_filter_keeps_the_contract():
        check_filter(MyFilter, database, log)

:func:`check_belief_filter` checks a filter of beliefs by itself, without database and log.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from math import isfinite, nan
from typing import Any, Generic, TypeVar

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.filters.contract import (
    BeliefFilter,
    Estimate,
    MotionStep,
    Reason,
    Status,
    UpdateInfo,
)
from mapfilter.positioning.epochs import Epoch, epochs
from mapfilter.positioning.estimate import StepOutput
from mapfilter.positioning.filter import Filter, estimate_of, kinds_of, locate, usable_part
from mapfilter.positioning.locators import as_filter
from mapfilter.tracks.log import TrackLog

AnyFilter = BeliefFilter[Any, Any, Any]
_ORDER = {
    Status.SEARCHING: {Status.SEARCHING, Status.CONVERGED, Status.LOST},
    Status.CONVERGED: {Status.TRACKING, Status.LOST},
    Status.TRACKING: {Status.TRACKING, Status.LOST},
    Status.LOST: set(Status),
}


class ContractError(AssertionError):
    """A filter breaks its contract; the message names the clause."""


def same(a: Any, b: Any) -> bool:
    """Return whether two beliefs, estimates or news are equal to the last bit."""
    if is_dataclass(a) and not isinstance(a, type):
        return type(a) is type(b) and all(
            same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)
        )
    if isinstance(a, tuple | list):
        pairs = zip(a, b, strict=False) if type(a) is type(b) else ()
        return type(a) is type(b) and len(a) == len(b) and all(same(*pair) for pair in pairs)
    if isinstance(a, Mapping):
        alike = isinstance(b, Mapping) and a.keys() == b.keys()
        return alike and all(same(a[key], b[key]) for key in a)
    if isinstance(a, np.ndarray):
        alike = isinstance(b, np.ndarray) and a.dtype == b.dtype
        return alike and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return bool(a is b or a == b or (a != a and b != b))


StepBeliefT = TypeVar("StepBeliefT")
EventT = TypeVar("EventT")


@dataclass(frozen=True, slots=True)
class Event(Generic[EventT]):
    """What happened at one moment: a motion interval that ended, a reading, or both.

    With both, the belief is moved first and weighed then.

    Parameters
    ----------
    time_s : float
        When; for motion the end of the interval.
    motion : MotionStep or None
        Dead reckoning over the interval that ends now.
    reading : object or None
        What the filter's ``update`` takes.
    """

    time_s: float
    motion: MotionStep | None = None
    reading: EventT | None = None


@dataclass(frozen=True, slots=True)
class Step(Generic[StepBeliefT, EventT]):
    """The belief after one event, and the news.

    Parameters
    ----------
    event : Event
        What happened.
    belief : object
        The filter's belief after it.
    motion_reason : Reason
        Whether the motion was used; ``USED`` when there was none.
    info : UpdateInfo or None
        StepOutput of the update; None without a reading.
    """

    event: Event[EventT]
    belief: StepBeliefT
    motion_reason: Reason
    info: UpdateInfo | None


def step(
    filter_: BeliefFilter[Any, StepBeliefT, EventT],
    belief: StepBeliefT,
    event: Event[EventT],
    rng: np.random.Generator,
) -> Step[StepBeliefT, EventT]:
    """Take one event in."""
    motion_reason, info = Reason.USED, None
    if event.motion is not None:
        belief, motion_reason = filter_.predict(belief, event.motion, rng)
    if event.reading is not None:
        belief, info = filter_.update(belief, event.reading, rng)
    return Step(event, belief, motion_reason, info)


def run(
    filter_: BeliefFilter[Any, StepBeliefT, EventT],
    belief: StepBeliefT,
    events: Iterable[Event[EventT]],
    rng: np.random.Generator,
) -> Iterator[Step[StepBeliefT, EventT]]:
    """Yield the belief after every event, in the order given."""
    for event in events:
        taken = step(filter_, belief, event, rng)
        belief = taken.belief
        yield taken


def check_filter(
    filter_: Any, database: RadioRouteDatabase, log: TrackLog, *, seed: int = 0
) -> None:
    """Check a filter over a log against :class:`mapfilter.positioning.filter.Filter`.

    Parameters
    ----------
    filter_ : str, options, Filter, or class
        As :func:`mapfilter.locate` takes it: built-in and custom filters alike.
    database : RadioRouteDatabase
    log : TrackLog
        At least ten epochs with motion, in the CRS of the database.
    seed : int

    Raises
    ------
    ContractError
        With the clause that is broken: a fix for every epoch, statuses in order, radii that grow,
        finite positions once converged, states that are never changed in place, an epoch without
        measurements that moves nothing, a result that only the generator decides, one epoch at a
        time the same as the whole log.
    """
    bound = as_filter(filter_, database)
    log, _ = usable_part(log, bound)
    merged = epochs(log)
    if len(merged) < 10:
        raise ValueError("a log of at least ten epochs")
    replayed = locate(log, bound, np.random.default_rng(seed)).estimate
    again = locate(log, as_filter(filter_, database), np.random.default_rng(seed)).estimate
    _require(same(replayed, again), "the generator alone decides the result")
    outputs = _step_by_step(bound, merged, kinds_of(log), seed)
    live = estimate_of(bound, outputs, start_utc_s=log.start_utc_s)
    _require(len(live) == len(replayed), "one epoch at a time gives a fix for every epoch")
    if bound.smoother() is None:
        for name in ("east_m", "north_m", "covariance_m2", "radii_m", "status", "reason"):
            same_values = same(getattr(live, name), getattr(replayed, name))
            _require(same_values, f"one epoch at a time gives the {name} of the whole log")


def _step_by_step(
    bound: Filter[Any], merged: Sequence[Epoch], kinds: Any, seed: int
) -> list[StepOutput]:
    """Step through epochs; check purity, order of statuses and each output on the way."""
    rng = np.random.default_rng(seed)
    state, last = bound.begin(kinds), Status.SEARCHING
    outputs: list[StepOutput] = []
    for epoch in merged:
        kept, kept_epoch = copy.deepcopy(state), copy.deepcopy(epoch)
        after, output = bound.step(state, epoch, rng)
        _require(isinstance(output, StepOutput), "step returns (state, StepOutput)")
        _require(same(state, kept), "states are never changed in place")
        _require(same(epoch, kept_epoch), "epochs are never changed in place")
        _check_output(output, epoch, last)
        _check_idle(bound, after, output, epoch)
        state, last = after, output.fix.status
        outputs.append(output)
    return outputs


def _check_output(output: StepOutput, epoch: Epoch, last: Status) -> None:
    fix = output.fix
    _require(fix.time_s == epoch.time_s, "a fix has the time of its epoch")
    _require(isinstance(fix.status, Status) and isinstance(fix.reason, Reason), "types of a fix")
    _require(fix.status in _ORDER[last], f"{last} is not followed by {fix.status}")
    known = np.isfinite([fix.east_m, fix.north_m])
    if fix.status is not Status.SEARCHING:
        _require(bool(known.all()), "a filter that has converged gives a position")
    radii = fix.radii_m[np.isfinite(fix.radii_m)]
    _require(bool(np.all(np.diff(radii) >= 0)), "radii for 50, 67 and 95 % do not shrink")
    for reading in output.unused:
        _require(reading.reason is not Reason.USED, "unused readings have a reason")


def _check_idle(bound: Filter[Any], state: Any, output: StepOutput, epoch: Epoch) -> None:
    _, idle = bound.step(state, Epoch(epoch.time_s), np.random.default_rng(0))
    before, after = output.fix, idle.fix
    places = (before.east_m, before.north_m), (after.east_m, after.north_m)
    _require(
        np.allclose(*places, rtol=0, atol=1e-6, equal_nan=True),
        "an epoch without motion and measurements moves nothing",
    )


def check_belief_filter(
    make: Callable[[], AnyFilter],
    prior: Any,
    motions: Sequence[MotionStep],
    readings: Sequence[Any],
    *,
    seed: int = 0,
) -> None:
    """Check a filter against the contract of :class:`mapfilter.filters.contract.BeliefFilter`.

    Parameters
    ----------
    make : callable
        Makes the filter; called several times.
    prior : object
        What ``init`` takes.
    motions : sequence of MotionStep
        Some steps, at least ten, that move.
    readings : sequence of object
        What ``update`` takes, as many as steps; None for none.
    seed : int

    Raises
    ------
    ContractError
        With the clause that is broken: types, statuses in order, estimates with a positive
        covariance and growing radii, beliefs that are never changed in place, absent steps and
        steps of nothing that change nothing, results that only the generator decides, one event
        at a time the same as all at once.
    """
    if len(motions) < 10 or len(readings) != len(motions):
        raise ValueError("at least ten steps, and one reading (or None) for each")
    events = [
        Event(float(i), motion, reading)
        for i, (motion, reading) in enumerate(zip(motions, readings, strict=True))
    ]
    steps = _follow(make(), prior, events, seed)
    _check_types(make(), steps)
    _check_statuses(steps)
    _check_purity(make(), prior, events, seed)
    _check_nothing(make(), steps)
    _check_determinism(make, prior, events, seed, steps)


def _follow(
    filter_: AnyFilter, prior: Any, events: Sequence[Event[Any]], seed: int
) -> list[Step[Any, Any]]:
    rng = np.random.default_rng(seed)
    return list(run(filter_, filter_.init(prior, rng), events, rng))


def _require(holds: bool, clause: str) -> None:
    if not holds:
        raise ContractError(clause)


def _check_types(filter_: AnyFilter, steps: Sequence[Step[Any, Any]]) -> None:
    for taken in steps:
        _require(isinstance(taken.motion_reason, Reason), "predict returns (belief, Reason)")
        if taken.info is not None:
            _require(isinstance(taken.info, UpdateInfo), "update returns (belief, UpdateInfo)")
            _require(taken.info.hypotheses >= 0, "hypotheses are counted from 0")
        said = filter_.locate(taken.belief)
        _require(isinstance(said, Estimate), "locate returns an Estimate")
        _require(np.shape(said.covariance_m2) == (2, 2), "covariance_m2 has the shape (2, 2)")
        _require(np.shape(said.radii_m) == (3,), "radii_m has the shape (3,)")
        known = isfinite(said.east_m)
        _require(known == isfinite(said.north_m), "east and north are both known, or neither")
        if known and np.all(np.isfinite(said.covariance_m2)):
            least = float(np.linalg.eigvalsh(said.covariance_m2).min())
            _require(least >= -1e-9, "covariance_m2 has no negative eigenvalue")
        if np.all(np.isfinite(said.radii_m)):
            _require(bool(np.all(np.diff(said.radii_m) >= 0)), "radii_m grow with their share")


def _check_statuses(steps: Sequence[Step[Any, Any]]) -> None:
    before = Status.SEARCHING
    for taken in steps:
        if taken.info is None:
            continue
        after = taken.info.status
        if after is Status.TRACKING:
            _require(before is not Status.SEARCHING, "TRACKING comes after CONVERGED")
        if after is Status.CONVERGED:
            _require(
                before in (Status.SEARCHING, Status.LOST), "CONVERGED comes after SEARCHING or LOST"
            )
        before = after


def _check_purity(filter_: AnyFilter, prior: Any, events: Sequence[Event[Any]], seed: int) -> None:
    rng = np.random.default_rng(seed)
    kept_prior = copy.deepcopy(prior)
    belief, seen = filter_.init(prior, rng), []
    for event in events:
        seen.append((belief, copy.deepcopy(belief), event.reading, copy.deepcopy(event.reading)))
        if event.motion is not None:
            belief, _ = filter_.predict(belief, event.motion, rng)
            seen.append((belief, copy.deepcopy(belief), None, None))
        if event.reading is not None:
            belief, _ = filter_.update(belief, event.reading, rng)
        filter_.locate(belief)
    for given, as_it_was, reading, reading_as_it_was in seen:
        _require(same(given, as_it_was), "beliefs are never changed in place")
        _require(same(reading, reading_as_it_was), "readings are never changed in place")
    _require(same(prior, kept_prior), "the prior is never changed in place")


def _check_nothing(filter_: AnyFilter, steps: Sequence[Step[Any, Any]]) -> None:
    rng = np.random.default_rng(0)
    for taken in steps[:: max(len(steps) // 3, 1)]:
        belief, heading = taken.belief, taken.event.motion
        absent, why = filter_.predict(belief, MotionStep(nan, 0.3), rng)
        _require(same(absent, belief), "a step of unknown length changes nothing")
        _require(why is not Reason.USED, "a step of unknown length is told")
        still = MotionStep(0.0, heading.heading_rad if heading is not None else 0.0, 0.0)
        stayed, _ = filter_.predict(belief, still, rng)
        _require(
            _alike(filter_.locate(stayed), filter_.locate(belief)),
            "a step of nothing moves nothing",
        )
        (none,) = run(filter_, belief, [Event(0.0)], rng)
        _require(none.belief is belief, "an absent reading changes nothing")


def _alike(a: Estimate, b: Estimate) -> bool:
    """Return whether two estimates differ by rounding at most, as sums in another order do."""
    pairs = ((getattr(a, one.name), getattr(b, one.name)) for one in fields(Estimate))
    return all(np.allclose(x, y, rtol=1e-9, atol=1e-9, equal_nan=True) for x, y in pairs)


def _check_determinism(
    make: Callable[[], AnyFilter],
    prior: Any,
    events: Sequence[Event[Any]],
    seed: int,
    steps: Sequence[Step[Any, Any]],
) -> None:
    again = _follow(make(), prior, events, seed)
    filter_, rng = make(), np.random.default_rng(seed)
    belief = filter_.init(prior, rng)
    for event, first, second in zip(events, steps, again, strict=True):
        _require(same(first.belief, second.belief), "the generator alone decides the result")
        taken = step(filter_, belief, event, rng)
        belief = taken.belief
        _require(
            same(belief, first.belief) and same(taken.info, first.info),
            "one event at a time gives what all at once give",
        )
