"""Motions of a Kalman-type filter's belief to another one, and what grows old, by hand."""

from math import radians

import numpy as np
import pytest

from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.coasting import Coasting, Separation
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.passing import as_time_passes
from mapfilter.positioning.kalman.redirected import jump_to, regained_by, turns_in_doubt
from mapfilter.positioning.kalman.turned import Turn

LAYOUT = StateLayout(8, 0, 1)
"""East, north, three errors of dead reckoning, east and north that fixes are of, and one more."""
MEAN = np.array([30.0, 40.0, 0.1, 0.2, 0.3])
ROOT = np.arange(25.0).reshape(5, 5) / 10 + 2 * np.eye(5)
COVARIANCE = ROOT @ ROOT.T


def regained(lasting_m):
    coast = Coast(0.0, MEAN, COVARIANCE, np.eye(2), 1.0, MEAN[:2], MEAN[:2])
    return regained_by(Coasting(apart=Separation(0.9, coast)), LAYOUT, lasting_m)


def test_a_belief_without_fixes_takes_over_all_errors_of_dead_reckoning():
    transition, noise, shift = regained(None)
    assert np.diag(transition).tolist() == [0, 0, 0, 0, 0, 1, 1, 1]
    assert np.count_nonzero(transition) == 3
    assert shift.tolist() == [*MEAN, 0, 0, 0]
    np.testing.assert_allclose(noise[:5, :5], COVARIANCE)
    assert not noise[5:].any()
    assert not noise[:, 5:].any()


def test_the_place_that_fixes_are_of_is_its_position_and_what_lasts():
    transition, noise, shift = regained(3.0)
    assert np.diag(transition).tolist() == [0, 0, 0, 0, 0, 0, 0, 1]
    assert np.count_nonzero(transition) == 1
    assert shift.tolist() == [*MEAN, 30.0, 40.0, 0]
    np.testing.assert_allclose(noise[:5, :5], COVARIANCE)
    np.testing.assert_allclose(noise[5:7, :5], COVARIANCE[:2])
    np.testing.assert_allclose(noise[:5, 5:7], COVARIANCE[:, :2])
    np.testing.assert_allclose(noise[5:7, 5:7], COVARIANCE[:2, :2] + 9.0 * np.eye(2))
    assert not noise[7].any()


def test_nothing_is_regained_by_no_belief():
    with pytest.raises(AssertionError):
        regained_by(Coasting(), LAYOUT, None)


def test_turns_that_led_astray_may_be_off_by_thirty_degrees():
    transition, noise, shift = turns_in_doubt(LAYOUT)
    np.testing.assert_array_equal(transition, np.eye(8))
    assert not shift.any()
    expected = np.zeros((8, 8))
    expected[2, 2], expected[4, 4] = radians(30.0) ** 2, radians(1.0) ** 2
    np.testing.assert_allclose(noise, expected)


def test_where_lasting_errors_are_no_part_of_the_state_a_jump_changes_five_components():
    turn = Turn(1.5, 0.1, 100.0, 200.0, 4.0, (0.2, -0.1))
    transition, noise, shift = jump_to(turn, LAYOUT, None)
    assert np.diag(transition).tolist() == [0, 0, 0, 1, 1, 1, 1, 1]
    assert shift.tolist() == [100, 200, 1.5, 0, 0, 0, 0, 0]
    np.testing.assert_allclose(
        noise[:3, :3], [[16.0, 0.0, 0.2], [0.0, 16.0, -0.1], [0.2, -0.1, 0.01]]
    )
    assert not noise[3:].any()


def test_what_grows_old_does_so_by_the_time_alone():
    transition, noise, shift = as_time_passes(KalmanOptions(drift_m_per_sqrt_s=2.0), 3.0, 0.0)
    np.testing.assert_array_equal(transition, np.eye(5))
    assert not shift.any()
    assert np.diag(noise)[:2].tolist() == [12.0, 12.0]
    expected = radians(0.05) ** 2 * (1 - np.exp(-3.0 / 150.0))
    assert noise[4, 4] == pytest.approx(expected)
    assert np.count_nonzero(noise) == 3
