"""Tiles of a small area by hand: windows, levels of parts, ranges, and which cells are strong."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from mapfilter.database.cell_levels import CellLevels, NearestPoints, PartExtents
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area import area_tiles as tested
from mapfilter.positioning.bayes.area.area_tiles import AreaTiles

ROWS, COLS, SIDE = 5, 7, 3
LATTICE = Lattice("EPSG:32632", 0.0, 100.0, 20.0, ROWS, COLS)
"""2 x 3 tiles of 3 pixels; the roughness of 20 m pixels is that of 3 x 3 of them."""
PARTS = {
    # Points and levels by part; A has two parts, B and C have one.
    "A west": ([0, 1, 8, 14], [-60.0, -70.0, -65.0, -90.0]),
    "A east": ([20, 26, 27], [-80.0, -75.0, -85.0]),
    "B": ([3, 33, 34], [-55.0, -95.0, -99.0]),
    "C": ([0], [-101.0]),
}
BANDS = {"A west": 0, "A east": 0, "B": 1, "C": 2}
QUIET_DBM = -116.0


@dataclass(frozen=True)
class Database:
    lattice: Lattice = LATTICE
    floor_dbm: float = -110.0


class Reader:
    """A point at each pixel; notes the windows that are read."""

    def __init__(self):
        self.windows = []

    def nearest(self, window):
        self.windows.append(window)
        top, left, rows, cols = window
        row, col = np.indices((rows, cols)).reshape(2, -1)
        point = (row + top) * COLS + col + left
        best = np.where(point % 5 == 0, np.nan, -50.0 - point).astype(np.float32)
        return NearestPoints(
            window, np.arange(point.size, dtype=np.int32).reshape(rows, cols), point,
            point % 3, best, best - np.float32(7.0), (point / 2.0).reshape(rows, cols).astype("f4"),
        )  # fmt: skip


@pytest.fixture
def tiles(monkeypatch):
    made, read = AreaTiles(Database(), ("A", "B", "C"), (), SIDE), []

    def levels_of(part, lattice):
        assert lattice is LATTICE
        read.append(part)
        point, level_dbm = PARTS[part]
        return CellLevels(np.array(point, np.int32), np.array(level_dbm, np.float32))

    monkeypatch.setattr(tested, "read_levels", levels_of)
    box = [[min(p) // COLS, max(p) // COLS, min(n % COLS for n in p), max(n % COLS for n in p)]
           for p, _ in PARTS.values()]  # fmt: skip
    most = np.array([max(level_dbm) for _, level_dbm in PARTS.values()])
    band = np.array(list(BANDS.values()))
    made.__dict__["extents"] = PartExtents(tuple(PARTS), band, np.array(box), most)
    made.__dict__["_reader"] = Reader()
    made.read = read
    return made


def level_at(band, point):
    for name, (points, level_dbm) in PARTS.items():
        if BANDS[name] == band and point in points:
            return level_dbm[points.index(point)]
    return QUIET_DBM


@pytest.mark.parametrize(
    ("number", "window", "own"),
    # One pixel more to each side, but not beyond the area; tiles at its ends are smaller.
    [(0, (0, 0, 4, 4), (0, 3, 0, 3)), (1, (0, 2, 4, 5), (0, 3, 3, 6)),
     (2, (0, 5, 4, 2), (0, 3, 6, 7)), (3, (2, 0, 3, 4), (3, 5, 0, 3)),
     (4, (2, 2, 3, 5), (3, 5, 3, 6)), (5, (2, 5, 3, 2), (3, 5, 6, 7))],
)  # fmt: skip
def test_windows_and_points_of_tiles(tiles, number, window, own):
    assert (tiles.rows, tiles.cols) == (2, 3)
    tile = tiles.tile(number)
    assert tiles.__dict__["_reader"].windows == [window]
    assert tile.corner == window[:2]
    top, bottom, left, right = own
    row, col = np.indices((ROWS, COLS))[:, top:bottom, left:right].reshape(2, -1)
    np.testing.assert_array_equal(tile.row, row)
    np.testing.assert_array_equal(tile.col, col)
    first_row, first_col, rows, cols = window
    assert tile.box == (first_row, first_row + rows - 1, first_col, first_col + cols - 1)
    # It is held, and not read again.
    assert tiles.tile(number) is tile
    # 5 m deviation: beside a way of 8.5 m a hypothesis is improbable.
    near = tiles.log_map(number, 5.0)
    assert near.shape == tile.points.edge_m.shape
    at = np.unravel_index(np.argmin(tile.points.edge_m), near.shape)
    assert near[at] == near.max()


@pytest.mark.parametrize("number", range(6))
def test_levels_are_those_of_all_parts_of_a_cell(tiles, number):
    point = tiles.tile(number).points.point
    for band in (0, 1, 2):
        expected = np.array([level_at(band, one) for one in point.tolist()], dtype=np.float32)
        found = tiles.levels(number, band)
        if (expected == QUIET_DBM).all():
            assert found is None
            assert tiles.rough_db(number, band) is None
        else:
            np.testing.assert_array_equal(found, expected)
            assert tiles.rough_db(number, band).shape == tiles.tile(number).points.near.shape
    # The strongest and the second strongest of all cells; a level for no cell where none is.
    best = np.where(point % 5 == 0, QUIET_DBM, -50.0 - point)
    np.testing.assert_array_equal(tiles.levels(number, 3), best.astype(np.float32))
    second = np.where(point % 5 == 0, QUIET_DBM, -57.0 - point)
    np.testing.assert_array_equal(tiles.levels(number, 4), second.astype(np.float32))


def test_parts_that_do_not_reach_a_tile_are_not_read(tiles):
    assert tiles.levels(5, 0) is not None
    assert set(tiles.read) == {"A east"}
    # The box of B's points reaches the tile, and none of the points does.
    assert tiles.levels(2, 1) is None
    assert tiles.levels(3, 1) is None
    assert set(tiles.read) == {"A east", "B"}
    assert tiles.levels(0, 0) is not None
    assert set(tiles.read) == {"A east", "B", "A west"}


@pytest.mark.parametrize("limit_dbm", [-50.0, -62.0, -77.0, -84.0, -97.0])
@pytest.mark.parametrize("bands", [(0, 1), (1,), (0,), ()])
def test_cells_that_may_be_above_a_level(tiles, limit_dbm, bands):
    for number in range(6):
        points = tiles.tile(number).points.point.tolist()
        strong = [
            place for place, band in enumerate(bands)
            if max(level_at(band, one) for one in points) > limit_dbm
        ]  # fmt: skip
        for _ in range(2):
            limits_dbm = np.full(len(bands), limit_dbm, dtype=np.float32)
            found = tiles.strong(number, np.array(bands, dtype=np.int32), limits_dbm)
            assert found.tolist() == strong


def test_cells_whose_parts_are_weaker_are_not_read_for_it(tiles):
    limits_dbm = np.full(2, -54.0, dtype=np.float32)
    assert tiles.strong(0, np.array([0, 1], dtype=np.int32), limits_dbm).tolist() == []
    assert tiles.read == []


def test_ranges_of_levels_by_tiles(tiles):
    """Of A in the first row of tiles the first and the last, in the second the last two."""
    first, second = tiles.range_of(0), tiles.range_of(1)
    assert (first.row, first.col, second.row, second.col) == (0, 0, 0, 1)
    nan = np.nan
    np.testing.assert_array_equal(first.most_dbm, [[-60.0, nan, -80.0], [nan, -75.0, -85.0]])
    np.testing.assert_array_equal(first.least_dbm, [[-90.0, nan, -80.0], [nan, -75.0, -85.0]])
    np.testing.assert_array_equal(second.most_dbm, [[-55.0, nan], [-95.0, -99.0]])
    np.testing.assert_array_equal(second.least_dbm, [[-55.0, nan], [-95.0, -99.0]])
    assert tiles.range_of(0) is first


def test_other_processes_read_for_themselves():
    given = AreaTiles(Database(), ("A", "B"), (), SIDE, 12_345)
    again = pickle.loads(pickle.dumps(given))
    assert (again.cell_ids, again.side, again.largest_bytes) == (("A", "B"), SIDE, 12_345)
    assert (again.rows, again.cols, again.quiet_dbm) == (2, 3, QUIET_DBM)
    usual = AreaTiles(Database(), ("A",))
    assert (usual.side, usual.largest_bytes, usual.rows, usual.cols) == (128, 640 << 20, 1, 1)
