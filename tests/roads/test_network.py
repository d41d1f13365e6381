"""The street network: lengths, one-way streets, walls, and its largest part."""

import numpy as np
import pytest
import shapely
from scipy.sparse.csgraph import dijkstra

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.network import street_network
from mapfilter.roads.osm import read_ways
from mapfilter.roads.route_points import route_lattice
from mapfilter.roads.ways import Buildings, Ways

CRS = "EPSG:32629"


def ways_of(*lines, oneway=None):
    count = len(lines)
    return Ways(
        CRS,
        np.arange(1, count + 1),
        np.zeros(count, np.int16),
        ("residential",),
        np.array([shapely.LineString(line) for line in lines], dtype=object),
        np.zeros(count, bool),
        np.array([0] * count if oneway is None else oneway, np.int8),
    )


def node_at(network, east, north):
    found = np.flatnonzero((network.east_m == east) & (network.north_m == north))
    assert found.size == 1
    return int(found[0])


def test_ways_join_at_shared_vertices_only():
    # The third way passes over the first without sharing a vertex: a bridge.
    network = street_network(
        ways_of([(0, 0), (30, 0), (30, 40)], [(30, 0), (60, 0)], [(10, -5), (10, 5)])
    )
    assert network.length_m.sum() == pytest.approx(100)
    assert sorted(network.way_id.tolist()) == [1, 1, 2]
    distance = dijkstra(network.adjacency, indices=node_at(network, 30, 40))
    assert distance[node_at(network, 60, 0)] == pytest.approx(70)
    np.testing.assert_array_equal(network.adjacency.toarray(), network.adjacency.toarray().T)


def test_of_parallel_edges_the_shortest_counts():
    round_about = [(0, 0), (0, 30), (40, 30), (40, 0)]
    network = street_network(ways_of(round_about, [(0, 0), (40, 0)], [(40, 0), (0, 0)]))
    a, b = node_at(network, 0, 0), node_at(network, 40, 0)
    assert network.adjacency[a, b] == pytest.approx(40)
    assert network.adjacency[b, a] == pytest.approx(40)


def test_one_way_streets_and_dead_ends_that_cannot_be_left():
    loop = [(0, 0), (100, 0), (100, 100), (0, 100), (0, 0)]
    out = [(100, 100), (200, 100)]
    network = street_network(ways_of(loop, out, oneway=[1, 1]))
    assert set(network.way_id.tolist()) == {1}
    start, end = node_at(network, 100, 0), node_at(network, 0, 0)
    assert dijkstra(network.adjacency, indices=start)[end] == pytest.approx(300)
    assert dijkstra(network.adjacency, indices=end)[start] == pytest.approx(100)
    backward = street_network(ways_of(loop, out, oneway=[-1, 0]))
    assert set(backward.way_id.tolist()) == {1, 2}
    assert dijkstra(backward.adjacency, indices=node_at(backward, 0, 0))[
        node_at(backward, 100, 0)
    ] == pytest.approx(300)


def test_edges_through_buildings_are_left_out():
    ways = ways_of([(10, 50), (90, 50)], [(10, 50), (10, 90), (90, 90), (90, 50)])
    lattice = Lattice(CRS, 0.0, 100.0, 5.0, 20, 20)
    house = np.array([shapely.box(40, 30, 60, 70)], dtype=object)
    buildings = Buildings(CRS, house, np.array([9.0]), 0, 0, 1)
    allowed = route_lattice(ways, None, buildings, lattice)
    network = street_network(ways, allowed)
    assert set(network.way_id.tolist()) == {2}
    assert network.length_m.sum() == pytest.approx(160)
    assert street_network(ways, route_lattice(ways, None, None, lattice)).length_m.sum() == (
        pytest.approx(240)
    )


def route_points(lattice, row, col):
    count = len(row)
    return RouteLattice(
        lattice,
        np.array(row, np.int32),
        np.array(col, np.int32),
        np.ones(count, np.int64),
        np.zeros(count, np.int16),
        ("residential",),
        np.zeros(count, np.float32),
        np.zeros(count, bool),
    )


@pytest.mark.parametrize(
    ("place_m", "stays"), [(22.4, False), (22.6, True), (32.4, True), (32.6, False)]
)
def test_an_edge_stays_between_the_points_around_it(place_m, stays):
    """Points at 27.5 m are around a place from one pixel before them to one after."""
    lattice, along = Lattice(CRS, 0.0, 50.0, 5.0, 10, 10), np.arange(10)
    # Row 4 is at 27.5 m north, column 5 at 27.5 m east.
    rows = route_points(lattice, np.full(10, 4), along)
    cols = route_points(lattice, along, np.full(10, 5))
    for allowed, line in (
        (rows, [(10, place_m), (40, place_m)]),
        (cols, [(place_m, 10), (place_m, 40)]),
    ):
        if stays:
            assert street_network(ways_of(line), allowed).length_m.sum() == pytest.approx(30)
        else:
            with pytest.raises(InputError, match="streets that join"):
                street_network(ways_of(line), allowed)


def test_nothing_left_is_told():
    lattice = Lattice(CRS, 5000.0, 100.0, 5.0, 20, 20)
    far = ways_of([(5010, 50), (5090, 50)])
    allowed = route_lattice(far, None, None, lattice)
    with pytest.raises(InputError, match="streets that join"):
        street_network(ways_of([(10, 50), (90, 50)]), allowed)


def test_helsinki_is_one_connected_network():
    bounds = (385_500.0, 6_671_300.0, 386_300.0, 6_672_300.0)
    ways = read_ways("helsinki", "walking", "EPSG:32635", bounds)
    network = street_network(ways)
    whole_m = shapely.length(ways.geometry).sum()
    assert 0.8 * whole_m < network.length_m.sum() <= whole_m
    distance = dijkstra(network.adjacency, indices=0)
    assert np.isfinite(distance).all()
    ends = np.stack([network.east_m, network.north_m], axis=1)
    straight = np.hypot(*(ends[network.node_a] - ends[network.node_b]).T)
    np.testing.assert_allclose(network.length_m, straight)
