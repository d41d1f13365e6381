"""Pedestrians of the foreign world: offsets, shortcuts, speeds, pauses, starts."""

from dataclasses import replace

import numpy as np
import pytest
from blocks_town import LATTICE, SIZE, SOUTH_M, WEST_M, ground, streets

from mapfilter.errors import InputError
from mapfilter.simulation.worlds.itinerary import STEP_M, Itinerary, itinerary
from mapfilter.simulation.worlds.shortcuts import off_ways_m, with_shortcuts
from mapfilter.simulation.worlds.street_lines import HALF_WIDTH_M, OFF_MARGIN_M
from mapfilter.simulation.worlds.walkers import (
    PedestrianModel,
    beside_centre_line,
    pedestrian_walk,
)

ON_WAYS = PedestrianModel(off_ways=0.0)
STEADY = replace(ON_WAYS, speed_sd=0.0, speed_wander=0.0, pause_every_m=0.0)


@pytest.fixture(scope="module")
def lines():
    return streets()


@pytest.fixture(scope="module")
def town():
    return ground()


def walked(lines, town, model, seed=0):
    return pedestrian_walk(lines, town, model, np.random.default_rng(seed))


def places(walk):
    return (walk.truth[name].to_numpy() for name in ("east_m", "north_m"))


def moved_m(walk):
    east, north = places(walk)
    return np.hypot(np.diff(east), np.diff(north))


def test_clearances_are_measured_from_the_edges_of_the_ways(lines):
    """In the middle of a block, 50 m from four streets; and 3 m from a residential one."""
    east, north = WEST_M + np.array([300.0, 300.0]), SOUTH_M + np.array([300.0, 253.0])
    residential, secondary = HALF_WIDTH_M["residential"], HALF_WIDTH_M["secondary"]
    expected = [50.0 - max(residential, secondary), 3.0 - residential]
    assert lines.clearance_m(east, north) == pytest.approx(expected)
    assert lines.off_ways(east, north).tolist() == [True, False]


def test_itineraries_are_long_enough_and_on_the_centre_lines(lines):
    for seed in range(10):
        path = itinerary(lines, 1500.0, np.random.default_rng(seed))
        assert path.walked_m[-1] >= 1490.0
        feet = lines.near(path.east_m, path.north_m, 1.0)
        assert set(feet.position) == set(range(path.east_m.size))
        assert feet.distance_m.min() < 1e-6
        assert set(path.half_width_m) <= {HALF_WIDTH_M["residential"], HALF_WIDTH_M["secondary"]}


def test_itineraries_seldom_turn_back(lines):
    turns = 0
    for seed in range(20):
        path = itinerary(lines, 1500.0, np.random.default_rng(seed))
        heading = np.arctan2(np.diff(path.north_m), np.diff(path.east_m))
        turns += int((np.cos(np.diff(heading)) < -0.9).sum())
    assert turns <= 3


def test_offsets_are_within_half_the_width_and_use_all_of_it(lines, town):
    path = itinerary(lines, 1500.0, np.random.default_rng(1))
    used = []
    for seed in range(30):
        beside = beside_centre_line(path, ON_WAYS, town, np.random.default_rng(seed))
        away = np.full(path.east_m.size, np.inf)
        feet = lines.near(beside.east_m, beside.north_m, 30.0)
        np.minimum.at(away, feet.position, feet.distance_m)
        # Smoothed corners add a little.
        assert (away <= np.maximum(path.half_width_m, HALF_WIDTH_M["secondary"]) + 1.0).all()
        used.append(away / path.half_width_m)
    middle = np.concatenate(used)
    assert np.percentile(middle, 90) > 0.75
    assert 0.4 < np.mean(middle) < 0.7


def test_offsets_last_for_tens_of_metres(town):
    along = np.arange(0.0, 30_000.0, STEP_M)
    straight = Itinerary(
        WEST_M + along, np.full(along.size, SOUTH_M + 5e4), np.full(along.size, 6.0)
    )
    beside = beside_centre_line(straight, ON_WAYS, town, np.random.default_rng(2))
    offset = beside.north_m - SOUTH_M - 5e4
    lag = int(60.0 / STEP_M)
    correlation = np.corrcoef(offset[:-lag], offset[lag:])[0, 1]
    assert correlation == pytest.approx(np.exp(-1), abs=0.12)
    assert np.abs(offset).max() <= 6.0


def test_walkers_keep_out_of_houses(lines, town):
    for seed in range(10):
        walk = walked(lines, town, PedestrianModel(off_ways=0.3, off_ways_exactly=True), seed)
        assert town.is_built(*places(walk)).mean() < 0.01


@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
def test_the_share_off_the_ways_is_as_asked(lines, town, share):
    model = PedestrianModel(off_ways=share, off_ways_exactly=True)
    found = [walked(lines, town, model, seed).off_ways for seed in range(12)]
    assert np.mean(found) == pytest.approx(share, abs=0.03)
    assert np.std(found) < 0.05


def test_the_share_is_that_of_the_positions(lines, town):
    model = PedestrianModel(off_ways=0.3, off_ways_exactly=True, pause_every_m=0.0)
    walk = walked(lines, town, model, 3)
    off = lines.off_ways(*places(walk)).mean()
    assert off == pytest.approx(walk.off_ways, abs=0.05)
    assert walk.truth["way_id"].isna().mean() == pytest.approx(off, abs=0.02)


def test_without_open_ground_nobody_leaves_the_ways(lines, town):
    row, col = np.indices(town.open.shape)
    east, north = town.lattice.east_north(row.ravel(), col.ravel())
    way = (lines.clearance_m(east, north) <= OFF_MARGIN_M).reshape(town.open.shape)
    closed = replace(town, open=town.open & way)
    path = itinerary(lines, 2500.0, np.random.default_rng(4))
    found = with_shortcuts(path, 0.3, 1940.0, lines, closed, np.random.default_rng(5))
    assert off_ways_m(found, lines) == 0.0
    assert found.walked_m[-1] == pytest.approx(1940.0, abs=3.0)


def test_the_share_of_a_journey_is_drawn(lines, town):
    model = PedestrianModel(off_ways=0.3)
    found = [walked(lines, town, model, seed).off_ways for seed in range(30)]
    assert np.mean(found) == pytest.approx(0.15, abs=0.07)
    assert np.std(found) > 0.05


def test_every_shortcut_is_continuous(lines, town):
    walk = walked(lines, town, PedestrianModel(off_ways=0.3, off_ways_exactly=True), 6)
    assert moved_m(walk).max() < 4.0


def test_steady_walkers_keep_the_mean_speed(lines, town):
    walk = walked(lines, town, STEADY)
    assert np.median(moved_m(walk)) == pytest.approx(1.34, rel=0.02)


def test_speeds_differ_between_persons_and_change_on_the_way(lines, town):
    model = replace(ON_WAYS, pause_every_m=0.0)
    speeds = [moved_m(walked(lines, town, model, seed)) for seed in range(40)]
    means = [np.median(speed) for speed in speeds]
    assert np.mean(means) == pytest.approx(1.34, abs=4 * 0.17 / np.sqrt(40))
    assert 0.08 < np.std(means) < 0.26
    assert np.mean([np.std(speed) / np.mean(speed) for speed in speeds]) > 0.06


def test_pauses_come_every_so_often_and_last(lines, town):
    model = replace(STEADY, pause_every_m=200.0, pause_s=15.0)
    standing = 0
    for seed in range(20):
        standing += int((moved_m(walked(lines, town, model, seed)) < 0.01).sum())
    expected = 20 * 1940.0 / 200.0 * 15.0 * np.exp(0.6**2 / 2)
    # Poisson numbers of log-normal durations; ticks at both ends are in motion.
    assert standing == pytest.approx(expected, rel=0.3)


def test_starts_indoors(lines, town):
    model = replace(STEADY, start="indoors")
    walk = walked(lines, town, model, 1)
    east, north = places(walk)
    assert (walk.loss_db[:180] == 15.0).all()
    assert town.is_built(east[:170], north[:170]).mean() > 0.5
    assert np.hypot(east[:180] - east[0], north[:180] - north[0]).max() < 6.0
    assert (walk.loss_db[260:] == 0.0).all()
    assert moved_m(walk).max() < 2.5
    assert (np.diff(walk.truth["time_s"]) == 1.0).all()


def test_starts_outside_the_area(lines, town):
    for seed in range(8):
        walk = walked(lines, town, replace(STEADY, start="outside"), seed)
        east, north = places(walk)
        row, col = LATTICE.row_col(east, north)
        inside = LATTICE.contains(row, col)
        first = int(np.argmax(inside))
        assert moved_m(walk)[:first].sum() == pytest.approx(250.0, abs=6.0)
        assert inside[first + 10 :].all()
        assert moved_m(walk).max() < 2.5


def test_walks_have_their_length_and_seconds(lines, town):
    walk = walked(lines, town, replace(STEADY, length_m=800.0), 2)
    assert moved_m(walk).sum() == pytest.approx(800.0, rel=0.01)
    assert (np.diff(walk.truth["time_s"]) == 1.0).all()
    known = set(100 + np.arange(SIZE)) | set(200 + np.arange(SIZE))
    assert set(walk.truth["way_id"].dropna()) <= known


def test_equal_seeds_give_equal_walks(lines, town):
    a, b = (walked(lines, town, PedestrianModel(), 7) for _ in range(2))
    assert a.truth.equals(b.truth)
    assert a.off_ways == b.off_ways
    assert not a.truth.equals(walked(lines, town, PedestrianModel(), 8).truth)


def test_a_map_without_streets_is_refused(lines):
    empty = replace(
        lines.network,
        **{
            name: getattr(lines.network, name)[:0]
            for name in ("node_a", "node_b", "length_m", "way_id", "way_class", "oneway")
        },
    )
    with pytest.raises(InputError, match="street network"):
        itinerary(replace(lines, network=empty), 100.0, np.random.default_rng(0))
