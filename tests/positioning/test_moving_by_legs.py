"""When steps that wait move the beliefs, and single changes of these, with made filters."""

from dataclasses import replace
from math import nan, pi
from types import SimpleNamespace

import numpy as np
import pytest
from made_filters import SEARCHING, TRACKING, belief

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.grid import GridBelief
from mapfilter.models.street_motion import BIAS, EAST, STATES, MotionErrors
from mapfilter.positioning.bayes.beliefs.belief_changes import (
    assumed,
    counted_from,
    moved_as_read,
    remounted,
)
from mapfilter.positioning.bayes.beliefs.legs import NO_LEG
from mapfilter.positioning.bayes.beliefs.moving import moved
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch, GnssFix, Pseudorange
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.watch import SensorWatch

STEP = MotionStep(1.4, 0.3)
FIX = {"gnss": GnssFix(0.0, 0.0)}
RANGE = {"pseudoranges": (Pseudorange("G", 2e7, 1.0, (0, 0, 0)),)}


def hypotheses(status=TRACKING, **changes):
    """Twenty in one place, without an error of headings."""
    state = np.zeros((STATES, 20), dtype=np.float32)
    kept = np.zeros((0, 20), dtype=np.float32)
    given = {"state": state, "log_weight": np.full(20, -np.log(20.0)), "kept": kept}
    return replace(belief(status), **given | changes)


class Filters:
    """Filters that note the lengths by which they move, and how hypotheses lie then."""

    def __init__(self, *, left=False, course=False, lead=False):
        self.left, self.course, self.lead, self.steps = left, course, lead, []
        self.holds, self.pulls, self.map_may_start = HoldRules(), PullRules(), False
        self.model = SimpleNamespace(motion=MotionErrors(remounts_per_m=0.0))

    def moving_filter(self, _state, *, compass):
        def predict(given, step, _rng):
            self.steps.append(step)
            after = given.state.copy()
            after[EAST] += step.step_m
            return replace(given, state=after), Reason.USED

        return SimpleNamespace(predict=predict, compass=compass)

    def may_be_anywhere(self, *_):
        return False

    def may_have_left(self, _):
        return self.left

    def left_share(self, *_):
        return 0.0

    def followed_ways(self, _):
        return self.course

    def positions_lead(self, _):
        return self.lead


WALKED = SensorWatch(pace=Pace(stepped_s=9.0), moving_s=4.0)
WALKING = BayesState(status=TRACKING, belief=hypotheses(), watch=WALKED, walking_rad=0.3)


def walked(*motion, state=WALKING, filters=None, waits=lambda _: True, watch=None, **readings):
    """The state after an epoch, and the lengths by which its beliefs were moved."""
    filters = filters or Filters()
    rng, watch = np.random.default_rng(1), watch or state.watch
    epoch = Epoch(10.0, motion, **readings)
    after, unused = moved(filters, state, watch, epoch, rng, waits)
    assert unused == []
    return after, [round(one.step_m, 6) for one in filters.steps]


def waiting(*motion, **more):
    state, lengths = walked(*motion or (STEP, STEP), **more)
    assert lengths == []
    return state


def test_steps_wait_and_are_reckoned():
    state = waiting()
    assert (state.leg.rows, state.leg.way_m) == (2, pytest.approx(2.8))
    assert state.reckoning.travelled_m == pytest.approx(2.8)
    assert state.belief is WALKING.belief
    assert state.leg.since == WALKING.reckoning
    assert waiting(state=state).leg.rows == 4


def test_beliefs_are_moved_by_what_waits_once_something_is_read():
    asked = []
    state, lengths = walked(STEP, state=waiting(), waits=lambda way_m: asked.append(way_m))
    assert asked == [pytest.approx(4.2)]
    assert (state.leg, lengths) == (NO_LEG, [4.2])
    assert state.belief.state[EAST, 0] == pytest.approx(4.2)


def test_without_waiting_each_row_moves_them_and_what_waits_goes_first():
    assert walked(STEP, STEP, waits=None)[1] == [1.4, 1.4]
    state, lengths = walked(STEP, state=waiting(), waits=None)
    assert (state.leg, lengths) == (NO_LEG, [2.8, 1.4])


def test_a_leg_that_is_whole_waits_no_longer():
    state, lengths = walked(*[STEP] * 5)
    assert (state.leg, lengths) == (NO_LEG, [7.0])
    # A step that does not fit begins another one.
    state, lengths = walked(*[STEP] * 4, MotionStep(3.0, 0.3))
    assert (state.leg.rows, state.leg.way_m, lengths) == (1, 3.0, [5.6])
    state, lengths = walked(STEP, STEP, MotionStep(1.0, 1.3))
    assert (state.leg.rows, lengths) == (1, [2.8])
    # Since where the steps before have led.
    assert state.leg.since.travelled_m == pytest.approx(2.8)


@pytest.mark.parametrize(
    "row",
    [MotionStep(-1.0, 0.3), MotionStep(1.0, 0.3, spread_m=2.0), MotionStep(1.0, nan, nan, 2.0)],
)
def test_other_rows_move_beliefs_after_what_waits(row):
    state, lengths = walked(row, state=waiting())
    assert (state.leg, lengths) == (NO_LEG, [2.8, row.step_m])


@pytest.mark.parametrize("readings", [FIX, RANGE])
def test_at_a_position_beliefs_are_where_one_is_before_others_begin(readings):
    filters = Filters(lead=True)
    state, lengths = walked(state=waiting(), filters=filters, waits=None, **readings)
    assert (state.leg, lengths) == (NO_LEG, [2.8])
    (alone,) = state.unaided
    assert alone.belief.state[EAST].tolist() == pytest.approx([2.8] * 20)
    assert alone.start_m == pytest.approx(2.8)
    nothing = {"pseudoranges": (Pseudorange("G", nan, 1.0, (0, 0, 0)),)}
    after, lengths = walked(state=waiting(), filters=Filters(lead=True), **nothing)
    assert (after.leg.rows, lengths, after.unaided) == (2, [], ())


def test_at_a_jump_beliefs_are_where_it_was_before_others_begin():
    state, lengths = walked(MotionStep(1.4, 2.3), state=waiting())
    assert lengths == [2.8]
    assert state.leg.rows == 1
    assert len(state.held) == 3
    for one in state.held:
        assert one.belief.state[EAST].tolist() == pytest.approx([2.8] * 20)
        assert one.start_m == pytest.approx(2.8)


@pytest.mark.parametrize("left", [False, True])
def test_who_may_have_left_is_moved_by_what_waits_first(left):
    rested = replace(waiting(), watch=WALKED._replace(rest=Rest(4.0, pace_mps=1.4)))
    state, lengths = walked(state=rested, filters=Filters(left=left), watch=WALKED)
    assert (state.leg.rows, lengths) == ((0, [2.8]) if left else (2, []))
    # Half of the hypotheses are where six seconds more may have led.
    assert (np.ptp(state.belief.state[EAST]) > 1.0) == left


def test_what_waits_is_part_of_a_course_before_headings_of_a_compass_begin():
    """Those count from the first of them."""
    other = HeldOtherwise(hypotheses(), Hold(), -2.0, 0.0)
    course = replace(waiting(MotionStep(2.0, 0.0)), held=(other,), unaided=(other,))
    state, lengths = walked(MotionStep(2.0, 0.5), state=course, filters=Filters(course=True))
    assert lengths == [2.0]
    assert state.leg.rows == 1
    assert (state.held, state.unaided) == ((), ())
    assert state.belief.state[BIAS].tolist() == pytest.approx([-0.5] * 20)
    # A row without one goes on with the course.
    gone_on, lengths = walked(
        MotionStep(2.0, nan), state=course, filters=Filters(course=True), waits=None
    )
    assert lengths == [2.0] * 6
    assert len(gone_on.held) == len(gone_on.unaided) == 1
    assert gone_on.belief.state[BIAS].tolist() == [0.0] * 20


GRID = GridBelief(np.ones((1, 2, 2), np.float32), np.zeros((1, 2, 2), np.float32), None)


def test_courses_are_counted_from_a_heading():
    turned = hypotheses()
    turned.state[BIAS, :2] = [3.0, -1.0]
    found = counted_from(turned, -1.0)
    assert found.state[BIAS, :3].tolist() == pytest.approx([4.0 - 2 * pi, 0.0, 1.0])
    assert turned.state[BIAS, 2] == 0.0
    assert counted_from(GRID, 1.0) is GRID


@pytest.mark.parametrize(
    ("status", "length_m", "per_m", "changes"),
    [
        (TRACKING, 2.0, 0.5, True), (TRACKING, 0.0, 0.5, False), (TRACKING, 2.0, 0.0, False),
        (SEARCHING, 2.0, 0.5, False), (Status.CONVERGED, 2.0, 0.5, False),
    ],
)  # fmt: skip
def test_phones_are_turned_in_the_hand_once_a_position_is_tracked(status, length_m, per_m, changes):
    given, rng = hypotheses(status), np.random.default_rng(4)
    found = remounted(given, MotionErrors(remounts_per_m=per_m), length_m, rng)
    assert (found is not given) is changes
    assert (np.ptp(found.state[BIAS]) > 0.5) == changes
    assert remounted(GRID, MotionErrors(remounts_per_m=1.0), 2.0, rng) is GRID


@pytest.mark.parametrize(
    ("status", "sd_m", "assumed_m"),
    [(TRACKING, 0.5, 0.5), (SEARCHING, 0.5, 0.0), (Status.CONVERGED, 0.5, 0.0),
     (SEARCHING, 0.0, 0.0)],
)  # fmt: skip
def test_sampling_counts_once_a_position_is_tracked(status, sd_m, assumed_m):
    step = replace(STEP, sampling_sd_m=sd_m)
    found = assumed(step, belief(status))
    assert found == replace(step, sampling_sd_m=assumed_m)
    assert (found is step) is (sd_m == assumed_m)


def test_a_rival_is_moved_by_a_step_as_it_reads_it():
    asked, after = [], belief(TRACKING, -3.0)
    one = HeldOtherwise(belief(SEARCHING), Hold(-1.0, 0.2, 2.0), -2.0, 7.0)
    rng = np.random.default_rng(1)

    def predict(*given):
        asked.append(given)
        return after, Reason.USED

    found = moved_as_read(one, predict, replace(STEP, sampling_sd_m=0.5), rng)
    ((given, step, drawn),) = asked
    assert given is one.belief
    assert drawn is rng
    assert (step.step_m, step.sampling_sd_m) == (2.8, 0.0)
    assert step.heading_rad == pytest.approx(Hold(-1.0, 0.2).read(STEP).heading_rad)
    assert found.belief is after
    assert (found.hold, found.start_m) == (one.hold, 7.0)
