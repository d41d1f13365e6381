"""The one loop over epochs: what filters, smoothers and recorders are given, and what counts."""

import time
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from cross_world import walk_log

from mapfilter.errors import ConfigError, InputError
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.filter import Filter, Hypotheses, StepOutput
from mapfilter.positioning.loop import _Album, estimate_of, locate, usable_part
from mapfilter.positioning.step_output import Fix

GNSS = pd.DataFrame({"time_s": [3.0, 4.0, 5.0], "east_m": 1.0, "north_m": 2.0})


class Tail:
    """A belief whose level is 7 over the risk."""

    def radius_m(self, share):
        return 100.0 * share

    def protection_m(self, risk):
        return 7.0 / risk


class Drawing(Filter):
    """Stands at a random place; its states are the numbers of epochs."""

    name, crs = "drawing", "EPSG:32629"
    uses = ("motion",)

    def __init__(self, smoother=None):
        self.seen, self._smoother = [], smoother

    def warm_up(self, merged):
        self.seen.append(len(merged))

    def begin(self, kinds=()):
        self.seen.append(kinds)
        return 0

    def step(self, state, epoch, rng):
        fix = Fix(epoch.time_s, rng.random(), 2.0, np.eye(2), np.array([1.0, 2.0, 3.0]),
                  Status.TRACKING, 1, 1.0, 0, np.nan, Reason.USED, 0.5, 0.25)  # fmt: skip
        return state + 1, StepOutput(fix, tail=Tail())

    def smoother(self):
        return self._smoother


def located(filter_=None, seed=4, **given):
    return locate(walk_log(), filter_ or Drawing(), np.random.default_rng(seed), **given)


def test_what_cannot_be_located_is_told():
    with pytest.raises(ConfigError, match="risk"):
        located(risk=1.5)
    other = Drawing()
    other.crs = "EPSG:32630"
    with pytest.raises(InputError, match="another area or zone"):
        located(other)


def test_a_filter_is_warmed_up_before_it_begins():
    filter_ = Drawing()
    count = len(located(filter_).estimate)
    assert filter_.seen == [count, frozenset({"motion", "serving"})]


def test_levels_are_those_of_the_risk_that_is_asked_for():
    """The usual one's are those that the filter gave."""
    assert set(located().estimate.protection_m) == {0.25}
    found = located(risk=0.02).estimate
    assert set(found.protection_m) == {350.0}
    np.testing.assert_array_equal(found.radius_99_m, 99.0)


def test_a_recorder_sees_each_step_and_takes_no_time(monkeypatch):
    """With the generator as it was before."""
    steps, clock = [], [0.0]

    def record(before, _, rng, after, output):
        clock[0] += 10.0
        steps.append((before, after, rng.random() == output.fix.east_m))

    class Slow(Drawing):
        def step(self, state, epoch, rng):
            clock[0] += 0.5
            return super().step(state, epoch, rng)

    monkeypatch.setattr(time, "process_time", lambda: clock[0])
    found = located(Slow(), recorder=SimpleNamespace(record=record))
    count = len(found.estimate)
    assert steps == [(k, k + 1, True) for k in range(count)]
    assert found.filter_s == pytest.approx(0.5 * count)
    np.testing.assert_array_equal(found.estimate.east_m, located().estimate.east_m)


def test_hypotheses_are_kept_where_that_is_asked_for():
    class Searching(Drawing):
        def step(self, state, epoch, rng):  # noqa: ARG002
            return state, StepOutput(Fix.nowhere(epoch.time_s, Status.SEARCHING, Reason.NO_READING))

        def hypotheses(self, state):  # noqa: ARG002
            return Hypotheses(*np.zeros((3, 1)))

    assert located(Searching()).snapshots == ()
    assert len(located(Searching(), snapshots=True).snapshots) > 1


def test_a_smoother_is_given_each_state_and_makes_the_estimate():
    pairs = []

    class Smoother:
        def add(self, before, after):
            pairs.append((before, after))

        def smoothed(self, estimate, rng):
            assert np.isnan(estimate.protection_m).all()
            return estimate, float(rng.random())

    estimate, _ = located(Drawing(Smoother())).estimate
    assert pairs == [(k, k + 1) for k in range(len(estimate))]


def test_kinds_that_a_filter_does_not_use_are_told_once_and_taken_out():
    """Radio stays, as it makes epochs."""
    log = walk_log(gnss=GNSS)
    found, unused = usable_part(log, Drawing())
    told = {one.kind: (one.time_s, one.readings, one.reason) for one in unused}
    serving_s = log.radio["time_s"].iloc[0]
    assert told == {
        "gnss": (3.0, 3, Reason.NOT_USED_BY_FILTER),
        "serving": (serving_s, len(log.radio), Reason.NOT_USED_BY_FILTER),
    }
    assert (len(found.gnss), len(found.radio)) == (0, len(log.radio))
    assert len(found.motion) == len(log.motion)
    both = Drawing()
    both.uses = ("motion", "gnss", "serving")
    kept, none = usable_part(log, both)
    assert (len(kept.gnss), none) == (3, [])


def test_outputs_make_an_estimate_of_as_many_epochs():
    outputs = [StepOutput(Fix.nowhere(t, Status.SEARCHING, Reason.NO_READING)) for t in (1.0, 2.0)]
    assert estimate_of(Drawing(), outputs).time_s.tolist() == [1.0, 2.0]


def test_hypotheses_are_kept_each_20_m_whatever_the_direction():
    none = np.zeros(0)
    album = _Album(SimpleNamespace(hypotheses=lambda _: Hypotheses(none, none, none)))
    steps_m = [(99.0,), (15.0,), (5.0,), (-19.5, np.nan), (0.5,), (19.0,), (-0.75, 0.5)]
    for k, own in enumerate(steps_m):
        epoch = SimpleNamespace(motion=[SimpleNamespace(step_m=one) for one in own])
        fix = Fix.nowhere(float(k), Status.SEARCHING, Reason.NO_READING)
        album.add(None, epoch, StepOutput(fix))
    assert [(one.time_s, one.travelled_m) for one in album.taken] == [
        (0.0, 0.0), (2.0, 20.0), (4.0, 40.0), (6.0, 60.25),
    ]  # fmt: skip
