"""What filters make of absent and hostile readings and starts; sums, smoothing, evidence."""

import numpy as np
import pytest
from fusion_world import FIRST, FIRST_COVARIANCE, PHI, Q, hybrid_readings, linear_problem

from mapfilter.errors import ConfigError, InputError
from mapfilter.filters.gaussian import EKF, METHODS, UKF, Method, SigmaPoints, factor_of
from mapfilter.filters.gaussian_sum import run_mixtures, split
from mapfilter.filters.kalman import smooth
from mapfilter.filters.trials import run_trials
from mapfilter.models.gaussian import stack
from mapfilter.models.motion import constant_velocity
from mapfilter.models.ranging import position_fix, range_differences
from mapfilter.models.state import MOVING
from mapfilter.positioning.kalman.models import compiled


def test_a_trial_does_not_depend_on_its_neighbours():
    model, _, readings = hybrid_readings(20, trials=70)
    firsts = FIRST + np.random.default_rng(3).normal(0, 1, (70, 6))
    for method in METHODS.values():
        whole = run_trials(compiled(model), PHI, Q, method, firsts, FIRST_COVARIANCE, readings)
        alone = run_trials(
            compiled(model), PHI, Q, method, firsts[66:67], FIRST_COVARIANCE, readings[66:67]
        )
        np.testing.assert_array_equal(whole.means[66], alone.means[0])


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_nothing_measured_is_nothing_learnt(method):
    model, _, readings = hybrid_readings(5)
    readings[:] = np.nan
    run = run_trials(
        compiled(model), PHI, Q, method, FIRST, FIRST_COVARIANCE, readings, covariances=True
    )
    mean, covariance = FIRST, FIRST_COVARIANCE
    for k in range(5):
        mean, covariance = PHI @ mean, PHI @ covariance @ PHI.T + Q
        np.testing.assert_allclose(run.means[0, k], mean, rtol=1e-12)
        np.testing.assert_allclose(run.covariances[0, k], covariance, rtol=1e-10, atol=1e-9)
    assert np.all(run.evidence == 0.0)


def test_absent_components_are_as_if_never_asked_for():
    sites = [[0, 0], [2000, 0], [0, 2000], [1500, 1500]]
    both = stack(
        [range_differences(MOVING, sites, [5, 8, 12, 20]), position_fix(MOVING, np.eye(2) * 400)]
    )
    alone = position_fix(MOVING, np.eye(2) * 400)
    motion = constant_velocity(1.0, 0.5)
    readings = np.random.default_rng(2).normal(0, 30, (1, 6, 5))
    readings[:, :, :3] = np.nan
    given = (motion.transition, motion.noise, UKF, np.zeros(4), np.eye(4) * 100.0)
    one = run_trials(compiled(both), *given, readings)
    other = run_trials(compiled(alone), *given, readings[:, :, 3:])
    np.testing.assert_allclose(one.means, other.means, rtol=1e-12)
    np.testing.assert_allclose(one.evidence, other.evidence, rtol=1e-12)


def test_evidence_is_the_joint_density():
    """On a linear problem the readings are jointly normal."""
    motion, model, readings = linear_problem(trials=1, steps=6)
    first = np.diag([100.0, 4.0, 100.0, 4.0])
    run = run_trials(
        compiled(model), motion.transition, motion.noise, EKF, np.zeros(4), first, readings
    )
    h, f = model.jacobian(np.zeros(4)), motion.transition
    powers = [np.linalg.matrix_power(f, k) for k in range(7)]
    size = 12
    joint = np.zeros((size, size))
    for i in range(6):
        for j in range(6):
            cross = powers[i + 1] @ first @ powers[j + 1].T
            for k in range(1, min(i, j) + 2):
                cross = cross + powers[i + 1 - k] @ motion.noise @ powers[j + 1 - k].T
            joint[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = h @ cross @ h.T
            if i == j:
                joint[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] += model.covariance()
    flat = readings[0].ravel()
    there = np.isfinite(flat)
    joint, flat = joint[np.ix_(there, there)], flat[there]
    density = -0.5 * (
        flat @ np.linalg.solve(joint, flat) + np.linalg.slogdet(2 * np.pi * joint).logabsdet
    )
    assert run.evidence.sum() == pytest.approx(density, rel=1e-10)


def test_smoothing_is_the_joint_estimate():
    """On a linear problem it is least squares over all states at once."""
    motion, model, readings = linear_problem(trials=1, steps=8)
    first = np.diag([100.0, 4.0, 100.0, 4.0])
    noise = motion.noise + 0.01 * np.eye(4)
    run = run_trials(
        compiled(model), motion.transition, noise, EKF, np.zeros(4), first, readings,
        covariances=True,
    )  # fmt: skip
    found = smooth(motion.transition, noise, run.means, run.covariances)
    h = model.jacobian(np.zeros(4))
    size = 32
    information, vector = np.zeros((size, size)), np.zeros(size)
    start = np.linalg.inv(motion.transition @ first @ motion.transition.T + noise)
    information[:4, :4] += start
    for k in range(8):
        at = slice(4 * k, 4 * k + 4)
        there = np.isfinite(readings[0, k])
        if there.any():
            weight = np.linalg.inv(model.covariance()[np.ix_(there, there)])
            information[at, at] += h[there].T @ weight @ h[there]
            vector[at] += h[there].T @ weight @ readings[0, k, there]
        if k:
            link = np.hstack([-motion.transition, np.eye(4)])
            both = slice(4 * k - 4, 4 * k + 4)
            information[both, both] += link.T @ np.linalg.inv(noise) @ link
    covariance = np.linalg.inv(information)
    np.testing.assert_allclose(found.means[0].ravel(), covariance @ vector, atol=1e-8)
    for k in range(8):
        np.testing.assert_allclose(
            found.covariances[0, k], covariance[4 * k : 4 * k + 4, 4 * k : 4 * k + 4], atol=1e-8
        )


def test_a_sum_of_one_is_its_filter_and_parts_of_a_linear_problem_are_the_whole():
    motion, model, readings = linear_problem(trials=2, steps=25)
    first = np.diag([100.0, 4.0, 100.0, 4.0])
    given = (motion.transition, motion.noise, EKF)
    alone = run_trials(compiled(model), *given, np.ones(4), first, readings, covariances=True)
    one = run_mixtures(compiled(model), *given, split(np.zeros(4), first, {}), np.ones(4), readings)
    np.testing.assert_allclose(one.means, alone.means, rtol=1e-12)
    np.testing.assert_allclose(one.evidence, alone.evidence, rtol=1e-10)
    many = run_mixtures(
        compiled(model), *given, split(np.zeros(4), first, {0: 15, 2: 15}, reach=4.0), np.ones(4),
        readings, least_weight=0.0,
    )  # fmt: skip
    np.testing.assert_allclose(many.means, alone.means, atol=0.02)
    np.testing.assert_allclose(many.covariances, alone.covariances, atol=0.1)


BAD = {
    "an indefinite start": lambda: (np.zeros(6), np.diag([1.0, 1, 1, 1, 1, -1])),
    "a lopsided start": lambda: (np.zeros(6), np.eye(6) + np.eye(6, k=1)),
    "correlations beyond 1": lambda: (np.zeros(6), np.eye(6) + 2 * np.eye(6)[::-1]),
    "NaN": lambda: (np.zeros(6), np.full((6, 6), np.nan)),
    "another size": lambda: (np.zeros(6), np.eye(4)),
}


@pytest.mark.parametrize("make", BAD.values(), ids=BAD)
def test_what_is_no_covariance_is_said(make):
    model, _, readings = hybrid_readings(2)
    mean, covariance = make()
    with pytest.raises(InputError, match="covariance"):
        run_trials(compiled(model), PHI, Q, EKF, mean, covariance, readings)


def test_infinite_readings_and_wrong_sizes_are_said():
    model, _, readings = hybrid_readings(2)
    with pytest.raises(InputError, match="readings"):
        run_trials(compiled(model), PHI, Q, EKF, FIRST, FIRST_COVARIANCE, readings + np.inf)
    with pytest.raises(InputError, match="readings"):
        run_trials(compiled(model), PHI, Q, EKF, FIRST, FIRST_COVARIANCE, readings[..., :3])
    with pytest.raises(ConfigError, match="alpha"):
        SigmaPoints(0.0)
    with pytest.raises(InputError, match="kappa"):
        SigmaPoints(1.0, 2.0, -6.0).spread(6)
    with pytest.raises(ConfigError, match="iterations"):
        Method("none", iterations=0)


def test_a_singular_start_is_a_start():
    model, _, readings = hybrid_readings(30)
    known = np.diag([0.0, 100.0, 0.0, 100.0, 1e4, 0.0])
    for method in METHODS.values():
        run = run_trials(compiled(model), PHI, Q, method, FIRST, known, readings, covariances=True)
        assert np.isfinite(run.means).all()
        assert np.linalg.eigvalsh(run.covariances).min() > -1e-9
    root = factor_of([[1.0, 1.0], [1.0, 1.0]], 2)
    np.testing.assert_allclose(root @ root.T, np.ones((2, 2)), atol=1e-12)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_a_start_on_a_base_station_stays_finite(method):
    model, _, readings = hybrid_readings(30)
    on_it = np.array([750.0, 0.0, 1000.0, 0.0, 0.0, 0.0])
    run = run_trials(
        compiled(model), np.eye(6), Q, method, on_it, FIRST_COVARIANCE, readings, covariances=True
    )
    assert np.isfinite(run.means).all()
    assert np.isfinite(run.covariances).all()


def test_an_update_that_fails_is_labelled_and_keeps_the_prediction():
    """β far below 0 makes the covariance of the readings indefinite."""
    model, _, readings = hybrid_readings(3)
    wild = Method("wild", SigmaPoints(1.0, -1e6, 0.0))
    run = run_trials(compiled(model), PHI, Q, wild, FIRST, FIRST_COVARIANCE, readings)
    assert np.isnan(run.evidence[0, 0])
    np.testing.assert_allclose(run.means[0, 0], PHI @ FIRST)
    assert np.isfinite(run.means).all()
