"""The one loop over time. It serves replays; a live stream takes the same steps one by one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from mapfilter.filters.contract import Filter, MotionStep, Reason, UpdateInfo

BeliefT = TypeVar("BeliefT")
ReadingT = TypeVar("ReadingT")


@dataclass(frozen=True, slots=True)
class Event(Generic[ReadingT]):
    """One thing that happened: a motion interval that ended, or a reading.

    Parameters
    ----------
    time_s : float
        When; for motion the end of the interval.
    motion : MotionStep or None
        Dead reckoning, if it is that.
    reading : object or None
        What the filter's ``update`` takes, if it is that.
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
    reason : Reason
        Whether the event was used.
    info : UpdateInfo or None
        News of the update; None after a motion.
    """

    event: Event[ReadingT]
    belief: BeliefT
    reason: Reason
    info: UpdateInfo | None


def step(
    filter_: Filter[object, BeliefT, ReadingT],
    belief: BeliefT,
    event: Event[ReadingT],
    rng: np.random.Generator,
) -> Step[BeliefT, ReadingT]:
    """Take one event in."""
    reason, info = Reason.USED, None
    if event.motion is not None:
        belief, reason = filter_.predict(belief, event.motion, rng)
    if event.reading is not None:
        belief, info = filter_.update(belief, event.reading, rng)
        reason = info.reason
    return Step(event, belief, reason, info)


def run(
    filter_: Filter[object, BeliefT, ReadingT],
    belief: BeliefT,
    events: Iterable[Event[ReadingT]],
    rng: np.random.Generator,
) -> Iterator[Step[BeliefT, ReadingT]]:
    """Yield the belief after every event, in the order given."""
    for event in events:
        taken = step(filter_, belief, event, rng)
        belief = taken.belief
        yield taken
