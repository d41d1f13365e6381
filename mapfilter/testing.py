"""The contract suite: what every filter promises, for filters that users write.

Import :func:`check_filter` into a test of your own and hand it your filter::

    def test_my_filter_keeps_the_contract():
        check_filter(make, prior, motions, readings)
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from mapfilter.filters.contract import (
    Estimate,
    Event,
    Filter,
    MotionStep,
    Reason,
    Status,
    Step,
    UpdateInfo,
    run,
    step,
)

AnyFilter = Filter[Any, Any, Any]


class ContractError(AssertionError):
    """A filter breaks its contract; the message says which clause."""


def same(a: Any, b: Any) -> bool:
    """Tell whether two beliefs, estimates or news are equal to the last bit."""
    if is_dataclass(a) and not isinstance(a, type):
        return type(a) is type(b) and all(
            same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)
        )
    if isinstance(a, np.ndarray):
        alike = isinstance(b, np.ndarray) and a.dtype == b.dtype
        return alike and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return bool(a is b or a == b or (a != a and b != b))


def check_filter(
    make: Callable[[], AnyFilter],
    prior: Any,
    motions: Sequence[MotionStep],
    readings: Sequence[Any],
    *,
    seed: int = 0,
) -> None:
    """Check a filter against the contract of :mod:`mapfilter.filters.contract`.

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
    """Tell whether two estimates differ by rounding at most, as sums in another order do."""
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
