"""Beliefs without the last fixes as they move, end and are doubted, with numbers by hand."""

from dataclasses import replace
from math import e, exp, pi

import numpy as np
import pytest

from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.coasting import Coasting, Separation

STATED_M2 = 9.0 * np.eye(2)


def coast(begun_s=10.0, mean=(0.0,) * 5, variances=(100.0, 100.0, 1e-2, 1e-3, 1e-6)):
    return Coast.of(begun_s, Gaussian(np.array(mean), np.diag(variances)), 1.0, np.zeros(2))


EAST_10 = np.eye(5), np.diag([4.0, 1.0, 0, 0, 0]), np.array([10.0, 0, 0, 0, 0])
EAST_10[0][:2, 2:] = [[0.0, 10.0, 0.0], [10.0, 0.0, 0.0]]


def test_a_way_is_turned_and_drawn_out_as_its_own_errors_say():
    """By a right angle, and by a half: ten metres to the east lead fifteen to the north."""
    one = coast(mean=(3.0, 4.0, pi / 2, 0.5, 0.0), variances=(1.0, 1.0, 0.01, 0.04, 0.0))
    one = one._replace(mean=np.array([*one.mean[:5], 0.3, 0.4]))
    found = one.moved(EAST_10, np.zeros(5))
    np.testing.assert_allclose(found.mean, [3.0, 19.0, pi / 2, 0.5, 0.0, 0.3, 0.4])
    p = found.covariance
    # 15 m by 0.1 rad across, and by a fifth along; and motion's noise, turned and drawn out.
    assert p[0, 0] == pytest.approx(1.0 + 225 * 0.01 + 2.25)
    assert p[1, 1] == pytest.approx(1.0 + 225 * 0.04 + 2.25 * 4.0)
    assert p[0, 2] == pytest.approx(-15 * 0.01)
    assert p[1, 3] == pytest.approx(15 * 0.04)
    np.testing.assert_allclose(p[5:, 5:], np.eye(2))
    # About one that takes steps for longer, too, it is drawn out by a fifth, and not turned.
    same = one.moved(EAST_10, np.array([9.0, 9.0, pi / 2, 0.25, 0.0]))
    led_m = 1.2 * np.array([10.0 + 2.5, 5 * pi])
    np.testing.assert_allclose(same.mean[:2], np.array([3.0, 4.0]) + led_m)


def test_all_that_are_kept_and_the_one_apart_move():
    apart = Separation(0.5, coast())
    for state, kept, moves in (
        (Coasting(kept=(coast(),)), 1, False), (Coasting(apart=apart), 0, True),
        (Coasting(kept=(coast(), coast(40.0)), apart=apart), 2, True),
    ):  # fmt: skip
        found = state.moved(EAST_10, np.zeros(5))
        assert [one.mean[0] for one in found.kept] == [10.0] * kept
        assert (found.apart.coast is not None) is moves
        if moves:
            assert found.apart.coast.mean[0] == 10.0
    nothing = Coasting()
    assert nothing.moved(EAST_10, np.zeros(5)) is nothing


PREDICTED = Gaussian(np.zeros(5), np.eye(5))


def compared(state, time_s, east_m):
    return state.compared(time_s, np.array([east_m, 0.0]), STATED_M2, PREDICTED, 1.0)


@pytest.mark.parametrize(("time_s", "is_held"), [(610.0, True), (610.1, False)])
def test_one_is_held_for_ten_minutes(time_s, is_held):
    state = Coasting(apart=Separation(0.5, coast(10.0)), is_held=True)
    found = compared(state, time_s, 4000.0)
    assert found.is_held is is_held
    assert (found.apart.coast is not None) is is_held


@pytest.mark.parametrize(("begun_s", "prior"), [(20.0, 3e-3 + 0.2 / e), (21.0, 3e-3)])
def test_fixes_that_came_back_are_wrong_more_often(begun_s, prior):
    """70 m off after a minute and a half: as wrong fixes, and as right ones."""
    state = Coasting(kept=(coast(begun_s),), returned_s=20.0, usual_s=1.0)
    age_s = 110.0 - begun_s
    right_m2, wrong_m2 = 109.0, 109.0 + age_s**2 * (1 + 1e-4 * age_s)
    ratio = right_m2 / wrong_m2 * exp(70.0**2 / 2 * (1 / right_m2 - 1 / wrong_m2))
    expected = prior * ratio / (1 + (prior + 3e-3) * ratio)
    found = compared(state, 110.0, 70.0)
    assert found.apart.probability == pytest.approx(expected)
    assert found.is_held
    again = replace(found, is_held=False, apart=Separation())
    assert not again.is_back
