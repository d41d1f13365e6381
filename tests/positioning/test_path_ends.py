"""Starts by the map alone: how they are drawn by a path, and what a recent path is."""

from dataclasses import replace
from math import ceil, exp, log, nan, pi, radians

import numpy as np
import pytest
import scalar_oracle as oracle
from small_area import COLS, DISTANCE_M, PIXEL_M, POINTS, ROWS, make_area

from mapfilter.filters.contract import MotionStep
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning, RecentPath
from mapfilter.positioning.bayes.beliefs.path_start import ends_of_path, possible_turns_rad

AREA = make_area()
WEIGHTS = MapWeights(
    sd_m=9.0, weight_per_m=0.05, off_cost_per_m=0.05, leave_per_m=8e-3, return_per_m=0.04
)
TURNS = np.array([-0.5, 0.4, 1.6]), np.array([-0.3, 0.0, -1.1]), 0.3
"""Errors of headings, their log prior, and the spacing of a grid that has them."""


def path_of(*legs):
    """A path of legs of 5 m, by their headings."""
    found = RecentPath()
    for heading_rad in legs:
        found = found.moved(MotionStep(5.0, heading_rad))
    return found


def weighed_by_hand(path, point, turned_rad):
    """Log-likelihood of a path that ends at a point, and the probability of being off there."""
    row, col = point
    end_m = np.array([(col + 0.5) * PIXEL_M, (ROWS - row - 0.5) * PIXEL_M])
    turn = np.array([[np.cos(turned_rad), -np.sin(turned_rad)],
                     [np.sin(turned_rad), np.cos(turned_rad)]])  # fmt: skip
    here = np.array([path.here.east_m, path.here.north_m])
    on, off, leg_m = 0.95, 0.05, 5.0
    leave, back = 1 - exp(-WEIGHTS.leave_per_m * leg_m), 1 - exp(-WEIGHTS.return_per_m * leg_m)
    for one in (*path.points, path.here):
        x, y = end_m + turn @ (np.array([one.east_m, one.north_m]) - here)
        at_col = min(max(int(x / PIXEL_M), 0), COLS - 1)
        at_row = min(max(ROWS - 1 - int(y / PIXEL_M), 0), ROWS - 1)
        nats = oracle.map_log_likelihood(float(DISTANCE_M[at_row, at_col]), WEIGHTS.sd_m)
        on, off = (
            (on * (1 - leave) + off * back) * exp(WEIGHTS.weight_per_m * leg_m * nats),
            (off * (1 - back) + on * leave) * exp(-WEIGHTS.off_cost_per_m * leg_m),
        )
    return log(on + off), off / (on + off)


def test_ends_are_drawn_by_the_root_of_their_likelihood_and_weighed_by_the_rest():
    path, count = path_of(0.1, 0.1, 1.7, 1.7).moved(MotionStep(3.0, 1.7)), 20_000
    ends = ends_of_path(AREA, WEIGHTS, path, TURNS, count, np.random.default_rng(3))
    turned, prior, width = TURNS
    expected = {
        (turn, point): weighed_by_hand(path, point, turned[turn])
        for turn in range(3) for point in POINTS
    }  # fmt: skip
    nats = {key: value[0] + prior[key[0]] for key, value in expected.items()}
    # None is so unlikely that it is left out.
    assert max(nats.values()) - min(nats.values()) < 10
    drawn_by = {key: exp(0.5 * one) for key, one in nats.items()}
    total = sum(exp(0.5 * one) * exp(0.5 * one) / sum(drawn_by.values()) for one in nats.values())
    turn_of = np.abs(ends.turned_rad[:, None] - turned).argmin(axis=1)
    col = (ends.place_m[0] / PIXEL_M).astype(int)
    row = ROWS - 1 - (ends.place_m[1] / PIXEL_M).astype(int)
    for (turn, point), one in nats.items():
        own = (turn_of == turn) & (row == point[0]) & (col == point[1])
        share = drawn_by[turn, point] / sum(drawn_by.values())
        assert abs(own.sum() - count * share) < 2.5
        np.testing.assert_allclose(
            ends.log_weight[own], 0.5 * one - log(total) - log(count), atol=2e-3
        )
        np.testing.assert_allclose(ends.off[own], expected[turn, point][1], rtol=1e-3)
    assert np.exp(ends.log_weight).sum() == pytest.approx(1.0)
    # Spread evenly over their pixels, and over the grid's spacing.
    middle_m = np.stack([(col + 0.5) * PIXEL_M, (ROWS - row - 0.5) * PIXEL_M])
    beside = [*(ends.place_m - middle_m) / PIXEL_M, (ends.turned_rad - turned[turn_of]) / width]
    for one in beside:
        assert np.abs(one).max() <= 0.5 + 1e-5
        assert abs(one.mean()) < 5 / (12 * count) ** 0.5
        assert one.var() == pytest.approx(1 / 12, rel=0.03)


def test_ends_that_are_much_less_probable_are_left_out():
    """Below the best of all by 14 nats."""
    turned, _, width = TURNS
    path = path_of(0.1, 0.1, 1.7, 1.7)
    best, other = (
        max(weighed_by_hand(path, point, turned[turn])[0] for point in POINTS for turn in turns)
        for turns in ((0,), (1, 2))
    )
    for below, count, there in ((6.0, 4000, True), (13.8, 200_000, True), (14.2, 200_000, False)):
        worse = other - best + below
        turns = turned, np.array([0.0, -worse, -worse]), width
        ends = ends_of_path(AREA, WEIGHTS, path, turns, count, np.random.default_rng(3))
        others = np.abs(ends.turned_rad - turned[0]) > width
        assert others.any() == there


def test_ends_are_drawn_alike_however_improbable_all_of_them_are():
    turned, prior, width = TURNS
    path = path_of(0.1, 0.1, 1.7)
    found = [
        ends_of_path(
            AREA, WEIGHTS, path, (turned, prior - by, width), 500, np.random.default_rng(1)
        )
        for by in (0.0, 3000.0)
    ]
    for ends in found:
        assert np.exp(ends.log_weight).sum() == pytest.approx(1.0)
    same = np.abs(found[0].place_m - found[1].place_m).max(axis=0) < 1e-3
    assert same.mean() > 0.95
    np.testing.assert_allclose(found[0].log_weight[same], found[1].log_weight[same], atol=0.01)


@pytest.mark.parametrize(
    ("sd_rad", "step_rad"), [(0.2, radians(3.0)), (0.12, radians(3.0)), (0.06, 0.03), (1e-9, 1e-6)]
)
def test_errors_of_a_compass_to_three_deviations(sd_rad, step_rad):
    turned, prior, width = possible_turns_rad(sd_rad, compass=True)
    assert width == pytest.approx(step_rad)
    side = ceil(3 * sd_rad / step_rad)
    np.testing.assert_allclose(turned, step_rad * np.arange(-side, side + 1))
    np.testing.assert_allclose(prior, -0.5 * (turned / max(sd_rad, 1e-6)) ** 2)
    assert turned[-1] >= 3 * sd_rad


def test_without_a_compass_all_directions_are_alike():
    turned, prior, width = possible_turns_rad(0.2, compass=False)
    assert turned.size == 120
    assert width == pytest.approx(radians(3.0))
    np.testing.assert_allclose(turned, -pi + radians(3.0) * np.arange(120), atol=1e-12)
    np.testing.assert_array_equal(prior, np.zeros(120))


@pytest.mark.parametrize("bend_rad", [0.05, 0.06, 1.0, -1.0, 3.0])
def test_bends_add_up_without_those_of_straight_legs(bend_rad):
    """Three degrees of each bend do not count; angles wrap."""
    path = path_of(*(bend_rad * k for k in range(5)))
    each = max(abs(bend_rad) - radians(3.0), 0.0)
    assert path.turned_rad == pytest.approx(4 * each, abs=1e-9)
    assert path_of(2.9, -2.9).turned_rad == pytest.approx(2 * pi - 5.8 - radians(3.0))


def test_points_of_a_path_are_those_of_the_last_fifty_metres():
    path = RecentPath()
    for k in range(37):
        path = path.moved(MotionStep(2.0, 0.0))
        assert len(path.points) == min((k + 1) // 3 + 1, 11)
        assert path.here.travelled_m == 2.0 * (k + 1)
        assert path.whole == (path.here.travelled_m - path.points[0].travelled_m >= 50)
    assert [point.travelled_m for point in path.points] == [12.0 + 6.0 * k for k in range(11)]
    assert path_of(*[0.0] * 9).whole is False
    assert path_of(*[0.0] * 10).whole is True
    assert path_of(*[0.0] * 30).points[0].travelled_m == 100.0


def test_what_begins_a_path_anew():
    path = path_of(0.0, 1.0)
    assert path.moved(MotionStep(0.0, nan)) is path
    for step in (MotionStep(nan, 0.0), MotionStep(1.0, nan), MotionStep(-1.0, nan)):
        assert path.moved(step) == RecentPath()
    assert RecentPath().points == (DeadReckoning(),)
    back = path.moved(MotionStep(-5.0, 1.0))
    assert back.here.travelled_m == 15.0
    assert (back.here.east_m, back.here.north_m) == pytest.approx((5.0, 0.0))


def test_the_mirrored_path_has_its_norths_negated():
    path = replace(path_of(0.3, 1.0, 2.0), turned_rad=1.25).moved(MotionStep(1.0, 2.0))
    other = path.mirrored
    assert other.here.north_m == -path.here.north_m
    assert other.here.east_m == path.here.east_m
    assert [p.north_m for p in other.points] == [-p.north_m for p in path.points]
    assert [p.east_m for p in other.points] == [p.east_m for p in path.points]
    assert other.turned_rad == path.turned_rad
    here = np.array([path.here.east_m, path.here.north_m])
    expected = [np.array([p.east_m, p.north_m]) - here for p in path.points]
    np.testing.assert_allclose(path.earlier_m, expected, atol=1e-6)
    assert path.earlier_m.dtype == np.float32
