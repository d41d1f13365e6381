"""What a smoother keeps: bounded bytes, and a jitter no less than the forward pass has."""

import inspect
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest
from small_area import make_area

from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.street_motion import STATES, MotionErrors
from mapfilter.positioning.bayes.beliefs import smoothing
from mapfilter.positioning.bayes.beliefs.legs import NO_LEG
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.beliefs.smoothing import BayesSmoother
from mapfilter.positioning.bayes.rivals.hold import Hold

COUNT = 10
KEPT_BYTES = COUNT * (5 * 4 + 4)
"""Five rows of the state and a weight, in single precision."""


def state_at(travelled_m):
    reckoning = DeadReckoning(travelled_m, travelled_m)
    belief = SimpleNamespace(
        state=np.full((STATES, COUNT), travelled_m, dtype=np.float32), log_weight=np.zeros(COUNT)
    )
    return SimpleNamespace(
        reckoning=reckoning, belief=belief, alternative=None, takeovers=0, hold=Hold(),
        leg=NO_LEG, alone_from_m=nan, held=(),
    )  # fmt: skip


@pytest.mark.parametrize(("room", "expected_m", "every_m"), [
    (11, [10.0 * k for k in range(11)], 10.0),
    # Twelve would be too many: every second is left, and the next come after twice the distance.
    (10, [0.0, 20.0, 40.0, 60.0, 80.0, 100.0], 20.0),
    (3, [0.0, 40.0, 80.0], 40.0),
])  # fmt: skip
def test_beliefs_are_kept_less_often_where_they_would_take_too_much(
    monkeypatch, room, expected_m, every_m
):
    monkeypatch.setattr(smoothing, "_MAX_BYTES", room * KEPT_BYTES)
    history, before = BayesSmoother(make_area(), MotionErrors(), every_m=10.0), state_at(0.0)
    most = 0
    for travelled_m in range(0, 101, 5):
        after = state_at(float(travelled_m))
        history.add(before, after)
        before = after
        held = [one.state.nbytes + one.log_weight.nbytes for one in history.kept]
        assert set(held) == {KEPT_BYTES}
        most = max(most, sum(held))
    assert [one.travelled_m for one in history.kept] == expected_m
    assert history.every_m == every_m
    assert most <= room * KEPT_BYTES
    assert len(history.moved) == 21


def test_the_usual_jitter_is_that_of_copies_while_searching():
    """Ancestors of jittered copies would not be found otherwise."""
    usual = inspect.signature(BayesSmoother.smoothed).parameters["jitter"].default
    options = ParticleOptions()
    assert usual == options.searching_jitter[:5]
    assert all(one >= other for one, other in zip(usual, options.jitter, strict=False))


def test_a_smoother_keeps_a_belief_every_five_metres():
    assert BayesSmoother(make_area(), MotionErrors()).every_m == 5.0
    assert inspect.signature(BayesSmoother.smoothed).parameters["paths"].default == 200
