"""A phone that was mirrored before a slow corner: a rival goes on to the other side."""

from dataclasses import replace
from math import exp, isnan, log, nan, pi, radians

import numpy as np
import pytest
from noting_filters import TRACKING, Beliefs, belief, move, walking

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.bends import Straight, mirrored_before, without_earlier
from mapfilter.positioning.bayes.rivals.compared import after_takeover, still_open
from mapfilter.positioning.bayes.rivals.half_turns import HalfTurns
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.epochs import Pseudorange


def walked(*headings_deg, step_m=1.0):
    straight = Straight()
    for heading_deg in headings_deg:
        straight = straight.after(MotionStep(step_m, radians(heading_deg)))
    return straight


def test_the_direction_of_the_last_metres():
    straight = walked(*[10.0] * 9)
    assert straight.heading_rad == pytest.approx(radians(10.0))
    assert straight.way_m == pytest.approx(9.0)
    # The last ones count more: e times as much as those of 12 m before.
    turned = walked(*[0.0] * 12, *[90.0] * 12)
    kept = exp(-1 / 12)
    last = (1 - kept**12) / (1 - kept)
    assert (turned.east_m, turned.north_m) == pytest.approx((last * kept**12, last))


def test_after_less_than_eight_metres_there_is_none():
    assert isnan(walked(*[0.0] * 7).heading_rad)
    assert not isnan(walked(*[0.0] * 8).heading_rad)
    assert not walked(*[0.0] * 7).bends(MotionStep(1.0, 3.0), HoldRules())


@pytest.mark.parametrize(
    ("step", "bends"),
    [
        (MotionStep(1.0, radians(34.0)), False),
        (MotionStep(1.0, radians(36.0)), True),
        (MotionStep(1.0, radians(-36.0)), True),
        (MotionStep(1.0, radians(360.0)), False),
        # Who stands may look round, and a step without a direction leads nowhere.
        (MotionStep(0.0, radians(90.0)), False),
        (MotionStep(1.0, nan, 0.5), False),
        (MotionStep(nan, radians(90.0)), False),
    ],
)
def test_where_a_way_bends(step, bends):
    assert walked(*[0.0] * 20).bends(step, HoldRules()) is bends


def test_from_where_on_it_does_and_where_nobody_watches():
    step, straight = MotionStep(1.0, radians(40.0)), walked(*[0.0] * 20)
    assert straight.bends(step, HoldRules(bend_deg=39.0))
    assert not straight.bends(step, HoldRules(bend_deg=41.0))
    assert not straight.bends(step, HoldRules(watched=False))


def test_across_the_west_too():
    west = walked(*[170.0, -170.0] * 10)
    assert abs(west.heading_rad) > radians(175.0)
    assert not west.bends(MotionStep(1.0, radians(-160.0)), HoldRules())
    assert west.bends(MotionStep(1.0, radians(-120.0)), HoldRules())


@pytest.mark.parametrize("step", [MotionStep(0.0, 1.0), MotionStep(nan, 1.0), MotionStep(1.0, nan)])
def test_what_has_no_way_or_no_direction_changes_nothing(step):
    before = walked(*[5.0] * 10)
    assert before.after(step) == before


def test_the_belief_beside_reads_turns_the_other_way():
    main, null = belief(log_evidence=-5.0), NullHypothesis(-8.0)
    rules = HoldRules(particles=10, probability=0.1, mirrored_odds=0.5)
    turned = Hold(1.0, pi / 2)
    by = null, turned, 0.3, 120.0, 0.0, np.random.default_rng(1)
    rival = mirrored_before(rules, main, *by)
    # Straight on as before, and a turn to the left is one to the right.
    assert rival.hold.direction_rad(0.3) == pytest.approx(turned.direction_rad(0.3))
    assert rival.hold.direction_rad(0.5) == pytest.approx(turned.direction_rad(0.3) - 0.2)
    assert rival.log_prior == pytest.approx(log(0.1 / 0.9) + log(0.5))
    assert (rival.start_m, rival.null, rival.belief.log_weight.size) == (120.0, null, 10)
    assert rival.log_bayes_factor(replace(main, log_evidence=-6.0)) == 1.0
    assert not rival.tells_half_turn
    assert rival.at_bend


@pytest.mark.parametrize(
    ("nats", "gone_m", "stays", "beside_next"),
    [
        (0.0, 199.0, True, False),
        (0.0, 200.0, False, False),
        # Something speaks for it.
        (0.3, 399.0, True, True),
        (0.3, 400.0, False, True),
        (0.2, 200.0, False, False),
        (-1.9, 10.0, True, False),
        (-2.0, 10.0, False, False),
    ],
)
def test_how_long_it_stays(nats, gone_m, stays, beside_next):
    main = belief()
    rival = HeldOtherwise(belief(log_evidence=nats), Hold(-1.0), -6.5, 50.0, at_bend=True)
    rules = HoldRules()
    assert len(still_open(rules, (rival,), main, 50.0 + gone_m)) == stays
    assert len(without_earlier((rival,), main)) == beside_next
    # Those of a jump stay for longer, also beside one of a bend.
    turned = replace(rival, at_bend=False)
    assert len(still_open(rules, (turned,), main, 449.0)) == 1
    assert len(without_earlier((turned,), main)) == 1


def test_one_that_leads_stays_longest():
    ahead = belief(log_evidence=9.0)
    ahead = replace(ahead, state=ahead.state + np.float32(100.0))
    rival = HeldOtherwise(ahead, Hold(-1.0), -6.5, 50.0, at_bend=True)
    assert len(still_open(HoldRules(), (rival,), belief(), 1249.0)) == 1
    assert still_open(HoldRules(), (rival,), belief(), 1250.0) == ()


def test_beside_a_mirrored_phone_that_has_taken_over_one_is_as_likely():
    """It was dropped at the next bend, with odds of 1 to 1."""
    best, other = (HeldOtherwise(belief(log_evidence=20.0), Hold(-1.0, axis_rad), -6.5, 50.0,
                                 at_bend=True) for axis_rad in (0.0, 1.0))  # fmt: skip
    (left,) = after_takeover((best, other), best)
    assert left.log_odds(best.belief) == 0.0
    assert without_earlier((left,), best.belief) == (left,)
    assert len(still_open(HoldRules(), (left,), belief(log_evidence=23.9), 449.0)) == 1


def at_a_bend(raw, *, status=TRACKING, rules=None, **changes):
    """The state after a row of a tracked walk that went at 0.1 rad so far."""
    straight = walked(*[np.degrees(0.1)] * 20)
    given = {"straight": straight, "walking_rad": 0.4} | changes
    return move(walking(status=status, **given), raw, beliefs=Beliefs(holds=rules or HoldRules()))[
        0
    ]


def test_a_tracked_position_has_one_from_a_slow_corner_on():
    # 0.6 rad further than the row before, which is no jump.
    after = at_a_bend(MotionStep(2.0, 1.0))
    (before,) = after.held
    assert before.hold.sign == -1.0
    assert before.hold.direction_rad(1.0) == pytest.approx(0.1 - 0.9)
    # At the next bend another takes its place, unless something speaks for it.
    later = at_a_bend(MotionStep(2.0, 1.0), held=(replace(before, start_m=-9.0),))
    assert [one.start_m for one in later.held] == [0.0]
    # The next corner is one of the way from here on.
    assert after.straight == Straight().after(MotionStep(2.0, 1.0))


@pytest.mark.parametrize(
    ("raw", "changes"),
    [
        (MotionStep(2.0, 0.6), {}),
        (MotionStep(2.0, 1.0), {"status": Status.LOST}),
        (MotionStep(2.0, 1.0), {"compass": False}),
        (MotionStep(2.0, 1.0), {"rules": HoldRules(watched=False)}),
        (MotionStep(2.0, 1.0), {"straight": Straight()}),
    ],
)
def test_else_there_is_none(raw, changes):
    assert at_a_bend(raw, **changes).held == ()


def test_a_jump_has_it_among_its_own_and_begins_a_way():
    after = at_a_bend(MotionStep(2.0, 2.0))
    assert len(after.held) == 3
    assert after.straight.way_m == 2.0


def test_who_has_stood_may_turn_to_the_other_side_too():
    (before,) = at_a_bend(MotionStep(2.0, 2.0), stepped_s=-90.0).held
    assert before.hold.direction_rad(2.0) == pytest.approx(0.1 - 1.9)


def test_a_half_turn_whose_rival_is_given_up_at_a_bend_was_the_walkers():
    """As it is where that is given up at a jump, or at a report."""
    turned = HeldOtherwise(belief(), Hold(1.0, pi), -1.1, -400.0, tells_half_turn=True)
    after = at_a_bend(MotionStep(2.0, 1.0), held=(turned,))
    assert [one.at_bend for one in after.held] == [True]
    assert after.half_turns == HalfTurns(1 / (1 + exp(-1.1)))
    # One that goes on beside does not tell yet.
    open_still = replace(turned, start_m=-399.0)
    after = at_a_bend(MotionStep(2.0, 1.0), held=(open_still,))
    assert (len(after.held), after.half_turns) == (2, HalfTurns())


def test_steps_in_feet_have_the_direction_of_as_many_metres():
    in_feet = walking(straight=Straight(), hold=Hold(step_unit_m=0.3048))
    after, _, _ = move(in_feet, *[MotionStep(3.0, 0.1)] * 8)
    assert after.straight.way_m == pytest.approx(8 * 0.9144)
    assert move(after, MotionStep(3.0, 1.0))[0].held == ()
    after, _, _ = move(after, MotionStep(3.0, 0.1))
    assert len(move(after, MotionStep(3.0, 1.0))[0].held) == 1


def test_a_jump_in_feet_is_one_of_a_row_as_short():
    """Each second of a walk has more than three feet, so none was."""
    in_feet = walking(walking_rad=0.1, hold=Hold(step_unit_m=0.3048))
    assert len(move(in_feet, MotionStep(4.6, 2.0))[0].held) == 3
    assert move(in_feet, MotionStep(9.9, 2.0))[0].held == ()


def test_a_corner_is_one_also_while_a_gyroscope_alone_takes_it():
    """It was one when the compass came back, and began where the way had led by then."""
    known, _, _ = move(walking(straight=walked(*[0.0] * 20)), MotionStep(1.0, 0.0))
    by_turns, _, _ = move(known, *[MotionStep(1.0, nan, 0.2)] * 5)
    (before,) = by_turns.held
    assert (by_turns.compass, before.start_m) == (True, pytest.approx(4.0))
    assert before.hold.direction_rad(0.8) == pytest.approx(-0.8, abs=0.3)


def test_who_turns_right_round_is_not_told_from_a_mirrored_phone():
    """A belief that went the same way back took the place of one that might tell."""
    rival = HeldOtherwise(belief(), Hold(-1.0, 0.5), -6.5, -30.0, at_bend=True)
    after = at_a_bend(MotionStep(2.0, 0.1 + pi), stepped_s=-90.0, held=(rival,))
    assert [one.hold for one in after.held] == [rival.hold]
    # The direction is that of the way back from here on.
    assert after.straight.way_m == 2.0


def test_a_corner_that_satellites_have_seen_is_none_afterwards():
    """A rival began beside it, mirrored along the street before, once none came any more."""
    seen = Pseudorange("G01", 2e7, 5.0, (2e7, 0.0, 0.0))
    before = walking(straight=walked(*[0.0] * 20))
    after, _, _ = move(before, *[MotionStep(1.0, 1.5)] * 3, pseudoranges=(seen,))
    assert after.straight == walked(*[np.degrees(1.5)] * 3)
    assert move(after, MotionStep(1.0, 1.5))[0].held == ()


@pytest.mark.parametrize(
    ("nats", "gone_m", "stays"), [(0.0, 99.0, 1), (0.0, 100.0, 0), (-1.0, 9.0, 0)]
)
def test_none_stays_longer_than_the_rules_allow(nats, gone_m, stays):
    rules = HoldRules(abandon_threshold=-1.0, abandon_after_m=100.0)
    rival = HeldOtherwise(belief(log_evidence=nats), Hold(-1.0), -6.5, 50.0, at_bend=True)
    assert len(still_open(rules, (rival,), belief(), 50.0 + gone_m)) == stays
