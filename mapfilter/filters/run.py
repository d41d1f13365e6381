"""The one loop over time. It serves replays; a live stream takes the same steps one by one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from mapfilter.filters.contract import Filter, MotionStep, Reason, UpdateInfo

BeliefT = TypeVar("BeliefT")
ReadingT = TypeVar("ReadingT")


@dataclass(frozen=True, slots=True)
class Event(Generic[ReadingT]):
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
    reading: ReadingT | None = None


@dataclass(frozen=True, slots=True)
class Step(Generic[BeliefT, ReadingT]):
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
        News of the update; None without a reading.
    """

    event: Event[ReadingT]
    belief: BeliefT
    motion_reason: Reason
    info: UpdateInfo | None


def step(
    filter_: Filter[Any, BeliefT, ReadingT],
    belief: BeliefT,
    event: Event[ReadingT],
    rng: np.random.Generator,
) -> Step[BeliefT, ReadingT]:
    """Take one event in."""
    motion_reason, info = Reason.USED, None
    if event.motion is not None:
        belief, motion_reason = filter_.predict(belief, event.motion, rng)
    if event.reading is not None:
        belief, info = filter_.update(belief, event.reading, rng)
    return Step(event, belief, motion_reason, info)


def run(
    filter_: Filter[Any, BeliefT, ReadingT],
    belief: BeliefT,
    events: Iterable[Event[ReadingT]],
    rng: np.random.Generator,
) -> Iterator[Step[BeliefT, ReadingT]]:
    """Yield the belief after every event, in the order given."""
    for event in events:
        taken = step(filter_, belief, event, rng)
        belief = taken.belief
        yield taken
