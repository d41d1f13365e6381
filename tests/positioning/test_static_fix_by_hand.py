"""Single steps of static fixes: how far they go, how often they are halved, and when they end."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.models.motion import random_walk
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import POSITION
from mapfilter.positioning.kalman.static_fix import (
    BAD_GEOMETRY,
    NOT_CONVERGED,
    StaticFix,
    filter_fixes,
    static_fix,
)


class Scalar:
    """A reading of one number by its function and slope, with a variance of 4."""

    def __init__(self, mean, slope):
        self.mean, self._slope = mean, slope

    def jacobian(self, state):
        return np.array([[self._slope(float(state[0]))]])

    def covariance(self):
        return np.array([[4.0]])


def test_a_step_that_raises_the_sum_of_squares_is_halved():
    """Newton's steps to the root of the arc tangent lead farther and farther away from 3.

    The first goes to -9.5, its half to -3.2, which is farther, too; a quarter of it to -0.1.
    """
    found = static_fix(Scalar(np.arctan, lambda x: 1 / (1 + x * x)), [0.0], [3.0])
    assert found.ok
    assert found.state == pytest.approx([0.0], abs=1e-9)
    assert found.iterations < 8


def test_steps_that_lead_to_and_fro_end_after_fifty():
    """Each time to the other side, as far as before."""
    found = static_fix(Scalar(np.asarray, lambda _: 0.5), [1.0], [0.0])
    assert not found.ok
    assert (found.problem, found.iterations) == (NOT_CONVERGED, 50)
    # The rest is -0.6 times as large each time: after 40 it is 1e-9.
    better = static_fix(Scalar(np.asarray, lambda _: 1 / 1.6), [1.0], [0.0])
    assert better.ok
    assert 35 < better.iterations < 45


@pytest.mark.parametrize(
    ("share", "iterations", "ok"), [(0.6, 42, True), (0.657, 50, True), (0.658, 50, False)]
)
def test_the_last_step_of_fifty_is_still_taken(share, iterations, ok):
    """The n-th step is (1 + share) share^(n-1): the last one that counts is 2e-9."""
    found = static_fix(Scalar(np.asarray, lambda _: 1 / (1 + share)), [1.0], [0.0])
    assert (found.ok, found.iterations) == (ok, iterations)


def test_what_cannot_be_solved_is_told_together():
    model = position_fix(POSITION, np.eye(2))
    with pytest.raises(InputError, match=r"start[\s\S]*reading"):
        static_fix(model, [np.inf, 0.0], [np.nan, 0.0])
    with pytest.raises(InputError, match=r"shape \(2,\)"):
        static_fix(model, [1.0], [0.0, 0.0])


@pytest.mark.parametrize(("power", "ok"), [(19.05, True), (20.05, False)])
def test_steps_are_halved_nineteen_times_at_most(power, ok):
    """The last one is of 1 / 2^19, or two in a million, and leads to 1.04; else to 2.07.

    Only between 0 and 2 steps are then as they should be; elsewhere they lead to and fro.
    """

    def slope(x):
        return 2.0**-power if x == 0.0 else 1.0 if 0.0 < x < 2.0 else 0.5

    found = static_fix(Scalar(np.asarray, slope), [1.0], [0.0])
    assert found.ok is ok
    assert (found.problem == "") is ok
    if ok:
        assert found.state == pytest.approx([1.0])
        assert found.covariance == pytest.approx(4.0)


def placed(sd_east_m, sd_north_m, **more):
    model = position_fix(POSITION, np.diag([sd_east_m**2, sd_north_m**2]))
    return static_fix(model, [30.0, -40.0], [0.0, 0.0], **more)


@pytest.mark.parametrize("scale_m", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize(("ratio", "ok"), [(0.9e7, True), (1.1e7, False)])
def test_deviations_that_differ_by_ten_millions_determine_nothing(scale_m, ratio, ok):
    """However large both are."""
    found = placed(scale_m, ratio * scale_m)
    assert (found.ok, found.problem) == (ok, "" if ok else BAD_GEOMETRY)
    if ok:
        np.testing.assert_allclose(found.state, [30.0, -40.0])
        np.testing.assert_allclose(
            found.covariance, np.diag([scale_m**2, (ratio * scale_m) ** 2]), rtol=1e-6
        )


def test_a_reading_that_does_not_depend_on_the_state_determines_nothing():
    found = static_fix(Scalar(np.asarray, lambda _: 0.0), [1.0], [0.0])
    assert (found.ok, found.problem, found.iterations) == (False, BAD_GEOMETRY, 1)
    assert found.covariance.shape == (1, 1)
    assert np.isnan(found.covariance).all()
    assert np.isnan(found.state).all()


@pytest.mark.parametrize(("largest_m", "ok"), [(7.0, True), (6.999, False), (None, True)])
def test_the_largest_deviation_is_still_a_fix(largest_m, ok):
    found = placed(3.0, 7.0, largest_deviation=largest_m)
    assert (found.ok, found.problem) == (ok, "" if ok else BAD_GEOMETRY)
    assert found.iterations in (1, 2)


def test_steps_that_leave_nothing_end():
    """The second one of a linear reading moves nothing; from the right place the first one."""
    assert placed(3.0, 7.0).iterations == 2
    model = position_fix(POSITION, np.eye(2))
    assert static_fix(model, [30.0, -40.0], [30.0, -40.0]).iterations == 1


def test_fixes_are_filtered_by_their_covariance_and_missed_ones_bridged():
    """Kalman's gain on each axis; 3 m² are added per epoch."""
    fix = StaticFix(np.array([10.0, -20.0, 5.0]), np.diag([4.0, 1.0, 9.0]), True, 1)
    none = StaticFix(np.full(3, np.nan), np.full((3, 3), np.nan), False, 0)
    found = filter_fixes(
        POSITION, random_walk(1.0, 3.0**0.5), [0.0, 0.0], 9.0 * np.eye(2), [none, fix, none]
    )
    gain = 15.0 / (15.0 + np.array([4.0, 1.0]))
    np.testing.assert_allclose(found.means[0], [0.0, 0.0])
    np.testing.assert_allclose(found.means[1], gain * [10.0, -20.0])
    np.testing.assert_allclose(found.means[2], found.means[1])
    for k, variance in enumerate(([12.0, 12.0], (1 - gain) * 15.0, (1 - gain) * 15.0 + 3.0)):
        np.testing.assert_allclose(found.covariances[k], np.diag(variance))
    assert found.used.tolist() == [False, True, False]
