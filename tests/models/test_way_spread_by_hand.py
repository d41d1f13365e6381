"""Steps to all sides: from the places that are drawn, which one is taken and what it tells."""

from math import exp, sqrt

import numpy as np
import pytest

from mapfilter.models.street_motion import EAST, NORTH, OFF, STATES
from mapfilter.models.way_map import MapWeights
from mapfilter.models.way_spread import spread_along_ways, ways_exponent

SIZE_M, DENSITY, FALLS_M, PLACES = (900.0, 600.0), 0.04, 300.0, 8
WEIGHTS = MapWeights(weight_per_m=0.1, leave_per_m=0.01, return_per_m=0.05)
ALL_SIDES_M, LENGTH_M = 60.0, -10.0


def spread(state, log_map_at, key=1, all_sides_m=ALL_SIDES_M):
    """Return hypotheses after a step, and the places (2, N, 8) that were looked at."""
    seen = []

    def noted(places):
        seen.append(places.copy())
        return log_map_at(places)

    moved = spread_along_ways(
        state, all_sides_m, LENGTH_M, WEIGHTS, noted, SIZE_M, (DENSITY, FALLS_M), np.uint64(key)
    )
    (places,) = seen
    return moved, places.reshape(2, -1, PLACES).astype(np.float64)


def at(east_m, north_m, off):
    state = np.zeros((STATES + 1, len(east_m)), dtype=np.float32)
    state[EAST], state[NORTH], state[OFF] = east_m, north_m, off
    return state


def rugged(places_m):
    """A map of which some places are as good as impossible."""
    return (-4.0 * (1 + np.sin(places_m[0] / 7) * np.cos(places_m[1] / 11))).astype(np.float32) - (
        places_m[0] > 880
    ) * np.float32(80)


def rated(places, before):
    """Return the weight of each place, and the probability of being off the map there."""
    share = ALL_SIDES_M**2 / (ALL_SIDES_M**2 + 200.0)
    power = 0.1 * 12.0 * (1 + share) / 2
    aside_m = np.maximum(np.maximum(-places[0], places[0] - 900.0), 0)
    ahead_m = np.maximum(np.maximum(-places[1], places[1] - 600.0), 0)
    far_m = np.hypot(aside_m, ahead_m)
    inside = far_m == 0
    fit = np.exp(np.maximum(power * rugged(places), -25.0))
    mean = np.where(inside, fit, 0).sum(axis=1) / np.maximum(inside.sum(axis=1), 1)
    away = (before * exp(-0.5) + (1 - before) * (1 - exp(-0.1)))[:, None]
    at_way = (1 - away) * fit / np.where(mean > 0, mean, 1)[:, None] + away
    # Beyond the area its density counts, as a root.
    beyond = sqrt(DENSITY) * np.exp(np.maximum(-far_m / (2 * FALLS_M), -25.0))
    weight = np.where(inside, at_way, beyond)
    return weight, np.where(inside, away / at_way, away), inside


@pytest.fixture(scope="module")
def step():
    rng = np.random.default_rng(8)
    count = 30_000
    # All over the area, many at its four edges, some far beyond.
    east_m, north_m = rng.uniform(-40, 940, count), rng.uniform(-40, 640, count)
    east_m[:300] -= 20_000
    state = at(east_m, north_m, rng.uniform(0, 1, count).astype(np.float32))
    moved, places = spread(state, rugged)
    match = (places[0] == moved[EAST, :, None]) & (places[1] == moved[NORTH, :, None])
    return state, moved, places, match


def test_one_of_its_own_places_is_taken(step):
    _, _, _, match = step
    assert (match.sum(axis=1) == 1).all()


def test_a_place_is_taken_by_its_share(step):
    state, _, places, match = step
    weight, _, inside = rated(places, state[OFF].astype(np.float64))
    share = weight / weight.sum(axis=1, keepdims=True)
    # Some statistics that any other share, or another order of them, changes.
    for value in (np.arange(8.0) + 0 * share, (np.arange(8) == 7) + 0 * share, share,
                  np.log(weight), ~inside * 1.0, np.maximum(places[0] - 900, 0)):  # fmt: skip
        expected = (share * value).sum(axis=1)
        spare = (share * value**2).sum(axis=1) - expected**2
        found = value[match]
        assert abs((found - expected).sum()) < 4 * sqrt(spare.sum())
    # Neighbours draw on their own.
    rank = (share.cumsum(axis=1) - share / 2)[match]
    for apart in (1, 2, 9):
        assert abs(np.corrcoef(rank[:-apart], rank[apart:])[0, 1]) < 4 / sqrt(len(rank))


def test_the_probability_of_being_off_the_map_is_that_at_the_place(step):
    state, moved, places, match = step
    _, off, inside = rated(places, state[OFF].astype(np.float64))
    np.testing.assert_allclose(moved[OFF], off[match], rtol=1e-4)
    # Both kinds occur.
    assert 0.02 < (~inside[match]).mean() < 0.3


def test_places_are_a_gaussian_about_each_hypothesis(step):
    state, _, places, _ = step
    off_m = places[:, 300:] - state[[EAST, NORTH], 300:, None]
    assert off_m.std(axis=1) == pytest.approx(ALL_SIDES_M / sqrt(2), rel=0.02)
    assert np.abs(off_m.mean(axis=1)).max() < 1.0
    # None of them is that of another hypothesis, or of another place.
    assert np.abs(np.corrcoef(off_m.reshape(2, -1))[0, 1]) < 0.01
    for k in range(1, PLACES):
        assert abs(np.corrcoef(off_m[0, :, 0], off_m[0, :, k])[0, 1]) < 0.03
        assert abs(np.corrcoef(off_m[0, :-1, k], off_m[0, 1:, 0])[0, 1]) < 0.03


@pytest.mark.parametrize(("all_sides_m", "share"), [(0.0, 0.5), (sqrt(200.0), 0.75), (1e6, 1.0)])
def test_the_power_of_the_map(all_sides_m, share):
    """Of short steps a half; the weight of 12 m, however long they are."""
    assert ways_exponent(WEIGHTS, all_sides_m) == pytest.approx(0.1 * 12.0 * share)
