"""The way travelled, of a ground truth with noise."""

import numpy as np
import pytest

from mapfilter.evaluation.truth import Truth

TIME_S = np.arange(600.0)


def truth(moved_m, noise_m, time_s=TIME_S, seed=0):
    """A way that goes east for 60 m, north for 60 m and so on, as a receiver with noise has it."""
    leg, rest = np.divmod(moved_m, 60.0)
    halves = np.floor(leg / 2) * 60.0
    east = halves + np.where(leg % 2 == 0, rest, 60.0)
    north = halves + np.where(leg % 2 == 1, rest, 0.0)
    noise = np.random.default_rng(seed).normal(0.0, noise_m, (2, time_s.size))
    return Truth(time_s, east + noise[0], north + noise[1])


def leg_sum_m(given):
    return np.concatenate([[0.0], np.hypot(np.diff(given.east_m), np.diff(given.north_m)).cumsum()])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise_m", [1.0, 2.0, 5.0])
def test_noise_adds_little_to_the_way_of_a_walker(noise_m, seed):
    moved_m = 1.4 * TIME_S
    given = truth(moved_m, noise_m, seed=seed)
    assert leg_sum_m(given)[-1] > 1.4 * moved_m[-1]
    found_m = given.distance_at(TIME_S)
    assert found_m[-1] == pytest.approx(moved_m[-1], rel=0.1)
    # The last six deviations may not be counted yet.
    assert (abs(found_m - moved_m) < 0.1 * moved_m + 12 * noise_m).all()


def test_a_rest_adds_nothing():
    moved_m = 1.4 * np.clip(TIME_S - 200.0, 0.0, 130.0)
    given = truth(moved_m, 5.0)
    assert leg_sum_m(given)[-1] > 4000
    assert given.distance_at(200.0) < 40.0
    assert given.distance_at(599.0) == pytest.approx(182.0, rel=0.2)
    assert given.distance_at(599.0) == given.distance_at(360.0)


def test_times_that_are_not_even_change_nothing():
    time_s = np.cumsum(np.random.default_rng(1).uniform(0.2, 2.0, 600))
    given = truth(1.4 * time_s, 3.0, time_s)
    assert given.distance_at(time_s[-1]) == pytest.approx(1.4 * time_s[-1], rel=0.1)


@pytest.mark.parametrize("speed_mps", [1.4, 14.0])
@pytest.mark.parametrize("noise_m", [0.0, 0.2])
def test_the_legs_of_a_smooth_truth_are_added_up(speed_mps, noise_m):
    given = truth(speed_mps * TIME_S, noise_m)
    assert np.array_equal(given.distance_at(TIME_S), leg_sum_m(given))


def test_steps_from_pixel_to_pixel_are_no_noise():
    steps = np.array([[5.0, 0.0], [5.0, 5.0]] * 100)
    east, north = np.concatenate([[[0.0, 0.0]], steps.cumsum(axis=0)]).T
    given = Truth(np.arange(201.0), east, north)
    assert np.array_equal(given.distance_at(given.time_s), leg_sum_m(given))


def test_a_way_there_and_back_counts_twice():
    time_s = np.array([0.0, 60.0, 120.0, 180.0])
    given = Truth(time_s, np.array([0.0, 90.0, 0.0, 90.0]), np.zeros(4))
    assert given.distance_at(time_s).tolist() == [0.0, 90.0, 180.0, 270.0]
