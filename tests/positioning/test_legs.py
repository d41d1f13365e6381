"""Steps that wait for others: beliefs go by legs, and positions by dead reckoning in between."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_town import Town, walk_log

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import BIAS, LOG_SCALE, STATES, MotionErrors, moving
from mapfilter.models.street_motion import noise_of_step as noise
from mapfilter.positioning.bayes.beliefs.legs import LEG_M, NO_LEG, Lead, may_wait
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.beliefs.smoothing import BayesSmoother
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.merging import epochs
from mapfilter.serving.state_file import decode, encode

TOWN = Town.of(1)
START_M = 500_300.0, 4_500_300.0
STEP = MotionStep(1.4, 0.3)


@cache
def positioner():
    few = {"max_particles": 400, "min_search_particles": 400, "min_particles": 200}
    return BayesFilter(heading_sd_deg=6.0, **few).over_area(TOWN.area())


def begun(**more):
    rng = np.random.default_rng(3)
    return replace(positioner().begin_at(*START_M, 3.0, rng), **more), rng


def walked(state, rng, *motion, since_s=0):
    """States and outputs after epochs of one row each."""
    found = []
    for time_s, step in enumerate(motion, since_s + 1):
        state, output = positioner().step(state, Epoch(float(time_s), (step,)), rng)
        found.append((state, output))
    return found


def leg_of(*steps):
    leg, reckoning = NO_LEG, DeadReckoning()
    for step in steps:
        leg = leg.joined(step, reckoning)
        reckoning = reckoning.moved(step)
    return leg


def test_a_leg_has_the_noise_of_its_steps():
    errors = MotionErrors()
    for rows, step_m in ((4, 1.4), (4, 2.5), (5, 0.7)):
        _, _, one = noise(step_m, errors, 0.0)
        _, _, leg = noise(rows * step_m, errors, 0.0, rows)
        for name in ("along_m", "across_m", "bias_rad"):
            expected = rows**0.5 * getattr(one, name)
            assert getattr(leg, name) == pytest.approx(expected), name


def test_a_leg_leads_where_its_steps_do():
    """Positions and their spread after four steps, by each and by their sum."""
    errors, count = MotionErrors(), 40_000
    state = np.zeros((STATES, count), dtype=np.float32)
    rng = np.random.default_rng(2)
    state[BIAS], state[LOG_SCALE] = rng.normal(0.3, 0.1, count), rng.normal(0.0, 0.05, count)
    steps = [MotionStep(1.4, heading) for heading in (0.2, 0.5, 0.4, 0.1)]
    each = state
    for key, step in enumerate(steps):
        (kernel, *given), moved = moving(
            each, step.step_m, step.heading_rad, errors, np.uint64(key)
        )
        kernel(0, count, *given)
        each = moved
    step = leg_of(*steps).step
    (kernel, *given), whole = moving(
        state, step.step_m, step.heading_rad, errors, np.uint64(9), 0.0, step.rows
    )
    kernel(0, count, *given)
    np.testing.assert_allclose(whole[:2].mean(axis=1), each[:2].mean(axis=1), atol=0.05)
    np.testing.assert_allclose(np.cov(whole[:2]), np.cov(each[:2]), rtol=0.1, atol=0.02)


def test_unequal_steps_have_the_noise_that_they_have_by_themselves():
    errors, lengths_m = MotionErrors(), (1.5, 4.5, 2.0)
    across_m2 = sum(noise(length_m, errors, 0.0)[2].across_m ** 2 for length_m in lengths_m)
    step = leg_of(*(MotionStep(length_m, 0.0) for length_m in lengths_m)).step
    _, _, leg = noise(step.step_m, errors, 0.0, step.rows)
    assert leg.across_m**2 == pytest.approx(across_m2)


def test_a_leg_of_sums_has_the_noise_of_the_steps_in_these():
    summed = leg_of(*[MotionStep(2.8, 0.0, rows=2.0)] * 2).step
    assert (summed.step_m, summed.rows) == (pytest.approx(5.6), pytest.approx(4.0))
    assert leg_of(MotionStep(5.6, 0.0, rows=4.0)).equal_rows == pytest.approx(4.0)


def test_a_leg_of_one_row_is_that_row():
    step = MotionStep(5.0, 0.5, 0.1, sampling_sd_m=0.25)
    assert leg_of(step).step is step


@pytest.mark.parametrize(
    ("steps", "whole"),
    [((5.0,), True), ((1.4,) * 4, False), ((1.4,) * 5, True), ((4.0,), False), ((), False)],
)
def test_a_leg_is_whole_once_another_such_step_would_be_too_much(steps, whole):
    assert leg_of(*(MotionStep(length_m, 0.5) for length_m in steps)).is_whole is whole


def test_where_none_waits_nothing_has_been_gone():
    assert (0, 0.0, 0.0, 0.0, 0.0, 0.0, DeadReckoning(), None) == NO_LEG
    assert leg_of(MotionStep(0.0, 1.0)) is NO_LEG


def test_the_sums_of_a_leg_are_those_of_its_steps():
    steps = MotionStep(3.0, 0.0, sampling_sd_m=0.3), MotionStep(4.0, 0.75, sampling_sd_m=0.4)
    leg = leg_of(*steps)
    east_m, north_m = 3.0 + 4.0 * np.cos(0.75), 4.0 * np.sin(0.75)
    assert leg[:6] == pytest.approx((2, 7.0, 25.0, east_m, north_m, 0.25))
    assert (leg.since, leg.first) == (DeadReckoning(), steps[0])
    assert leg.equal_rows == pytest.approx(49 / 25)
    assert leg.step.step_m == pytest.approx(np.hypot(east_m, north_m))
    assert leg.step.heading_rad == pytest.approx(np.arctan2(north_m, east_m))
    assert leg.step.sampling_sd_m == pytest.approx(0.5)
    here = DeadReckoning().moved(steps[0]).moved(steps[1])
    assert leg.gone_m(here) == pytest.approx((east_m, north_m))


def test_a_leg_ends_at_a_corner_and_before_it_is_too_long():
    leg = leg_of(*[MotionStep(2.0, 0.0)] * 3)
    assert leg.joined(MotionStep(1.0, 0.7), DeadReckoning()).rows == 4
    assert leg.joined(MotionStep(1.0, 0.9), DeadReckoning()) is None
    assert leg.joined(MotionStep(LEG_M - 5.9, 0.0), DeadReckoning()) is None
    assert leg.joined(MotionStep(0.0, 3.0), DeadReckoning()) is leg


@pytest.mark.parametrize(
    "step",
    [
        MotionStep(-1.0, 0.0), MotionStep(1.0, np.nan), MotionStep(np.nan, 0.0),
        MotionStep(1.0, 0.0, turned_sd_rad=0.1), MotionStep(1.0, 0.0, spread_m=1.0),
    ],
)  # fmt: skip
def test_other_steps_do_not_wait(step):
    assert not may_wait(step)


def test_a_belief_stays_and_its_position_goes_on_until_the_leg_is_whole():
    state, rng = begun()
    found = walked(state, rng, *[STEP] * 5)
    assert [after.belief is state.belief for after, _ in found] == [True] * 4 + [False]
    assert [after.leg.rows for after, _ in found] == [1, 2, 3, 4, 0]
    east_m = np.array([output.fix.east_m for _, output in found])
    # What the belief's errors make of a step, in the mean.
    np.testing.assert_allclose(np.diff(east_m), 1.4 * np.cos(0.3), atol=0.15)
    after, output = found[3]
    fix = output.fix
    here = positioner().hypotheses(after)
    for places, found_m in ((here.east_m, fix.east_m), (here.north_m, fix.north_m)):
        assert here.weight @ (places - found_m) == pytest.approx(0.0, abs=0.01)
    first = found[0][1].fix
    assert (output.fix.hypotheses, output.fix.way_id) == (first.hypotheses, first.way_id)
    assert after.reckoning.travelled_m == pytest.approx(4 * 1.4)


def test_all_beliefs_have_been_moved_when_something_is_read_of_them():
    radio = (ReportRow("serving", "a", None, None, -70.0, 0),)
    fix = GnssFix(START_M[0] + 4.0, START_M[1], 25.0, 25.0, 0.0)
    for read in ({"radio": radio}, {"gnss": fix}):
        state, rng = begun()
        before, _ = walked(state, rng, STEP, STEP)[-1]
        assert before.leg.rows == 2
        after, _ = positioner().step(before, Epoch(3.0, (STEP,), **read), rng)
        assert after.leg == NO_LEG
        gone_m = after.belief.summary.mean[0] - before.belief.summary.mean[0]
        assert gone_m == pytest.approx(3 * 1.4 * np.cos(0.3), abs=1.0)


def centre_m(belief):
    return belief.summary.mean[:2]


def test_a_leg_ends_where_one_turns_aside_or_goes_back():
    ahead_m = 2 * 1.4 * np.array([np.cos(0.3), np.sin(0.3)])
    for step, waiting in ((MotionStep(1.4, 1.3), 1), (MotionStep(-0.7, 0.3), 0)):
        state, rng = begun()
        after, _ = walked(state, rng, STEP, STEP, step)[-1]
        assert after.leg.rows == waiting
        gone_m = centre_m(after.belief) - centre_m(state.belief)
        np.testing.assert_allclose(gone_m, ahead_m * (1.0 if waiting else 0.75), atol=0.4)


def test_beliefs_that_begin_at_a_jump_or_a_position_begin_where_one_is():
    turned = MotionStep(1.4, 0.3 - np.pi)
    fix = GnssFix(*START_M, 25.0, 25.0, 0.0)
    for hold, more in ((Hold(), {"motion": (turned,)}), (Hold(1.0, np.pi), {"gnss": fix})):
        state, rng = begun(hold=hold)
        state, _ = walked(state, rng, STEP, STEP, STEP)[-1]
        assert (state.leg.rows, state.held) == (3, ())
        after, _ = positioner().step(state, Epoch(4.0, **more), rng)
        assert len(after.held) > 0
        for rival in after.held:
            apart_m = centre_m(rival.belief) - centre_m(after.belief)
            assert np.hypot(*apart_m) < 2.0


def test_smoothing_keeps_beliefs_that_have_been_moved_and_the_last_one_as_it_is():
    state, rng = begun()
    smoother = BayesSmoother(positioner().area, MotionErrors(), every_m=1.0)
    for time_s in range(1, 9):
        before = state
        state, output = positioner().step(before, Epoch(float(time_s), (STEP,)), rng)
        smoother.add(before, state)
    assert (state.leg.rows, [one.epoch for one in smoother.kept]) == (3, [4])
    smoother.close()
    last = smoother.kept[-1]
    assert last.epoch == 7
    weights = np.exp(last.log_weight)
    place = np.average(last.state[:2], axis=1, weights=weights) + positioner().area.origin_m
    assert place == pytest.approx([output.fix.east_m, output.fix.north_m], abs=0.05)


def test_nothing_waits_for_a_belief_that_begins_anew():
    state, rng = begun()
    state, _ = walked(state, rng, STEP)[-1]
    assert state.leg.rows == 1
    assert state.begun_anew().leg == NO_LEG


def test_a_course_that_waits_ends_before_headings_of_a_compass_begin():
    few = {"max_particles": 400, "min_search_particles": 400, "min_particles": 200}
    driven, rng = BayesFilter(vehicle=True, **few).over_area(TOWN.area()), np.random.default_rng(3)
    state = driven.begin_at(*START_M, 1.0, rng)
    errors = replace(state.belief, state=state.belief.state.copy())
    # Hypotheses that all go north.
    errors.state[BIAS] = np.pi / 2
    state = replace(state, belief=errors, compass=False)
    for time_s, heading_rad in ((1.0, np.nan), (2.0, np.pi / 2)):
        motion = (MotionStep(3.0, heading_rad),)
        state, output = driven.step(state, Epoch(time_s, motion), rng)
    assert state.leg.rows == 1
    assert abs(state.belief.summary.mean[1] - errors.summary.mean[1] - 3.0) < 0.5
    assert output.fix.north_m == pytest.approx(START_M[1] + 6.0, abs=1.0)


def test_what_lasts_for_one_epoch_does_not_wait():
    state, rng = begun(status=Status.CONVERGED)
    ((after, _),) = walked(state, rng, STEP)
    assert (after.leg, after.belief is state.belief) == (NO_LEG, False)


def test_what_is_uncertain_stays_so_while_it_waits():
    state, rng = begun(status=Status.UNCERTAIN)
    ((after, output),) = walked(state, rng, STEP)
    assert (after.leg.rows, after.belief is state.belief) == (1, True)
    assert (after.status, output.fix.status) == (Status.UNCERTAIN, Status.UNCERTAIN)


def test_a_search_waits_too_and_loses_nothing_of_the_way():
    log, rng = walk_log(TOWN, 1), np.random.default_rng(5)
    state, waited, gone_m = positioner().begin(), 0, 0.0
    for epoch in epochs(log)[:60]:
        # Four steps where the log has one.
        for part in range(4):
            motion = tuple(replace(one, step_m=one.step_m / 4) for one in epoch.motion)
            radio = epoch.radio if part == 3 else ()
            time_s = epoch.time_s - 0.2 * (3 - part)
            given = replace(epoch, time_s=max(time_s, 0.0), motion=motion, radio=radio)
            begun_m = 0.0 if state.belief is None else state.reckoning.travelled_m
            state, _ = positioner().step(state, given, rng)
            waited += state.leg.rows > 0
            if state.belief is not None and begun_m < state.reckoning.travelled_m:
                gone_m += state.reckoning.travelled_m - begun_m
    assert waited > 60
    assert isinstance(state.belief, ParticleBelief)
    assert state.reckoning.travelled_m == pytest.approx(gone_m)
    way_m = state.belief.travelled_m + state.leg.way_m
    assert way_m == pytest.approx(state.reckoning.travelled_m, rel=0.01)


def test_a_session_is_saved_between_two_steps_of_a_leg():
    state, rng = begun()
    state, _ = walked(state, rng, STEP, STEP)[-1]
    again = decode(encode({"state": state}), "session")["state"]
    assert again.leg == state.leg != NO_LEG
    assert again.reported.lead == state.reported.lead != None  # noqa: E711
    other = np.random.default_rng()
    other.bit_generator.state = rng.bit_generator.state
    for given, draws in ((state, rng), (again, other)):
        after, output = walked(given, draws, *[STEP] * 4, since_s=2)[-1]
        if given is state:
            expected = after.belief.state, output.fix
    np.testing.assert_array_equal(after.belief.state, expected[0])
    assert output.fix == expected[1]


def test_a_lead_is_that_of_hypotheses_near_the_place():
    state = np.zeros((STATES, 3), dtype=np.float32)
    state[0], state[BIAS], state[LOG_SCALE] = [0.0, 10.0, 80.0], np.pi / 2, np.log(1.1)
    state[BIAS, 2] = 0.0
    lead = Lead.of(state, np.full(3, 1 / 3, dtype=np.float32), np.zeros(STATES))
    assert lead == pytest.approx((0.0, 1.1), abs=1e-6)
    assert lead.led_m((2.0, 1.0)) == pytest.approx((-1.1, 2.2), abs=1e-5)
    assert Lead.of(state, np.zeros(3, dtype=np.float32), np.zeros(STATES)) == (1.0, 0.0)
