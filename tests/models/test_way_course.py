"""Courses along ways, where nothing measures directions."""

from itertools import pairwise

import numpy as np
import pytest

from mapfilter.models.street_motion import BIAS, EAST, NORTH, RATE, TURN, MotionErrors, move
from mapfilter.models.way_course import _choose, with_courses
from mapfilter.models.way_map import map_log_likelihood

ERRORS = MotionErrors(
    step_sd_m=0.05,
    heading_sd_rad=0.026,
    bias_drift_rad_per_sqrt_m=0.0005,
    disturbances_per_m=0.0,
    rate_rad_per_m=0.0,
    stretch_sd=0.02,
    corners_per_m=1 / 20,
)
COUNT, LEG_M, HALF_WIDTH_M = 4000, 12.0, 3.0


def on_ways(*ways):
    """Return the map of straight streets, each from one place to another."""
    ends = np.array(ways, dtype=float)

    def log_map_at(places_m):
        start, along = ends[:, 0, :, None], (ends[:, 1] - ends[:, 0])[:, :, None]
        away = places_m[None].astype(float) - start
        share = np.clip((away * along).sum(1) / (along**2).sum(1), 0, 1)
        distance_m = np.linalg.norm(away - share[:, None] * along, axis=1).min(axis=0)
        return map_log_likelihood(np.float32(np.maximum(distance_m - HALF_WIDTH_M, 0)), 3.0)

    return log_map_at


def at(east_m, north_m, course_rad):
    state = np.zeros((8, COUNT), dtype=np.float32)
    state[EAST], state[NORTH], state[BIAS] = east_m, north_m, course_rad
    return state


def driven(state, way_m, log_map_at, errors=ERRORS):
    for number in range(round(way_m / LEG_M)):
        key = np.uint64(7919 * number + 13)
        state = with_courses(state, LEG_M, errors, log_map_at, key)
        state = move(state, LEG_M, 0.0, errors, key)
    return state


@pytest.mark.parametrize("course_rad", [0.0, 0.7, -2.0])
def test_a_straight_road_is_followed(course_rad):
    """Without turns to all sides the spread would be 500 m after a kilometre."""
    far = 3000 * np.array([np.cos(course_rad), np.sin(course_rad)])
    found = driven(at(0, 0, course_rad), 1008, on_ways((-far, far)))
    along = np.cos(course_rad) * found[EAST] + np.sin(course_rad) * found[NORTH]
    across = np.cos(course_rad) * found[NORTH] - np.sin(course_rad) * found[EAST]
    assert np.quantile(np.abs(across), 0.95) < HALF_WIDTH_M + 5
    # At 5e-5 a metre one of twenty turned round, and a few more by two corners.
    assert 0.85 < np.mean(along > 900) < 0.97
    assert np.median(along) == pytest.approx(1000, abs=30)


def test_a_bend_costs_no_hypotheses():
    angles = np.radians(np.arange(0, 91, 6))
    places = [200 * np.array([np.sin(a), 1 - np.cos(a)]) for a in angles]
    bend = [*pairwise(places), ((-500, 0), (0, 0)), ((200, 200), (200, 900))]
    found = driven(at(-300, 0, 0.0), 900, on_ways(*bend))
    assert np.mean(np.hypot(found[EAST] - 200, found[NORTH] - 486) < 60) > 0.8


def test_at_a_crossing_each_way_is_taken_by_many():
    found = driven(at(-200, 0, 0.0), 400, on_ways(((-900, 0), (900, 0)), ((0, -900), (0, 900))))
    ahead, left, right = (
        np.mean(np.hypot(found[EAST] - east, found[NORTH] - north) < 60)
        for east, north in ((200, 0), (0, 200), (0, -200))
    )
    assert ahead + left + right > 0.9
    assert left == pytest.approx(right, abs=0.05)
    assert 0.1 < left < 0.45
    assert ahead > 0.2


def test_at_a_dead_end_it_comes_back():
    """Most are on the road again, back, half a kilometre later."""
    found = driven(at(-200, 0, 0.0), 600, on_ways(((-900, 0), (0, 0))))
    assert np.mean((found[EAST] < -250) & (np.abs(found[NORTH]) < 12)) > 0.5


def test_backwards_it_stays_on_the_road():
    """Which of its ends a vehicle reverses to is behind it."""
    state, road = at(0, 0, 0.0), on_ways(((-900, 0), (2, 0)))
    for number in range(10):
        key = np.uint64(31 * number + 5)
        state = move(with_courses(state, -LEG_M, ERRORS, road, key), -LEG_M, 0.0, ERRORS, key)
    assert np.mean((state[EAST] < -100) & (np.abs(state[NORTH]) < 12)) > 0.9


def test_draws_follow_the_key_and_inputs_stay():
    state = at(0, 0, 0.3)
    state[[TURN, RATE]] = 0.1
    before, road = state.copy(), on_ways(((-900, 0), (900, 0)))
    first, again, other = (
        with_courses(state, LEG_M, ERRORS, road, np.uint64(key)) for key in (5, 5, 6)
    )
    np.testing.assert_array_equal(state, before)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    # There is no gyroscope, and the course has no deviation besides.
    assert not first[[TURN, RATE]].any()
    np.testing.assert_array_equal(first[[EAST, NORTH]], before[[EAST, NORTH]])
    assert np.abs(first[BIAS]).max() <= np.float32(np.pi)


def test_without_any_way_courses_are_as_usual():
    """Bends, corners and turns with the shares that the errors state."""

    def nothing(places_m):
        return np.full(places_m.shape[1], -3.0, dtype=np.float32)

    turned = with_courses(at(0, 0, 0.0), LEG_M, ERRORS, nothing, np.uint64(3))[BIAS]
    aside = 1 - np.exp(-LEG_M / 20)
    corner = (np.abs(turned) > np.radians(20)) & (np.abs(turned) < np.radians(121))
    assert np.mean(corner) == pytest.approx(aside, abs=0.03)
    bend_rad = ERRORS.bend_rad_per_sqrt_m * np.sqrt(LEG_M)
    straight = turned[np.abs(turned) < np.radians(20)]
    assert np.std(straight) == pytest.approx(bend_rad, rel=0.1)


@pytest.mark.parametrize(
    ("others", "on_way"),
    [(-0.25, ()), (-0.25, (0, 5, 6, 13)), (-0.25, (4, 12)), (-6.0, (4,)), (-50.0, (4,))],
)
def test_each_course_has_its_share(others, on_way):
    """The usual one of its kind, times the cube of the map's likelihood half and all the way."""
    count, aside, around = 100_000, 0.4, 0.2
    usual = np.array([0.6 * 0.8 / 5] * 5 + [0.4 / 8] * 8 + [0.6 * 0.2])
    log_map = np.full((14, 2), [others - 0.25, others], dtype=np.float32)
    log_map[list(on_way)] = [0.0, -0.1] if others > -1 else -5.9
    # Far from all ways none is less likely than by six.
    weight = usual * np.exp(3 * np.maximum(log_map.mean(axis=1), -6))
    course = np.tile(np.arange(14, dtype=np.float32), (count, 1))
    chosen = np.empty(count, dtype=np.float32)
    drawn = np.tile(log_map.ravel(), count)
    _choose(course, drawn, aside, around, np.uint64(5), chosen)
    share = np.bincount(chosen.astype(int), minlength=14) / count
    # Five standard errors.
    np.testing.assert_allclose(share, weight / weight.sum(), atol=5 * (0.15 / count) ** 0.5)
