"""Contract suites for filters, built-in and custom.

Import :func:`check_filter` into a test and give it a filter, a database and a log::

    def test_my_filter_keeps_the_contract():
        check_filter(MyFilter, database, log)

:func:`check_belief_filter` checks a filter of beliefs alone, without database and log.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from math import isfinite, isnan, nan
from typing import Any

import numpy as np

from mapfilter._arguments import Argument, check_arguments
from mapfilter._same import same
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError
from mapfilter.filters.contract import (
    BeliefFilter,
    Estimate,
    MotionStep,
    Reason,
    ReturnTypeError,
    Status,
    UpdateInfo,
)
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.filter import Filter
from mapfilter.positioning.locators import as_filter
from mapfilter.positioning.loop import estimate_of, kinds_of, locate, usable_part
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.step_output import StepOutput
from mapfilter.positioning.user_errors import ADVICE
from mapfilter.tracks.log import TrackLog

_ROUNDING = 1e-9
_PLACE = ("east_m", "north_m", "covariance_m2")
_TRACKED = {Status.TRACKING, Status.UNCERTAIN}
_ORDER = {
    Status.SEARCHING: set(Status) - _TRACKED,
    Status.CONVERGED: _TRACKED | {Status.LOST, Status.OUTSIDE},
    Status.TRACKING: _TRACKED | {Status.LOST, Status.OUTSIDE},
    Status.UNCERTAIN: _TRACKED | {Status.LOST, Status.OUTSIDE},
    Status.LOST: set(Status),
    Status.OUTSIDE: set(Status),
}
_BELIEF_ORDER = {
    Status.SEARCHING: set(Status) - _TRACKED,
    Status.CONVERGED: set(Status) - {Status.CONVERGED},
    Status.TRACKING: set(Status) - {Status.CONVERGED},
    Status.UNCERTAIN: set(Status) - {Status.CONVERGED},
    Status.LOST: set(Status),
    Status.OUTSIDE: set(Status),
}
"""Statuses that may follow each other over epochs, and from update to update of a belief."""


class ContractError(AssertionError):
    """A filter breaks its contract; the message names the clause."""


def check_filter(
    filter_: Any, database: RadioRouteDatabase, log: TrackLog, *, seed: int = 0
) -> None:
    """Check a filter over a log against :class:`mapfilter.positioning.filter.Filter`.

    Parameters
    ----------
    filter_ : str, options, Filter, or class
        As :func:`mapfilter.locate` takes it: built-in and custom filters alike.
    log : TrackLog
        At least ten epochs with motion, in the CRS of the database.

    Raises
    ------
    ContractError
        With the clause that is broken: a fix for every epoch, statuses in order, covariances that
        are symmetric without negative eigenvalues, radii that grow and, as protection levels, are
        not negative, shares between 0 and 1, finite positions once converged, states that are never
        changed in place, an epoch without measurements that moves nothing, a result that only the
        generator decides, one epoch at a time the same as the whole log, functions that return what
        they have to.
    ConfigError
        The code of a custom filter ends in an error, with its file and line; or database and log
        are none.
    ValueError
        The log has fewer than ten epochs.
    """
    check_arguments(
        "check_filter",
        Argument("filter_", filter_, object, "a filter, its options, its class or its name"),
        Argument("database", database, RadioRouteDatabase, "a database of open_database or build"),
        Argument("log", log, TrackLog, "a log of read_log or make_log"),
    )
    with _named_clause():
        _check_filter(filter_, database, log, seed)


@contextmanager
def _named_clause() -> Iterator[None]:
    """Name the clause of a function that returns something else; advise nobody to call this."""
    try:
        yield
    except ReturnTypeError as error:
        raise ContractError(str(error)) from error
    except ConfigError as error:
        if isinstance(error.__cause__, ReturnTypeError):
            raise ContractError(str(error.__cause__)) from error
        plain = (replace(one, hint="") if one.hint == ADVICE else one for one in error.faults)
        raise ConfigError(tuple(plain)) from error.__cause__


def _check_filter(filter_: Any, database: RadioRouteDatabase, log: TrackLog, seed: int) -> None:
    bound = as_filter(filter_, database)
    log, _ = usable_part(log, bound)
    merged = epochs(log)
    if len(merged) < 10:
        raise ValueError("a log of at least ten epochs")
    try:
        replayed = locate(log, bound, np.random.default_rng(seed)).estimate
    except (TypeError, ValueError):
        # Of arrays in other shapes no estimate can be made; step by step their clause is named.
        _step_by_step(bound, merged, kinds_of(log), seed)
        raise
    again = locate(log, as_filter(filter_, database), np.random.default_rng(seed)).estimate
    _require(same(replayed, again), "the generator alone decides the result")
    outputs = _step_by_step(bound, merged, kinds_of(log), seed)
    live = estimate_of(bound, outputs, start_utc_s=log.start_utc_s)
    _require(len(live) == len(replayed), "one epoch at a time gives a fix for every epoch")
    if bound.smoother() is None:
        for name in (*_PLACE, "radii_m", "radius_99_m", "protection_m", "status", "reason"):
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
    _require(known[0] == known[1], "east and north are both known, or neither")
    _check_spread(fix.covariance_m2, fix.radii_m)
    radii = fix.radii_m[np.isfinite(fix.radii_m)]
    wide = not fix.radius_99_m < radii.max(initial=0.0)
    _require(wide, "the radius for 99 % is not below that for 95 %")
    _require(not fix.protection_m < 0, "a protection level is not negative")
    _require(fix.hypotheses >= 0, "hypotheses are counted from 0")
    for name in ("mass_50m", "way_probability"):
        outside = not -_ROUNDING <= getattr(fix, name) <= 1 + _ROUNDING
        _require(not outside or isnan(getattr(fix, name)), f"{name} lies between 0 and 1")
    for reading in output.unused:
        _require(reading.reason is not Reason.USED, "unused readings have a reason")


def _check_spread(covariance_m2: Any, radii_m: Any) -> None:
    """Check a covariance, and radii for 50, 67 and 95 %, where they are known."""
    _require(np.shape(covariance_m2) == (2, 2), "covariance_m2 has the shape (2, 2)")
    _require(np.shape(radii_m) == (3,), "radii_m has the shape (3,)")
    covariance = np.asarray(covariance_m2, dtype=np.float64)
    if np.isfinite(covariance).all():
        # Beliefs of an area come with variances of millions of square metres.
        size = 1.0 + float(np.abs(covariance).max())
        skew = float(abs(covariance[0, 1] - covariance[1, 0]))
        _require(skew <= _ROUNDING * size, "covariance_m2 is symmetric")
        least = float(np.linalg.eigvalsh(covariance).min())
        _require(least >= -_ROUNDING * size, "covariance_m2 has no negative eigenvalue")
    radii = np.asarray(radii_m, dtype=np.float64)
    radii = radii[np.isfinite(radii)]
    _require(bool(np.all(radii >= 0)), "radii are not negative")
    _require(bool(np.all(np.diff(radii) >= 0)), "radii for 50, 67 and 95 % do not shrink")


def _check_idle(bound: Filter[Any], state: Any, output: StepOutput, epoch: Epoch) -> None:
    _, idle = bound.step(state, Epoch(epoch.time_s), np.random.default_rng(0))
    before, after = output.fix, idle.fix
    places = (before.east_m, before.north_m), (after.east_m, after.north_m)
    _require(
        np.allclose(*places, rtol=0, atol=1e-6, equal_nan=True),
        "an epoch without motion and measurements moves nothing",
    )


def check_belief_filter(
    make: Callable[[], BeliefFilter[Any, Any, Any]],
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
        What ``update`` takes, one for each step, or None.

    Raises
    ------
    ContractError
        With the clause that is broken: types, statuses in order, estimates with a symmetric
        covariance without negative eigenvalues and growing radii, beliefs, readings and prior that
        are never changed in place, steps of unknown length or of length 0 that change nothing,
        results that only the generator decides.
    """
    if len(motions) < 10 or len(readings) != len(motions):
        raise ValueError("at least ten steps, and one reading (or None) for each")
    beliefs, infos = _follow(make(), prior, motions, readings, seed)
    again = _follow(make(), prior, motions, readings, seed)
    for first, second in zip((*beliefs, *infos), (*again[0], *again[1]), strict=True):
        _require(same(first, second), "the generator alone decides the result")
    filter_, rng = make(), np.random.default_rng(0)
    every = max(len(beliefs) // 3, 1)
    for belief, motion in zip(beliefs[::every], motions[::every], strict=True):
        absent, why = filter_.predict(belief, MotionStep(nan, 0.3), rng)
        _require(same(absent, belief), "a step of unknown length changes nothing")
        _require(why is not Reason.USED, "a step of unknown length is labelled as not used")
        stayed, _ = filter_.predict(belief, MotionStep(0.0, motion.heading_rad, 0.0), rng)
        # Sums in another order differ by rounding.
        before, after = filter_.locate(belief), filter_.locate(stayed)
        for name in (one.name for one in fields(Estimate)):
            pair = getattr(before, name), getattr(after, name)
            alike = np.allclose(*pair, rtol=1e-9, atol=1e-9, equal_nan=True)
            _require(alike, "a step of length 0 moves nothing")


def _follow(
    filter_: BeliefFilter[Any, Any, Any],
    prior: Any,
    motions: Sequence[MotionStep],
    readings: Sequence[Any],
    seed: int,
) -> tuple[list[Any], list[UpdateInfo | None]]:
    """Return the belief and the information after each event; check types, statuses and purity."""
    rng, status = np.random.default_rng(seed), Status.SEARCHING
    seen = [("the prior is", prior, copy.deepcopy(prior))]
    belief = filter_.init(prior, rng)
    beliefs: list[Any] = []
    infos: list[UpdateInfo | None] = []
    for motion, reading in zip(motions, readings, strict=True):
        seen.append(("beliefs are", belief, copy.deepcopy(belief)))
        belief, why = filter_.predict(belief, motion, rng)
        _require(isinstance(why, Reason), "predict returns (belief, Reason)")
        seen.append(("beliefs are", belief, copy.deepcopy(belief)))
        info = None
        if reading is not None:
            seen.append(("readings are", reading, copy.deepcopy(reading)))
            belief, info = filter_.update(belief, reading, rng)
            _require(isinstance(info, UpdateInfo), "update returns (belief, UpdateInfo)")
            _require(info.hypotheses >= 0, "hypotheses are counted from 0")
            _require(
                info.status in _BELIEF_ORDER[status], f"{status} is not followed by {info.status}"
            )
            status = info.status
        _check_estimate(filter_.locate(belief))
        beliefs.append(belief)
        infos.append(info)
    for what, given, as_it_was in seen:
        _require(same(given, as_it_was), f"{what} never changed in place")
    return beliefs, infos


def _check_estimate(located: Any) -> None:
    _require(isinstance(located, Estimate), "locate returns an Estimate")
    known = isfinite(located.east_m)
    _require(known == isfinite(located.north_m), "east and north are both known, or neither")
    _check_spread(located.covariance_m2, located.radii_m)


def _require(holds: bool, clause: str) -> None:
    if not holds:
        raise ContractError(clause)
