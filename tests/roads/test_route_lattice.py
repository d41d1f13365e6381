"""The route lattice against distances computed point by point."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.osm import read_squares, read_ways
from mapfilter.roads.route_points import route_lattice, route_lattice_from_landuse
from mapfilter.roads.ways import Buildings, Squares, Ways

CRS = "EPSG:32629"
LATTICE = Lattice(CRS, 0.0, 100.0, 5.0, 20, 24)


def ways_of(*lines, ids=None):
    count = len(lines)
    geometry = np.array([shapely.LineString(line) for line in lines], dtype=object)
    return Ways(
        CRS,
        np.arange(1, count + 1) if ids is None else np.array(ids),
        (np.arange(count) % 2).astype(np.int16),
        ("footway", "residential"),
        geometry,
        np.zeros(count, bool),
        np.zeros(count, np.int8),
    )


def squares_of(*boxes):
    geometry = np.array([shapely.box(*box) for box in boxes], dtype=object)
    return Squares(CRS, np.arange(1, len(boxes) + 1), geometry)


def buildings_of(*boxes):
    geometry = np.array([shapely.box(*box) for box in boxes], dtype=object)
    return Buildings(CRS, geometry, np.full(len(boxes), 10.0), 0, 0, len(boxes))


def same(a, b):
    for name in RouteLattice.__dataclass_fields__:
        x, y = getattr(a, name), getattr(b, name)
        if isinstance(x, np.ndarray):
            assert x.dtype == y.dtype
            np.testing.assert_array_equal(x, y)
        else:
            assert x == y


coordinate = st.integers(-20, 140).map(float)
lines = st.lists(
    st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=5, unique=True),
    min_size=1,
    max_size=6,
)
# Box edges lie off the pixel centres, so that inside and outside are never in doubt.
corner = st.integers(-10, 70).map(lambda n: n + 0.25)
boxes = st.lists(
    st.tuples(corner, corner, st.integers(3, 60), st.integers(3, 60)).map(
        lambda b: (b[0], b[1], b[0] + b[2] + 0.5, b[1] + b[3] + 0.5)
    ),
    max_size=4,
)


@settings(max_examples=60, deadline=None)
@given(lines, boxes, boxes, st.sampled_from([2.0, 6.0, 11.0]), st.sampled_from([7, 512]))
def test_same_as_point_by_point(drawn, open_boxes, built_boxes, half_width_m, tile_px):
    ways = ways_of(*drawn)
    row, col = np.divmod(np.arange(LATTICE.rows * LATTICE.cols), LATTICE.cols)
    points = shapely.points(*LATTICE.east_north(row, col))
    distance = np.array([shapely.distance(points, line) for line in ways.geometry])
    nearest = distance.min(axis=0)

    def within(areas):
        return np.any([shapely.contains(shapely.box(*b), points) for b in areas], axis=0) & True

    on_square = within(open_boxes) if open_boxes else np.zeros(points.size, bool)
    built = within(built_boxes) if built_boxes else np.zeros(points.size, bool)
    near = nearest <= half_width_m
    expected = np.flatnonzero((near | on_square) & ~built)
    squares = squares_of(*open_boxes) if open_boxes else None
    buildings = buildings_of(*built_boxes) if built_boxes else None
    if not expected.size:
        with pytest.raises(InputError, match="a point near a way"):
            route_lattice(ways, squares, buildings, LATTICE, half_width_m, tile_px=tile_px)
        return
    routes = route_lattice(ways, squares, buildings, LATTICE, half_width_m, tile_px=tile_px)
    np.testing.assert_array_equal(routes.point, expected)
    np.testing.assert_allclose(routes.distance_to_way_m, nearest[expected], rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(routes.on_square, on_square[expected])
    np.testing.assert_array_equal(routes.way_id > 0, near[expected])
    chosen = np.flatnonzero(routes.way_id > 0)
    own = distance[routes.way_id[chosen] - 1, expected[chosen]]
    np.testing.assert_allclose(own, nearest[expected[chosen]], atol=1e-9)
    same(routes, route_lattice(ways, squares, buildings, LATTICE, half_width_m, tile_px=11))


def test_worked_example():
    """A street along y = 52.5 through a house, with a square beside it."""
    ways = ways_of([(0, 52.5), (120, 52.5)])
    routes = route_lattice(
        ways, squares_of((20, 60, 40, 80)), buildings_of((60, 40, 80, 70)), LATTICE
    )
    mask = routes.mask()
    expected = np.zeros((20, 24), bool)
    expected[8:11] = True  # centres at y = 57.5, 52.5, 47.5 are at most 6 m away
    expected[4:8, 4:8] = True
    expected[6:12, 12:16] = False
    np.testing.assert_array_equal(mask, expected)
    top = routes.way_id == 0
    assert top.sum() == 16
    assert routes.on_square.sum() == 16
    assert {routes.class_names[code] for code in routes.way_class[top]} == {"square"}
    assert sorted(set(routes.distance_to_way_m[top].tolist())) == [10.0, 15.0, 20.0, 25.0]


def test_of_equally_near_ways_the_smallest_id_is_taken():
    lines = [(0, 52.5), (60, 52.5)], [(60, 52.5), (60, 0)], [(60, 52.5), (120, 52.5)]
    routes = route_lattice(ways_of(*lines, ids=[30, 20, 10]), None, None, LATTICE)
    # At the junction's column the three ways meet; beyond it 10 and 30 lie closest.
    places = zip(routes.row.tolist(), routes.col.tolist(), strict=True)
    by_place = dict(zip(places, routes.way_id.tolist(), strict=True))
    assert by_place[(9, 11)] == 30
    assert by_place[(9, 12)] == 10
    assert by_place[(8, 12)] == 10
    reordered = ways_of(*lines[::-1], ids=[10, 20, 30])
    np.testing.assert_array_equal(
        route_lattice(reordered, None, None, LATTICE).way_id, routes.way_id
    )


def test_other_crs_and_widths_are_refused():
    ways = ways_of([(0, 50), (100, 50)])
    other = Lattice("EPSG:32630", 0.0, 100.0, 5.0, 20, 24)
    with pytest.raises(InputError, match=r"ways, crs.*\n.*half_width_m"):
        route_lattice(ways, None, None, other, half_width_m=0.0)


def test_landuse_points_name_the_way_near_them():
    mask = np.zeros((20, 24), bool)
    mask[9:12, 0:3] = True
    plain = route_lattice_from_landuse(mask, LATTICE)
    np.testing.assert_array_equal(plain.mask(), mask)
    assert not plain.way_id.any()
    assert np.isinf(plain.distance_to_way_m).all()
    named = route_lattice_from_landuse(mask, LATTICE, ways_of([(0, 52.5), (120, 52.5)]))
    np.testing.assert_array_equal(named.mask(), mask)
    assert named.way_id.tolist() == [1] * 6 + [0] * 3
    assert named.distance_to_way_m.tolist() == [0.0] * 3 + [5.0] * 3 + [10.0] * 3
    assert named.on_square.all()
    with pytest.raises(InputError, match="shape"):
        route_lattice_from_landuse(mask[:5], LATTICE)
    with pytest.raises(InputError, match="no class is walkable"):
        route_lattice_from_landuse(mask & False, LATTICE)


def test_types_refuse_what_does_not_fit():
    with pytest.raises(InputError, match="LineString"):
        Ways(
            CRS, np.array([1]), np.array([0], np.int16), ("a",),
            np.array([shapely.box(0, 0, 1, 1)]), np.array([False]), np.array([0], np.int8),
        )  # fmt: skip
    with pytest.warns(RuntimeWarning, match="linestrings"):
        broken = shapely.LineString([(0, 0), (np.nan, 1)])
    with pytest.raises(InputError, match="finite"):
        ways_of(broken)
    with pytest.raises(InputError, match="numbers > 0"):
        ways_of([(0, 0), (1, 1)], ids=[-4])
    with pytest.raises(InputError, match="row-major"):
        RouteLattice(
            LATTICE, np.array([1, 0], np.int32), np.array([0, 0], np.int32),
            np.array([1, 1]), np.zeros(2, np.int16), ("a",),
            np.zeros(2, np.float32), np.zeros(2, bool),
        )  # fmt: skip


def test_porto_has_the_expected_number_of_points(shared_data):
    east, north = (float(v) for v in project(CRS, -8.6235, 41.1325))
    bounds = (east, north, east + 3000, north + 3000)
    porto = shared_data / "osm-extracts" / "porto.osm.pbf"
    layers = (
        read_ways(porto, "walking", CRS, bounds),
        read_squares(porto, CRS, bounds),
        read_buildings(porto, CRS, bounds),
    )
    routes = route_lattice(*layers, Lattice.covering(CRS, bounds, 5.0))
    assert 55_000 <= len(routes) <= 75_000


def test_layers_and_points_show_themselves_in_a_line():
    ways = ways_of([(0, 52.5), (120, 52.5)])
    assert repr(ways) == f"Ways(1 in {CRS})"
    routes = route_lattice(ways, squares_of((20, 60, 40, 80)), None, LATTICE)
    assert repr(routes) == f"RouteLattice({len(routes)} points, 3 classes; {LATTICE})"


POINTS = ([3, 4], [5, 5], [1, 1], [0, 0], ("a",), [0.0, 2.0], [False, True])


def test_columns_may_be_lists_and_arrays_of_any_whole_numbers():
    made = RouteLattice(LATTICE, *POINTS)
    assert [made.row.dtype, made.way_id.dtype, made.way_class.dtype] == [
        np.int32,
        np.int64,
        np.int16,
    ]
    assert [made.distance_to_way_m.dtype, made.on_square.dtype] == [np.float32, np.bool_]
    assert made.mask().sum() == 2
    same = RouteLattice(LATTICE, np.array([3.0, 4.0]), *POINTS[1:])
    assert (same.row.dtype, same.row.tolist()) == (np.int32, [3, 4])


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        (0, [3.5, 4], r"route lattice, row: expected whole numbers, found 3\.5"),
        (1, [5, np.nan], "route lattice, col: expected whole numbers, found nan"),
        (2, ["a", "b"], "route lattice, way_id: expected whole numbers, found text"),
        (2, [1, None], "route lattice, way_id: expected whole numbers, found object"),
        (3, [0, 70_000], "route lattice, way_class: expected whole numbers of int16, found 70000"),
        (0, [[3], [4]], r"route lattice, row: expected one dimension, found \(2, 1\)"),
        (5, ["x", "y"], "route lattice, distance_to_way_m: expected numbers, found text"),
        (2, [2**63, 1], "route lattice, way_id: expected whole numbers of int64, found 9"),
        (6, [0.5, 1], r"route lattice, on_square: expected true or false, found 0\.5"),
        (6, [np.nan, 1], "route lattice, on_square: expected true or false, found nan"),
        (6, ["x", "y"], "route lattice, on_square: expected numbers, found text"),
    ],
)
def test_columns_of_something_else_are_named(column, value, expected):
    columns = list(POINTS)
    columns[column] = value
    with pytest.raises(InputError, match=expected):
        RouteLattice(LATTICE, *columns)
