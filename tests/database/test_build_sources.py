"""Points of a build, tile by tile: those of the whole, their number or area, and checksums."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import STRtree
from small_world import CRS

from mapfilter.database.sources import (
    LatticeRoutes,
    LayerRoutes,
    _ways_near,
    check_aligned,
    note_misaligned,
)
from mapfilter.errors import Faults, InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import Buildings
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.ways import Squares, Ways

LATTICE = Lattice(CRS, 1000.0, 2000.0, 5.0, 12, 17)
NAMES = ("point", "way_id", "way_class", "distance_to_way_m", "on_square")


def points(seed=3, count=70):
    rng = np.random.default_rng(seed)
    number = np.sort(rng.choice(LATTICE.rows * LATTICE.cols, count, replace=False))
    row, col = np.divmod(number.astype("i4"), np.int32(LATTICE.cols))
    return RouteLattice(
        LATTICE, row, col, rng.integers(1, 9, count), rng.integers(0, 2, count).astype("i2"),
        ("path", "road"), rng.uniform(0, 9, count).astype("f4"), rng.random(count) < 0.3,
    )  # fmt: skip


WINDOWS = [(0, 0, 12, 17), (0, 0, 1, 1), (3, 5, 4, 6), (11, 16, 1, 1), (0, 9, 12, 3), (5, 0, 2, 17)]


@pytest.mark.parametrize("window", WINDOWS)
def test_a_window_has_the_points_that_lie_in_it(window):
    whole, (top, left, rows, cols) = points(), window
    source = LatticeRoutes(whole)
    inside = (whole.row >= top) & (whole.row < top + rows)
    inside &= (whole.col >= left) & (whole.col < left + cols)
    cut = LATTICE.window(*window)
    assert source.lattice == LATTICE
    assert source.weight(cut) == inside.sum()
    assert source.holds(cut) == inside.any()
    part = source.part(cut)
    assert (part.lattice, part.class_names) == (cut, whole.class_names)
    assert (part.row.dtype, part.col.dtype) == (np.int32, np.int32)
    np.testing.assert_array_equal(part.row + top, whole.row[inside])
    np.testing.assert_array_equal(part.col + left, whole.col[inside])
    for name in NAMES[1:]:
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[inside])


def test_a_checksum_of_points_depends_on_all_that_they_are():
    whole = points()
    changed = [
        replace(whole, lattice=replace(LATTICE, west_m=1005.0)),
        replace(whole, class_names=("path", "street")),
        *(
            replace(whole, **{name: np.append(values[:-1], values.dtype.type(other))})
            for name, values, other in (
                ("way_id", whole.way_id, whole.way_id[-1] + 1),
                ("way_class", whole.way_class, 1 - whole.way_class[-1]),
                ("distance_to_way_m", whole.distance_to_way_m, whole.distance_to_way_m[-1] + 1),
                ("on_square", whole.on_square, not whole.on_square[-1]),
            )
        ),
        points(count=69),
        points(seed=4),
    ]
    sums = [LatticeRoutes(one).digest() for one in (whole, *changed)]
    assert len(set(sums)) == len(sums)
    assert LatticeRoutes(points()).digest() == sums[0]


def ways(*lines, ids=None):
    count = len(lines)
    geometry = np.array([shapely.LineString(line) for line in lines], dtype=object)
    ids = np.arange(count) + 5 if ids is None else np.array(ids)
    return Ways(
        CRS, ids, np.zeros(count, np.int16), ("residential",), geometry,
        np.zeros(count, bool), np.zeros(count, np.int8),
    )  # fmt: skip


STREET = [(1000.0, 1970.0), (1060.0, 1970.0)]
SQUARE = shapely.box(1030.0, 1945.0, 1050.0, 1955.0)


def layers(lines=(STREET,), squares=(SQUARE,), buildings=(), half_width_m=6.0, ids=None):
    areas = Squares(CRS, np.arange(len(squares)), np.array(squares)) if squares else None
    heights = np.full(len(buildings), 9.0), len(buildings), 0, 0
    houses = Buildings(CRS, np.array(buildings), *heights) if buildings else None
    source = RouteSource.of(ways(*lines, ids=ids), areas, houses, half_width_m)
    return LayerRoutes(source, LATTICE)


def test_the_weight_of_a_window_is_the_area_of_its_ways_and_squares():
    """Twice the half width times the length within it, and what it has of squares."""
    of = layers()
    assert of.weight(LATTICE) == pytest.approx(60 * 12 + 20 * 10)
    # West of 1040: 40 m of the street, and half of the square.
    assert of.weight(LATTICE.window(0, 0, 12, 8)) == pytest.approx(40 * 12 + 10 * 10)
    assert of.weight(LATTICE.window(9, 0, 3, 17)) == pytest.approx(20 * 10)
    assert of.weight(LATTICE.window(0, 0, 2, 2)) == 0.0
    assert layers(squares=(), half_width_m=2.0).weight(LATTICE) == pytest.approx(60 * 4)


def test_a_window_holds_what_reaches_it():
    of = layers()
    assert of.holds(LATTICE)
    assert of.holds(LATTICE.window(9, 8, 1, 1)), "the square"
    assert of.holds(LATTICE.window(5, 0, 1, 1)), "the street"
    # 6 m about the street count, 11 m do not; 1085 lies east of both.
    assert of.holds(LATTICE.window(4, 0, 1, 1))
    assert not of.holds(LATTICE.window(3, 0, 1, 1))
    assert not of.holds(LATTICE.window(9, 0, 3, 5))
    assert not layers(squares=()).holds(LATTICE.window(9, 8, 1, 1))


@pytest.mark.parametrize("squares", [(), (SQUARE,), (SQUARE, shapely.box(1001, 1985, 1084, 1999))])
@pytest.mark.parametrize("buildings", [(), (shapely.box(1020, 1940, 1034, 1972),)])
def test_tiles_have_the_points_of_the_whole(squares, buildings):
    """The nearest way of a place in a square may lie tiles away, and counts all the same."""
    lines = (STREET, [(1070.0, 1945.0), (1084.0, 1941.0)], [(1003.0, 1942.0), (1003.0, 1950.0)])
    of = layers(lines, squares, buildings, half_width_m=4.0)
    whole = of.part(LATTICE)()
    assert len(whole) > 20
    found = {name: [] for name in NAMES}
    for top, left, rows, cols in LATTICE.tiles(3):
        part = of.part(LATTICE.window(top, left, rows, cols))()
        found["point"].append((part.row + top).astype(int) * LATTICE.cols + part.col + left)
        for name in NAMES[1:]:
            values = getattr(part, name)
            names = np.array(part.class_names)[part.way_class] if name == "way_class" else values
            found[name].append(names)
    order = np.argsort(np.concatenate(found["point"]))
    for name in NAMES:
        expected = getattr(whole, name)
        if name == "way_class":
            expected = np.array(whole.class_names)[expected]
        np.testing.assert_array_equal(np.concatenate(found[name])[order], expected)


def test_ways_that_are_taken_along():
    """Of squares the nearest way of any of a window's points is needed; else what reaches it."""
    lines = [[(1000.0, 1970.0), (1060.0, 1970.0)], [(1000.0, 1500.0), (1060.0, 1500.0)],
             [(1000.0, 1955.0), (1001.0, 1955.0)]]  # fmt: skip
    index = RouteSource.of(ways(*lines), None, None, 2.0).ways
    window = LATTICE.window(11, 0, 1, 2)
    assert len(_ways_near(index, window, far=False).ways) == 0
    taken = _ways_near(index, window, far=True)
    # The centre, (1005, 1942.5), is 13 m from the third: 13 + 11.2 m are looked at.
    assert taken.ways.way_id.tolist() == [7]
    assert taken.half_width_m.tolist() == [2.0]
    high = _ways_near(index, LATTICE.window(8, 0, 2, 6), far=True)
    assert high.ways.way_id.tolist() == [5, 7]
    np.testing.assert_array_equal(high.ways.way_id[high.way], [5, 7])
    np.testing.assert_array_equal(high.ends_m, [index.ends_m[0], index.ends_m[2]])
    none = RouteSource.of(ways(), None, None, 2.0).ways
    assert len(_ways_near(none, window, far=True).ways) == 0


def test_a_checksum_of_layers_depends_on_all_that_they_are():
    house = (shapely.box(1020, 1940, 1034, 1972),)
    every = [
        layers(),
        layers(squares=()),
        layers(squares=(shapely.box(1030.0, 1945.0, 1050.0, 1956.0),)),
        layers(buildings=house),
        layers(lines=(STREET, STREET[::-1])),
        layers(lines=([(1000.0, 1970.0), (1060.0, 1970.5)],)),
        layers(half_width_m=7.0),
        layers(ids=(6,)),
        replace(layers(), lattice=replace(LATTICE, rows=11)),
    ]
    bare = layers().layers
    wet = replace(bare, water=STRtree(np.array([SQUARE])), bridges=bare.ways)
    drowned = replace(wet, bridges=layers(lines=(STREET[::-1],)).layers.ways)
    every += [LayerRoutes(one, LATTICE) for one in (wet, drowned)]
    sums = [one.digest() for one in every]
    assert len(set(sums)) == len(sums)
    assert layers().digest() == sums[0]


def noted(other):
    faults = Faults()
    note_misaligned(LATTICE, other, "roads", "a hint", faults)
    return [fault.expected for fault in faults.found]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, []),
        ({"west_m": 1000.0 + 35.0, "north_m": 2000.0 - 20.0}, []),
        ({"west_m": 1000.0 + 0.0045}, []),
        ({"north_m": 2000.0 - 0.0045}, []),
        ({"west_m": 1000.0 - 0.0055}, ["pixels that align"]),
        ({"north_m": 2000.0 + 0.0055}, ["pixels that align"]),
        ({"resolution_m": 5.0 + 4e-6}, []),
        ({"resolution_m": 5.0 - 6e-6}, ["one resolution"]),
        ({"crs": "EPSG:32630", "resolution_m": 4.0}, ["one CRS (EPSG:32629)"]),
    ],
)
def test_pixels_align_within_a_thousandth(changes, expected):
    assert noted(replace(LATTICE, **changes)) == expected


def test_areas_that_do_not_overlap_are_named_by_their_bounds():
    with pytest.raises(InputError) as caught:
        check_aligned(LATTICE, replace(LATTICE, west_m=1085.0), "roads")
    (fault,) = caught.value.faults
    got = "rasters 1000..1085 E 1940..2000 N, roads 1085..1170 E 1940..2000 N"
    assert (fault.where, fault.got) == ("roads", got)
    check_aligned(LATTICE, replace(LATTICE, west_m=1080.0), "roads")
