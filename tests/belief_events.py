"""Events one after another through a filter of beliefs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from mapfilter.filters.contract import BeliefFilter, MotionStep, Reason, UpdateInfo

StepBeliefT = TypeVar("StepBeliefT")
EventT = TypeVar("EventT")


@dataclass(frozen=True, slots=True)
class Event(Generic[EventT]):
    """What happened at one moment: a motion interval that ended, a reading, or both.

    With both, the belief is moved first and weighed then.

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
    filter_: BeliefFilter[object, StepBeliefT, EventT],
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
    filter_: BeliefFilter[object, StepBeliefT, EventT],
    belief: StepBeliefT,
    events: Iterable[Event[EventT]],
    rng: np.random.Generator,
) -> Iterator[Step[StepBeliefT, EventT]]:
    """Yield the belief after every event, in the order given."""
    for event in events:
        taken = step(filter_, belief, event, rng)
        belief = taken.belief
        yield taken
