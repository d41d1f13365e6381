"""The nearest lattice point against brute force over all points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.database.nearest import CellPointIndex
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice

LATTICE = Lattice("EPSG:32629", 531_000.0, 4_556_000.0, 5.0, 12, 15)


def brute_force(index, east_m, north_m, max_distance_m=np.inf):
    """Compare every point with every position; the last of equals wins, as in a stable sort."""
    which, distance = [], []
    for east, north in zip(east_m, north_m, strict=True):
        square = (index.east_m - east) ** 2 + (index.north_m - north) ** 2
        order = np.argsort(-square, kind="stable")
        near = order.size > 0 and square[order[-1]] <= max_distance_m**2
        which.append(order[-1] if near else -1)
        distance.append(np.sqrt(square[order[-1]]) if near else np.inf)
    return np.array(which), np.array(distance)


def index_of(ranks):
    ranks = np.unique(np.asarray(sorted(ranks), dtype=np.int64))
    return CellPointIndex.of_points(LATTICE, ranks // LATTICE.cols, ranks % LATTICE.cols)


ranks = st.sets(st.integers(0, LATTICE.rows * LATTICE.cols - 1), max_size=40)
# Multiples of half a pixel make ties common; the offsets reach well off the lattice.
half_pixels = st.integers(-30, 60).map(lambda n: n * 2.5)
anywhere = st.one_of(half_pixels, st.floats(-200.0, 300.0))


@settings(max_examples=300, deadline=None)
@given(ranks, st.lists(st.tuples(anywhere, anywhere), min_size=1, max_size=20))
def test_same_as_brute_force(chosen, offsets):
    index = index_of(chosen)
    east = LATTICE.west_m + np.array([x for x, _ in offsets])
    north = LATTICE.north_m - np.array([y for _, y in offsets])
    for reach in (np.inf, 2.0, 3.5, 5.0, 12.5):
        which, distance = index.nearest(east, north, reach)
        expected, expected_m = brute_force(index, east, north, reach)
        np.testing.assert_array_equal(which, expected)
        np.testing.assert_array_equal(distance, expected_m)


def test_the_last_of_four_equals_wins():
    index = index_of([0, 1, 15, 16])
    which, distance = index.nearest(LATTICE.west_m + 5.0, LATTICE.north_m - 5.0)
    assert which.tolist() == [3]
    assert distance[0] == pytest.approx(np.hypot(2.5, 2.5))


def test_a_point_at_exactly_the_reach_counts():
    index = index_of([0])
    which, _ = index.nearest(LATTICE.west_m + 7.5, LATTICE.north_m - 2.5, 5.0)
    assert which.tolist() == [0]
    which, distance = index.nearest(LATTICE.west_m + 7.6, LATTICE.north_m - 2.5, 5.0)
    assert which.tolist() == [-1]
    assert np.isinf(distance[0])


@pytest.mark.parametrize("place", [(np.nan, 0.0), (0.0, np.inf), (-np.inf, np.nan)])
def test_positions_that_are_nowhere_have_no_nearest_point(place):
    which, distance = index_of([0, 7]).nearest(*place)
    assert which.tolist() == [-1]
    assert np.isinf(distance[0])


def test_very_far_positions_are_answered():
    which, _ = index_of([0, 7, 170]).nearest([1e12, -1e12], [-1e12, 1e12])
    assert which.tolist() == [2, 0]


def test_no_points_no_answer():
    which, distance = index_of([]).nearest([531_010.0], [4_555_990.0])
    assert which.tolist() == [-1]
    assert np.isinf(distance[0])


@pytest.mark.parametrize(
    ("row", "col", "message"),
    [
        ([0, 0], [3, 1], "row-major"),
        ([1, 1], [2, 2], "row-major"),
        ([0, 12], [0, 0], "off the lattice"),
        ([0, 1], [0], "as many rows"),
    ],
)
def test_points_in_another_order_or_off_the_lattice_are_refused(row, col, message):
    with pytest.raises(InputError, match=message):
        CellPointIndex.of_points(LATTICE, row, col)
