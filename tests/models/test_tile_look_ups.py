"""Look-ups in an area that is held by tiles, by brute force; functions as they stand in Python."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates, uniform_filter

from mapfilter.models import tile_kernels
from mapfilter.models.fingerprint import RasterFrame

ROWS, COLS, SIDE = 11, 14, 4
TILE_ROWS, TILE_COLS = 3, 4
TILES = TILE_ROWS * TILE_COLS


def plain(name):
    """A kernel as it is written, not compiled."""
    return getattr(tile_kernels, name).py_func


def tile_of(pixel):
    row, col = np.divmod(pixel, COLS)
    return row // SIDE * TILE_COLS + col // SIDE


@pytest.mark.parametrize("count", [0, 1, 40])
def test_pixels_are_grouped_by_tiles_in_their_order(count):
    pixel = np.random.default_rng(count).integers(ROWS * COLS, size=count).astype(np.int32)
    order, first, numbers = plain("by_tile")(pixel, COLS, SIDE, TILE_COLS, TILES)
    np.testing.assert_array_equal(numbers, np.unique(tile_of(pixel)))
    assert first.size == numbers.size + 1
    assert first[-1] == count
    for k, number in enumerate(numbers):
        own = order[first[k] : first[k + 1]]
        np.testing.assert_array_equal(own, np.flatnonzero(tile_of(pixel) == number))


@pytest.mark.parametrize("with_roughness", [True, False])
def test_levels_are_those_of_the_nearest_points(with_roughness):
    rng, (top, left), rows, cols, cells, points = np.random.default_rng(2), (4, 8), 6, 5, 3, 7
    near = rng.integers(points, size=(rows, cols)).astype(np.int32)
    levels_dbm = rng.normal(-80, 9, (cells, points)).astype(np.float32)
    rough = rng.integers(200, size=(cells if with_roughness else 0, rows, cols)).astype(np.uint8)
    row, col = rng.integers(rows, size=9), rng.integers(cols, size=9)
    pixel = ((row + top) * COLS + col + left).astype(np.int32)
    which = np.array([0, 3, 8])
    found_dbm = np.full((9, cells), np.nan, np.float32)
    found_rough = np.full((9, cells), 255, np.uint8)
    given = pixel, which, COLS, (top, left), near, levels_dbm, rough, found_dbm, found_rough
    plain("look_up_levels")(*given)
    others = np.setdiff1d(np.arange(9), which)
    np.testing.assert_array_equal(found_dbm[which], levels_dbm[:, near[row, col]].T[which])
    assert np.isnan(found_dbm[others]).all()
    if with_roughness:
        np.testing.assert_array_equal(found_rough[which], rough[:, row, col].T[which])
    assert (found_rough[others] == 255).all()
    assert with_roughness or (found_rough == 255).all()


FRAME = RasterFrame(2.5, 52.5, 0.2, ROWS, COLS)
"""From the centres of its pixels, of 5 m: rows to the south."""


def test_values_are_bilinear_between_centres_and_those_of_the_edge_beyond():
    rng = np.random.default_rng(3)
    whole = rng.normal(size=(ROWS, COLS)).astype(np.float32)
    east = np.append(rng.uniform(-10, 90, 60), [2.5, 67.5, 30.0, 27.5]).astype(np.float32)
    north = np.append(rng.uniform(-10, 70, 60), [52.5, 2.5, 52.5, 2.5]).astype(np.float32)
    state = np.stack([east, north])
    col = np.clip((east - 2.5) / 5, 0, COLS - 1)
    row = np.clip((52.5 - north) / 5, 0, ROWS - 1)
    # The pixel north-west of each, of which three others exist.
    first = np.minimum(row.astype(int), ROWS - 2) * COLS + np.minimum(col.astype(int), COLS - 2)
    np.testing.assert_array_equal(tile_kernels.upper_left(state, FRAME), first)
    expected = map_coordinates(whole.astype(float), [row, col], order=1)
    found = np.full(east.size, np.nan, np.float32)
    top, left = 3, 5
    inside = (first // COLS >= top) & (first % COLS >= left)
    for which, corner in ((np.flatnonzero(inside), (top, left)), (np.flatnonzero(~inside), (0, 0))):
        values = whole[corner[0] :, corner[1] :]
        given = state, first.astype(np.int32), which, FRAME, corner, values, found
        plain("interpolate_tile")(*given)
        assert np.isfinite(found[which]).all()
        assert corner == (0, 0) or np.isnan(found[~inside]).all()
    np.testing.assert_allclose(found, expected, atol=2e-5)


def test_pixels_are_counted_from_the_south():
    east = np.array([0.0, 4.9, 5.0, 69.9, 70.0, -1.0, 500.0, 33.0])
    north = np.array([0.0, 5.0, 4.9, 54.9, 55.0, 20.0, 20.0, -9.0])
    found = plain("pixels_from_south")(east, north, ROWS, COLS, 0.2)
    assert found.dtype == np.int32
    row, col = np.divmod(found, COLS)
    assert row.tolist() == [10, 9, 10, 0, 0, 6, 6, 10]
    assert col.tolist() == [0, 0, 1, 13, 13, 0, 13, 6]


def test_ranges_of_levels_by_tile():
    rng = np.random.default_rng(4)
    point = rng.choice(ROWS * COLS, 30, replace=False).astype(np.int32)
    level_dbm = rng.normal(-80, 9, 30).astype(np.float32)
    least, most = plain("level_ranges")(point, level_dbm, COLS, SIDE, TILE_COLS, TILES)
    for tile in range(TILES):
        own = level_dbm[tile_of(point) == tile]
        expected = (own.min(), own.max()) if own.size else (np.nan, np.nan)
        np.testing.assert_array_equal((least[tile], most[tile]), expected)
    assert np.isnan(least).any()
    assert np.any(least < most)


@pytest.mark.parametrize(
    ("point", "expected", "there"),
    [
        ([2, 5, 9], [-62, -120, -69], True),
        ([5, 6, 7], [-120, -120, -120], False),
        ([0, 1], [-120, -120], False),
        ([9], [-69], True),
        ([4, 10, 11], [-64, -120, -120], True),
        ([10, 11], [-120, -120], False),
    ],
)
def test_levels_of_a_cell_at_points(point, expected, there):
    known = np.array([2, 4, 8, 9], np.int32), np.array([-62, -64, -68, -69], np.float32)
    found, is_there = plain("levels_at_points")(np.array(point), *known, -120.0)
    assert (found.tolist(), bool(is_there)) == (expected, there)
    none = np.empty(0, np.int32), np.empty(0, np.float32)
    found, is_there = plain("levels_at_points")(np.array(point), *none, -120.0)
    assert (set(found.tolist()), bool(is_there)) == ({-120.0}, False)


@pytest.mark.parametrize("size", [1, 3, 5, 25])
def test_roughness_is_the_deviation_within_a_square(size):
    """At edges the area goes on as its mirror image; tenths of a decibel, 25.5 dB at most."""
    rng = np.random.default_rng(size)
    near = rng.integers(30, size=(6, 9)).astype(np.int32)
    levels = rng.normal(-80, 6, 30).astype(np.float32)
    levels[:2] = (-40.0, -140.0)
    found = plain("tenths_of_roughness")(levels, near, size)
    level = levels[near].astype(float)
    mean = uniform_filter(level, size, mode="reflect")
    square = uniform_filter(level**2, size, mode="reflect")
    exact = 10 * np.sqrt(np.maximum(square - mean**2, 0))
    assert found.dtype == np.uint8
    assert np.abs(found - np.minimum(exact, 255.0)).max() <= 0.51
    assert found.max() == (0 if size == 1 else found.max())
    steep = plain("tenths_of_roughness")(np.array([0.0, -200.0], np.float32), near % 2, 3)
    assert steep.max() == 255


def test_places_beyond_a_row_are_those_of_its_mirror_image():
    row = np.arange(4)
    mirrored = np.pad(row, 9, mode="symmetric")
    found = [plain("_reflected")(at, 4) for at in range(-9, 13)]
    np.testing.assert_array_equal(found, mirrored)
    assert plain("_reflected")(-5, 1) == plain("_reflected")(7, 1) == 0
