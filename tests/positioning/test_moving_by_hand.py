"""How an epoch's motion moves beliefs, alternatives, twins and turned phones, with made filters."""

from dataclasses import replace
from math import inf, isnan, nan, pi
from types import SimpleNamespace

import numpy as np
import pytest
from noting_filters import (
    FIX,
    SEARCHING,
    STEP,
    TRACKING,
    Beliefs,
    belief,
    move,
    moved_by,
    steps_of,
    walking,
)

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.models.street_motion import BIAS, EAST
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, NullHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch, Pseudorange
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.watch import SensorWatch


def test_a_belief_is_moved_by_each_step_in_turn():
    other = replace(STEP, step_m=-3.0, heading_rad=0.6)
    found, unused, asked = move(walking(), STEP, other)
    assert asked == [
        ("predict", 0, STEP, True), ("remounted", 2.0),
        ("predict", 0, other, True), ("remounted", 3.0),
    ]  # fmt: skip
    assert found.belief.state[EAST, 0] == -1.0
    assert (found.reckoning.travelled_m, found.heading_rad, unused) == (5.0, 0.6, [])
    assert found.reckoning.sampling_m2 == pytest.approx(2 * 0.25**2)
    # Headings of steps forward are those of the walk.
    assert found.walking_rad == 0.5
    still, _, asked = move(walking())
    assert (asked, still.walking_rad) == ([], 0.4)


@pytest.mark.parametrize("why", [Reason.USED, Reason.NO_STEP])
def test_motion_that_is_not_used_is_reported(why):
    _, unused, _ = move(walking(), STEP, STEP, beliefs=Beliefs(why=why))
    expected = [] if why is Reason.USED else [(10.0, "motion", "", why)] * 2
    assert [(one.time_s, one.kind, one.what, one.reason) for one in unused] == expected


def test_the_sampling_of_steps_counts_once_a_position_is_tracked():
    for status, sd_m in ((TRACKING, 0.25), (SEARCHING, 0.0), (Status.CONVERGED, 0.0)):
        _, _, asked = move(walking(belief(status)), STEP)
        assert steps_of(asked) == [replace(STEP, sampling_sd_m=sd_m)]
    rough = replace(STEP, sampling_sd_m=1.0)
    assert steps_of(move(walking(belief(SEARCHING)), rough)[2]) == [replace(STEP, sampling_sd_m=0)]


@pytest.mark.parametrize(
    ("raw", "before", "compass"),
    [
        (MotionStep(1.0, 0.3), False, True),
        (MotionStep(1.0, nan, 0.2), True, False),
        # An unmeasured way says nothing of it.
        (MotionStep(1.0, nan, nan, 5.0), True, True),
        (MotionStep(1.0, nan, nan, 5.0), False, False),
    ],
)
def test_before_a_belief_motion_tells_whether_there_is_a_compass(raw, before, compass):
    found, unused, asked = move(BayesState(compass=before), raw)
    assert (found.compass, asked) == (compass, [])
    assert [one.reason for one in unused] == [Reason.NOT_STARTED]
    assert found.reckoning.travelled_m == 0.0


def test_where_the_map_may_start_a_belief_the_path_is_kept():
    streets = Beliefs(map_may_start=True)
    found, unused, _ = move(BayesState(), STEP, STEP, beliefs=streets)
    assert (found.path.here.travelled_m, unused) == (4.0, [])
    found, unused, _ = move(BayesState(), replace(STEP, step_m=nan), beliefs=streets)
    assert [one.reason for one in unused] == [Reason.NO_STEP]
    assert move(BayesState(), STEP)[0].path.here.travelled_m == 0.0
    # Headings that begin to be relative, or no longer are, begin another path.
    known, _, _ = move(BayesState(), STEP, STEP, beliefs=streets)
    turn = MotionStep(1.0, nan, 0.2)
    assert move(known, turn, beliefs=streets)[0].path.here.travelled_m == 1.0
    assert move(known, STEP, beliefs=streets)[0].path.here.travelled_m == 6.0
    relative, _, _ = move(BayesState(compass=False), turn, turn, beliefs=streets)
    assert relative.path.here.travelled_m == 2.0


@pytest.mark.parametrize(
    ("raw", "gone_m", "compass"),
    [(MotionStep(1.0, nan, 0.2), 0.0, False), (MotionStep(1.0, nan, 0.2), 3.0, True),
     (MotionStep(1.0, 0.2), 0.0, True), (MotionStep(1.0, nan, nan, 5.0), 0.0, True)],
)  # fmt: skip
def test_turns_alone_at_the_start_make_headings_relative(raw, gone_m, compass):
    state = walking()
    reckoning = replace(state.reckoning, travelled_m=gone_m)
    state = replace(state, reckoning=reckoning, unaided=(turned_phone(Hold(), 6),))
    found, _, asked = move(state, raw)
    assert found.compass is compass
    # A belief without positions that began with a compass is none any more.
    assert len(found.unaided) == compass
    assert (("without compass",) in asked) is not compass
    assert [one[3] for one in asked if one[:2] == ("predict", 0)] == [compass]


@pytest.mark.parametrize(
    ("raw", "readings", "changes", "jumped"),
    [
        (MotionStep(2.0, 2.0), {}, {}, True),
        (MotionStep(2.0, 1.0), {}, {}, False),
        (MotionStep(4.0, 2.0), {}, {}, False),
        # A position leaves no doubt; a satellite without a range is none.
        (MotionStep(2.0, 2.0), {"gnss": FIX}, {}, False),
        (
            MotionStep(2.0, 2.0),
            {"pseudoranges": (Pseudorange("G", 2e7, 1.0, (0, 0, 0)),)},
            {},
            False,
        ),
        (
            MotionStep(2.0, 2.0),
            {"pseudoranges": (Pseudorange("G", nan, 1.0, (0, 0, 0)),)},
            {},
            True,
        ),
        # Who stood for longer than 3 s may have turned there.
        (MotionStep(2.0, 2.0), {}, {"stepped_s": 7.0}, True),
        (MotionStep(2.0, 2.0), {}, {"stepped_s": 6.9}, False),
        (MotionStep(2.0, 2.0), {}, {"stepped_s": nan}, False),
        (MotionStep(2.0, 2.0), {}, {"compass": False}, False),
    ],
)
def test_a_search_turns_some_phones_at_a_jump(raw, readings, changes, jumped):
    state = walking(belief(SEARCHING), hold=Hold(-1.0, 0.3), **changes)
    found, _, asked = move(state, raw, **readings)
    turned = [one[1] for one in asked if one[0] == "turned"]
    # 2 rad after 0.4; the phone is read as mirrored.
    assert turned == ([pytest.approx(-1.6)] if jumped else [])
    assert found.held == ()


def test_a_tracked_position_has_other_beliefs_from_a_jump_on():
    raw = MotionStep(2.0, 2.0, 1.6)
    found, _, asked = move(walking(null=NullHypothesis(-6.0)), raw)
    assert not [one for one in asked if one[0] == "turned"]
    turned, mirrored, before = found.held
    # On it goes at 0.4 rad; or, mirrored before, at -1.2 rad.
    assert [one.hold.direction_rad(2.0) for one in found.held] == pytest.approx([0.4, 0.4, -1.2])
    assert (turned.hold.sign, mirrored.hold.sign, before.hold.sign) == (1.0, -1.0, -1.0)
    assert {(one.start_m, one.null.log_odds) for one in found.held} == {(0.0, -6.0)}
    # They are moved by the step as they read it, then the belief as it is.
    headings = [one.heading_rad for one in steps_of(asked)]
    assert headings == pytest.approx([0.4, 0.4, -1.2, 2.0])
    # One right round is one that was turned, or mirrored, at once.
    assert len(move(walking(), MotionStep(2.0, 0.4 + pi - 0.1))[0].held) == 2
    # What is reported as LOST, or on a grid, has none.
    assert move(walking(status=Status.LOST), raw)[0].held == ()
    grid = SimpleNamespace(status=TRACKING, state=belief().state, log_evidence=0.0)
    with_grid = Beliefs()
    with_grid.moving_filter = lambda *_, **__: SimpleNamespace(
        predict=lambda b, *_: (b, Reason.USED)
    )
    assert move(walking(grid), raw, beliefs=with_grid)[0].held == ()


AHEAD = Hold(1.0, 3.0)


def turned_phone(hold=AHEAD, name=5):
    return HeldOtherwise(belief(name=name), hold, -2.0, 0.0)


def test_other_beliefs_are_moved_as_they_read_headings():
    found, _, asked = move(walking(held=(turned_phone(), turned_phone(Hold(-1.0, 0.0), 6))), STEP)
    assert steps_of(asked, 5)[0].heading_rad == pytest.approx(3.5 - 2 * pi)
    assert steps_of(asked, 6) == [replace(STEP, heading_rad=-0.5, turn_rad=-0.1)]
    assert steps_of(asked) == [STEP]
    assert [one.belief.state[EAST, 0] for one in found.held] == [2.0, 2.0]


def test_positions_that_lead_begin_a_belief_without_them():
    for readings in ({"gnss": FIX}, {"pseudoranges": (Pseudorange("G", 2e7, 1.0, (0, 0, 0)),)}):
        hold, null = Hold(-1.0, 0.2), NullHypothesis(-9.0)
        state = walking(belief(log_evidence=-4.0), hold=hold, null=null)
        beliefs = Beliefs(lead=True)
        (alone,) = move(state, STEP, beliefs=beliefs, **readings)[0].unaided
        assert (alone.hold, alone.null, alone.start_m) == (hold, null, 0.0)
        # One in ten thousand, and what happens from here on.
        assert alone.log_prior == pytest.approx(-np.log(9999.0))
        assert alone.belief.log_evidence == -4.0
        # It is moved as the belief is, from the same epoch on.
        assert alone.belief.state[EAST].tolist() == [2.0] * 20
        assert move(state, STEP, **readings)[0].unaided == ()
    assert move(walking(), STEP, beliefs=Beliefs(lead=True))[0].unaided == ()


def test_a_belief_without_positions_is_moved_as_it_reads_headings_with_draws_of_its_own():
    alone = turned_phone(Hold(-1.0, 0.0), 6)
    found, _, asked = move(walking(unaided=(alone,)), STEP)
    assert steps_of(asked, 6) == [replace(STEP, heading_rad=-0.5, turn_rad=-0.1)]
    assert found.unaided[0].belief.state[EAST, 0] == 2.0
    rng = np.random.default_rng(1)
    moved_by(Beliefs(), walking(unaided=(alone,)), SensorWatch(), Epoch(10.0, (STEP,)), rng)
    other = np.random.default_rng(1)
    moved_by(Beliefs(), walking(), SensorWatch(), Epoch(10.0, (STEP,)), other)
    assert rng.bit_generator.state == other.bit_generator.state


FIXED = {"gnss": FIX}
RANGED = {"pseudoranges": (Pseudorange("G", 2e7, 1.0, (0, 0, 0)),)}


def test_pseudoranges_leave_no_doubt_of_a_jump_and_fixes_weigh_other_beliefs():
    """Pseudoranges weigh the main belief alone."""
    plain, other = turned_phone(Hold(), 4), turned_phone()
    assert move(walking(held=(plain, other)), **RANGED)[0].held == ()
    assert move(walking(held=(plain, other)), **FIXED)[0].held == (plain, other)
    nothing = {"pseudoranges": (Pseudorange("G", nan, 1.0, (0, 0, 0)),)}
    assert len(move(walking(held=(plain, other)), **nothing)[0].held) == 2
    # A heading may jump where there is a fix.
    raw = MotionStep(2.0, 2.0, 1.6)
    assert len(move(walking(), raw, **FIXED)[0].held) == 3
    assert move(walking(), raw, **RANGED)[0].held == ()


def test_once_a_turned_phone_has_taken_over_positions_begin_the_one_as_measured():
    plain, other = turned_phone(Hold(), 4), turned_phone()
    for readings, left in ((RANGED, ()), (FIXED, (other,))):
        state = walking(held=(plain, other), hold=Hold(1.0, 3.0))
        assert set(move(state, **readings)[0].held) == {plain, *left}
        *rest, back = move(replace(state, held=(other,)), **readings)[0].held
        assert tuple(rest) == left
        assert (back.hold, back.log_prior) == (Hold(), pytest.approx(np.log(1 / 3)))
        assert move(replace(state, held=(), status=Status.LOST), **readings)[0].held == ()
        searching = replace(state, held=(), belief=belief(SEARCHING))
        assert move(searching, **readings)[0].held == ()


@pytest.mark.parametrize(
    ("left", "rest", "carried"), [(True, None, True), (False, None, False), (True, 1, False)]
)
def test_hypotheses_are_carried_on_once_steps_are_counted_again(left, rest, carried):
    watch = SensorWatch(rest=rest)
    rested = walking()
    rested = replace(rested, watch=rested.watch._replace(rest=Rest(4.0)))
    found, _, asked = move(rested, beliefs=Beliefs(left=left), watch=watch)
    # Since the last step at the usual pace, at 4 s.
    assert asked == ([("carried on", 6.0)] if carried else [])
    assert (found.belief.log_evidence == -77.0) is carried
    assert found.watch is watch


def test_after_a_ride_the_search_begins_anew():
    other = AlternativeHypothesis(belief(SEARCHING, name=5), 0.0, 0.0)
    state = replace(walking(alternative=other, held=(turned_phone(),)), proven=True)
    state = replace(state, watch=state.watch._replace(rest=Rest(4.0)))
    beliefs = Beliefs(anywhere=True, left=True)
    found, _, asked = move(state, STEP, beliefs=beliefs, watch=SensorWatch())
    assert asked == []
    assert (found.belief, found.alternative, found.held) == (None, None, ())
    assert (found.status, found.proven) == (Status.LOST, False)
    assert found.null == NullHypothesis()
    # While it lasts the belief is kept.
    rest = SensorWatch(rest=Rest(4.0))
    assert move(state, STEP, beliefs=beliefs, watch=rest)[0].belief is not None
    searching = replace(state, status=SEARCHING)
    assert move(searching, STEP, beliefs=beliefs, watch=SensorWatch())[0].status is SEARCHING


def test_an_alternative_reads_headings_as_they_are_and_lengths_in_its_unit():
    other = AlternativeHypothesis(belief(SEARCHING, name=5), 0.0, 0.0, hold=Hold(step_unit_m=0.5))
    state = walking(alternative=other, hold=Hold(-1.0, 0.2, 2.0))
    found, _, asked = move(state, STEP)
    (own,) = steps_of(asked)
    assert (own.step_m, own.turn_rad, own.sampling_sd_m) == (4.0, -0.1, 0.5)
    assert own.heading_rad == pytest.approx(-0.3)
    (read,) = steps_of(asked, 5)
    assert (read.step_m, read.heading_rad, read.turn_rad, read.sampling_sd_m) == (
        1.0,
        0.5,
        0.1,
        0.0,
    )
    assert found.alternative.belief.state[EAST, 0] == 1.0
    assert found.reckoning.travelled_m == 4.0


def test_a_twin_is_moved_with_left_and_right_exchanged():
    twin = MirroredTwin(belief(SEARCHING, name=5), -3.0)
    found, _, asked = move(walking(twin=twin), STEP)
    assert steps_of(asked, 5) == [
        replace(STEP, heading_rad=-0.5, turn_rad=-0.1, sampling_sd_m=0.0)
    ]  # fmt: skip
    assert (found.twin.belief.state[EAST, 0], found.twin.main_log_evidence) == (2.0, -3.0)


@pytest.mark.parametrize(
    ("raw", "walking_rad"),
    [(MotionStep(1.0, 0.7), 0.7), (MotionStep(0.0, 0.7), 0.4), (MotionStep(-1.0, 0.7), 0.4),
     (MotionStep(1.0, nan, 0.2), 0.4), (MotionStep(1.0, nan, nan, 5.0), nan),
     (MotionStep(0.0, 0.7, spread_m=5.0), nan)],
)  # fmt: skip
def test_the_heading_of_the_walk(raw, walking_rad):
    found, _, _ = move(walking(), raw)
    assert found.walking_rad == pytest.approx(walking_rad, nan_ok=True)


def test_the_rest_of_the_state_stays():
    kept = {
        "contested": True, "sources": {"one": 1}, "null": NullHypothesis(-3.0), "takeovers": 2,
        "reported": "reported", "last_fix": FIX, "recovery": "recovery", "alternatives": 4,
        "hold": Hold(1.0, 0.1),
    }  # fmt: skip
    found, _, _ = move(walking(status=Status.LOST, **kept), STEP)
    for name, value in kept.items():
        assert getattr(found, name) is value, name
    assert found.status is Status.LOST
    assert isnan(move(walking(walking_rad=inf, stepped_s=1.0))[0].walking_rad)


def test_a_compass_tells_where_a_phone_that_was_turned_points_afterwards():
    turned = MotionStep(2.0, nan, nan, 5.0, turned_sd_rad=0.3)
    for compass, sd_rad in ((True, 0.0), (False, 0.3)):
        (read,) = steps_of(move(walking(compass=compass), turned)[2])
        assert (read.step_m, read.turned_sd_rad) == (2.0, sd_rad)


def test_what_followed_the_ways_counts_from_the_first_heading_of_a_compass():
    """Courses along ways, from a heading of 0, are errors of the headings from then on."""
    other = AlternativeHypothesis(belief(SEARCHING, name=5), 0.0, 0.0)
    state = walking(alternative=other, held=(turned_phone(),), unaided=(turned_phone(),))
    by_ways = Beliefs()
    by_ways.followed_ways = lambda _: True
    found, _, _ = move(state, STEP, replace(STEP, heading_rad=0.9), beliefs=by_ways)
    for one in (found.belief, found.alternative.belief):
        assert one.state[BIAS].tolist() == pytest.approx([-0.5] * 20)
        assert one.state[EAST].tolist() == [4.0] * 20
    assert (found.held, found.unaided) == ((), ())
    # Without a heading there is nothing to count from, nor is there before a belief.
    along, _, _ = move(state, MotionStep(2.0, nan, nan, 5.0), beliefs=by_ways)
    assert along.belief.state[BIAS].tolist() == [0.0] * 20
    assert len(along.held) == 1
    assert move(BayesState(), STEP, beliefs=by_ways)[0].belief is None
    assert move(walking(), STEP)[0].belief.state[BIAS].tolist() == [0.0] * 20
