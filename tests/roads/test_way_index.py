"""Half widths by class and waters, against distances computed point by point."""

import pickle

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from test_route_lattice import CRS, LATTICE, boxes, lines, same, ways_of

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.index import WayIndex
from mapfilter.roads.route_points import RouteSource, route_lattice
from mapfilter.roads.ways import Water

ROW, COL = np.divmod(np.arange(LATTICE.rows * LATTICE.cols), LATTICE.cols)
POINTS = shapely.points(*LATTICE.east_north(ROW, COL))


def water_of(*boxes):
    return Water(CRS, np.array([shapely.box(*box) for box in boxes], dtype=object))


@settings(max_examples=60, deadline=None)
@given(lines, boxes, st.sampled_from([0.0, 2.0, 9.0, 16.0]), st.sampled_from([7, 512]))
def test_same_as_point_by_point(drawn, wet_boxes, footway_m, tile_px):
    """Lines 0, 2, … are footways with their own half width; the others have 6 m."""
    ways = ways_of(*drawn)
    widths = np.where(ways.way_class == 0, footway_m, 6.0)
    distance = np.array([shapely.distance(POINTS, line) for line in ways.geometry])
    reached = (distance <= widths[:, None]) & (widths[:, None] > 0)
    own = np.where(reached, distance, np.inf)
    expected = reached.any(axis=0)
    water = None
    if wet_boxes:
        water = water_of(*wet_boxes)
        flooded = np.any([shapely.contains(box, POINTS) for box in water.geometry], axis=0)
        sea = shapely.union_all(water.geometry)
        bridges = shapely.intersection(ways.geometry, sea)
        crossing = (shapely.distance(POINTS, bridges[:, None]) <= widths[:, None]) & (
            widths[:, None] > 0
        )
        crossing &= (shapely.length(bridges) > 0)[:, None]
        expected &= ~flooded | crossing.any(axis=0)
    options = {"half_width_by_class_m": {"footway": footway_m}, "water": water}
    if not expected.any():
        with pytest.raises(InputError, match="a point near a way"):
            route_lattice(ways, None, None, LATTICE, **options, tile_px=tile_px)
        return
    routes = route_lattice(ways, None, None, LATTICE, **options, tile_px=tile_px)
    np.testing.assert_array_equal(routes.point, np.flatnonzero(expected))
    np.testing.assert_allclose(routes.distance_to_way_m, own.min(axis=0)[expected], atol=1e-5)
    chosen = own[routes.way_id - 1, routes.point]
    np.testing.assert_allclose(chosen, own.min(axis=0)[expected], atol=1e-9)
    same(routes, route_lattice(ways, None, None, LATTICE, **options, tile_px=11))


def test_a_narrow_path_beside_a_wide_road():
    """Points 5 m from the road belong to it, though the path, too narrow for them, is nearer."""
    ways = ways_of([(0, 52.5), (120, 52.5)], [(0, 57.5), (120, 57.5)])
    narrow = {"footway": 20.0, "residential": 2.0}
    routes = route_lattice(ways, None, None, LATTICE, half_width_by_class_m=narrow)
    by_row = {row: set(routes.way_id[routes.row == row].tolist()) for row in range(4, 14)}
    assert by_row == {row: {1} for row in (5, 6, 7, 9, 10, 11, 12, 13)} | {8: {2}, 4: set()}
    third = routes.row == 7
    assert set(routes.distance_to_way_m[third].tolist()) == {10.0}


def test_a_bridge_stays_and_the_bank_is_cut():
    """A river along x = 40..80: a street crosses it, a path runs along its western bank."""
    ways = ways_of([(0, 52.5), (120, 52.5)], [(37.5, 0), (37.5, 100)])
    mask = route_lattice(ways, None, None, LATTICE, water=water_of((40, 0, 80, 100))).mask()
    dry = route_lattice(ways, None, None, LATTICE).mask()
    assert dry[:, 8].all()
    np.testing.assert_array_equal(mask[:, :8], dry[:, :8])
    np.testing.assert_array_equal(np.flatnonzero(mask[:, 8]), [8, 9, 10])
    np.testing.assert_array_equal(np.flatnonzero(mask[:, 12]), [8, 9, 10])
    assert not mask[0, 8:].any()


def test_ways_outside_the_lattice_reach_into_it():
    beside = ways_of([(-4.0, 0.0), (-4.0, 100.0)])
    routes = route_lattice(beside, None, None, LATTICE, 7.0)
    assert set(routes.col.tolist()) == {0}
    assert len(routes) == LATTICE.rows
    assert set(routes.distance_to_way_m.tolist()) == {6.5}


def test_a_source_can_be_sent_to_another_process():
    ways = ways_of([(0, 52.5), (120, 52.5)])
    source = RouteSource.of(ways, water=water_of((40, 0, 80, 100)))
    window = LATTICE.window(5, 5, 10, 10)
    same(pickle.loads(pickle.dumps(source)).tile(window), source.tile(window))


def test_segments_of_any_size_are_no_trouble():
    """Far beyond the window, longer than it by far, or shorter than numbers can square."""
    ways = ways_of(
        [(-1e9, 52.5), (1e9, 52.5)],
        [(60.0, 60.0), (60.0 + 1e-14, 60.0)],
        [(1e-200, 1e-200), (2e-200, 1e-200)],
        [(1e15, 1e15), (1e15 + 8, 1e15)],
    )
    way, distance_m = WayIndex.of(ways).reaching(LATTICE)
    assert set(way[9].tolist()) == {0}
    assert np.all(distance_m[9] < 1e-6)


def test_half_widths_are_lengths():
    ways = ways_of([(0, 52.5), (120, 52.5)])
    for wrong in ({"footway": -1.0}, {"footway": np.nan}, {"footway": np.inf}):
        with pytest.raises(InputError, match="half_width_by_class_m, footway"):
            route_lattice(ways, None, None, LATTICE, half_width_by_class_m=wrong)
    other = Water("EPSG:32630", np.array([shapely.box(0, 0, 1, 1)], dtype=object))
    with pytest.raises(InputError, match=r"water, crs.*\n.*half_width_m"):
        route_lattice(ways, None, None, LATTICE, -1.0, water=other)


def test_on_a_lattice_of_large_coordinates():
    lattice = Lattice(CRS, 530_000.0, 4_556_100.0, 5.0, 20, 24)
    moved = ways_of([(530_000.0, 4_556_052.5), (530_120.0, 4_556_052.5)])
    routes = route_lattice(moved, None, None, lattice)
    here = route_lattice(ways_of([(0, 52.5), (120, 52.5)]), None, None, LATTICE)
    np.testing.assert_array_equal(routes.point, here.point)
