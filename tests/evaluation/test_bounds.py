"""Bounds against the reference, the Kalman filter, and what no filter may beat."""

import numpy as np
import pytest
from fusion_world import CASES, PHI, hybrid, information, linear_problem, zhang

from mapfilter.errors import InputError
from mapfilter.evaluation.bounds import (
    bound_of,
    expected_information,
    posterior_bound,
    quantities,
    rmse_over_time,
)
from mapfilter.filters.gaussian import EKF
from mapfilter.filters.trials import run_trials
from mapfilter.models.motion import constant_velocity
from mapfilter.models.state import MOVING_CLOCK
from mapfilter.positioning.kalman.models import compiled

START = np.array([-200.0, 8.84, -200.0, 8.84, 0.0, 0.0])
FIRST = np.diag([200.0**2, 100.0, 200.0**2, 100.0, 300e3**2 / 3, 100 / 3])
TRUE_Q = np.array(CASES["fk_process"]["GQGt_true"])


def straight_line(transition, start, steps):
    states = [start]
    for _ in range(steps):
        states.append(transition @ states[-1])
    return np.array(states[1:])[None]


@pytest.mark.parametrize(("name", "satellites"), [("GSM", 0), ("Hybrid1", 1), ("Hybrid2", 2)])
def test_bounds_of_the_hybrid_problem_are_those_of_the_reference(name, satellites):
    n = 6 if satellites else 4
    phi, case = PHI[:n, :n], CASES["fk_pcrlb_straight_line"][name]
    states = straight_line(phi, START[:n], 20)
    information = expected_information(hybrid(satellites), states)
    found = posterior_bound(phi, TRUE_Q[:n, :n], FIRST[:n, :n], information)
    for k, told in zip(case["k"], case["Cdiag"], strict=True):
        np.testing.assert_allclose(np.diagonal(found[k - 1]), told, rtol=1e-10)


@pytest.mark.parametrize("name", CASES["zhang"]["pcrb10"])
def test_bounds_of_timing_advance_and_levels_are_those_of_the_reference(name):
    case, told = CASES["zhang"], CASES["zhang"]["pcrb10"][name]
    sigma, combination = name.removeprefix("sl=").split(",")
    motion = constant_velocity(0.48, 0.1)
    states = straight_line(motion.transition, np.array(case["x0"]), 10)
    information = expected_information(zhang(combination, float(sigma)), states)
    found = posterior_bound(motion.transition, motion.noise, case["P0"], information)
    np.testing.assert_allclose(found[-1], told["P"], rtol=1e-9)
    assert bound_of(found, (0, 2))[-1] == pytest.approx(told["pos"], rel=1e-10)


def test_on_a_linear_problem_the_bound_is_the_filters_covariance():
    motion, model, readings = linear_problem(trials=1, steps=15)
    readings = np.where(np.isfinite(readings), readings, 0.0)
    first = np.diag([100.0, 4.0, 100.0, 4.0])
    run = run_trials(
        compiled(model), motion.transition, motion.noise, EKF, np.zeros(4), first, readings,
        covariances=True,
    )  # fmt: skip
    information = expected_information(model, np.zeros((3, 15, 4)))
    found = posterior_bound(motion.transition, motion.noise, first, information)
    np.testing.assert_allclose(found, run.covariances[0], rtol=1e-9, atol=1e-12)


def test_nothing_measured_leaves_what_is_known():
    motion = constant_velocity(1.0, 0.0)
    first = np.diag([4.0, 0.0, 9.0, 0.0])
    found = posterior_bound(motion.transition, motion.noise, first, np.zeros((5, 4, 4)))
    np.testing.assert_allclose(found[-1], first, atol=1e-12)


def test_expected_information_is_a_mean_over_trials():
    model = hybrid(2)
    states = np.random.default_rng(1).normal(500, 300, (4, 3, 6))
    each = information(model, states)
    np.testing.assert_allclose(expected_information(model, states), each.mean(axis=0), rtol=1e-10)


def test_errors_over_time_are_those_of_the_components():
    states = np.zeros((2, 3, 4))
    estimates = states.copy()
    estimates[0, :, 0], estimates[1, :, 2] = 3.0, 4.0
    np.testing.assert_allclose(rmse_over_time(estimates, states, (0, 2)), np.sqrt(12.5))
    assert quantities(MOVING_CLOCK)["drift_mps"] == (5,)


def test_what_is_wrong_is_said():
    with pytest.raises(InputError, match="first_covariance"):
        posterior_bound(np.eye(2), np.eye(2), np.diag([1.0, -1.0]), np.zeros((1, 2, 2)))
    with pytest.raises(InputError, match="process"):
        posterior_bound(np.eye(2), np.diag([1.0, -1.0]), np.eye(2), np.zeros((1, 2, 2)))
    with pytest.raises(InputError, match="information, step 2"):
        posterior_bound(np.eye(2), np.eye(2), np.eye(2), [np.eye(2), np.full((2, 2), np.nan)])
