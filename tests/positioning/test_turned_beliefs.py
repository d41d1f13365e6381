"""Beliefs with a turned phone as they begin: their odds, their hypotheses and their draws."""

from dataclasses import replace
from math import isnan, log, nan, pi, radians
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import BIAS, STATES
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.compared import after_takeover, is_ahead, still_open, winner
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise, as_measured, forked, jumps
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.bayes.rivals.own_draws import Purpose, own_rng

RULES = HoldRules(
    jump_deg=60.0, around_deg=150.0, probability=0.01, around_probability=0.2, mirrored_odds=0.3,
    particles=300,
)  # fmt: skip
NULL = NullHypothesis(-2.5)
RARE, USUAL = log(0.01 / 0.99), log(0.2 / 0.8)
MIRRORED = log(0.3)


def belief(count=1000, seed=2):
    rng = np.random.default_rng(seed)
    state = rng.standard_normal((STATES, count)).astype(np.float32)
    state[BIAS] = 3.0
    # Nearly all of the weight lies at the first tenth.
    weight = np.where(np.arange(count) < count // 10, 9.0, 0.1)
    return ParticleBelief(
        state, np.log(weight / weight.sum()) - 40.0, Bins.over((0.0, 0.0, 100.0, 100.0)),
        np.arange(2.0 * count, dtype=np.float32).reshape(2, count), log_evidence=-70.0,
    )  # fmt: skip


def forks(hold, before_rad, after_rad, rules=RULES, white_rad=0.0, main=None):
    rng = np.random.default_rng(4)
    headings = (before_rad, after_rad)
    return forked(rules, main or belief(), NULL, hold, headings, 123.0, white_rad, rng)


@pytest.mark.parametrize(
    ("hold", "jump_rad", "odds"),
    [
        # A jump of a right angle is rarely the phone's, one right round often.
        (Hold(), 1.6, (RARE, RARE + MIRRORED)),
        (Hold(), -1.6, (RARE, RARE + MIRRORED)),
        (Hold(), np.radians(149.0), (RARE, RARE + MIRRORED)),
        (Hold(), np.radians(151.0), (USUAL, USUAL + MIRRORED)),
        (Hold(), np.radians(209.0), (USUAL, USUAL + MIRRORED)),
        (Hold(), np.radians(211.0), (RARE, RARE + MIRRORED)),
        # Turned back, which is likely: by as much as it was turned.
        (Hold(1.0, 1.6), 1.6, (USUAL, RARE + MIRRORED)),
        (Hold(1.0, 1.6), 1.6 - np.radians(29.0), (USUAL, RARE + MIRRORED)),
        (Hold(1.0, 1.6), 1.6 - np.radians(31.0), (RARE, RARE + MIRRORED)),
        # From usual to usual is no turning back.
        (Hold(1.0, 0.3), 0.3, (RARE, RARE + MIRRORED)),
    ],
)
def test_the_odds_of_a_phone_that_was_turned(hold, jump_rad, odds):
    before_rad = 0.7
    found = forks(hold, before_rad, float(wrap_rad(before_rad + jump_rad)))
    found, earlier = found[:2], found[2:]
    assert [one.log_prior for one in found] == pytest.approx(odds)
    assert [one.hold.sign for one in found] == [hold.sign, -hold.sign]
    for one in found:
        assert (one.start_m, one.null) == (123.0, NULL)
        ahead_rad = hold.direction_rad(before_rad)
        assert one.hold.direction_rad(before_rad + jump_rad) == pytest.approx(ahead_rad)
        assert one.belief.log_evidence == -70.0
        assert one.log_bayes_factor(belief()) == 0.0
    # Mirrored before, with the turn to the other side: not where it is one right round.
    assert bool(earlier) == (abs(wrap_rad(jump_rad)) < np.radians(150.0))
    for one in earlier:
        assert one.log_prior == pytest.approx(RARE + MIRRORED)
        turn_rad = one.hold.direction_rad(before_rad + jump_rad) - hold.direction_rad(before_rad)
        assert wrap_rad(turn_rad + hold.sign * jump_rad) == pytest.approx(0.0, abs=1e-9)


def test_mirrored_back_to_the_usual_reading_is_likely():
    """From a mirrored reading the other sign is the mirrored one of the two."""
    hold = Hold(-1.0, 2.0)
    _, other, *_ = forks(hold, 0.5, hold.direction_rad(0.5))
    assert other.hold.is_usual
    assert other.log_prior == pytest.approx(USUAL + MIRRORED)
    # Along an axis of the mirror nothing jumps, and the next corner shows that it is over.
    *_, earlier = forks(hold, 1.0, 1.0 + 1.6)
    assert earlier.hold == Hold()
    assert earlier.log_prior == pytest.approx(USUAL + MIRRORED)


def test_the_belief_in_which_headings_are_as_measured():
    hold = Hold(-1.0, 2.0, 0.3048)
    found = as_measured(RULES, belief(), NULL, hold, 55.0, 0.0, np.random.default_rng(1))
    assert found.hold == Hold(step_unit_m=0.3048)
    assert found.log_prior == pytest.approx(USUAL)
    assert (found.start_m, found.null) == (55.0, NULL)
    assert found.belief.state.shape == (STATES, 300)


def test_smaller_beliefs_have_hypotheses_by_weight_and_equal_weights():
    """With what they keep; their number is no larger than that of the main belief."""
    main = belief()
    for one in forks(Hold(), 0.0, 1.6):
        own = one.belief
        assert own.state.shape == (STATES, 300)
        np.testing.assert_allclose(own.log_weight, -log(300))
        from_ = own.kept[0].astype(int)
        np.testing.assert_array_equal(own.kept, main.kept[:, from_])
        others = np.arange(STATES) != BIAS
        np.testing.assert_array_equal(own.state[others], main.state[others][:, from_])
        # 9 in 10 of 1000 by weight are among the first 100: five standard errors.
        share = np.mean(from_ < 100)
        assert abs(share - 900 / 990) < 5 * (0.0827 / 300) ** 0.5
    # Rows of a satellite receiver stay with the main belief.
    more = replace(main, state=np.vstack([main.state, main.state[:5]]))
    for one, other in zip(forks(Hold(), 0.0, 1.6, main=more), forks(Hold(), 0.0, 1.6), strict=True):
        np.testing.assert_array_equal(one.belief.state, other.belief.state)
    few = belief(40)
    assert forks(Hold(), 0.0, 1.6, main=few)[0].belief.state.shape == (STATES, 40)
    np.testing.assert_array_equal(main.state, belief().state)


def test_the_white_noise_of_two_headings_is_in_their_bias():
    """Wrapped; the main belief keeps its own."""
    main = belief()
    rules = replace(RULES, particles=1000)
    for own in (one.belief for one in forks(Hold(), 0.0, 1.6, rules, white_rad=0.2, main=main)):
        added = wrap_rad(own.state[BIAS].astype(float) - 3.0)
        assert abs(added.mean()) < 5 * 0.2 * (2 / 1000) ** 0.5
        assert added.std() == pytest.approx(0.2 * 2**0.5, rel=5 / 2000**0.5)
        assert np.all(np.abs(own.state[BIAS]) <= pi + 1e-6)
    assert np.all(main.state[BIAS] == 3.0)


def test_draws_are_of_the_time_and_of_what_they_are_for():
    def drawn(time_s, purpose):
        return own_rng(time_s, Purpose(purpose)).random(3).tolist()

    assert drawn(12.345, 7) == drawn(12.345, 7) == drawn(12.3451, 7)
    assert drawn(12.345, 7) not in (drawn(12.346, 7), drawn(12.345, 8))
    # Any time has one, also before 0 and beyond what a seed holds.
    assert drawn(-3.0, 1) != drawn(1e15, 1)


def test_a_reading_of_headings_by_hand():
    """Direction and turn change their sign together; lengths stay, and what is missing."""
    step = MotionStep(1.4, 0.5, 0.2, 3.0)
    found = Hold(-1.0, 2.0).read(step)
    assert (found.step_m, found.spread_m) == (1.4, 3.0)
    assert (found.heading_rad, found.turn_rad) == pytest.approx((1.5, -0.2))
    found = Hold(1.0, 3.0).read(step)
    assert (found.heading_rad, found.turn_rad) == pytest.approx((3.5 - 2 * pi, 0.2))
    nothing = MotionStep(1.4, np.nan, 0.2)
    assert Hold(-1.0, 2.0).read(nothing) is nothing
    assert Hold(-1.0, 0.0).read(step).heading_rad == -0.5
    assert Hold(1.0, np.radians(29.9)).is_usual
    assert not Hold(1.0, np.radians(30.1)).is_usual
    assert not Hold(-1.0, 0.0).is_usual


@pytest.mark.parametrize(
    ("other_m", "elsewhere"),
    [((30.0, 40.0), False), ((31.0, 40.0), True), ((-30.0, -41.0), True), ((30.0, -39.0), False)],
)
def test_a_position_is_another_one_from_fifty_metres_on(other_m, elsewhere):
    def at(place_m):
        return SimpleNamespace(summary=SimpleNamespace(mean=place_m), log_evidence=-9.0)

    one = HeldOtherwise(at((700.0, 500.0)), Hold(), -1.0, 0.0)
    main = at((700.0 + other_m[0], 500.0 + other_m[1]))
    assert one.is_elsewhere(main) is elsewhere
    assert one.log_odds(replace_evidence(main, -12.0)) == pytest.approx(2.0)


def replace_evidence(belief, log_evidence):
    return SimpleNamespace(summary=belief.summary, log_evidence=log_evidence)


def test_lengths_are_read_in_their_unit_and_turns_by_the_sign():
    step = MotionStep(10.0, 0.5, 0.1, 4.0, 2.0)
    assert Hold().read(step) is step
    found = Hold(step_unit_m=0.25).read(step)
    assert found == MotionStep(2.5, 0.5, 0.1, 1.0, 0.5)
    found = Hold(-1.0, 2.0, 0.25).read(step)
    assert found == MotionStep(2.5, 1.5, -0.1, 1.0, 0.5)
    # Both ways in which the phone may be held since are in the same unit.
    for one in (*Hold(step_unit_m=0.25).straight_on(0.5, 2.0), Hold(1.0, 0.0, 0.25).mirrored_at(1)):
        assert one.step_unit_m == 0.25


@pytest.mark.parametrize(
    ("before_rad", "heading_rad", "step_m", "found"),
    [
        (0.0, radians(60.1), 1.0, True), (0.0, radians(59.9), 1.0, False),
        (0.0, -radians(60.1), 3.0, True), (0.0, radians(60.1), 3.1, False),
        (0.0, radians(60.1), 0.0, False), (0.0, radians(60.1), -1.0, False),
        (0.0, radians(60.0), 1.0, False), (1.0, 1.0 - radians(60.1), 1.0, True),
        (1.0, 1.0 + radians(59.9), 1.0, False), (3.0, -3.0, 1.0, False),
        (nan, 2.0, 1.0, False), (2.0, nan, 1.0, False),
    ],
)  # fmt: skip
def test_what_a_jump_is(before_rad, heading_rad, step_m, found):
    """Sixty degrees from one row of up to 3 m to the next."""
    step = MotionStep(step_m, heading_rad)
    assert jumps(before_rad, step, HoldRules()) == found
    assert not jumps(before_rad, step, HoldRules(watched=False))


def beside(log_bayes_factor, *, log_prior=0.0, east_m=100.0, start_m=0.0, ahead_m=nan, **more):
    """A belief beside one at 0 m with a log evidence of -50."""
    status, null = more.get("status", Status.TRACKING), NullHypothesis(more.get("null", -12.0))
    summary = SimpleNamespace(mean=(east_m, 0.0))
    own = SimpleNamespace(log_evidence=log_bayes_factor - 50.0, summary=summary, status=status)
    return HeldOtherwise(own, Hold(-1.0), log_prior, start_m, null, ahead_m)


MAIN = SimpleNamespace(log_evidence=-50.0, summary=SimpleNamespace(mean=(0.0, 0.0)))


@pytest.mark.parametrize(
    ("one", "travelled_m", "is_open"),
    [
        (beside(-3.9, log_prior=-5.0), 100.0, True),
        (beside(-4.0, log_prior=-5.0), 100.0, False),
        (beside(0.0, log_prior=-5.0, start_m=30.0), 429.9, True),
        (beside(0.0, log_prior=-5.0, start_m=30.0), 430.0, False),
        # Likely enough, and elsewhere, it may stay undecided for longer.
        (beside(4.1, log_prior=-5.0, start_m=30.0), 1229.9, True),
        (beside(4.1, log_prior=-5.0, start_m=30.0), 1230.0, False),
        (beside(4.0, log_prior=-5.0, start_m=30.0), 430.0, False),
        (beside(4.1, log_prior=-5.0, start_m=30.0, east_m=50.0), 430.0, False),
    ],
)
def test_when_a_turned_phone_is_refuted_or_undecided_for_too_long(one, travelled_m, is_open):
    assert len(still_open(HoldRules(), [one], MAIN, travelled_m)) == is_open
    assert not still_open(HoldRules(abandon_after_m=0.0), [beside(0.0, log_prior=-5.0)], MAIN, 0.5)


def test_the_most_likely_turned_phones_are_kept_with_the_distance_since_which_they_lead():
    leads = [beside(nats, log_prior=-1.0, ahead_m=20.0 if nats == 3.0 else nan)
             for nats in (1.0, 3.0, -2.0, 2.0, 0.1)]  # fmt: skip
    kept = still_open(HoldRules(max_beliefs=4), leads, MAIN, 70.0)
    assert [one.log_bayes_factor(MAIN) for one in kept] == pytest.approx([3.0, 2.0, 1.0, 0.1])
    assert [one.ahead_m for one in kept] == [20.0, 70.0, 70.0, 70.0]
    # Who has fallen back, or is at the same place, leads no longer.
    for one in (beside(0.0, log_prior=-1.0, ahead_m=20.0), beside(9.0, east_m=50.0, ahead_m=20.0)):
        (found,) = still_open(HoldRules(), [one], MAIN, 70.0)
        assert isnan(found.ahead_m)


@pytest.mark.parametrize(
    ("one", "ahead"),
    [
        (beside(0.1, log_prior=-1.0, ahead_m=63.0), True),
        (beside(0.1, log_prior=-1.0, ahead_m=63.1), False),
        (beside(0.0, log_prior=-1.0, ahead_m=0.0), False),
        (beside(9.0, ahead_m=0.0, east_m=50.0), False),
        (beside(9.0), False),
    ],
)
def test_a_turned_phone_is_ahead_after_seven_metres(one, ahead):
    assert is_ahead(HoldRules(), [beside(-9.0), one], MAIN, 70.0) == ahead


def test_which_turned_phone_takes_over():
    rules, most = HoldRules(), -5.0
    assert winner(rules, [], MAIN, most) is None
    able = beside(9.0, log_prior=-1.0, null=-5.0)
    for other in (
        beside(8.9, log_prior=-1.0),
        beside(30.0, status=Status.SEARCHING),
        beside(30.0, null=-4.9),
    ):
        assert winner(rules, [other], MAIN, most) is None
        assert winner(rules, [other, able], MAIN, most) is able
    better = beside(9.5, log_prior=-1.0)
    assert winner(rules, [able, better], MAIN, most) is better
    # The others then have odds against it, and none is ahead of it yet.
    (left,) = after_takeover([replace(able, ahead_m=3.0), better], better)
    assert left.belief is able.belief
    assert left.log_prior == 0.0
    assert isnan(left.ahead_m)
