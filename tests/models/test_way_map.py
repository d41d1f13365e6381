"""The weighing by the map in one call is that of its parts."""

import numpy as np
import pytest

from mapfilter.models.street_motion import OFF, STATES
from mapfilter.models.way_map import (
    MapWeights,
    WayMap,
    all_inside,
    interpolate,
    places_beyond,
    weigh_by_map,
    weigh_by_ways,
)

ROWS, COLS, PIXEL_M = 12, 9, 5.0
WIDTH_M, HEIGHT_M = COLS * PIXEL_M, ROWS * PIXEL_M


def hypotheses(rng, count=401):
    state = np.zeros((STATES, count), dtype=np.float32)
    state[0] = rng.uniform(-20.0, WIDTH_M + 20.0, count)
    state[1] = rng.uniform(-20.0, HEIGHT_M + 20.0, count)
    state[OFF] = rng.uniform(0.0, 1.0, count)
    return state


@pytest.mark.parametrize("beyond", [np.nan, -0.18])
def test_one_call_is_look_up_and_weighing(beyond):
    rng = np.random.default_rng(2)
    raster = -rng.uniform(0.0, 5.0, (ROWS, COLS)).astype(np.float32)
    state, log_weight = hypotheses(rng), rng.normal(0.0, 1.0, 401)
    ways, factors = WayMap(raster, PIXEL_M, WIDTH_M, HEIGHT_M), MapWeights().over(1.4)
    moved, given = state.copy(), log_weight.copy()
    weighed = np.empty(401)
    weigh_by_ways(0, 401, moved, ways, factors, beyond, log_weight, weighed)
    np.testing.assert_array_equal(log_weight, given)
    found = interpolate(*state[:2], raster, PIXEL_M / 2, (ROWS - 0.5) * PIXEL_M, 1 / PIXEL_M)
    if np.isfinite(beyond):
        found[places_beyond(*state[:2], WIDTH_M, HEIGHT_M)] = beyond
    weigh_by_map(found, state[OFF], factors, log_weight)
    np.testing.assert_array_equal(weighed, log_weight)
    np.testing.assert_array_equal(moved, state)


def test_what_lies_beyond_an_area():
    east = np.array([0.0, 45.0, 45.1, -0.1, 20.0, 20.0, np.nan], dtype=np.float32)
    north = np.array([0.0, 60.0, 30.0, 30.0, 60.1, -0.1, 30.0], dtype=np.float32)
    beyond = places_beyond(east, north, WIDTH_M, HEIGHT_M)
    assert beyond.tolist() == [False, False, True, True, True, True, False]
    inside = [all_inside(east[k : k + 1], north[k : k + 1], WIDTH_M, HEIGHT_M) for k in range(7)]
    assert inside == [True, True, False, False, False, False, False]
    assert all_inside(east[:2], north[:2], WIDTH_M, HEIGHT_M)
    assert not all_inside(east[:3], north[:3], WIDTH_M, HEIGHT_M)
