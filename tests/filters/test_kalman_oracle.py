"""Kalman-type filters against the formulas of the literature, with dense matrices.

A trial takes ranges to sites, differences of them (whose noises are correlated) and a clock that
adds to some of them; components are absent here and there.
"""

from math import log, pi

import numpy as np
import pytest
from scipy.optimize import least_squares

from mapfilter.errors import InputError
from mapfilter.filters import kalman
from mapfilter.filters.gaussian import CKF, EKF, IEKF, UKF, Gaussian, Method, SigmaPoints
from mapfilter.filters.gaussian_sum import Mixture, run_mixtures
from mapfilter.filters.trials import run_trials
from mapfilter.models.gaussian import stack
from mapfilter.models.ranging import position_fix, pseudoranges, range_differences, timing_advances
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.models import compiled

# North, a rate nobody measures, east, the clock, and one more behind all that matters.
LAYOUT = StateLayout(5, 2, 0, clock=3)
SITES = np.array([[90.0, 0.0], [-20.0, 110.0], [-60.0, -70.0]])
AWAY = np.array([[300.0, 400.0, 900.0], [-500.0, 100.0, 800.0]])
NEAR = stack([timing_advances(LAYOUT, SITES, [3.0, 4.0, 5.0]), pseudoranges(LAYOUT, AWAY, 2.0)])
FULL = stack([NEAR, range_differences(LAYOUT, SITES, [2.0, 3.0, 4.0], 1)])
MODELS = {"independent": NEAR, "correlated": FULL}
PHI = np.eye(5) + np.diag([0.5, 0.0, 0.0, 0.7], 1) + np.diag([0.2, 0.0, -0.1], 2)
ROOT = np.random.default_rng(1).normal(0, 1, (5, 5))
PROCESS = 0.5 * ROOT @ ROOT.T
WIDE = 30.0 * np.eye(5) + 4.0 * ROOT.T @ ROOT
METHODS = [
    EKF,
    CKF,
    UKF,
    IEKF,
    Method("two", iterations=2),
    Method("far", SigmaPoints(0.7, 1.5, 0.5)),
    Method("near", SigmaPoints(0.05, 2.0, 0.0)),
]


def expected(model, state):
    """Readings by hand; the state is north, a rate, east, the clock, and nothing."""
    place = np.array([state[2], state[0]])
    reach = np.hypot(*(SITES - place).T)
    sky = np.sqrt(((AWAY - [*place, 0.0]) ** 2).sum(axis=1)) + state[3]
    apart = [reach[0] - reach[1], reach[2] - reach[1]]
    return np.concatenate([reach, sky, apart if model is FULL else []])


def slopes(model, state):
    return np.array(
        [
            (expected(model, state + step) - expected(model, state - step)) / 2e-4
            for step in 1e-4 * np.eye(5)
        ]
    ).T


NOISE = np.diag([9.0, 16.0, 25.0, 4.0, 4.0, 13.0, 25.0])
NOISE[5, 6] = NOISE[6, 5] = 9.0


def density(residual, covariance):
    """Log density and normalised square."""
    square = residual @ np.linalg.solve(covariance, residual)
    constant = residual.size * log(2 * pi) + np.linalg.slogdet(covariance)[1]
    return -0.5 * (square + constant), square


def by_formula(model, method, mean, covariance, reading):
    """Mean, covariance, log density of the reading and normalised innovation squared."""
    there = np.isfinite(reading)
    noise = NOISE[: reading.size, : reading.size][np.ix_(there, there)]

    def h(state):
        return expected(model, state)[there]

    y = reading[there]
    if method.sigma is not None:
        alpha, beta, kappa = method.sigma.alpha, method.sigma.beta, method.sigma.kappa
        n, lam = 5, alpha**2 * (5 + kappa) - 5
        root = np.sqrt(n + lam) * np.linalg.cholesky(covariance)
        points = np.array([mean, *(mean + root.T), *(mean - root.T)])
        weight = np.full(11, 0.5 / (n + lam))
        weight[0] = lam / (n + lam)
        ours = weight.copy()
        ours[0] += 1 - alpha**2 + beta
        seen = np.array([h(point) for point in points])
        centre = weight @ seen
        spread = (seen - centre).T @ np.diag(ours) @ (seen - centre) + noise
        cross = (points - mean).T @ np.diag(ours) @ (seen - centre)
        gain, residual = cross @ np.linalg.inv(spread), y - centre
        after = covariance - gain @ spread @ gain.T
        return mean + gain @ residual, after, *density(residual, spread)
    place, slope = mean, slopes(model, mean)[there]
    if method.iterations == 2:
        gain = covariance @ slope.T @ np.linalg.inv(slope @ covariance @ slope.T + noise)
        place = mean + gain @ (y - h(mean))
    elif method.iterations > 2:
        root, white = np.linalg.cholesky(covariance), np.linalg.cholesky(noise)

        def cost(z):
            return np.concatenate([z, np.linalg.solve(white, y - h(mean + root @ z))])

        place = mean + root @ least_squares(cost, np.zeros(5), xtol=1e-14, ftol=1e-14).x
    # The last linearisation, as seen from the prediction.
    slope = slopes(model, place)[there]
    residual = y - h(place) + slope @ (place - mean)
    spread = slope @ covariance @ slope.T + noise
    gain = covariance @ slope.T @ np.linalg.inv(spread)
    after = covariance - gain @ spread @ gain.T
    return mean + gain @ residual, after, *density(residual, spread)


def trials(model, count, steps, seed=3):
    """First means, covariances and readings about them; a fifth of all components absent."""
    rng = np.random.default_rng(seed)
    means = rng.normal(0, 8, (count, 5))
    shapes = rng.normal(0, 1, (count, 5, 5))
    covariances = WIDE + shapes @ np.swapaxes(shapes, 1, 2)
    readings = np.empty((count, steps, model.size))
    for t in range(count):
        for k in range(steps):
            readings[t, k] = expected(model, means[t] + rng.normal(0, 4, 5))
    readings[rng.random(readings.shape) < 0.2] = np.nan
    return means, covariances, readings


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
@pytest.mark.parametrize("name", MODELS)
def test_an_update_is_that_of_the_formula(method, name):
    model = MODELS[name]
    means, covariances, readings = trials(model, 6, 1)
    for mean, covariance, reading in zip(means, covariances, readings[:, 0], strict=True):
        belief, news = kalman.update(Gaussian(mean, covariance), compiled(model), reading, method)
        after, spread, evidence, nis = by_formula(model, method, mean, covariance, reading)
        loose = 2e-5 if method is IEKF else 2e-6
        np.testing.assert_allclose(belief.mean, after, atol=loose * 100)
        np.testing.assert_allclose(belief.covariance, spread, atol=loose * 100)
        assert (news.evidence, news.nis) == pytest.approx((evidence, nis), abs=loose * 100)
        assert news.used


@pytest.mark.parametrize("method", [EKF, UKF, IEKF], ids=lambda method: method.name)
def test_many_trials_are_the_same_steps_one_after_the_other(method):
    """More trials than a kernel takes at once, each from a belief of its own."""
    means, covariances, readings = trials(FULL, 67, 3)
    readings[5, 1], readings[66, 2] = np.nan, np.nan
    found = run_trials(
        compiled(FULL), PHI, PROCESS, method, means, covariances, readings, covariances=True
    )
    assert found.means.shape == (67, 3, 5)
    assert found.covariances.shape == (67, 3, 5, 5)
    for t in (0, 5, 63, 64, 66):
        belief = Gaussian(means[t], covariances[t])
        for k in range(3):
            belief = kalman.predict(belief, PHI, PROCESS)
            belief, news = kalman.update(belief, compiled(FULL), readings[t, k], method)
            np.testing.assert_allclose(found.means[t, k], belief.mean, atol=1e-7)
            np.testing.assert_allclose(found.covariances[t, k], belief.covariance, atol=1e-7)
            told = found.evidence[t, k], found.nis[t, k]
            assert told == pytest.approx((news.evidence, news.nis), abs=1e-7)
    # Nothing heard says nothing.
    assert (found.evidence[5, 1], found.nis[5, 1]) == (0.0, 0.0)
    alone = run_trials(compiled(FULL), PHI, PROCESS, method, means, covariances, readings)
    assert alone.covariances.shape == (67, 0, 5, 5)
    np.testing.assert_array_equal(alone.means, found.means)
    shared = run_trials(compiled(FULL), PHI, PROCESS, method, means[0], WIDE, readings[:2])
    for t in (0, 1):
        belief = kalman.predict(Gaussian(means[0], WIDE), PHI, PROCESS)
        belief, _ = kalman.update(belief, compiled(FULL), readings[t, 0], method)
        np.testing.assert_allclose(shared.means[t, 0], belief.mean, atol=1e-7)


def test_a_prediction_is_the_linear_one():
    moved = kalman.predict(Gaussian(np.arange(5.0), WIDE), PHI, PROCESS, np.full(5, 7.0))
    np.testing.assert_allclose(moved.mean, PHI @ np.arange(5.0) + 7.0)
    np.testing.assert_allclose(moved.covariance, PHI @ WIDE @ PHI.T + PROCESS)
    np.testing.assert_array_equal(moved.covariance, moved.covariance.T)


@pytest.mark.parametrize("method", [EKF, UKF, IEKF], ids=lambda method: method.name)
def test_what_cannot_be_taken_in_is_left_and_told(method):
    """A reading beyond all bounds leaves its own trial's prediction, and no other trial's."""
    means, covariances, readings = trials(NEAR, 3, 2)
    readings[1, 0] = 1e200
    found = run_trials(
        compiled(NEAR), PHI, PROCESS, method, means, covariances, readings, covariances=True
    )
    assert np.isnan([found.evidence[1, 0], found.nis[1, 0]]).all()
    assert np.isfinite(found.evidence).sum() == np.isfinite(found.nis).sum() == 5
    kept = kalman.predict(Gaussian(means[1], covariances[1]), PHI, PROCESS)
    np.testing.assert_allclose(found.means[1, 0], kept.mean, atol=1e-9)
    np.testing.assert_allclose(found.covariances[1, 0], kept.covariance, rtol=1e-9)
    kept = kalman.predict(kept, PHI, PROCESS)
    belief, _ = kalman.update(kept, compiled(NEAR), readings[1, 1], method)
    np.testing.assert_allclose(found.means[1, 1], belief.mean, atol=1e-7)
    same, news = kalman.update(kept, compiled(NEAR), np.full(5, 1e200), method)
    assert same is kept
    assert not news.used


@pytest.mark.parametrize("sigma_m", [1e30, 1e-25])
def test_many_components_of_wide_or_narrow_noise_have_a_density(sigma_m):
    """The product of 20 deviations is beyond what a number can hold."""
    layout = StateLayout(2, 0, 1)
    model = stack([position_fix(layout, sigma_m**2 * np.eye(2))] * 10)
    covariance = np.diag([1e-60, 1e-60])
    belief, news = kalman.update(
        Gaussian(np.zeros(2), covariance), compiled(model), np.zeros(20), EKF
    )
    assert news.evidence == pytest.approx(-10 * log(2 * pi) - 20 * log(sigma_m), rel=1e-9)
    assert belief.mean.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("method", [EKF, UKF, IEKF], ids=lambda method: method.name)
def test_a_component_that_is_known_stays(method):
    """Covariances may be singular; what has no variance is not moved."""
    covariance = WIDE.copy()
    covariance[2], covariance[:, 2] = 0.0, 0.0
    _, _, readings = trials(FULL, 1, 1)
    belief, news = kalman.update(
        Gaussian(np.ones(5), covariance), compiled(FULL), readings[0, 0], method
    )
    assert belief.mean[2] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(belief.covariance[2], 0.0, atol=1e-12)
    assert abs(belief.mean[0] - 1.0) > 1e-3
    assert news.used


def mixture_by_formula(first, start, readings, least):
    """Means, covariances, log densities and numbers of components left."""
    parts = [
        (w, start + m, first.covariance) for w, m in zip(first.weights, first.means, strict=True)
    ]
    for reading in readings:
        updated = []
        for weight, mean, covariance in parts:
            moved, wide = PHI @ mean, PHI @ covariance @ PHI.T + PROCESS
            after, spread, evidence, _ = by_formula(FULL, EKF, moved, wide, reading)
            updated.append((weight * np.exp(evidence), after, spread))
        total = sum(weight for weight, _, _ in updated)
        parts = [(weight / total, mean, spread) for weight, mean, spread in updated]
        centre = sum(weight * mean for weight, mean, _ in parts)
        whole = sum(w * (s + np.outer(m - centre, m - centre)) for w, m, s in parts)
        left = sum(weight >= least for weight, _, _ in parts)
        yield centre, whole, np.log(total), left


def test_a_mixture_is_that_of_the_formula():
    rng = np.random.default_rng(8)
    first = Mixture(rng.dirichlet(np.ones(9)), rng.normal(0, 12, (9, 5)), 0.3 * WIDE)
    starts, _, readings = trials(FULL, 2, 3, seed=9)
    found = run_mixtures(
        compiled(FULL), PHI, PROCESS, EKF, first, starts, readings, least_weight=1e-30
    )
    for t in range(2):
        steps = mixture_by_formula(first, starts[t], readings[t], 1e-30)
        for k, (mean, covariance, evidence, left) in enumerate(steps):
            np.testing.assert_allclose(found.means[t, k], mean, atol=1e-4)
            np.testing.assert_allclose(found.covariances[t, k], covariance, atol=1e-4)
            assert found.evidence[t, k] == pytest.approx(evidence, abs=1e-4)
            assert found.counts[t, k] == left


def test_components_that_lost_all_weight_are_not_missed():
    """Of twelve components far apart most are dropped by the first readings."""
    rng = np.random.default_rng(12)
    means = np.zeros((12, 5))
    means[:, 0], means[:, 2] = rng.uniform(-200, 200, (2, 12))
    first = Mixture(rng.dirichlet(np.ones(12)), means, 0.3 * WIDE)
    starts, _, readings = trials(FULL, 1, 4, seed=9)
    found = run_mixtures(compiled(FULL), PHI, PROCESS, EKF, first, starts, readings)
    for k, step in enumerate(mixture_by_formula(first, starts[0], readings[0], 1e-8)):
        mean, covariance, evidence, left = step
        np.testing.assert_allclose(found.means[0, k], mean, atol=1e-4)
        np.testing.assert_allclose(found.covariances[0, k], covariance, atol=1e-4)
        assert found.evidence[0, k] == pytest.approx(evidence, abs=1e-4)
        assert 1 <= found.counts[0, k] == left < 9


def test_sizes_that_do_not_fit_are_told():
    first = Mixture(np.ones(1), np.zeros((1, 5)), WIDE)
    for readings, said in (
        (np.zeros((2, 3)), "readings"),
        (np.zeros((1, 1, 6)), "steps, 7"),
        (np.full((1, 1, 7), np.inf), "infinity"),
    ):
        with pytest.raises(InputError, match=said):
            run_trials(compiled(FULL), PHI, PROCESS, EKF, np.zeros(5), WIDE, readings)
        with pytest.raises(InputError, match=said):
            run_mixtures(compiled(FULL), PHI, PROCESS, EKF, first, np.zeros(5), readings)
    with pytest.raises(InputError, match="a state of 3 components, found 4"):
        run_trials(
            compiled(FULL), np.eye(3), np.eye(3), EKF, np.zeros(3), np.eye(3), np.zeros((1, 1, 7))
        )
