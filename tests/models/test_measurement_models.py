"""Measurement models against reference values, differences, and what is hostile."""

import math

import numpy as np
import pytest
from fusion_world import CASES, LAYOUT, MOVING_3D, MOVING_CLOCK_3D, hybrid, zhang
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.evaluation.bounds import expected_information
from mapfilter.filters.gaussian import EKF
from mapfilter.filters.trials import run_trials
from mapfilter.models.gaussian import stack
from mapfilter.models.ranging import (
    GSM_STEP_M,
    difference_covariance,
    position_fix,
    pseudoranges,
    range_differences,
    timing_advances,
)
from mapfilter.models.signal_strength import levels, sampled_pattern
from mapfilter.models.state import (
    MOVING,
    MOVING_CLOCK,
    POSITION,
    POSITION_CLOCK_3D,
    GaussianMeasurement,
    StateLayout,
)
from mapfilter.models.terms import atan2_lanes, log_lanes
from mapfilter.positioning.kalman.models import compiled
from mapfilter.radio.antenna import MeasuredAntenna, sector_gain_db


@pytest.mark.parametrize("case", CASES["fk_h"], ids=lambda case: str(case["x"][:3]))
def test_hybrid_readings_and_slopes_are_those_of_the_reference(case):
    model = hybrid(2)
    np.testing.assert_allclose(model.mean(case["x"]), case["y"], rtol=1e-12)
    np.testing.assert_allclose(model.jacobian(case["x"]), case["H"], rtol=1e-10, atol=1e-14)


def test_losses_are_those_of_the_reference():
    case = CASES["zhang"]["h"]
    model = zhang("both")
    np.testing.assert_allclose(model.mean(case["x"]), case["y"], rtol=1e-12)
    np.testing.assert_allclose(model.jacobian(case["x"]), case["H"], rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize("case", CASES["antenna_gain"], ids=lambda case: str(case["phi"]))
def test_the_antenna_is_that_of_the_reference(case):
    at_rad = np.radians(case["phi"])
    place = 500.0 * np.array([np.cos(at_rad), np.sin(at_rad)])
    given_antenna = {"boresight_rad": 0.0, "beamwidth_rad": np.pi / 3}
    with_antenna = levels(
        POSITION, [[0.0, 0.0]], 8.0, loss_at_km_db=0.0, exponent=0.0, **given_antenna
    )
    assert with_antenna.mean(place)[0] == pytest.approx(case["gain"], abs=1e-9)
    assert sector_gain_db(at_rad, np.pi / 3, 20.0) == pytest.approx(case["gain"], abs=1e-9)
    # Along a circle a radian is 500 m.
    along = np.array([-np.sin(at_rad), np.cos(at_rad)])
    slope = with_antenna.jacobian(place)[0] @ along * 500.0
    assert slope == pytest.approx(case["slope_dB_per_deg"] * 180 / np.pi, abs=1e-7)


def test_differences_share_their_reference():
    case = CASES["tdoa_cov"]
    np.testing.assert_array_equal(difference_covariance(case["s_toa"], case["ref"]), case["C"])
    np.testing.assert_array_equal(
        difference_covariance(case["s_toa"], case["ref2"]), case["C_ref2"]
    )


def test_hybrid_slopes_of_a_static_fix_are_those_of_the_reference():
    case = CASES["gauss_newton"]
    model = stack(
        [
            pseudoranges(POSITION_CLOCK_3D, case["sats"], case["s_pr"]),
            range_differences(POSITION_CLOCK_3D, case["bs"], case["s_toa"], case["ref"]),
        ]
    )
    np.testing.assert_allclose(model.jacobian(case["x_true"]), case["H_at_true"], rtol=1e-10)
    np.testing.assert_allclose(
        model.mean(case["x_true"]) + case["noise"], case["y"], rtol=0, atol=1e-8
    )
    np.testing.assert_array_equal(model.covariance(), case["R"])


def measured_antenna():
    angle = np.arange(360.0)
    loss = 15 * (1 - np.cos(np.radians(angle))) + 3 * np.sin(np.radians(5 * angle)) ** 2
    return MeasuredAntenna("made", angle, loss, np.array([0.0, 180.0]), np.array([0.0, 0.0]))


def every_kind(state):
    sites = [[0.0, 0.0, 25.0], [900.0, -300.0, 40.0], [200.0, 1200.0, 30.0]]
    antenna = {"boresight_rad": [0.3, 2.0, -1.7], "loss_at_km_db": 130.0, "exponent": [3.5, 3.8, 4]}
    parts = [
        timing_advances(state, sites, 300.0),
        levels(state, sites, 8.0, eirp_dbm=50.0, **antenna),
        levels(
            state,
            sites,
            8.0,
            eirp_dbm=50.0,
            pattern_db=sampled_pattern(measured_antenna()),
            **antenna,
        ),
        range_differences(state, sites, [5.0, 8.0, 12.0], 1),
        position_fix(state, [[9.0, 2.0], [2.0, 4.0]]),
    ]
    if state.clock is not None:
        parts.append(pseudoranges(state, [[1e7, 1e7, 1.5e7], [-1e7, 5e6, 1.9e7]], 15.0))
    return stack(parts)


@pytest.mark.parametrize(
    "state", [POSITION, MOVING, MOVING_CLOCK, MOVING_3D, MOVING_CLOCK_3D, POSITION_CLOCK_3D]
)
def test_slopes_are_those_of_differences(state):
    model = every_kind(state)
    rng = np.random.default_rng(5)
    for at in rng.normal(300.0, 400.0, (20, state.size)):
        slope = model.jacobian(at)
        step = 1e-3
        for index in range(state.size):
            ahead, behind = at.copy(), at.copy()
            ahead[index] += step
            behind[index] -= step
            difference = (model.mean(ahead) - model.mean(behind)) / (2 * step)
            # 2e7 m leave 4e-9 m in double precision.
            np.testing.assert_allclose(slope[:, index], difference, rtol=1e-4, atol=1e-5)


def test_a_batch_is_its_states_one_by_one():
    model = every_kind(MOVING_CLOCK)
    states = np.random.default_rng(1).normal(0, 500, (3, 7, 6))
    assert model.mean(states).shape == (3, 7, model.size)
    for i in range(3):
        for j in range(7):
            np.testing.assert_array_equal(model.mean(states)[i, j], model.mean(states[i, j]))
            np.testing.assert_array_equal(
                model.jacobian(states)[i, j], model.jacobian(states[i, j])
            )


def test_a_measured_pattern_is_that_of_the_antenna():
    antenna = measured_antenna()
    model = levels(
        POSITION,
        [[0.0, 0.0]],
        8.0,
        loss_at_km_db=0.0,
        exponent=0.0,
        boresight_rad=0.7,
        pattern_db=sampled_pattern(antenna),
    )
    offsets = np.radians(np.arange(-180.0, 181.0))
    places = 300.0 * np.stack([np.cos(offsets + 0.7), np.sin(offsets + 0.7)], axis=-1)
    expected = antenna.gain_db(offsets, np.zeros(361))
    np.testing.assert_allclose(model.mean(places)[:, 0], expected, atol=1e-9)
    # Between two samples it is on the line.
    between = 300.0 * np.array([np.cos(0.7 + np.radians(40.25)), np.sin(0.7 + np.radians(40.25))])
    low, high = expected[220:222]
    assert model.mean(between)[0] == pytest.approx(low + 0.25 * (high - low))


def test_on_top_of_a_base_station_nothing_is_infinite():
    model = every_kind(MOVING_CLOCK)
    at = np.array([0.0, 1.0, 0.0, 1.0, 0.0, 0.0])
    flat = stack([timing_advances(MOVING, [[0.0, 0.0]], 300.0), zhang("both")])
    for found in (model.mean(at), model.jacobian(at), flat.mean(at[:4]), flat.jacobian(at[:4])):
        assert np.isfinite(found).all()
    assert flat.mean(at[:4])[0] == 0.0
    np.testing.assert_array_equal(flat.jacobian(at[:4])[0], 0.0)


def test_turning_the_world_turns_nothing_that_is_measured():
    turn_rad = 2.1
    turned = np.array([[np.cos(turn_rad), -np.sin(turn_rad)], [np.sin(turn_rad), np.cos(turn_rad)]])
    sites = np.array(LAYOUT["bs"])
    options = {"loss_at_km_db": 132.8, "exponent": 3.8}
    boresights = np.radians(LAYOUT["boresight_deg_ccw_from_east"])
    here = levels(POSITION, sites, 8.0, boresight_rad=boresights, **options)
    there = levels(POSITION, sites @ turned.T, 8.0, boresight_rad=boresights + turn_rad, **options)
    places = np.random.default_rng(3).uniform(-500, 2500, (200, 2))
    np.testing.assert_allclose(here.mean(places), there.mean(places @ turned.T), atol=1e-9)


def test_likelihood_is_the_density_and_absent_components_do_not_count():
    model = position_fix(POSITION, [[9.0, 2.0], [2.0, 4.0]])
    still = np.eye(2), np.zeros((2, 2)), EKF, np.zeros(2), np.zeros((2, 2))

    def evidence(readings):
        return run_trials(compiled(model), *still, np.array(readings)[:, None]).evidence[:, 0]

    grid = np.arange(-15.0, 15.0, 0.25)
    density = np.exp(evidence(np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)))
    assert np.sum(density) * 0.25**2 == pytest.approx(1.0, abs=1e-4)
    alone, nothing = evidence([[1.5, np.nan], [np.nan, np.nan]])
    assert alone == pytest.approx(-0.5 * (1.5**2 / 9 + math.log(2 * math.pi * 9)))
    assert nothing == 0.0


def test_samples_have_the_mean_and_the_covariance():
    model = range_differences(MOVING, [[0, 0], [900, 0], [0, 900], [800, 800]], [5, 8, 12, 20])
    state = np.array([300.0, 0.0, 200.0, 0.0])
    drawn = model.sample(np.tile(state, (40_000, 1)), np.random.default_rng(4))
    np.testing.assert_allclose(drawn.mean(axis=0), model.mean(state), atol=0.5)
    np.testing.assert_allclose(np.cov(drawn.T), model.covariance(), rtol=0.06, atol=3)


@pytest.mark.parametrize("state", [MOVING, MOVING_CLOCK_3D])
def test_samples_of_every_kind_have_the_mean_and_the_covariance(state):
    model = every_kind(state)
    at = np.full(state.size, 150.0)
    drawn = model.sample(np.tile(at, (40_000, 1)), np.random.default_rng(6))
    deviation = np.sqrt(np.diagonal(model.covariance()))
    # 40 000 draws: a standard error of 0.005 of means and correlations.
    assert np.abs((drawn.mean(axis=0) - model.mean(at)) / deviation).max() < 0.025
    correlation = np.cov(drawn.T) / np.outer(deviation, deviation)
    expected = model.covariance() / np.outer(deviation, deviation)
    np.testing.assert_allclose(correlation, expected, atol=0.03)
    assert expected[9, 10] == pytest.approx(64 / math.hypot(8, 5) / math.hypot(8, 12))


def test_a_leaning_antenna_is_seen_from_above():
    antenna = measured_antenna()
    upright = sampled_pattern(antenna, 0.1)
    leaning = sampled_pattern(antenna, 0.1, mechanical_downtilt_rad=0.1)
    flat = sampled_pattern(antenna, 0.0)
    assert leaning[0] == pytest.approx(flat[0])
    assert np.isfinite(leaning).all()
    assert leaning.shape == upright.shape == (360,)


def test_timing_advance_comes_in_steps_on_request():
    model = timing_advances(POSITION, [[0.0, 0.0]], 1e-6, step_m=GSM_STEP_M)
    drawn = model.sample(np.array([[100.0, 0.0], [600.0, 0.0]]), np.random.default_rng(0))
    np.testing.assert_allclose(drawn[:, 0], [0.5 * GSM_STEP_M, 1.5 * GSM_STEP_M])


def test_information_is_that_of_a_linear_reading():
    model = position_fix(MOVING, [[4.0, 0.0], [0.0, 9.0]])
    states = np.zeros((2, 5, 4))
    once = expected_information(model, states)
    np.testing.assert_allclose(np.diag(once[3]), [0.25, 0.0, 1 / 9, 0.0])
    assert isinstance(model, GaussianMeasurement)
    twice = expected_information(stack([model, model]), states)
    np.testing.assert_allclose(twice[3], 2 * once[3])


BAD = {
    "no deviation": lambda: timing_advances(MOVING, [[0.0, 0.0]], 0.0),
    "a negative deviation": lambda: pseudoranges(MOVING_CLOCK, [[0.0, 0.0, 2e7]], [-1.0]),
    "NaN for a deviation": lambda: range_differences(MOVING, [[0, 0], [1, 1]], math.nan),
    "no clock": lambda: pseudoranges(MOVING, [[0.0, 0.0, 2e7]], 15.0),
    "one station": lambda: range_differences(MOVING, [[0, 0]], 5.0),
    "no such reference": lambda: range_differences(MOVING, [[0, 0], [1, 1]], 5.0, 2),
    "an indefinite covariance": lambda: position_fix(MOVING, [[1.0, 2.0], [2.0, 1.0]]),
    "a singular covariance": lambda: position_fix(MOVING, [[1.0, 1.0], [1.0, 1.0]]),
    "a lopsided covariance": lambda: position_fix(MOVING, [[1.0, 0.5], [0.0, 1.0]]),
    "no height": lambda: position_fix(MOVING, np.eye(3)),
    "a site at NaN": lambda: timing_advances(MOVING, [[0.0, math.nan]], 300.0),
    "no site": lambda: timing_advances(MOVING, np.zeros((0, 2)), 300.0),
    "no measurement": lambda: stack([]),
    "two states": lambda: stack([zhang("ta"), position_fix(POSITION, np.eye(2))]),
    "indices that clash": lambda: StateLayout(4, 0, 0),
    "a state of another size": lambda: zhang("ta").mean(np.zeros(3)),
    "a step below 0": lambda: timing_advances(MOVING, [[0.0, 0.0]], 300.0, -1.0),
    "a short pattern": lambda: levels(
        MOVING, [[0, 0]], 8, loss_at_km_db=1, exponent=2, pattern_db=np.zeros(1)
    ),
}


@pytest.mark.parametrize("make", BAD.values(), ids=BAD.keys())
def test_what_is_wrong_is_said(make):
    with pytest.raises(InputError, match="expected"):
        make()


@settings(max_examples=200, deadline=None)
@given(st.floats(1e-12, 1e20), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_functions_over_lanes_are_those_of_the_library(value, left, ahead):
    out, work = np.empty(3), np.empty(3)
    log_lanes(np.full(3, value), out, work)
    assert out[1] == pytest.approx(math.log(value), rel=1e-15, abs=1e-15)
    # A direction is one unless it is too short to hold.
    if math.hypot(left, ahead) > 1e-200:
        atan2_lanes(np.full(3, left), np.full(3, ahead), out)
        expected = math.atan2(left + 0.0, ahead + 0.0)
        assert abs(math.remainder(out[1] - expected, 2 * math.pi)) < 1e-15
