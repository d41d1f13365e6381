"""Equations (3)-(10) of Khalaf-Allah 2007 by hand, by inversion and by statistics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapfilter.tracks.deadreckoning import dead_reckon, noisy_steps, steps_between


def test_equations_3_and_4_by_hand():
    # 10 m to the north-east, 5 m to the west, 2 m to the south.
    east, north = dead_reckon(100.0, 200.0, [10.0, 5.0, 2.0], np.radians([45.0, 180.0, -90.0]))
    root = 10 / np.sqrt(2)
    np.testing.assert_allclose(east, [100 + root, 95 + root, 95 + root], atol=1e-12)
    np.testing.assert_allclose(north, [200 + root, 200 + root, 198 + root], atol=1e-12)


def test_batches_are_the_same_as_a_loop():
    rng = np.random.default_rng(1)
    step, heading = rng.uniform(0, 2, (3, 4, 7)), rng.uniform(-3, 3, (3, 4, 7))
    start_east, start_north = rng.normal(size=(2, 3, 4))
    east, north = dead_reckon(start_east, start_north, step, heading)
    for i in np.ndindex(3, 4):
        one = dead_reckon(start_east[i], start_north[i], step[i], heading[i])
        np.testing.assert_array_equal(one, (east[i], north[i]))


def test_no_steps_lead_nowhere():
    east, north = dead_reckon(1.0, 2.0, [], [])
    assert east.shape == north.shape == (0,)


def test_standing_still_keeps_the_heading():
    step, heading = steps_between([0.0, 0.0, 1.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0, 2.0, 2.0])
    np.testing.assert_array_equal(step, [0, 1, 0, 2, 1])
    np.testing.assert_allclose(heading, [0, 0, 0, np.pi / 2, -np.pi])


def test_never_moving_has_no_heading():
    step, heading = steps_between([3.0, 3.0, 3.0], [1.0, 1.0, 1.0])
    assert step.tolist() == [0, 0]
    assert np.isnan(heading).all()
    assert steps_between([1.0], [1.0])[1].shape == (0,)


@given(arrays(float, (2, 3, 8), elements=st.floats(-1e4, 1e4)))
def test_dead_reckoning_undoes_steps_between(path):
    step, heading = steps_between(path[0], path[1])
    east, north = dead_reckon(path[0, :, 0], path[1, :, 0], step, np.nan_to_num(heading))
    np.testing.assert_allclose(east, path[0, :, 1:], atol=1e-9)
    np.testing.assert_allclose(north, path[1, :, 1:], atol=1e-9)


def test_no_noise_changes_nothing_but_wraps():
    step, heading = noisy_steps([1.0, 2.0], [0.5, 4.0], 0.0, 0.0, np.random.default_rng(0))
    np.testing.assert_array_equal(step, [1.0, 2.0])
    np.testing.assert_allclose(heading, [0.5, 4.0 - 2 * np.pi])


def test_noise_has_the_mean_and_deviation_of_equations_7_and_8():
    n = 200_000
    step, heading = noisy_steps(
        np.full(n, 1.4), 0.3, 0.2, np.radians(6.0), np.random.default_rng(20070926)
    )
    # 4 standard errors: a right generator fails once in 16 000 seeds, and this seed is fixed.
    assert abs(step.mean() - 1.4) < 4 * 0.2 / np.sqrt(n)
    assert abs(heading.mean() - 0.3) < 4 * np.radians(6.0) / np.sqrt(n)
    assert abs(step.std() / 0.2 - 1) < 4 / np.sqrt(2 * n)
    assert abs(heading.std() / np.radians(6.0) - 1) < 4 / np.sqrt(2 * n)
    assert abs(np.corrcoef(step, heading)[0, 1]) < 4 / np.sqrt(n)
    assert abs(np.corrcoef(step[1:], step[:-1])[0, 1]) < 4 / np.sqrt(n)


def test_as_printed_doubles_the_mean():
    same = [np.random.default_rng(3) for _ in range(2)]
    zero_mean, _ = noisy_steps(np.full(9, 1.4), 0.0, 0.2, 0.1, same[0])
    printed, _ = noisy_steps(
        np.full(9, 1.4), 0.0, 0.2, 0.1, same[1], translation_noise="as_printed"
    )
    np.testing.assert_allclose(printed, zero_mean + 1.4)


@pytest.mark.parametrize("shape", [(5,), (3, 5), (2, 3, 5)])
def test_noise_is_drawn_for_every_element_of_a_batch(shape):
    step, heading = noisy_steps(np.ones(5), np.zeros(shape), 0.2, 0.1, np.random.default_rng(0))
    assert step.shape == heading.shape == shape
    assert np.unique(step).size == np.unique(heading).size == np.prod(shape)


def test_the_same_draws_are_scaled_by_sigma():
    small, _ = noisy_steps(np.zeros(5), 0.0, 0.1, 0.0, np.random.default_rng(5))
    large, _ = noisy_steps(np.zeros(5), 0.0, 0.3, 0.2, np.random.default_rng(5))
    np.testing.assert_allclose(large, 3 * small)
