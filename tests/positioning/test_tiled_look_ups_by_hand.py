"""Look-ups in an area of a few tiles, whose levels, ways and distances are plain numbers."""

from threading import RLock
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.errors import StoreError
from mapfilter.positioning.bayes.area import tiled_area
from mapfilter.positioning.bayes.area.tiled_area import TiledArea

ROWS, COLS, SIDE = 4, 5, 2
"""Two rows of three tiles, of which the last column is narrower; pixels of 10 m."""
LATTICE = SimpleNamespace(
    rows=ROWS, cols=COLS, resolution_m=10.0, bounds_m=(1000.0, 2000.0, 1050.0, 2040.0)
)
QUIET_DBM = -116.0
NOWHERE = {(0, 0), (4, 1)}
"""Tiles and cells without a level there; cell 2 has none anywhere."""
PIXELS = np.arange(ROWS * COLS, dtype=np.int32)


def level_of(pixel, cell):
    """A dB less for each pixel, and ten for each cell."""
    return np.float32(-60.0 - pixel - 10.0 * cell)


def tile_of(pixel):
    return 3 * (pixel // COLS // SIDE) + pixel % COLS // SIDE


class Tiles:
    """Each pixel of a tile has a point of its own, in the order of columns."""

    rows, cols, side, quiet_dbm = 2, 3, SIDE, QUIET_DBM

    def __init__(self):
        self.lock, self.asked = RLock(), []

    def pixels(self, number):
        top, left = SIDE * (number // 3), SIDE * (number % 3)
        row, col = np.arange(top, top + SIDE), np.arange(left, min(left + SIDE, COLS))
        return COLS * row[:, None] + col

    def tile(self, number):
        pixels = self.pixels(number)
        near = np.arange(pixels.size, dtype=np.int32).reshape(pixels.shape[::-1]).T.copy()
        own = pixels.T.ravel()
        points = SimpleNamespace(near=near, point=own, way_id=np.where(own < 7, 70, 80 + own // 15))
        return SimpleNamespace(corner=(SIDE * (number // 3), SIDE * (number % 3)), points=points)

    def levels(self, number, band):
        if band == 2 or (number, band) in NOWHERE:
            return None
        return level_of(self.tile(number).points.point, band)

    def rough_db(self, number, band):
        self.asked.append((number, band))
        return None if band == 1 else (self.pixels(number) + band).astype(np.uint8)

    def strong(self, number, cell, _):
        at = [k for k, band in enumerate(cell.tolist()) if self.levels(number, band) is not None]
        return np.array(at, dtype=np.int64)

    def log_map(self, number, sd_m):
        """A plane, of the tile's pixels and one around it."""
        top, left = SIDE * (number // 3), SIDE * (number % 3)
        row, col = np.indices((SIDE + 2, SIDE + 2))
        return (sd_m * (row + top) - 2.0 * (col + left)).astype(np.float32)


def area(tiles=None):
    return TiledArea(LATTICE, ("A", "B", "C", "D"), frozenset(), {}, -110.0, {}, tiles or Tiles())


def expected_dbm(pixel, cell):
    if cell == 2 or (tile_of(pixel), cell) in NOWHERE:
        return np.float32(QUIET_DBM)
    return level_of(pixel, cell)


@pytest.mark.parametrize("rough", [True, False])
@pytest.mark.parametrize("cells", [(0, 1, 2, 3), (3, 1), (2,)])
def test_levels_and_roughness_of_cells_at_pixels(cells, rough):
    """What is nowhere received is quiet, and smooth; so is what has no roughness."""
    pixel, tiles = np.random.default_rng(1).permutation(PIXELS), Tiles()
    found_dbm, found_rough = area(tiles).looked_up(pixel, np.array(cells, np.int32), rough=rough)
    assert (found_dbm.dtype, found_rough.dtype) == (np.float32, np.uint8)
    levels = [[expected_dbm(one, cell) for cell in cells] for one in pixel.tolist()]
    np.testing.assert_array_equal(found_dbm, levels)
    assert found_rough.shape == (pixel.size, len(cells) if rough else 0)
    for at, k in np.ndindex(*found_rough.shape):
        one, cell = int(pixel[at]), cells[k]
        told = expected_dbm(one, cell) != QUIET_DBM and cell != 1
        assert found_rough[at, k] == (one + cell if told else 0)
    assert bool(tiles.asked) == (rough and cells != (2,))


def test_nothing_is_looked_up_of_no_pixels():
    none = np.empty(0, dtype=np.int32)
    found_dbm, found_rough = area().looked_up(none, np.array([0, 1], np.int32))
    assert (found_dbm.shape, found_rough.shape) == ((0, 2), (0, 2))


def test_predictions_have_a_row_for_each_hypothesis():
    pixel, cell = np.array([7, 2, 19], dtype=np.int32), np.array([3, 0], dtype=np.int32)
    predicted, own, bands = area().predicted(pixel, cell, 0.25)
    levels = [expected_dbm(one, k) for one in (7, 2, 19) for k in (3, 0)]
    assert predicted.level_dbm.tolist() == levels
    assert predicted.rough_db.tolist() == [10, 7, 5, 2, 22, 19]
    assert (predicted.bands, predicted.share) == (2, 0.25)
    assert (own.tolist(), bands.tolist()) == ([0, 1, 2], [0, 1])
    assert (own.dtype, bands.dtype) == (np.int32, np.int32)
    smooth, _, _ = area().predicted(pixel, cell, 0.25, rough=False)
    assert smooth.rough_db.size == 0


@pytest.mark.parametrize("limit_dbm", [-70.0, -79.0, -116.0, -116.5])
def test_shares_of_pixels_above_a_level(limit_dbm):
    """Cells that are nowhere received are above what is below the quiet level."""
    cell = np.array([3, 0, 2, 1], dtype=np.int32)
    pixel = np.array([2, 9, 9, 0, 13, 14, 19], dtype=np.int32)
    found = area().shares_above(pixel, cell, np.full(cell.size, limit_dbm, dtype=np.float32))
    share = [np.mean([expected_dbm(one, k) > limit_dbm for one in pixel.tolist()]) for k in cell]
    np.testing.assert_allclose(found, share)


def test_a_level_at_the_limit_is_not_above_it_where_quiet_ones_are():
    tiles = Tiles()
    tiles.quiet_dbm = -50.0
    cell = np.array([1, 2, 0], dtype=np.int32)
    limit_dbm = np.full(3, -79.0, dtype=np.float32)
    found = area(tiles).shares_above(np.array([9, 8], dtype=np.int32), cell, limit_dbm)
    # Of the first cell -79 and -78 dBm; the second one is nowhere received.
    assert found.tolist() == [0.5, 1.0, 1.0]


@pytest.mark.parametrize("rough", [True, False])
def test_kernels_are_handed_as_many_cells_as_they_fill_in(monkeypatch, rough):
    shapes = []
    monkeypatch.setattr(
        tiled_area, "look_up_levels", lambda *given: shapes.append([one.shape for one in given[5:]])
    )
    area().looked_up(PIXELS[:2], np.array([1, 2, 3], np.int32), rough=rough)
    count = 3 if rough else 0
    assert shapes == [[(3, 4), (count, 2, 2), (2, 3), (2, count)]]


def test_the_maps_likelihood_is_interpolated_between_centres():
    """A plane of 3 for each row to the south and -2 for each column to the east."""
    rng = np.random.default_rng(2)
    state = np.zeros((8, 40), dtype=np.float32)
    state[0], state[1] = rng.uniform(5.0, 45.0, 40), rng.uniform(5.0, 35.0, 40)
    found = area().log_map_at(state, 3.0)
    assert found.dtype == np.float32
    expected = 3.0 * (3.5 - state[1] / 10.0) - 2.0 * (state[0] / 10.0 - 0.5)
    np.testing.assert_allclose(found, expected, atol=1e-4)
    # Outside the centres, those at the edge.
    state[0, :2], state[1, :2] = [-20.0, 90.0], [-20.0, 90.0]
    found = area().log_map_at(state[:, :2].copy(), 3.0)
    np.testing.assert_allclose(found, [9.0, -8.0], atol=1e-4)


@pytest.mark.parametrize("count", [1, 255, 256, 257, 700])
def test_each_hypothesis_may_be_asked_for_a_cell_of_its_own(count):
    rng = np.random.default_rng(count)
    pixel, band = rng.integers(0, 20, count).astype(np.int32), rng.integers(0, 4, count)
    found = area().levels_at(pixel, band)
    expected = [expected_dbm(one, k) for one, k in zip(pixel.tolist(), band.tolist(), strict=True)]
    np.testing.assert_array_equal(found, expected)
    assert found.dtype == np.float32


@pytest.mark.parametrize(
    ("places_m", "weights", "way", "share"),
    [
        # Pixels are counted from the north-west: 4 and 5 are of one way, in two tiles.
        ([(45.0, 35.0), (5.0, 25.0), (25.0, 5.0)], [0.3, 0.3, 0.4], 70, 0.6),
        ([(45.0, 35.0), (5.0, 5.0), (45.0, 5.0)], [0.4, 0.3, 0.3], 81, 0.6),
        ([(45.0, 15.0), (-9.0, -9.0)], [0.6, 0.4], 80, 0.6),
        ([(45.0, 15.0)], [1.1], 80, 1.0),
    ],
)
def test_the_way_that_holds_the_most_of_a_belief(places_m, weights, way, share):
    east_m, north_m = np.array(places_m, dtype=np.float32).T.copy()
    found = area().matched_way(east_m, north_m, np.array(weights, dtype=np.float32))
    assert found == (way, pytest.approx(share))
    assert area().count == 6


def database(rows, cols):
    plan = SimpleNamespace(ids=("A", "B"), cells=())
    lattice = SimpleNamespace(rows=rows, cols=cols)
    return SimpleNamespace(lattice=lattice, plan=plan, floor_dbm=-110.0, path="db")


def test_an_area_has_fewer_pixels_than_32_bits_count(monkeypatch):
    monkeypatch.setattr(tiled_area, "received_cells", lambda _: ("A",))
    monkeypatch.setattr(tiled_area, "AreaTiles", lambda *given: given)
    with pytest.raises(StoreError, match="less than 2147483648 pixels"):
        TiledArea.of_database(database(1 << 16, 1 << 15))
    large = database((1 << 16) - 1, 1 << 15)
    found = TiledArea.of_database(large)
    assert found.tiles == (large, ("A",), (0,), tiled_area.TILE_PX, tiled_area.HELD_BYTES)
    assert (found.search_tiles, found.cell_ids, found.known_ids) == (48, ("A",), {"A", "B"})
    assert (found.lattice, found.floor_dbm) == (large.lattice, -110.0)
    given = TiledArea.of_database(large, 7, 99, 5)
    assert given.tiles == (large, ("A",), (0,), 7, 99)
    assert given.search_tiles == 5
