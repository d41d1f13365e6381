"""Models of motion and clocks."""

import numpy as np
import pytest
from fusion_world import CASES
from scipy.linalg import expm

from mapfilter.errors import ConfigError, InputError
from mapfilter.models.motion import (
    QUARTZ,
    LinearMotion,
    Oscillator,
    clock_motion,
    clock_noise,
    constant_velocity,
    random_walk,
    scaled,
    together,
)

C0_SQUARED = 299_792_458.0**2


def test_the_clock_is_that_of_the_reference():
    case = CASES["clock_Q"]
    printed, textbook = (clock_noise(case["Ts"], QUARTZ, t) for t in ("as_printed", "textbook"))
    np.testing.assert_allclose(printed, case["as_printed_times_c0sq"], rtol=1e-12)
    np.testing.assert_allclose(printed / C0_SQUARED, case["as_printed_Ts3"], rtol=1e-12)
    np.testing.assert_allclose(textbook / C0_SQUARED, case["textbook_Ts2"], rtol=1e-12)


def test_the_process_is_that_of_the_reference():
    case = CASES["fk_process"]
    car, clock = constant_velocity(0.48, 1e-2), clock_motion(0.48)
    both = together([car, clock])
    np.testing.assert_allclose(both.transition, case["Phi"], rtol=1e-15)
    np.testing.assert_allclose(both.noise, case["GQGt_true"], rtol=1e-10, atol=1e-20)
    assumed = together([scaled(car, 100.0), scaled(clock, 5.0)])
    np.testing.assert_allclose(assumed.noise, case["GQGt_filter"], rtol=1e-10, atol=1e-20)


def test_zhang_moves_as_in_the_reference():
    noise = constant_velocity(0.48, 0.1).noise
    np.testing.assert_allclose(noise, CASES["zhang"]["Q"], rtol=1e-12, atol=1e-20)


def test_continuous_noise_does_not_depend_on_how_time_is_cut():
    whole, half = (constant_velocity(t, 0.7, 3, "continuous") for t in (2.0, 1.0))
    twice = half.transition @ half.noise @ half.transition.T + half.noise
    np.testing.assert_allclose(twice, whole.noise, atol=1e-12)
    np.testing.assert_allclose(half.transition @ half.transition, whole.transition)
    # Van Loan's block exponential.
    f, g = np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([0.0, 0.7**2])
    block = expm(np.block([[-f, g], [np.zeros((2, 2)), f.T]]) * 2.0)
    np.testing.assert_allclose(block[2:, 2:].T @ block[:2, 2:], whole.noise[:2, :2], atol=1e-12)


@pytest.mark.parametrize(
    "motion", [constant_velocity(0.48, [0.1, 0.4]), clock_motion(0.5), random_walk(3.0, 2.0)]
)
def test_samples_have_the_mean_and_the_covariance(motion):
    start = np.arange(1.0, motion.size + 1)
    drawn = motion.sample(np.tile(start, (50_000, 1)), np.random.default_rng(1))
    deviation = np.sqrt(np.diagonal(motion.noise))
    off = (drawn.mean(axis=0) - motion.transition @ start) / deviation
    assert np.abs(off).max() < 0.025
    correlations = np.cov(drawn.T) / np.outer(deviation, deviation)
    np.testing.assert_allclose(
        correlations, motion.noise / np.outer(deviation, deviation), atol=0.03
    )


BAD = {
    "no time": lambda: constant_velocity(0.0, 1.0),
    "time backwards": lambda: random_walk(-1.0, 1.0),
    "NaN": lambda: clock_motion(float("nan")),
    "a negative deviation": lambda: constant_velocity(1.0, -1.0),
    "a negative factor": lambda: scaled(random_walk(1.0, 1.0), -2.0),
    "nothing": lambda: together([]),
    "an indefinite noise": lambda: LinearMotion(np.eye(2), np.array([[1.0, 2.0], [2.0, 1.0]])),
    "a lopsided noise": lambda: LinearMotion(np.eye(2), np.array([[1.0, 0.5], [0.0, 1.0]])),
    "sizes": lambda: LinearMotion(np.eye(2), np.eye(3)),
}


@pytest.mark.parametrize("make", BAD.values(), ids=BAD.keys())
def test_what_is_wrong_is_said(make):
    with pytest.raises(InputError, match="expected"):
        make()


def test_a_bad_oscillator_is_said():
    with pytest.raises(ConfigError, match="h0: expected a number >= 0"):
        Oscillator(-1.0, 0.0, 0.0)
