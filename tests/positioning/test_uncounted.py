"""A walk of which no step was counted, beside a belief that has rested meanwhile."""

from dataclasses import replace
from math import exp, log

import numpy as np
import pytest
from turned_walks import WATCHED, begun, walked

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.bayes.rivals.uncounted import walked_on
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.sensors.rest import Rest

REST = Rest(10.0, pace_mps=1.25, left_nats=-6.0, still_nats=-8.0)
NULL, TURNED = NullHypothesis(-9.0), Hold(1.0, 0.5)


def rested(rest, at_s=50.0, status=Status.TRACKING):
    """A tracked position at a rest, and its generator."""
    state, rng = begun()
    state, _ = walked(state, rng, (1.0, 1.4, 0.0))
    times = state.watch.times._replace(epoch_s=at_s)
    watch = state.watch._replace(rest=rest, known_s=at_s, times=times)
    return replace(state, watch=watch, status=status), rng


def went_on(state, rng):
    """The states before and after the step that ends the rest, at the latest after 30 s."""
    for second in range(1, 31):
        before, at_s = state, state.watch.times.epoch_s + 1.0
        state, _ = WATCHED.step(state, Epoch(at_s, (MotionStep(1.4, 0.0),)), rng)
        if second > 1 and state.watch.rest is None:
            break
    return before, state


def test_it_goes_on_from_where_the_pace_before_may_have_led():
    state, rng = rested(REST)
    calls = []

    def predict(belief, step, _):
        calls.append(step)
        gone_m = belief.travelled_m + 77.0
        return replace(belief, log_weight=belief.log_weight - 3.0, travelled_m=gone_m), None

    rules = HoldRules(particles=200)
    found = walked_on(rules, state.belief, NULL, TURNED, REST, 50.0, 0.02, 123.0, predict, rng)
    (step,) = calls
    # 40 s at 1.25 m/s to all sides; the compass tells where the phone points afterwards.
    assert (step.step_m, step.turned_sd_rad) == (50.0, 0.0)
    assert np.isnan([step.heading_rad, step.turn_rad]).all()
    mean_square_m2 = 2 * 1.25**2 * 60 * (40 - 60 * (1 - exp(-40 / 60)))
    assert step.spread_m == pytest.approx(mean_square_m2**0.5)
    assert found.log_prior == pytest.approx(log(0.02 / 0.98))
    assert (found.hold, found.start_m) == (TURNED, 123.0)
    way_m = state.belief.travelled_m + 77.0
    assert (found.belief.travelled_m, found.belief.log_weight.size) == (way_m, 200)
    # The way costs it nothing, and the null hypothesis neither.
    assert found.null == NullHypothesis(-9.0, 77.0)
    still = found.null.after(RadioReading(), 0.0, 0.0, 77.0)
    assert still.log_odds == NULL.after(RadioReading(), 0.0, 0.0, 0.0).log_odds
    assert np.exp(found.belief.log_weight).sum() == pytest.approx(1.0)
    assert found.log_bayes_factor(state.belief) == 0.0
    assert not found.tells_half_turn


def test_a_rest_that_levels_have_not_shown_may_have_been_a_walk():
    before, after = went_on(*rested(REST))
    (rival,) = after.held
    share = before.watch.rest.left_share(before.watch.times.epoch_s)
    assert 0.015 < share < 0.03
    assert rival.log_prior == pytest.approx(log(share / (1 - share)))
    assert rival.start_m == before.reckoning.travelled_m
    apart_m = rival.belief.state[:2] - np.array([after.belief.summary.mean[:2]]).T
    # Its root mean square is 45 m or more.
    assert 40 < np.sqrt(np.mean(np.sum(apart_m**2, axis=0))) < 70


@pytest.mark.parametrize(
    ("rest", "at_s"),
    [
        (None, 50.0),
        (replace(REST, since_s=31.0), 50.0),
        (replace(REST, left_nats=-20.0), 50.0),
        (replace(REST, still_nats=-2.0), 50.0),
    ],
)
def test_short_rests_and_those_that_levels_have_shown_leave_no_doubt(rest, at_s):
    assert went_on(*rested(rest, at_s))[1].held == ()


def test_what_searches_or_is_in_doubt_has_none():
    state, rng = rested(REST)
    searching = replace(state.belief, status=Status.SEARCHING)
    searches = replace(state, belief=searching, status=Status.SEARCHING)
    assert went_on(searches, rng)[1].held == ()
    assert went_on(*rested(replace(REST, is_doubtful=True, left_nats=2.0)))[1].held == ()
