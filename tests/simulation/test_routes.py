"""Routes keep to the streets, to their direction and to the exact length."""

from itertools import pairwise

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.simulation.routes import Route, route


def rng(seed):
    return np.random.default_rng(seed)


def nodes_of(path, network):
    """The network's nodes under a route's corners but the last, which is a cut."""
    away = np.hypot(
        path.east_m[:-1, None] - network.east_m, path.north_m[:-1, None] - network.north_m
    )
    assert away.min(axis=1).max() == 0
    return away.argmin(axis=1)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("length_m", [5.0, 300.0, 1940.0, 6000.0])
def test_length_is_exact_and_every_segment_is_a_street(town, seed, length_m):
    path = route(town, length_m, rng(seed))
    assert path.length_m == pytest.approx(length_m, abs=1e-6)
    nodes = nodes_of(path, town)
    ends = {frozenset(e): i for i, e in enumerate(zip(town.node_a, town.node_b, strict=True))}
    for i, pair in enumerate(pairwise(nodes)):
        edge = ends[frozenset(pair)]
        assert path.way_id[i] == town.way_id[edge]
        assert path.way_class[i] == town.way_class[edge]
    last = np.flatnonzero(town.way_id == path.way_id[-1])[0]
    assert nodes[-1] in (town.node_a[last], town.node_b[last])
    a, b = town.node_a[last], town.node_b[last]
    along = (path.east_m[-1] - town.east_m[a]) * (town.north_m[b] - town.north_m[a])
    across = (path.north_m[-1] - town.north_m[a]) * (town.east_m[b] - town.east_m[a])
    assert along == pytest.approx(across, abs=1e-3)


@pytest.mark.parametrize("seed", range(20))
def test_no_turning_back_on_the_spot_in_a_town(town, seed):
    nodes = nodes_of(route(town, 8000.0, rng(seed)), town)
    assert (nodes[2:] != nodes[:-2]).all()


def test_real_turns(town):
    """A route of two kilometres over 100 m blocks is no straight line."""
    turns = []
    for seed in range(20):
        path = route(town, 1940.0, rng(seed))
        heading = np.unwrap(np.arctan2(np.diff(path.north_m), np.diff(path.east_m)))
        turns.append(np.sum(np.abs(np.diff(heading)) > np.radians(45)))
    assert np.mean(turns) > 3


def test_equal_seeds_equal_routes_and_others_differ(town):
    one, same, other = (route(town, 1000.0, rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.east_m, same.east_m)
    assert one.east_m[0] != other.east_m[0] or one.east_m.size != other.east_m.size


def test_routes_begin_all_over_the_town(town):
    starts = [route(town, 100.0, rng(seed)) for seed in range(200)]
    east = np.array([path.east_m[0] - 530000 for path in starts])
    # Uniform over 1400 m: four standard errors of the mean.
    assert abs(east.mean() - 700) < 4 * 1400 / np.sqrt(12 * 200)


def test_legs_are_shortest_paths_to_goals_in_reach(town):
    """Until its first goal a route is a shortest path, hence it gets 300 m away without detour."""
    from scipy.sparse.csgraph import dijkstra

    for seed in range(10):
        path = route(town, 1940.0, rng(seed))
        nodes = nodes_of(path, town)
        away = np.hypot(path.east_m - path.east_m[0], path.north_m - path.north_m[0])[:-1]
        reach = int(np.argmax(away >= 300))
        shortest = dijkstra(town.adjacency, indices=nodes[0])
        assert path.corner_m[reach] == pytest.approx(shortest[nodes[reach]])


def test_a_dead_end_is_left_the_way_one_came(network_of):
    line = network_of([0, 400], [0, 0], [(0, 1)])
    path = route(line, 1000.0, rng(0))
    assert path.length_m == 1000.0
    np.testing.assert_array_equal(path.north_m, 0)
    assert set(path.east_m[:-1].tolist()) == {0.0, 400.0}


def test_a_ring_with_dead_ends_is_walked_round(network_of):
    """A square of 400 m with a side street of 300 m at each corner: goals lie on the square."""
    east = [0, 400, 400, 0, -300, 700, 700, -300, -150, 550, 550, -150]
    north = [0, 0, 400, 400, 0, 0, 400, 400, 0, 0, 400, 400]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0)]
    edges += [(i, 8 + i) for i in range(4)] + [(8 + i, 4 + i) for i in range(4)]
    ring = network_of(east, north, edges)
    for seed in range(20):
        nodes = nodes_of(route(ring, 6000.0, rng(seed)), ring)
        inside = nodes[np.argmax(nodes < 4) :]
        assert (inside < 4).all()
        assert (inside[2:] != inside[:-2]).all()


def test_a_network_smaller_than_a_leg(network_of):
    block = network_of([0, 50, 50, 0], [0, 0, 50, 50], [(0, 1), (1, 2), (2, 3), (3, 0)])
    assert route(block, 1940.0, rng(0)).length_m == pytest.approx(1940.0)


def test_one_way_streets_are_kept(network_of):
    corners = [0, 400, 400, 0], [0, 0, 400, 400]
    edges = [(0, 1), (1, 2), (3, 2), (3, 0)]
    # Anticlockwise only: the third street is drawn against its direction.
    ring = network_of(*corners, edges, oneway=[1, 1, -1, 1])
    for seed in range(10):
        path = route(ring, 4000.0, rng(seed))
        assert (np.diff(nodes_of(path, ring)) % 4 == 1).all()
        assert (np.diff(path.way_id) % 4 == 1).all()


def test_no_way_on_is_an_error(network_of):
    away = network_of([0, 400], [0, 0], [(0, 1)], oneway=[1])
    with pytest.raises(InputError, match="dead ends of one-way streets"):
        route(away, 1000.0, rng(0))


def test_an_empty_network_is_an_error(network_of):
    with pytest.raises(InputError, match="at least one street"):
        route(network_of([], [], []), 1000.0, rng(0))


def test_places_along_a_route_by_hand():
    path = Route(
        np.array([0.0, 3.0, 3.0]),
        np.array([0.0, 4.0, 14.0]),
        np.array([7, 8]),
        np.array([0, 0], dtype=np.int16),
        ("residential",),
    )
    assert path.corner_m.tolist() == [0, 5, 15]
    east, north, way_id = path.at([0.0, 2.5, 5.0, 10.0, 15.0, 99.0])
    np.testing.assert_allclose(east, [0, 1.5, 3, 3, 3, 3])
    np.testing.assert_allclose(north, [0, 2, 4, 9, 14, 14])
    assert way_id.tolist() == [7, 7, 8, 8, 8, 8]
