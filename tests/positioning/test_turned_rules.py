"""Rules of beliefs in which the phone was turned: which stay open, lead, and take over."""

from dataclasses import replace
from math import isnan
from types import SimpleNamespace

import numpy as np
import pytest
from turned_walks import AREA, TOWN, begun, walked

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.compared import after_takeover, is_ahead, still_open, winner
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise, jumps
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules


def one_of(log_odds, east_m=100.0, start_m=0.0, status=Status.TRACKING, null=-9.0, prior=0.0):
    """A belief with given log odds against MAIN."""
    summary = SimpleNamespace(mean=(east_m, 0.0))
    belief = SimpleNamespace(
        log_evidence=MAIN.log_evidence + log_odds - prior, summary=summary, status=status
    )
    return HeldOtherwise(belief, Hold(1.0, 3.0), prior, start_m, NullHypothesis(null))


MAIN = SimpleNamespace(log_evidence=-50.0, summary=SimpleNamespace(mean=(0.0, 0.0)))
RULES = HoldRules(max_beliefs=2, lost_log_odds=1.0)


def test_which_beliefs_stay_open():
    low, high, mid = one_of(-3.0), one_of(2.0), one_of(1.0, start_m=300.0)

    def left(travelled_m):
        return [one.belief for one in still_open(RULES, (low, high, mid), MAIN, travelled_m)]

    assert left(399.0) == [high.belief, mid.belief]
    # What is likely enough, elsewhere, stays for longer.
    assert left(400.0) == [high.belief, mid.belief]
    assert left(1199.0) == [high.belief]
    assert left(1200.0) == []
    assert still_open(RULES, (one_of(2.0, east_m=40.0),), MAIN, 400.0) == ()
    behind = one_of(0.9)
    assert len(still_open(RULES, (behind,), MAIN, 399.0)) == 1
    assert still_open(RULES, (behind,), MAIN, 400.0) == ()
    # The Bayes factor refutes, whatever the odds before.
    assert still_open(RULES, (one_of(-3.0, prior=1.5),), MAIN, 0.0) == ()


def test_when_a_belief_is_ahead_and_when_it_takes_over():
    held = still_open(RULES, (one_of(0.9), one_of(1.1)), MAIN, 20.0)
    assert is_ahead(RULES, held, MAIN, 27.0)
    near = still_open(RULES, (one_of(0.9), one_of(9.0, east_m=40.0)), MAIN, 20.0)
    assert not is_ahead(RULES, near, MAIN, 27.0)
    assert not is_ahead(RULES, (), MAIN, 27.0)
    best = one_of(9.0)
    assert winner(RULES, (one_of(8.5), best), MAIN, -3.0) is best
    assert winner(RULES, (one_of(7.9),), MAIN, -3.0) is None
    assert winner(RULES, (one_of(9.0, null=-2.0),), MAIN, -3.0) is None
    assert winner(RULES, (one_of(9.0, status=Status.SEARCHING),), MAIN, -3.0) is None
    # Of those that are able to take over the likeliest one does.
    doubtful = one_of(12.0, null=-2.0)
    assert winner(RULES, (doubtful, best), MAIN, -3.0) is best
    assert winner(RULES, (), MAIN, -3.0) is None


def test_odds_that_come_and_go_leave_a_position():
    """A belief has to stay ahead for 7 m before the position is LOST."""
    held = still_open(RULES, (one_of(1.1),), MAIN, 20.0)
    assert not is_ahead(RULES, held, MAIN, 26.9)
    later = still_open(RULES, held, MAIN, 26.0)
    assert is_ahead(RULES, later, MAIN, 27.0)
    behind = still_open(RULES, (replace(held[0], log_prior=-1.0),), MAIN, 26.0)
    again = still_open(RULES, (replace(behind[0], log_prior=0.0),), MAIN, 30.0)
    assert not is_ahead(RULES, again, MAIN, 36.0)
    assert is_ahead(RULES, again, MAIN, 37.0)


def test_a_position_is_lost_before_another_one_is_the_likelier():
    rules = HoldRules()
    for log_odds, lost in ((-0.9, True), (-1.1, False)):
        held = still_open(rules, (one_of(log_odds),), MAIN, 20.0)
        assert is_ahead(rules, held, MAIN, 27.0) is lost


def test_the_other_beliefs_keep_their_odds_after_a_takeover():
    best, other = one_of(9.0, prior=-1.0), replace(one_of(4.0, prior=-5.0), ahead_m=20.0)
    (left,) = after_takeover((best, other), best)
    assert left.log_odds(best.belief) == pytest.approx(4.0 - 9.0)
    # It was ahead of the belief that is no more.
    assert isnan(left.ahead_m)


def test_what_a_jump_is():
    rules = HoldRules()
    walked, far = MotionStep(1.4, 3.0), MotionStep(3.5, 3.0)
    assert jumps(0.0, walked, rules)
    # Angles wrap; small changes, long rows, rests and rows without a heading are no jumps.
    assert not jumps(-3.0, walked, rules)
    assert not jumps(2.2, walked, rules)
    assert not jumps(0.0, far, rules)
    assert not jumps(0.0, MotionStep(0.0, 3.0), rules)
    assert not jumps(0.0, MotionStep(1.4, np.nan), rules)
    assert not jumps(np.nan, walked, rules)
    assert not jumps(0.0, walked, replace(rules, watched=False))
    # A row of 3.5 feet is a short one.
    assert jumps(0.0, far, rules, 0.3048)


def test_how_headings_are_read_after_a_jump():
    turned, mirror = Hold().straight_on(0.4, 0.4 + np.pi)
    assert turned.read(MotionStep(1.0, 0.9 + np.pi, 0.5)).heading_rad == pytest.approx(0.9)
    read = mirror.read(MotionStep(1.0, 0.9 + np.pi, 0.5))
    assert (read.heading_rad, read.turn_rad) == pytest.approx((-0.1, -0.5))
    # Turned back, headings are read as they are.
    back, _ = turned.straight_on(0.4 + np.pi, 0.4)
    assert back.is_usual
    assert not turned.is_usual
    again, _ = mirror.straight_on(1.0, 1.0)
    assert again.direction_rad(1.0) == pytest.approx(mirror.direction_rad(1.0))
    step = MotionStep(1.0, 0.3)
    assert Hold().read(step) is step


def test_a_phone_that_was_mirrored_before_shows_it_at_a_corner():
    """Along the axis nothing changes; then left is right, for a mirrored phone as for others."""
    for hold in (Hold(), Hold(-1.0, 0.7), Hold(1.0, 2.0, 0.3048)):
        other = hold.mirrored_at(0.4)
        assert other.direction_rad(0.4) == pytest.approx(hold.direction_rad(0.4))
        turn = wrap_rad(hold.direction_rad(0.4 + 1.5) - hold.direction_rad(0.4))
        assert wrap_rad(other.direction_rad(0.4 + 1.5) - other.direction_rad(0.4)) == pytest.approx(
            -turn
        )
        assert other.step_unit_m == hold.step_unit_m
    state, rng = begun()
    state, _ = walked(state, rng, (1.0, 1.4, 0.0), (2.0, 1.4, 1.5))
    directions = sorted(one.hold.direction_rad(1.5) for one in state.held)
    # Straight on, by a turned and by a mirrored phone, and to the other side.
    assert directions == pytest.approx([-1.5, 0.0, 0.0], abs=1e-9)
    priors = {round(one.hold.direction_rad(1.5), 1): one.log_prior for one in state.held}
    assert priors[-1.5] == pytest.approx(np.log(0.006 / 0.994) + np.log(0.25))


def test_vehicles_and_maps_without_cells_are_not_watched():
    assert AREA.holds.watched
    assert not BayesFilter(vehicle=True).over_area(TOWN.area()).holds.watched
