"""The one loop over time: order, what is called and what is told."""

from math import nan

import numpy as np
import pytest
from belief_events import Event, Step, run, step

from mapfilter.filters.contract import MotionStep, Reason, Status, UpdateInfo

MOVE = MotionStep(1.0, 0.5)


class Recorder:
    """Its belief is the tuple of everything it was asked to do, and a draw for each."""

    def init(self, prior, rng):
        return ((prior, rng.random()),)

    def predict(self, belief, motion, rng):
        reason = Reason.USED if np.isfinite(motion.step_m) else Reason.NO_STEP
        return (*belief, (motion.step_m, rng.random())), reason

    def update(self, belief, reading, rng):
        info = UpdateInfo(Reason.USED, Status.SEARCHING, len(belief))
        return (*belief, (reading, rng.random())), info


def asked(belief):
    return [what for what, _ in belief]


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_the_belief_is_moved_first_and_weighed_then(rng):
    taken = step(Recorder(), (), Event(3.0, MOVE, "A"), rng)
    assert asked(taken.belief) == [1.0, "A"]
    assert (taken.motion_reason, taken.info.hypotheses) == (Reason.USED, 1)
    assert taken.event == Event(3.0, MOVE, "A")


def test_motion_alone_brings_no_news_and_a_reading_alone_no_motion(rng):
    moved = step(Recorder(), (), Event(0.0, motion=MOVE), rng)
    assert (asked(moved.belief), moved.info) == ([1.0], None)
    weighed = step(Recorder(), (), Event(0.0, reading="A"), rng)
    assert (asked(weighed.belief), weighed.motion_reason) == (["A"], Reason.USED)


def test_an_event_without_anything_changes_nothing_and_draws_nothing(rng):
    belief = (("start", 0.0),)
    taken = step(Recorder(), belief, Event(1.0), rng)
    assert taken == Step(Event(1.0), belief, Reason.USED, None)
    assert taken.belief is belief
    assert rng.random() == np.random.default_rng(5).random()


@pytest.mark.parametrize("reading", [0, "", 0.0, False])
def test_readings_that_are_false_are_readings_all_the_same(rng, reading):
    taken = step(Recorder(), (), Event(1.0, reading=reading), rng)
    assert asked(taken.belief) == [reading]


def test_motion_that_was_not_used_is_told(rng):
    taken = step(Recorder(), (), Event(1.0, MotionStep(nan, 0.0), "A"), rng)
    assert taken.motion_reason is Reason.NO_STEP
    assert taken.info.reason is Reason.USED


EVENTS = [Event(0.0, MOVE), Event(0.0, MotionStep(2.0, 0.0), "A"), Event(1.0, reading="B")]


def test_events_are_taken_in_the_order_given(rng):
    steps = list(run(Recorder(), (), EVENTS, rng))
    assert [taken.event for taken in steps] == EVENTS
    assert asked(steps[-1].belief) == [1.0, 2.0, "A", "B"]
    assert [len(taken.belief) for taken in steps] == [1, 3, 4]


def test_a_stream_is_served_as_it_comes(rng):
    given = []

    def stream():
        for event in EVENTS:
            given.append(event)
            yield event

    steps = run(Recorder(), (), stream(), rng)
    assert given == []
    for count in range(1, 4):
        next(steps)
        assert len(given) == count


def test_live_steps_are_the_replay_draw_by_draw():
    filter_, live_rng = Recorder(), np.random.default_rng(9)
    replay_rng = np.random.default_rng(9)
    belief = filter_.init("A", live_rng)
    replay = run(filter_, filter_.init("A", replay_rng), EVENTS, replay_rng)
    for event, expected in zip(EVENTS, replay, strict=True):
        taken = step(filter_, belief, event, live_rng)
        belief = taken.belief
        assert taken == expected


def test_no_event_gives_no_step(rng):
    assert list(run(Recorder(), (), [], rng)) == []
