"""The radio field: levels on and off the ways."""

import numpy as np
import pytest
from small_world import IDS, LATTICE

from mapfilter.errors import InputError


@pytest.fixture(scope="module")
def field(database):
    return database.field()


def test_points_hold_their_own_levels(database, field):
    assert field.lattice == LATTICE
    assert field.cell_ids == IDS
    assert field.level_dbm.shape == (LATTICE.rows, LATTICE.cols, len(IDS))
    assert field.level_dbm.dtype == np.float32
    points = database.points()
    assert field.on_way.sum() == len(points)
    assert field.on_way[points.row, points.col].all()
    for n, cell in enumerate(IDS):
        expected = np.full(field.on_way.shape, np.nan, np.float32)
        row, col, level = database.cell_points(cell, np.inf)
        expected[row, col] = level
        np.testing.assert_array_equal(
            field.level_dbm[points.row, points.col, n], expected[points.row, points.col]
        )
    np.testing.assert_array_equal(field.way_id[points.row, points.col], points.way_id)
    np.testing.assert_array_equal(
        field.distance_to_way_m[points.row, points.col],
        np.where(points.on_square, 0, points.distance_to_way_m),
    )


def test_other_pixels_hold_what_a_nearest_point_holds(database, field):
    points = database.points()
    rng = np.random.default_rng(5)
    for row, col in rng.integers((0, 0), (LATTICE.rows, LATTICE.cols), size=(60, 2)).tolist():
        away = np.hypot(points.row - row, points.col - col)
        nearest = np.flatnonzero(away == away.min())
        here = field.level_dbm[row, col]
        there = field.level_dbm[points.row[nearest], points.col[nearest]]
        same = ((there == here) | (np.isnan(there) & np.isnan(here))).all(axis=1)
        own = np.where(points.on_square, 0, points.distance_to_way_m)[nearest]
        expected = away.min() * LATTICE.resolution_m + own
        assert (same & np.isclose(expected, field.distance_to_way_m[row, col])).any()


def test_the_width_is_that_of_the_nearest_ways_class(field):
    """7 m to each side of a residential street; squares have no width of their own."""
    assert set(np.unique(field.way_id)) == {0, 77}
    np.testing.assert_array_equal(field.half_width_m[field.way_id == 77], 7.0)
    np.testing.assert_array_equal(field.half_width_m[field.way_id == 0], 0.0)
    assert field.half_width_m.dtype == np.float32


def test_a_part_of_the_area(database, field):
    west, _, _, north = LATTICE.bounds_m
    part = database.field((west + 30, north - 90, west + 120, north - 10))
    assert part.lattice == LATTICE.window(2, 6, 17, 19)
    kept = [IDS.index(cell) for cell in part.cell_ids]
    inside = field.level_dbm[2:19, 6:25][part.on_way]
    np.testing.assert_array_equal(part.level_dbm[part.on_way], inside[:, kept])
    left_out = np.delete(inside, kept, axis=1)
    assert np.isnan(left_out).all()
    np.testing.assert_array_equal(part.on_way, field.on_way[2:19, 6:25])


def test_areas_without_points(database):
    west, south, _, north = LATTICE.bounds_m
    with pytest.raises(InputError, match="points of the database"):
        database.field((west + 1, south + 1, west + 20, south + 20))
    with pytest.raises(InputError, match="degrees given for metres"):
        database.field((-8.62, 41.13, -8.61, 41.14))
    with pytest.raises(InputError, match="an area within"):
        database.field((west + 20, north - 20, west + 10, north - 30))


@pytest.mark.parametrize("bounds", [(1, 2, 3), "west", 5.0, (0, 0, np.nan, 10)])
def test_bounds_that_are_no_four_numbers(database, bounds):
    with pytest.raises(InputError, match="area: expected west, south, east, north in metres"):
        database.field(bounds)
