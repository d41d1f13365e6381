"""Walkers beside the centre line, who keep out of buildings and stop now and then."""

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.lattice import Lattice
from mapfilter.simulation.journeys import JourneyPlan, journey
from mapfilter.simulation.routes import Route
from mapfilter.simulation.walking import WalkerModel, inside_buildings, path_beside, with_stops

NEVER_M = 1e9
CLASSES = {
    "motorway": 14.0,
    "primary": 9.0,
    "secondary": 8.0,
    "tertiary": 6.5,
    "residential": 5.0,
    "living_street": 2.5,
    "pedestrian": 3.0,
    "service": 2.0,
    "footway": 0.5,
    "steps": 0.5,
    "bridleway": 3.0,
}


def route_of(east_m, north_m, names=("residential",), way_class=None):
    ways = len(east_m) - 1
    return Route(
        np.asarray(east_m, dtype=float),
        np.asarray(north_m, dtype=float),
        np.arange(ways) + 10,
        np.asarray(way_class or [0] * ways, dtype=np.int16),
        tuple(names),
    )


def path(along, seed=1, inside=None, **model):
    model = {"beside": "pavement", "change_side_m": NEVER_M, **model}
    return path_beside(along, WalkerModel(**model), np.random.default_rng(seed), inside)


@pytest.mark.parametrize(("name", "beside_m"), CLASSES.items())
def test_the_pavement_of_a_class_of_way(name, beside_m):
    walked = path(route_of([0, 300], [0, 0], [name]))
    np.testing.assert_allclose(np.abs(walked.north_m), beside_m, atol=1e-6)
    np.testing.assert_allclose(walked.east_m[20:-20], walked.distance_m[20:-20], atol=1e-6)


def test_metres_beside_every_way():
    along = route_of([0, 300, 600], [0, 0, 0], ["footway", "primary"], [0, 1])
    np.testing.assert_allclose(np.abs(path(along, beside=8.0).north_m), 8.0, atol=1e-6)
    by_class = np.abs(path(along).north_m)
    np.testing.assert_allclose(by_class[:280], 0.5, atol=0.01)
    np.testing.assert_allclose(by_class[-280:], 9.0, atol=0.01)
    # From one to the other over about ten metres.
    assert 8 < np.sum((by_class > 1.0) & (by_class < 8.5)) < 16


def test_the_offset_is_perpendicular_whatever_the_direction():
    for angle in np.radians([30.0, 135.0, 250.0]):
        along = route_of([0, 200 * np.cos(angle)], [0, 200 * np.sin(angle)])
        walked = path(along)
        across = -np.sin(angle) * walked.east_m + np.cos(angle) * walked.north_m
        ahead = np.cos(angle) * walked.east_m + np.sin(angle) * walked.north_m
        np.testing.assert_allclose(np.abs(across), 5.0, atol=1e-6)
        np.testing.assert_allclose(ahead[20:-20], walked.distance_m[20:-20], atol=1e-6)


def test_round_a_corner_one_stays_on_ones_side():
    walked = path(route_of([0, 100, 100], [0, 0, 100]))
    side = np.sign(walked.north_m[50])
    assert walked.north_m[50] == pytest.approx(5.0 * side, abs=1e-6)
    assert walked.east_m[150] == pytest.approx(100.0 - 5.0 * side, abs=1e-6)
    # The inner corner is short, the outer one long, by less than the offset on each way.
    assert abs(walked.walked_m[-1] - (200.0 - 10.0 * side)) < 6.0


def test_either_side_is_as_likely_and_walks_differ():
    along = route_of([0, 50], [0, 0])
    left = [path(along, seed).north_m[25] > 0 for seed in range(400)]
    assert abs(np.mean(left) - 0.5) < 4 * 0.5 / np.sqrt(400)


def test_the_street_is_crossed_after_its_mean_distance():
    along = route_of([0, 3000], [0, 0])
    crossings = [
        np.sum(np.diff(np.sign(path(along, seed, change_side_m=150.0).north_m)) != 0)
        for seed in range(60)
    ]
    # Two crossings within some ten metres cancel: each is missed with probability 10 / 150 or so.
    expected = 3000 / 150
    assert 0.85 * expected < np.mean(crossings) < expected + 4 * np.sqrt(expected / 60)


def wall(from_m, clear_m):
    """Buildings on both sides beyond some metres, from some place on."""

    def inside(east_m, north_m):
        return (east_m >= from_m) & (np.abs(north_m) > clear_m)

    return inside


def test_between_walls_one_walks_closer_to_the_centre_line():
    along = route_of([0, 300], [0, 0])
    # Of 5 m, three quarters would be 3.75 m.
    narrow = np.abs(path(along, inside=wall(-1e9, 3.0)).north_m)
    np.testing.assert_allclose(narrow, 2.5, atol=1e-6)
    np.testing.assert_allclose(path(along, inside=wall(-1e9, 1.0)).north_m, 0.0, atol=1e-6)
    np.testing.assert_allclose(np.abs(path(along, inside=wall(-1e9, 5.1)).north_m), 5.0, atol=1e-6)


def test_where_walls_begin_one_has_come_closer():
    inside = wall(150.0, 3.0)
    walked = path(route_of([0, 300], [0, 0]), inside=inside)
    assert abs(walked.north_m[100]) == pytest.approx(5.0, abs=1e-3)
    assert abs(walked.north_m[200]) == pytest.approx(2.5, abs=1e-3)
    in_walls = inside(walked.east_m, walked.north_m)
    # At most two metres along the corner of a house.
    assert in_walls.sum() <= 2


def test_behind_a_narrow_building_one_does_not_walk_either():
    """No share of the offset counts that has a building between it and the centre line."""

    def inside(_, north_m):
        return (np.abs(north_m) > 2.0) & (np.abs(north_m) < 3.0)

    walked = path(route_of([0, 100], [0, 0]), inside=inside)
    np.testing.assert_allclose(np.abs(walked.north_m), 1.25, atol=1e-6)


def test_buildings_on_a_lattice():
    heights = np.zeros((2, 3), dtype=np.float32)
    heights[0, 2] = 9.0
    inside = inside_buildings(heights, Lattice("EPSG:32629", 500_000.0, 20.0, 10.0, 2, 3))
    east = np.array([500_025.0, 500_015.0, 500_025.0, 500_035.0, 500_025.0])
    assert inside(east, np.array([15.0, 15, 5, 15, 25])).tolist() == [True, *[False] * 4]


def test_the_truth_keeps_its_speed_and_its_way():
    along = route_of([0, 100, 100], [0, 0, 100])
    plan = JourneyPlan(walker=WalkerModel("pavement", change_side_m=50.0))
    truth = journey(along, plan, np.random.default_rng(2))
    step_m = np.hypot(np.diff(truth["east_m"]), np.diff(truth["north_m"]))
    assert step_m.max() <= 1.4 + 1e-9
    assert np.mean(step_m > 1.35) > 0.9
    at_start = truth["way_id"].to_numpy()[: len(truth) // 3]
    assert set(at_start) == {10}
    assert truth["way_id"].iloc[-1] == 11
    with pytest.raises(ValueError, match="rng"):
        journey(along, plan)


def test_a_walker_on_the_centre_line_cuts_no_corners():
    corner = Route(
        np.array([0.0, 40.0, 40.0]),
        np.array([0.0, 0.0, 30.0]),
        np.array([1, 2]),
        np.zeros(2, dtype=np.int16),
        ("residential",),
    )
    path = path_beside(corner, WalkerModel(stop_every_m=100.0), np.random.default_rng(0))
    assert path.walked_m[-1] == path.distance_m[-1] == 70.0
    at = np.flatnonzero(path.distance_m == 40.0)
    assert (path.east_m[at].item(), path.north_m[at].item()) == (40.0, 0.0)
    assert np.all((path.north_m == 0) | (path.east_m == 40.0))


def test_a_walker_on_the_centre_line_needs_no_draws():
    along = route_of([0, 100, 100], [0, 0, 100])
    plain = journey(along, JourneyPlan())
    for model in (WalkerModel(), WalkerModel(0.0)):
        drawn = journey(along, JourneyPlan(walker=model), np.random.default_rng(2))
        assert drawn.equals(plain)
    np.testing.assert_allclose(np.minimum(plain["north_m"], 100.0 - plain["east_m"]), 0.0)


def test_stops_by_hand():
    walker = WalkerModel(stop_every_m=1.0, stop_s=20.0)

    class Draws:
        """Two stops, at 30 m for 5 s and at 70 m for 7 s, drawn out of order."""

        def poisson(self, mean):
            assert mean == 100.0
            return 2

        def uniform(self, low, high, count):
            assert (low, high, count) == (0.0, 100.0, 2)
            return np.array([70.0, 30.0])

        def exponential(self, mean, count):
            assert (mean, count) == (20.0, 2)
            return np.array([5.0, 7.0])

    place_m, time_s = with_stops(np.array([0.0, 100.0]), np.array([0.0, 50.0]), walker, Draws())
    np.testing.assert_allclose(place_m, [0, 30, 30, 70, 70, 100])
    np.testing.assert_allclose(time_s, [0, 15, 20, 40, 47, 62])


def test_stops_come_as_often_and_last_as_long_as_stated():
    along = route_of([0, 1940], [0, 0])
    plan = JourneyPlan(walker=WalkerModel(stop_every_m=300.0, stop_s=20.0))
    count, stood_s, stops = 300, [], []
    for seed in range(count):
        truth = journey(along, plan, np.random.default_rng(seed))
        still = np.diff(truth["east_m"]) == 0
        stood_s.append(truth["time_s"].iloc[-1] - 1385.0)
        stops.append(np.sum(np.diff(still.astype(int)) == 1))
    mean = 1940 / 300
    # A sum of Poisson many exponential times has the variance 2 · number · duration².
    assert abs(np.mean(stood_s) - 20 * mean) < 4 * 20 * np.sqrt(2 * mean / count)
    # Stops of less than one or two seconds are not seen between the ticks.
    assert 0.85 * mean < np.mean(stops) < mean + 4 * np.sqrt(mean / count)


def test_without_stops_nothing_changes():
    given = np.array([0.0, 50.0]), np.array([0.0, 40.0])
    assert with_stops(*given, WalkerModel(), np.random.default_rng(0)) == given


def test_what_a_walker_cannot_be():
    with pytest.raises(ConfigError) as caught:
        WalkerModel("grass", change_side_m=0.0, stop_every_m=-1.0, stop_s=np.nan)  # type: ignore[arg-type]
    for part in (
        "'centre', 'pavement', or a number in 0..50",
        "change_side_m",
        "stop_every_m",
        "stop_s",
    ):
        assert part in str(caught.value)
    with pytest.raises(ConfigError, match=r"a number in 0\.\.50"):
        WalkerModel(51.0)
