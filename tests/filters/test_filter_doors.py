"""What filters assume unless told otherwise, and where they stop taking input."""

from dataclasses import asdict
from math import inf, isnan, nan, sqrt

import numpy as np
import pytest

from mapfilter.errors import ConfigError, InputError
from mapfilter.filters import kalman
from mapfilter.filters.candidate import CandidateOptions
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.gaussian import (
    CKF,
    CUBATURE,
    EKF,
    IEKF,
    METHODS,
    RBUKF,
    UKF,
    Method,
    SigmaPoints,
    factor_of,
    factors_of,
)
from mapfilter.filters.gaussian_sum import split
from mapfilter.filters.kalman import smooth
from mapfilter.filters.particle import ParticleOptions
from mapfilter.filters.rao_blackwell import REGULARISED, SIR, SirOptions, init
from mapfilter.filters.switch_rule import switched
from mapfilter.filters.trials import problem_of, run_trials
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import POSITION
from mapfilter.positioning.kalman.models import compiled

READING = position_fix(POSITION, np.eye(2))


def test_the_usual_options():
    assert asdict(ParticleOptions()) == {
        "max_particles": 20_000,
        "min_search_particles": 12_000,
        "min_particles": 3000,
        "particles_per_bin": 60.0,
        "resample_below": 0.5,
        "mass_exponent": 0.5,
        "jitter": (0.3, 0.3, 0.004, 0.002, 0.0, 0.004, 0.004, 1e-4),
        "searching_jitter": (1.5, 1.5, 0.01, 0.006, 0.0, 0.01, 0.01, 1e-4),
        "switch_mass": 0.99,
        "switch_hold_m": 14.0,
        "split_mass": 0.5,
    }
    assert asdict(CandidateOptions()) == {
        "update_length_m": 22.0,
        "tracking_length_m": None,
        "prediction": "displacement",
        "duplicates": "set",
        "threshold": 1,
        "at_threshold": "switch",
        "switch_check": "same_call",
        "when_empty": "fail",
    }
    assert SirOptions() == SIR == SirOptions(1.0, 0.0)
    assert SirOptions(0.5, 0.5) == REGULARISED
    assert SigmaPoints() == SigmaPoints(1e-3, 2.0, 0.0)
    assert SigmaPoints(1.0, 0.0, 0.0) == CUBATURE
    assert Method("ekf", None, 1) == EKF
    assert Method("iekf", None, 30) == IEKF
    assert Method("rbukf", SigmaPoints(1e-3, 2.0, 0.0)) == RBUKF
    assert Method("ukf", SigmaPoints(1.0, 2.0, 0.0)) == UKF
    assert Method("ckf", CUBATURE) == CKF
    assert list(METHODS) == ["ekf", "iekf", "rbukf", "ukf", "ckf"]
    assert isnan(MotionStep(1.0, 2.0).turn_rad)


def test_where_sigma_points_lie():
    points = SigmaPoints(0.5, 1.0, 1.0)
    assert points.spread(3) == 1.0
    assert points.bend_weight == 0.75
    assert SigmaPoints(2.0, 0.0, -1.0).spread(2) == 2.0
    for method, numbers in (
        (Method("far", SigmaPoints(2.0, 5.0, 2.0)), (1, 4.0, 1.0)),
        (IEKF, (30, 1.0, 0.0)),
    ):
        problem = problem_of(compiled(READING), np.eye(2), np.zeros((2, 2)), method)
        assert (problem.iterations, problem.spread, problem.bend_weight) == numbers
        assert problem.diagonal
    correlated = position_fix(POSITION, [[1.0, 1e-9], [1e-9, 1.0]])
    assert not problem_of(compiled(correlated), np.eye(2), np.zeros((2, 2)), IEKF).diagonal


def covariances(count, size, seed=0):
    """Covariances of which each component has a unit of its own, from 1e-6 to 1e6."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((count, size, size)) + 2 * np.eye(size)
    root *= 10.0 ** rng.integers(-6, 7, (count, size, 1))
    return root @ root.transpose(0, 2, 1)


@pytest.mark.parametrize("size", [1, 2, 5])
def test_factors_of_a_stack_are_those_of_each(size):
    stack = covariances(6, size)
    singular = np.ones((size, size))
    unknown = np.diag(np.append(np.zeros(1), np.ones(size - 1)))
    for more in ((), (singular,), (unknown, singular)):
        every = np.array([*stack, *more])
        found = factors_of(every, size)
        for factor, one in zip(found, every, strict=True):
            np.testing.assert_allclose(factor, factor_of(one, size), rtol=1e-9)
            np.testing.assert_array_equal(factor, np.tril(factor))
            unit = np.sqrt(np.maximum(np.diagonal(one), 1e-300))
            error = (factor @ factor.T - one) / np.outer(unit, unit)
            assert np.abs(error).max() < 1e-12
    assert factors_of(np.empty((0, size, size)), size).size == 0


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ([[1.0, 0.5], [0.4, 1.0]], "a symmetric matrix"),
        ([[1.0, 0.0], [0.0, -1.0]], "variances >= 0"),
        ([[1.0, 2.0], [2.0, 1.0]], "no negative eigenvalue"),
        ([[1.0, np.nan], [np.nan, 1.0]], "finite numbers"),
        ([[np.inf, 0.0], [0.0, 1.0]], "finite numbers"),
        ([[1.0, 0.5 + 1e-8], [0.5, 1.0]], "a symmetric matrix"),
    ],
)
def test_one_of_a_stack_that_is_no_covariance_is_refused(wrong, told):
    stack = covariances(3, 2)
    stack[1] = wrong
    with pytest.raises(InputError) as caught:
        factors_of(stack, 2)
    assert [fault.expected for fault in caught.value.faults] == [told]
    with pytest.raises(InputError, match="expected shape"):
        factors_of(stack, 3)


def test_factors_of_covariances():
    np.testing.assert_allclose(factor_of([[4.0, 2.0], [2.0, 10.0]], 2), [[2.0, 0.0], [1.0, 3.0]])
    wide = factor_of([[1e16, 0.0], [0.0, 1e-16]], 2)
    np.testing.assert_allclose(wide, [[1e8, 0], [0, 1e-8]], atol=0)
    np.testing.assert_array_equal(factor_of(np.zeros((2, 2)), 2), np.zeros((2, 2)))
    singular = np.array([[4.0, -2.0, 0.0], [-2.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    root = factor_of(singular, 3)
    np.testing.assert_allclose(root @ root.T, singular, atol=1e-9)
    np.testing.assert_allclose(root, [[2.0, 0, 0], [-1.0, 0, 0], [0, 0, 0]], atol=1e-9)
    both = np.outer([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]) + np.outer([1.0, 0, -1], [1.0, 0, -1])
    root = factor_of(both, 3)
    np.testing.assert_allclose(root @ root.T, both, atol=1e-9)
    assert np.all(np.triu(root, 1) == 0.0)
    assert np.all(np.diagonal(root) >= 0.0)
    # Rounding may leave a negative eigenvalue of a billionth for each component.
    assert factor_of([[1.0, 1.0 + 1.9e-9], [1.0 + 1.9e-9, 1.0]], 2).shape == (2, 2)
    assert factor_of([[1.0, 0.5], [0.5 * (1 + 0.9e-9), 1.0]], 2).shape == (2, 2)
    # One covariance for all trials, or each its own.
    still = compiled(READING), np.eye(2), np.zeros((2, 2)), EKF, np.zeros(2)
    nothing = np.full((2, 1, 2), np.nan)
    for given in (4.0 * np.eye(2), [4.0 * np.eye(2), 9.0 * np.eye(2)]):
        found = run_trials(*still, given, nothing, covariances=True).covariances[:, 0]
        np.testing.assert_allclose(found, np.broadcast_to(given, (2, 2, 2)))
    # As many trials as components: a matrix is still one covariance.
    found = run_trials(*still, [[4.0, 1.0], [1.0, 9.0]], nothing, covariances=True).covariances
    np.testing.assert_allclose(found, np.full((2, 1, 2, 2), [[4.0, 1.0], [1.0, 9.0]]))
    belief = kalman.as_belief([1, 2], [[1, 0], [0, 0]])
    assert (belief.mean.tolist(), belief.covariance.tolist()) == ([1.0, 2.0], [[1.0, 0], [0, 0]])


def test_a_split_keeps_mean_and_variance():
    wide = np.diag([4.0, 1.0, 9.0])
    whole = split([1.0, 2.0, 3.0], wide, {0: 1})
    assert (whole.weights.tolist(), whole.means.tolist()) == ([1.0], [[1.0, 2.0, 3.0]])
    np.testing.assert_array_equal(whole.covariance, wide)
    cut = split([1.0, 2.0, 3.0], wide, {2: 5, 0: 11})
    assert cut.means.shape == (55, 3)
    assert cut.weights.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(cut.weights @ cut.means, [1.0, 2.0, 3.0])
    # Means within ± 2.5 deviations.
    np.testing.assert_allclose(cut.means.min(axis=0), [-4.0, 2.0, -4.5])
    np.testing.assert_allclose(cut.means.max(axis=0), [6.0, 2.0, 10.5])
    own = (cut.means - [1.0, 2.0, 3.0]).T @ np.diag(cut.weights) @ (cut.means - [1.0, 2.0, 3.0])
    np.testing.assert_allclose(own + cut.covariance, wide, atol=1e-9)
    # The deviation of each is the spacing: half of one, and at most nine tenths.
    np.testing.assert_allclose(np.diag(cut.covariance), [4.0 * 0.25, 1.0, 9.0 * 0.81], rtol=1e-6)
    # Weights are those of a normal shape: their logarithms are a parabola.
    line = split([0.0], [[1.0]], {0: 11})
    bend = np.diff(np.log(line.weights), 2)
    np.testing.assert_allclose(bend, bend[0], rtol=1e-6)
    assert bend[0] < 0
    assert split([0.0], [[1.0]], {0: 3}, 1.0).means.tolist() == [[-1.0], [0.0], [1.0]]


def test_what_switches():
    def told(status, travelled_m, agreement_start_m, agrees=True, splits=False):
        return switched(
            status, travelled_m, agreement_start_m, agrees=agrees, splits=splits, hold_m=14.0
        )

    assert told(Status.SEARCHING, 100.0, 86.0) == (Status.CONVERGED, 86.0)
    assert told(Status.SEARCHING, 100.0, 86.1) == (Status.SEARCHING, 86.1)
    assert told(Status.SEARCHING, 100.0, nan) == (Status.SEARCHING, 100.0)
    status, since_m = told(Status.SEARCHING, 100.0, 20.0, agrees=False)
    assert (status, isnan(since_m)) == (Status.SEARCHING, True)
    assert told(Status.CONVERGED, 100.0, 86.0, agrees=False) == (Status.TRACKING, 86.0)
    for status in (Status.TRACKING, Status.LOST):
        assert told(status, 100.0, 5.0, agrees=False) == (status, 5.0)
    # A belief in several places is searched again, also one that agreed for long enough.
    for status in (Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.LOST):
        status, since_m = told(status, 100.0, 5.0, splits=True)
        assert (status, isnan(since_m)) == (Status.SEARCHING, True)
    assert told(Status.SEARCHING, 100.0, 99.0, splits=True) == (Status.SEARCHING, 99.0)


def test_what_lies_on_the_border_is_taken():
    one = ParticleOptions(
        max_particles=1,
        min_particles=1,
        min_search_particles=1,
        mass_exponent=1.0,
        switch_hold_m=0.0,
    )
    assert one.max_particles == 1
    still = ParticleOptions(jitter=(0.0,), searching_jitter=(), particles_per_bin=1e-9)
    assert still.jitter == (0.0,)
    near = ParticleOptions(resample_below=1e-9, switch_mass=1 - 1e-9, mass_exponent=1e-9)
    assert near.mass_exponent == 1e-9
    assert SirOptions(0.0, 2.0) != SirOptions(1.0, 0.0)
    assert SirOptions(0.0, 0.0).resample_below == 0.0
    assert SigmaPoints(1e-9, -1.0, -1.0).spread(2) == 1e-9
    options = CandidateOptions(update_length_m=0.0, tracking_length_m=0.0)
    assert options.tracking_length_m == 0.0
    assert Method("one", iterations=1).iterations == 1
    assert init(np.zeros(2), np.eye(2), [1], 2, np.random.default_rng(0)).state.shape == (2, 2)
    assert split([0.0, 0.0], np.eye(2), {1: 3}).means.shape == (3, 2)


def test_two_parts_keep_mean_and_variance():
    cut = split([1.0, 5.0], np.diag([4.0, 9.0]), {0: 2, 1: 2})
    for index, (mean, variance) in enumerate([(1.0, 4.0), (5.0, 9.0)]):
        off = cut.means[:, index] - mean
        assert cut.weights @ off == pytest.approx(0.0, abs=1e-12)
        assert cut.weights @ off**2 + cut.covariance[index, index] == pytest.approx(variance)
    np.testing.assert_allclose(np.diagonal(cut.covariance), 0.81 * np.array([4.0, 9.0]))


P, C, S = ParticleOptions, CandidateOptions, SirOptions
ODD = np.array([[1.0, 0.5], [0.5 * (1 + 1.5e-9), 1.0]])
DOORS = {
    "ParticleOptions, min_particles: expected a whole number >= 1, found 0": (
        lambda: P(min_particles=0, max_particles=5),
        ConfigError,
    ),
    "max_particles: expected min_particles <= max_particles, found 6 and 5": (
        lambda: P(min_particles=6, max_particles=5),
        ConfigError,
    ),
    "ParticleOptions, min_search_particles": (lambda: P(min_search_particles=0), ConfigError),
    "particles_per_bin": (lambda: P(particles_per_bin=0.0), ConfigError),
    "particles_per_bin: expected a number > 0": (lambda: P(particles_per_bin=inf), ConfigError),
    "mass_exponent": (lambda: P(mass_exponent=0.0), ConfigError),
    "mass_exponent: expected a number > 0 and <= 1": (lambda: P(mass_exponent=1.01), ConfigError),
    "resample_below": (lambda: P(resample_below=0.0), ConfigError),
    "resample_below: expected a number > 0 and < 1": (
        lambda: P(resample_below=1.0),
        ConfigError,
    ),
    "switch_mass": (lambda: P(switch_mass=1.0), ConfigError),
    "switch_mass: expected a": (lambda: P(switch_mass=0.0), ConfigError),
    "switch_hold_m": (lambda: P(switch_hold_m=-0.1), ConfigError),
    "switch_hold_m: exp": (lambda: P(switch_hold_m=inf), ConfigError),
    "ParticleOptions, jitter": (lambda: P(jitter=(1.0, -1.0)), ConfigError),
    "ParticleOptions, jitter: exp": (lambda: P(jitter=(inf, 1.0)), ConfigError),
    "ParticleOptions, searching_jitter": (lambda: P(searching_jitter=(nan,)), ConfigError),
    "update_length_m": (lambda: C(update_length_m=-0.1), ConfigError),
    "update_length_m: expected": (lambda: C(update_length_m=inf), ConfigError),
    "tracking_length_m": (lambda: C(tracking_length_m=-0.1), ConfigError),
    "threshold": (lambda: C(threshold=0), ConfigError),
    "SirOptions, resample_below": (lambda: S(-0.01), ConfigError),
    "SirOptions, resample_below: expected a number in 0..1": (lambda: S(1.01), ConfigError),
    "SirOptions, regularise": (lambda: S(1.0, -0.01), ConfigError),
    "SirOptions, regularise: expected a number in 0..2": (lambda: S(1.0, 2.01), ConfigError),
    "SigmaPoints, alpha": (lambda: SigmaPoints(0.0), ConfigError),
    "SigmaPoints, alpha: expected a number > 0": (lambda: SigmaPoints(inf), ConfigError),
    "SigmaPoints, beta": (lambda: SigmaPoints(1.0, nan), ConfigError),
    "SigmaPoints, kappa": (lambda: SigmaPoints(1.0, 2.0, inf), ConfigError),
    "kappa: expected more than -2": (lambda: SigmaPoints(1.0, 2.0, -2.0).spread(2), InputError),
    "kappa: expected more than -3": (lambda: SigmaPoints(1.0, 2.0, -3.5).spread(3), InputError),
    "Method, iterations: expected a whole number >= 1": (
        lambda: Method("none", iterations=0),
        ConfigError,
    ),
    "covariance: expected shape .2, 2.": (lambda: factor_of(np.eye(3), 2), InputError),
    "there: expected shape": (lambda: factor_of(1.0, 1, "there"), InputError),
    "covariance: expected finite": (lambda: factor_of([[nan]], 1), InputError),
    "covariance: expected a symmetric": (lambda: factor_of(ODD, 2), InputError),
    "covariance: expected variances >= 0": (lambda: factor_of(np.diag([1, -1.0]), 2), InputError),
    "covariance: expected no negative eigenvalue": (
        lambda: factor_of([[1.0, 1 + 2.5e-9], [1 + 2.5e-9, 1.0]], 2),
        InputError,
    ),
    "covariance: expected shape": (lambda: kalman.as_belief([1.0], np.eye(2)), InputError),
    "parts": (lambda: split([0.0, 0.0], np.eye(2), {2: 2}), InputError),
    "parts: expected indices below 2": (lambda: split([0.0, 0.0], np.eye(2), {-1: 2}), InputError),
    "parts: expected indices below 2 and": (lambda: split([0, 0], np.eye(2), {1: 0}), InputError),
    "covariance, row 0: expected no correlation": (
        lambda: split([0.0] * 2, [[1.0, 0.1], [0.1, 1.0]], {0: 2}),
        InputError,
    ),
    "sampled: expected indices in 0..1": (lambda: drawn([-1]), InputError),
    "sampled: expected indices in 0..1, found": (lambda: drawn([0, 2]), InputError),
    "particles: expected at least 2, found 1": (lambda: drawn([0], 1), InputError),
    "covariances: expected shape": (
        lambda: smooth(np.eye(2), np.eye(2), np.zeros((1, 3, 2)), np.zeros((1, 2, 2, 2))),
        InputError,
    ),
    "covariances": (
        lambda: smooth(np.eye(3), np.eye(3), np.zeros((1, 2, 2)), np.zeros((1, 2, 2, 2))),
        InputError,
    ),
}


def drawn(sampled, count=5):
    return init(np.zeros(2), np.eye(2), sampled, count, np.random.default_rng(0))


@pytest.mark.parametrize(("said", "door"), DOORS.items(), ids=range(len(DOORS)))
def test_what_lies_beyond_is_told(said, door):
    make, error = door
    with pytest.raises(error, match=said):
        make()


def test_faults_of_particles_are_told_one_by_one():
    with pytest.raises(ConfigError) as told:
        P(
            min_search_particles=0,
            mass_exponent=2.0,
            switch_mass=nan,
            switch_hold_m=nan,
            jitter=(nan,),
        )
    assert len(told.value.faults) == 5


def test_smoothing_of_one_step_changes_nothing():
    means, covariances = np.ones((2, 1, 2)), np.tile(np.eye(2), (2, 1, 1, 1))
    found = smooth(np.eye(2), np.eye(2), means, covariances)
    np.testing.assert_array_equal(found.means, means)
    np.testing.assert_array_equal(found.covariances, covariances)
    # Something known without error is no division by nothing.
    still = smooth(np.eye(1), np.zeros((1, 1)), np.ones((1, 2, 1)), np.full((1, 2, 1, 1), 1e-20))
    assert np.isfinite(still.means).all()
    assert sqrt(still.covariances[0, 0, 0, 0]) == pytest.approx(1e-10)


@pytest.mark.parametrize("copy", [0.0, 1.0], ids=["known", "a copy"])
def test_components_that_others_or_nothing_tells_are_smoothed(copy):
    """Beside a random walk a component that is known, or one that is the same."""
    means, covariances = np.array([[[1.0], [5.0], [2.0]]]), np.array([[[[4.0]], [[3.0]], [[2.0]]]])
    alone = smooth(np.eye(1), np.eye(1), means, covariances)
    both = np.array([[1.0], [copy]])
    found = smooth(np.eye(2), both @ both.T, means @ both.T, both @ covariances @ both.T)
    np.testing.assert_allclose(found.means, alone.means @ both.T, rtol=1e-12)
    np.testing.assert_allclose(found.covariances, both @ alone.covariances @ both.T, rtol=1e-12)
