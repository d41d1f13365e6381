"""Steps to all sides keep to the ways that there are, and are no evidence for any place."""

from math import inf

import numpy as np
import pytest

from mapfilter.models.street_motion import BIAS, EAST, NORTH, OFF, STATES
from mapfilter.models.way_map import MapWeights
from mapfilter.models.way_spread import density_beyond, spread_along_ways

SIZE_M, BEYOND = (900.0, 900.0), (0.01, 300.0)
WEIGHTS = MapWeights()
COUNT, PLACES = 20_000, 8


def at(east_m, north_m, count=COUNT, off=0.0):
    state = np.zeros((STATES + 1, count), dtype=np.float32)
    state[EAST], state[NORTH], state[OFF] = east_m, north_m, off
    state[BIAS] = np.arange(count)
    return state


def street(places_m):
    """A street along the northing 450, as a map's log-likelihood: 10 m wide."""
    return np.where(np.abs(places_m[1] - 450.0) <= 5.0, 0.0, -3.0).astype(np.float32)


def nothing(places_m):
    return np.zeros(places_m.shape[1], dtype=np.float32)


def spread(state, all_sides_m, log_map_at, *, weights=WEIGHTS, beyond=BEYOND, key=1, length_m=5.0):
    return spread_along_ways(
        state, all_sides_m, length_m, weights, log_map_at, SIZE_M, beyond, np.uint64(key)
    )


def test_without_ways_a_step_leads_to_all_sides_alike():
    moved = spread(at(450.0, 450.0), 30.0, nothing)
    for row in (EAST, NORTH):
        away_m = moved[row] - 450.0
        assert abs(away_m.mean()) < 5 * 30 / 2**0.5 / COUNT**0.5
        assert away_m.std() == pytest.approx(30 / 2**0.5, rel=5 / (2 * COUNT) ** 0.5)
    assert abs(np.corrcoef(moved[EAST], moved[NORTH])[0, 1]) < 5 / COUNT**0.5


def test_it_ends_on_a_way_as_often_as_places_drawn_by_hand_do():
    """Of eight places about a hypothesis one is taken with its share of the map's likelihood."""
    never_off = MapWeights(leave_per_m=0.0)
    moved = spread(at(450.0, 450.0), 30.0, street, weights=never_off)
    rng = np.random.default_rng(5)
    north_m = rng.normal(0.0, 30.0 / 2**0.5, (COUNT, PLACES))
    on = np.abs(north_m) <= 5.0
    power = (1 + 30.0**2 / (30.0**2 + 2 * 10.0**2)) / 2
    weight = np.where(on, 1.0, np.exp(-3.0 * power))
    by_hand = (weight * on).sum(axis=1) / weight.sum(axis=1)
    found = np.abs(moved[NORTH] - 450.0) <= 5.0
    error = 5 * (found.std() + by_hand.std()) / COUNT**0.5
    assert found.mean() == pytest.approx(by_hand.mean(), abs=error)
    assert found.mean() > 0.6 > 0.3 > on.mean()
    assert np.all(moved[OFF] == 0.0)


def test_how_far_it_leads_along_a_way_does_not_depend_on_the_way():
    moved = spread(at(450.0, 450.0), 30.0, street)
    assert (moved[EAST] - 450.0).std() == pytest.approx(30 / 2**0.5, rel=5 / (2 * COUNT) ** 0.5)


def test_a_map_that_weighs_nothing_leads_nowhere():
    blind = MapWeights(weight_per_m=0.0)
    same = spread(at(450.0, 450.0), 30.0, street, weights=blind)
    np.testing.assert_array_equal(same, spread(at(450.0, 450.0), 30.0, nothing, weights=blind))


@pytest.mark.parametrize("log_map_at", [street, nothing])
def test_so_many_are_off_the_map_as_have_left_it_and_not_come_back(log_map_at):
    for before in (0.0, 0.3, 1.0):
        moved = spread(at(450.0, 450.0, off=before), 30.0, log_map_at, length_m=20.0)
        expected = before * np.exp(-0.2) + (1 - before) * (1 - np.exp(-0.02))
        assert moved[OFF].mean() == pytest.approx(expected, rel=0.06)
        assert np.all((moved[OFF] >= 0) & (moved[OFF] <= 1 + 1e-6))


def test_who_ends_beside_all_ways_is_off_the_map_more_probably():
    moved = spread(at(450.0, 450.0), 30.0, street)
    on = np.abs(moved[NORTH] - 450.0) <= 5.0
    assert moved[OFF][on].mean() < 0.003 < 0.01 < moved[OFF][~on].mean()


def test_after_a_long_time_a_few_of_a_hundred_are_beyond_the_area():
    share = 0.02
    rng = np.random.default_rng(2)
    state = at(*rng.uniform(0, 900, (2, 1500)), count=1500)
    beyond, shares = (density_beyond(SIZE_M, share, 300.0), 300.0), []
    for key in range(1000):
        state = spread(state, 60.0, nothing, beyond=beyond, key=key)
        inside = np.all((state[:2] >= 0) & (state[:2] <= 900), axis=0)
        shares.append(1 - inside.mean())
    # More than were there at the start, as a step reaches back from close by.
    assert share < np.mean(shares[300:]) < 4 * share
    # In the area they are everywhere.
    counts, _, _ = np.histogram2d(*state[:2, inside], bins=3, range=[[0, 900]] * 2)
    assert counts.min() > 0.7 * counts.mean()


def test_who_is_beyond_comes_back_where_the_area_is_within_reach():
    moved = spread(at(-20.0, 450.0), 60.0, nothing)
    assert (moved[EAST] >= 0).mean() > 0.7
    far = spread(at(-5000.0, 450.0), 60.0, nothing)
    assert np.all(np.isfinite(far))
    assert np.all(far[EAST] < -4000)
    # Farther out one is less often.
    drift_m = far[EAST].mean() + 5000.0
    assert 0 < drift_m < 2 * (60.0**2 / 2) / 300


def test_far_from_all_ways_nothing_is_lost():
    def far(places_m):
        return np.full(places_m.shape[1], -1e4, dtype=np.float32)

    moved = spread(at(450.0, 450.0), 30.0, far)
    assert np.all(np.isfinite(moved))
    assert (moved[EAST] - 450.0).std() == pytest.approx(30 / 2**0.5, rel=5 / (2 * COUNT) ** 0.5)


def test_other_rows_stay_and_equal_keys_draw_the_same():
    state = at(450.0, 450.0, off=0.2)
    before = state.copy()
    one, same, other = (spread(state, 30.0, street, key=key) for key in (3, 3, 4))
    np.testing.assert_array_equal(state, before)
    np.testing.assert_array_equal(one, same)
    assert np.mean(one[EAST] == other[EAST]) < 0.01
    np.testing.assert_array_equal(one[[BIAS, *range(5, STATES + 1)]],
                                  state[[BIAS, *range(5, STATES + 1)]])  # fmt: skip


@pytest.mark.parametrize("size_m", [(900.0, 900.0), (300.0, 8000.0)])
def test_the_density_beyond_makes_up_its_share(size_m):
    """Summed over squares of 20 m about the area."""
    density, falls_m = density_beyond(size_m, 0.02, 100.0), 100.0
    axes = [np.arange(-2000, side + 2000, 20.0) + 10 for side in size_m]
    east_m, north_m = np.meshgrid(*axes)
    aside, ahead = (
        np.maximum(np.maximum(-x, x - side), 0)
        for x, side in zip((east_m, north_m), size_m, strict=True)
    )
    far_m = np.hypot(aside, ahead)
    beyond = density * np.exp(-far_m[far_m > 0] / falls_m).sum() * 400
    inside = size_m[0] * size_m[1]
    assert beyond / (beyond + inside) == pytest.approx(0.02, rel=0.1)
    assert density < inf
