"""Half turns of a journey that were the walker's, and the odds of the next one."""

from dataclasses import replace
from math import exp, log, pi, radians
from types import SimpleNamespace

import numpy as np
import pytest
from made_filters import SEARCHING, STATE, TRACKING, Beliefs, belief, gaining, weighed
from made_filters import rival as alternative

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.models.street_motion import BIAS, STATES, MotionErrors
from mapfilter.positioning.bayes.beliefs.belief_changes import turned_at_jump
from mapfilter.positioning.bayes.beliefs.moving import moved
from mapfilter.positioning.bayes.rivals.compared import after_takeover
from mapfilter.positioning.bayes.rivals.half_turns import HalfTurns
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.watch import SensorWatch

MAIN, COMPASS = belief(log_evidence=-10.0), MotionErrors()
WATCH = SensorWatch(pace=Pace(stepped_s=9.0), moving_s=4.0)


def rival(odds, *, start_m=0.0, half_turn=True):
    """A rival with these odds against the main belief by now."""
    own = belief(TRACKING, -10.0 + log(odds) - log(0.5), east_m=800.0)
    return HeldOtherwise(own, Hold(1.0, 3.0), log(0.5), start_m, tells_half_turn=half_turn)


@pytest.mark.parametrize(
    ("turns", "odds"),
    [
        (HalfTurns(), 1 / 3),
        (HalfTurns(1.0), 1 / 6),
        (HalfTurns(4.0), 1 / 15),
        (HalfTurns(2.0, 3), 1 / 18),
    ],
)
def test_each_half_turn_of_the_walker_makes_the_phone_less_likely_at_the_next(turns, odds):
    rules = turns.rules(HoldRules())
    assert rules.around_probability == pytest.approx(odds / (1 + odds))
    assert replace(rules, around_probability=0.25) == HoldRules()


def test_half_turns_count_by_the_odds_of_their_rivals_once_these_are_given_up():
    refuted, undecided, other = rival(0.01), rival(1.0, start_m=1.0), rival(0.01, half_turn=False)
    before, open_ = (refuted, undecided, other), rival(3.0, start_m=2.0)
    turns = HalfTurns(2.0)
    assert turns.after((*before, open_), (open_,), MAIN).walkers == pytest.approx(
        2.0 + 1 / 1.01 + 0.5
    )
    # As they go on beside the belief they have another distance since which they lead.
    assert turns.after(before, [replace(one, ahead_m=9.0) for one in before], MAIN) is turns
    assert turns.with_jumps((open_,), MAIN).walkers == pytest.approx(2.25)
    # No odds are too large.
    assert turns.with_jumps((rival(exp(500.0)), rival(exp(-500.0))), MAIN).walkers == 3.0


@pytest.mark.parametrize(("turned", "walkers"), [(0, 3.0), (1, 2.75), (4, 2.0)])
def test_a_search_tells_by_its_hypotheses_whose_the_half_turns_were(turned, walkers):
    state = np.zeros((STATES, 4), dtype=np.float32)
    state[BIAS, :turned] = [pi, -2.0, 1.6, -pi][:turned]
    found = HalfTurns(0.0, 3).found(replace(MAIN, state=state))
    assert found == HalfTurns(pytest.approx(walkers))
    # Where nothing was searched the hypotheses say nothing of it.
    assert HalfTurns(1.5).found(replace(MAIN, state=state)) == HalfTurns(1.5)


@pytest.mark.parametrize(
    ("turns", "odds"),
    # The phone was turned at one of those in the search, and the walker turned at the others.
    [(HalfTurns(0.0, 1), 4 / 3), (HalfTurns(0.0, 3), 4 / 9), (HalfTurns(2.0, 2), 4 / 12)],
)
def test_a_phone_that_was_turned_in_a_search_is_likely_to_be_turned_back(turns, odds):
    assert turns.back_probability(HoldRules()) == pytest.approx(odds / (1 + odds))


@pytest.mark.parametrize(("jump_rad", "share"), [(pi, 0.6), (2.0, 0.006)])
def test_hypotheses_with_a_turned_phone_turn_it_back(jump_rad, share):
    state = np.zeros((STATES, 20_000), dtype=np.float32)
    state[BIAS, 10_000:] = pi
    before = replace(MAIN, state=state, log_weight=np.full(20_000, -log(20_000.0)))
    rules = replace(HoldRules(), around_probability=0.1)
    rng = np.random.default_rng(3)
    after = turned_at_jump(before, rules, jump_rad, rng, back_probability=0.6).state[BIAS]
    changed = (after != state[BIAS]).reshape(2, -1).mean(axis=1)
    # Four standard deviations of a binomial share.
    for found, expected in zip(changed, (min(share, 0.1), share), strict=True):
        sd = (expected * (1 - expected) / 10_000) ** 0.5
        assert found == pytest.approx(expected, abs=4 * sd)


@pytest.mark.parametrize(("bias_sd_deg", "tells"), [(10.0, True), (29.9, True), (30.1, False)])
def test_a_wide_error_of_the_compass_does_not_tell_a_turned_phone(bias_sd_deg, tells):
    assert MotionErrors(bias_sd_rad=radians(bias_sd_deg)).tells_turned is tells


def walking(status=TRACKING, **more):
    """A state in the middle of a walk to the east."""
    state = np.zeros((STATES, 20), dtype=np.float32)
    own = replace(belief(status), state=state, log_weight=np.full(20, -log(20.0)),
                  kept=np.zeros((0, 20), np.float32))  # fmt: skip
    return BayesState(status=status, belief=own, watch=WATCH, walking_rad=0.0, **more)


def after_a_row(state, heading_rad, motion=COMPASS):
    """The state after a row of motion with another heading."""
    filters = SimpleNamespace(
        holds=HoldRules(), pulls=PullRules(), map_may_start=False,
        model=SimpleNamespace(motion=motion),
        moving_filter=lambda *_, **__: SimpleNamespace(predict=lambda given, *_: (given, None)),
        may_have_left=lambda _: False, followed_ways=lambda _: False,
        may_be_anywhere=lambda *_: False, positions_lead=lambda _: False,
    )  # fmt: skip
    epoch = Epoch(10.0, motion=(MotionStep(1.0, heading_rad),))
    return moved(filters, state, WATCH, epoch, np.random.default_rng(1))[0]


def test_who_has_turned_round_before_has_a_phone_that_is_less_likely_turned():
    first = after_a_row(walking(), pi)
    assert [one.log_prior for one in first.held] == pytest.approx([log(1 / 3), log(1 / 12)])
    assert [one.tells_half_turn for one in first.held] == [True, False]
    later = after_a_row(walking(half_turns=HalfTurns(2.0)), pi)
    assert [one.log_prior for one in later.held] == pytest.approx([log(1 / 9), log(1 / 36)])
    # So it is where the one before is as good as refuted, though still open.
    beside = replace(rival(0.01), start_m=-50.0)
    found = after_a_row(walking(half_turns=HalfTurns(1.0), held=(beside,)), pi)
    log_prior = min(one.log_prior for one in found.held if one.tells_half_turn)
    assert log_prior == pytest.approx(log(1 / 3 / (2 + 1 / 1.01)))
    # Of other corners this says nothing.
    corner = after_a_row(walking(half_turns=HalfTurns(2.0)), 2.0)
    assert [one.log_prior for one in corner.held][:1] == pytest.approx([log(0.006 / 0.994)])
    assert not any(one.tells_half_turn for one in corner.held)


def test_a_search_counts_half_turns_until_it_has_found_a_place():
    state = walking(SEARCHING)
    state = after_a_row(replace(state, half_turns=HalfTurns(1.0)), pi)
    assert state.half_turns == HalfTurns(1.0, 1)
    assert after_a_row(replace(state, walking_rad=0.0), 2.0).half_turns == HalfTurns(1.0, 1)
    # Of the next one a hypothesis in which the first was the phone's thinks otherwise.
    turned = state.belief.state.copy()
    turned[BIAS] = pi
    twice = replace(state, walking_rad=0.0, belief=replace(state.belief, state=turned))
    shares = [
        (after_a_row(twice, pi, motion).belief.state[BIAS] != turned[BIAS]).mean()
        for motion in (COMPASS, MotionErrors(bias_sd_rad=1.0))
    ]
    assert shares[0] > 0.25 > shares[1]
    assert state.begun_anew().half_turns == HalfTurns(1.0)
    tracked = walking(half_turns=HalfTurns(1.0, 2))
    assert after_a_row(tracked, 0.5).half_turns == HalfTurns(1.0, 2)
    found = after_a_row(tracked, pi)
    assert found.half_turns == HalfTurns(3.0)
    assert found.held[0].log_prior == pytest.approx(log(1 / 12))


def test_rivals_that_are_refuted_by_readings_count():
    given = replace(STATE, held=(rival(1.0), rival(0.01, start_m=1.0)), half_turns=HalfTurns(1.0))
    found, _ = weighed(Beliefs(held_otherwise=gaining(-3.0)), given)
    assert [one.start_m for one in found.held] == [0.0]
    # The second one has lost another nat against the main belief, which loses two.
    assert found.half_turns.walkers == pytest.approx(1.0 + 1 / (1 + 0.01 * exp(-1.0)))


def test_where_the_phone_was_mirrored_nobody_has_turned_round():
    mirrored, turned = replace(rival(9.0, half_turn=False), hold=Hold(-1.0, 3.0)), rival(2.0)
    before = rival(2.0, start_m=-40.0)
    left = after_takeover((mirrored, turned, before), mirrored)
    assert [one.tells_half_turn for one in left] == [False, True]
    assert HalfTurns().after(left, left[1:], mirrored.belief) == HalfTurns()


def test_a_rival_without_any_hypothesis_left_counts_whatever_its_odds():
    held = rival(1.0), rival(1.0, start_m=1.0, half_turn=False)
    none_left = gaining(0.0, reason=Reason.NO_CANDIDATES_LEFT)
    found, _ = weighed(Beliefs(held_otherwise=none_left), replace(STATE, held=held))
    assert (found.held, found.half_turns) == ((), HalfTurns(1.0))


def test_a_belief_that_takes_over_a_search_has_half_turns_of_its_own():
    searching = replace(
        STATE, belief=belief(SEARCHING), status=SEARCHING, half_turns=HalfTurns(1.0, 2)
    )
    found, _ = weighed(state=replace(searching, alternative=alternative(6.0)))
    assert (found.takeovers, found.half_turns) == (1, HalfTurns(1.0))
    assert weighed(state=searching)[0].half_turns == HalfTurns(1.0, 2)
