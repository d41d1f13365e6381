"""What models of motion assume unless told otherwise, and where they stop taking input."""

import math

import numpy as np
import pytest

from mapfilter._constants import LIGHT_MPS
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

NAN, INF = math.nan, math.inf
I2 = np.eye(2)


def test_the_clock_term_by_term():
    assert LIGHT_MPS == 299_792_458.0
    assert Oscillator(9.4e-20, 1.8e-19, 3.8e-21) == QUARTZ
    c2, pi2 = 299_792_458.0**2, math.pi**2
    white = clock_noise(4.0, Oscillator(1.0, 0.0, 0.0), "textbook") / c2
    np.testing.assert_allclose(white, [[2.0, 0.0], [0.0, 1 / 8]])
    flicker = clock_noise(3.0, Oscillator(0.0, 1.0, 0.0), "textbook") / c2
    np.testing.assert_allclose(flicker, [[18.0, 6.0], [6.0, 2.0]])
    walk = clock_noise(3.0, Oscillator(0.0, 0.0, 1.0), "textbook") / c2
    np.testing.assert_allclose(walk, pi2 * np.array([[18.0, 9.0], [9.0, 8.0]]))
    printed = clock_noise(3.0, Oscillator(0.0, 0.0, 1.0)) / c2
    np.testing.assert_allclose(printed, pi2 * np.array([[18.0, 27.0], [27.0, 8.0]]))
    np.testing.assert_array_equal(clock_noise(2.0), clock_noise(2.0, QUARTZ, "as_printed"))


def test_a_clock_moves_by_its_drift():
    motion = clock_motion(0.5)
    assert motion.transition.tolist() == [[1.0, 0.5], [0.0, 1.0]]
    np.testing.assert_array_equal(motion.noise, clock_noise(0.5, QUARTZ, "as_printed"))
    other = clock_motion(0.5, Oscillator(0.0, 0.0, 1e-20), "textbook")
    expected = clock_noise(0.5, Oscillator(0.0, 0.0, 1e-20), "textbook")
    np.testing.assert_array_equal(other.noise, expected)


def test_nearly_constant_velocity_by_hand():
    motion = constant_velocity(2.0, 3.0)
    assert motion.size == 4
    pair = np.array([[1.0, 2.0], [0.0, 1.0]])
    np.testing.assert_array_equal(motion.transition, np.kron(I2, pair))
    # γ = [2, 2], σ² = 9.
    np.testing.assert_allclose(motion.noise, np.kron(I2, [[36.0, 36.0], [36.0, 36.0]]))
    continuous = constant_velocity(3.0, [1.0, 2.0], noise="continuous").noise
    np.testing.assert_allclose(continuous[:2, :2], [[9.0, 4.5], [4.5, 3.0]])
    np.testing.assert_allclose(continuous[2:, 2:], 4 * continuous[:2, :2])
    np.testing.assert_array_equal(continuous[:2, 2:], 0.0)
    assert constant_velocity(1.0, [1.0, 2.0, 3.0], 3).size == 6


def test_a_random_walk_by_hand():
    walk = random_walk(4.0, 3.0)
    np.testing.assert_array_equal(walk.transition, I2)
    np.testing.assert_array_equal(walk.noise, 36.0 * I2)
    assert random_walk(4.0, 3.0, 3).size == 3


def test_parts_stand_one_after_the_other():
    both = together([random_walk(1.0, 2.0, 1), constant_velocity(2.0, 1.0, 1)])
    assert both.transition.tolist() == [[1, 0, 0], [0, 1, 2], [0, 0, 1]]
    assert both.noise.tolist() == [[4, 0, 0], [0, 4, 4], [0, 4, 4]]


def test_a_factor_is_of_the_noise_alone():
    more = scaled(constant_velocity(2.0, 1.0, 1), 5.0)
    assert more.noise.tolist() == [[20.0, 20.0], [20.0, 20.0]]
    assert more.transition.tolist() == [[1.0, 2.0], [0.0, 1.0]]


def test_what_does_not_err_is_moved_by_its_transition():
    still = LinearMotion(np.array([[1.0, 2.0], [0.0, 1.0]]), np.zeros((2, 2)))
    states = np.array([[[1.0, 3.0]], [[4.0, -1.0]]])
    moved = still.sample(states, np.random.default_rng(0))
    np.testing.assert_array_equal(moved, [[[7.0, 3.0]], [[2.0, -1.0]]])


def test_noise_of_one_direction_stays_on_its_line():
    # Eigenvalues of rounding may be a little below 0.
    motion = LinearMotion(I2, np.array([[4.0, 2.0], [2.0, 1.0]]))
    gone = motion.sample(np.zeros((2000, 2)), np.random.default_rng(3))
    np.testing.assert_allclose(gone[:, 0], 2 * gone[:, 1], atol=1e-6)
    assert gone[:, 0].std() == pytest.approx(2.0, rel=0.08)


def test_what_lies_on_the_border_is_taken():
    assert constant_velocity(1.0, 0.0).noise.tolist() == np.zeros((4, 4)).tolist()
    assert random_walk(1.0, 0.0).noise.tolist() == np.zeros((2, 2)).tolist()
    assert scaled(random_walk(1.0, 1.0), 0.0).noise.tolist() == np.zeros((2, 2)).tolist()
    assert Oscillator(0.0, 0.0, 0.0).h0 == 0.0
    assert random_walk(0.25, 2.0).noise[0, 0] == 1.0
    # What rounding makes of a matrix is let through: a billionth of the largest entry.
    assert LinearMotion(I2, np.diag([1e4, -0.9e-5])).size == 2
    assert LinearMotion(I2, np.array([[1.0, 0.5], [0.5 * (1 + 0.9e-9), 1.0]])).size == 2


DOORS = {
    "motion: expected two square matrices of one shape": lambda: LinearMotion(np.eye(2), np.eye(3)),
    "motion: expected two square": lambda: LinearMotion(np.ones(3), np.ones(3)),
    "motion: expected two square matrices": lambda: LinearMotion(np.ones((2, 3)), np.ones((2, 3))),
    "motion: expected finite numbers": lambda: LinearMotion(np.full((2, 2), INF), I2),
    "motion: expected finite": lambda: LinearMotion(I2, np.full((2, 2), NAN)),
    "motion, noise: expected a symmetric": lambda: LinearMotion(
        I2, np.array([[1.0, 500.0], [500.0 * (1 + 1.5e-9), 1e6]])
    ),
    "motion, noise: expected no negative": lambda: LinearMotion(I2, np.diag([1e4, -1.5e-5])),
    "motion, noise: expected no negative eigenvalue": lambda: LinearMotion(
        I2, np.diag([-1e4, -1e4])
    ),
    "interval_s: expected seconds above 0, found 0": lambda: constant_velocity(0.0, 1.0),
    "interval_s: expected seconds above 0, found inf": lambda: random_walk(INF, 1.0),
    "interval_s: expected seconds above 0, found -1": lambda: clock_motion(-1.0),
    "interval_s.*found 0.0": lambda: clock_noise(0.0),
    "interval_s.*found inf": lambda: clock_noise(INF),
    "sigma_mps2: expected m/s² >= 0": lambda: constant_velocity(1.0, [1.0, -1e-9]),
    "sigma_mps2.*inf": lambda: constant_velocity(1.0, INF),
    "sigma_m: expected metres >= 0, found inf": lambda: random_walk(1.0, INF),
    "sigma_m: expected metres >= 0, found -1": lambda: random_walk(1.0, -1.0),
    "factor: expected a number >= 0, found -1": lambda: scaled(random_walk(1.0, 1.0), -1.0),
    "factor.*inf": lambda: scaled(random_walk(1.0, 1.0), INF),
    "motion: expected at least one part": lambda: together([]),
    "Oscillator, h0: expected a number >= 0": lambda: Oscillator(-1.0, 0.0, 0.0),
    "Oscillator, h_minus1": lambda: Oscillator(0.0, INF, 0.0),
    "Oscillator, h_minus2": lambda: Oscillator(0.0, 0.0, -1e-30),
}


@pytest.mark.parametrize(("said", "make"), DOORS.items(), ids=range(len(DOORS)))
def test_what_lies_beyond_is_told(said, make):
    with pytest.raises(ConfigError if "Oscillator" in said else InputError, match=said):
        make()


def test_a_clock_as_printed_is_refused_where_its_noise_is_no_covariance():
    assert np.linalg.eigvalsh(clock_motion(1.9).noise)[0] > 0
    with pytest.raises(InputError, match=r'found 2.5 s \(likely: .*cross_term="textbook"'):
        clock_motion(2.5)
    assert np.linalg.eigvalsh(clock_motion(2.5, cross_term="textbook").noise)[0] > 0
