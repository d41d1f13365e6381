"""The clock of a phone in a vehicle by hand: means, shares explained, and shifts that are shown."""

import numpy as np
import pytest

from mapfilter.tracks.pdr.mounted_clock import _explained, _integral, _means, clock_shift_s


def test_integrals_and_means_of_forces():
    """By trapezoids: 1 and 6; a line's mean is its middle."""
    time_s = np.array([0.0, 1.0, 3.0])
    values = np.array([[0.0, 5.0], [2.0, 5.0], [4.0, 5.0]])
    integral = _integral(time_s, values)
    assert integral.tolist() == [[0, 0], [1, 5], [7, 15]]
    # From 1 s before to 1 s after.
    assert _means(np.array([1.0, 2.0]), time_s, integral).tolist() == [[2, 5], [3, 5]]


def test_the_share_that_forces_explain():
    """Of 0, 2, 1 and 3 by -1, 1, -1 and 1: residuals of 1/2 beside deviations of 3/2 and 1/2."""
    gained = np.array([0.0, 2.0, 1.0, 3.0])
    force = np.array([-1.0, 1.0, -1.0, 1.0])
    two = np.column_stack([force, np.zeros(4)])
    assert _explained(gained, two) == pytest.approx(0.8)
    assert _explained(7 * gained + 3, 5 * two - 4) == pytest.approx(0.8)
    assert _explained(gained, np.zeros((4, 2))) == pytest.approx(0.0)
    assert _explained(gained, np.column_stack([gained, force])) == pytest.approx(1.0)
    assert _explained(np.ones(4), two) == 0


def shift(late_s, seconds=300.0, period_s=(56.5, 25.1), begin_s=0.0):
    """Return the shift of a phone whose clock is late, that lies on its side."""
    time_s = np.arange(0.0, seconds, 0.5)
    speed = 10.0 + sum(3 * np.sin(2 * np.pi * time_s / one) for one in period_s)
    ahead = sum(6 * np.pi / one * np.cos(2 * np.pi * time_s / one) for one in period_s)
    force = np.stack([9.8 + 0 * ahead, 0.6 * ahead, -0.8 * ahead], axis=1)
    return clock_shift_s((time_s, speed), (begin_s + time_s + late_s, force))


@pytest.mark.parametrize("late_s", [1.0, -1.0, 7.5, -29.5])
def test_a_clock_that_is_late_by_seconds(late_s):
    found, best, now = shift(late_s)
    assert found == -late_s
    assert best == pytest.approx(1.0, abs=1e-3)
    assert now < best


@pytest.mark.parametrize("late_s", [0.0, 0.5, -0.5])
def test_half_a_second_is_not_shown(late_s):
    found, best, _ = shift(late_s)
    assert found == 0
    assert best > 0.99


def test_a_shift_at_the_end_of_those_tried_is_none():
    assert shift(30.0)[0] == 0
    assert shift(34.0)[0] == 0


def test_speeds_that_repeat_themselves_tell_no_shift():
    """Every 20 s they agree as well."""
    found, best, now = shift(4.0, period_s=(20.0,))
    assert found == 0
    assert best > 0.99
    assert now < 0.5


@pytest.mark.parametrize(("seconds", "is_long"), [(184.0, True), (181.0, False)])
def test_two_minutes_are_needed_beside_all_shifts(seconds, is_long):
    """And half a minute, with half of a mean, at either end."""
    found, best, _ = shift(4.0, seconds=seconds + 4.0)
    assert (found != 0) == (best > 0) == is_long
