"""Levels by cell and nearest points by window, against brute force over all points."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest
from small_world import CRS, IDS, LATTICE, make_plan

from mapfilter.database import cell_levels
from mapfilter.database.cell_levels import PointReader, part_extents, read_levels, received_cells
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.store import open_database
from mapfilter.database.tiles import TileRows, places_table, received_levels
from mapfilter.errors import StoreError
from mapfilter.lattice import Lattice
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.widths import half_width_of

NO_CELL = "S0.Q"


def write_points(folder, lattice, row, col, level_dbm=None, ids=IDS, tiles=1):
    """Write a database of given points; levels (cells, points), some of them NaN.

    Ways and distances differ from point to point; every third point lies in a square.
    """
    count, plan = len(row), make_plan(ids)
    level_dbm = np.full((len(ids), count), -70.0) if level_dbm is None else level_dbm
    number = np.arange(count)
    folder.mkdir(parents=True)

    def parts():
        for which in np.array_split(number, tiles):
            routes = RouteLattice(
                lattice, row[which].astype("i4"), col[which].astype("i4"),
                np.where(which % 5 == 4, 0, 100 + which), (which % 2).astype("i2"),
                ("residential", "motorway"), (which % 4).astype("f4"), which % 3 == 2,
            )  # fmt: skip
            levels = received_levels(level_dbm[:, which], -100.0)
            yield TileRows(places_table(routes, lattice), levels)

    written = write_parts(folder, CRS, plan.ids, parts(), tiles)
    counts = {"points": written.received, "points_below_floor": 0, "points_off_rasters": 0}
    parameters = {"margin_db": 6.0, "floor_dbm": -100.0, "tile_px": 60}
    Head(lattice, plan, parameters, "", (), counts).write(folder, written.parts)
    return open_database(folder)


def scattered(lattice, count, seed):
    """Points in row-major order."""
    rng = np.random.default_rng(seed)
    number = np.sort(rng.choice(lattice.rows * lattice.cols, count, replace=False))
    return np.divmod(number, lattice.cols)


def test_cells_without_a_level_are_not_received(tmp_path):
    ids = (NO_CELL, *IDS)
    row, col = scattered(LATTICE, 30, 1)
    level_dbm = np.full((4, 30), -80.0)
    level_dbm[0] = np.nan
    level_dbm[2, 1:] = np.nan
    made = write_points(tmp_path / "db", LATTICE, row, col, level_dbm, ids)
    assert received_cells(made) == IDS
    assert received_cells(made.without_cells()) == ()
    # A part without rows is none.
    empty = {cell: tuple(replace(part, rows=0) for part in made.level_parts[cell]) for cell in IDS}
    made.__dict__["level_parts"] = {**empty, IDS[1]: made.level_parts[IDS[1]]}
    assert received_cells(made) == (IDS[1],)
    # The band is the cell's place among all that are asked for.
    assert part_extents(made, IDS).band.tolist() == [1]


def test_extents_are_those_of_each_cells_points(database):
    asked = (IDS[2], IDS[0])
    found = part_extents(database, asked)
    assert found.band.tolist() == [0, 1]
    for band, cell in enumerate(asked):
        row, col, level_dbm = database.cell_points(cell, np.inf)
        assert found.box[band].tolist() == [row.min(), row.max(), col.min(), col.max()]
        assert found.most_dbm[band] == level_dbm.max()
    assert found.box[0].tolist() != found.box[1].tolist()


def test_extents_of_cells_that_are_received_nowhere(database):
    database = replace(database)
    database.__dict__["level_parts"] = dict.fromkeys(IDS, ())
    found = part_extents(database, IDS)
    assert [len(one) for one in found] == [0, 0, 0, 0]


def test_the_levels_of_a_part_are_in_the_order_of_its_points(database):
    for cell in IDS:
        row, col, level_dbm = database.cell_points(cell, np.inf)
        (part,) = database.level_parts[cell]
        found = read_levels(part, LATTICE)
        np.testing.assert_array_equal(found.point, row.astype(np.int64) * LATTICE.cols + col)
        np.testing.assert_array_equal(found.level_dbm, level_dbm)
        assert np.all(np.diff(found.point) > 0)
        assert (found.point.dtype, found.level_dbm.dtype) == (np.int32, np.float32)


def test_extents_name_the_parts_of_each_cell_in_order(database):
    parts = {cell: database.level_parts[cell] for cell in IDS}
    several = replace(database)
    several.__dict__["level_parts"] = {**parts, IDS[0]: parts[IDS[0]] * 3}
    found = part_extents(several, IDS)
    assert found.band.tolist() == [0, 0, 0, 1, 2]
    assert found.part == (*parts[IDS[0]] * 3, *parts[IDS[1]], *parts[IDS[2]])


def test_points_beyond_the_lattice_are_refused(database):
    (part,) = database.level_parts[IDS[0]]
    last = int(read_levels(part, LATTICE).point[-1])
    assert read_levels(part, Lattice(CRS, 0.0, 5.0, 5.0, 1, last + 1)).point[-1] == last
    with pytest.raises(
        StoreError, match="points on the database's lattice, found others"
    ) as caught:
        read_levels(part, Lattice(CRS, 0.0, 5.0, 5.0, 1, last))
    assert str(part) in caught.value.faults[0].where


def test_a_lattice_with_more_pixels_than_32_bits_count_is_refused(database):
    (part,) = database.level_parts[IDS[0]]
    point = read_levels(part, LATTICE).point
    most = read_levels(part, Lattice(CRS, 0.0, 5.0, 5.0, 1 << 15, 1 << 16))
    np.testing.assert_array_equal(most.point, point)
    with pytest.raises(
        StoreError, match="at most 2147483648 pixels, found 32769 x 65536"
    ) as caught:
        read_levels(part, Lattice(CRS, 0.0, 5.0, 5.0, (1 << 15) + 1, 1 << 16))
    assert str(part) in caught.value.faults[0].where


@pytest.mark.parametrize(
    ("points", "good"),
    [((0,), True), ((1999,), True), ((2000,), False), ((-1,), False), ((-1, 7), False),
     ((5, 2000), False), ((5, 3, 0), True), ((), True)],
)  # fmt: skip
def test_which_points_lie_on_the_lattice(database, monkeypatch, points, good):
    levels_dbm = -60.0 - np.arange(len(points), dtype=np.float32)
    table = pa.table({"point": np.array(points, dtype=np.int64), "level_dbm": levels_dbm})
    monkeypatch.setattr(cell_levels, "read_columns", lambda _, columns: table.select(columns))
    if not good:
        with pytest.raises(StoreError, match="points on the database's lattice, found others"):
            read_levels(database.level_parts[IDS[0]][0], LATTICE)
        return
    found = read_levels(database.level_parts[IDS[0]][0], LATTICE)
    order = np.argsort(points)
    np.testing.assert_array_equal(found.point, np.array(points, dtype=int)[order])
    np.testing.assert_array_equal(found.level_dbm, levels_dbm[order])


WIDE = Lattice(CRS, 500_000.0, 4_000_000.0, 10.0, 300, 260)
"""Wider than what is read at first around a window, several times over."""


@pytest.fixture(scope="module")
def sparse(tmp_path_factory):
    row, col = scattered(WIDE, 40, 5)
    rng = np.random.default_rng(6)
    level_dbm = np.round(rng.uniform(-90, -60, (3, 40)), 2)
    level_dbm[1:, ::4] = np.nan
    level_dbm[:, 7] = -65.0
    return write_points(tmp_path_factory.mktemp("sparse") / "db", WIDE, row, col, level_dbm)


def windows(lattice, count, seed):
    """Windows of all sizes, also at the edges."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        rows, cols = rng.integers(1, 60, 2)
        top, left = (
            rng.integers(0, lattice.rows - rows + 1),
            rng.integers(0, lattice.cols - cols + 1),
        )
        yield int(top), int(left), int(rows), int(cols)
    yield 0, 0, lattice.rows, lattice.cols
    yield 0, 0, 1, 1
    yield lattice.rows - 1, lattice.cols - 1, 1, 1
    yield lattice.rows // 2, 0, 1, lattice.cols


@pytest.mark.parametrize("window", [*windows(WIDE, 8, 7)])
def test_the_nearest_points_of_a_window_are_those_of_the_database(sparse, window):
    points, (top, left, rows, cols) = sparse.points(), window
    found = PointReader(sparse).nearest(window)
    assert found.window == window
    assert found.near.shape == found.edge_m.shape == (rows, cols)
    assert (found.near.dtype, found.point.dtype) == (np.int32, np.int64)
    assert (found.edge_m.dtype, found.best_dbm.dtype, found.second_dbm.dtype) == (np.float32,) * 3
    row, col = np.mgrid[top : top + rows, left : left + cols]
    chosen = found.point[found.near]
    away = np.hypot(chosen // WIDE.cols - row, chosen % WIDE.cols - col)
    every = np.hypot(points.row - row[..., None], points.col - col[..., None])
    np.testing.assert_allclose(away, every.min(axis=-1), rtol=1e-12)
    # Each of the points is the nearest of a pixel, and they ascend.
    np.testing.assert_array_equal(np.unique(found.near), np.arange(found.point.size))
    assert np.all(np.diff(found.point) > 0)
    at = np.searchsorted(points.point, found.point)
    np.testing.assert_array_equal(found.way_id, points.way_id[at])
    np.testing.assert_array_equal(found.best_dbm, points.best_level_dbm[at])
    second = points.best_level_dbm[at] - points.margin_db[at].astype(float)
    np.testing.assert_allclose(found.second_dbm, second, atol=6e-3)
    code, classes = points.way_class
    half_m = np.array([half_width_of(name) for name in classes])[code]
    half_m = np.where(points.way_id == 0, 0.0, half_m)[at][found.near]
    on_way_m = np.where(points.on_square, 0.0, points.distance_to_way_m)[at][found.near]
    expected_m = np.maximum(10.0 * away + on_way_m - half_m, 0.0)
    np.testing.assert_allclose(found.edge_m, expected_m, rtol=1e-5, atol=1e-4)


def test_second_levels_are_those_of_the_second_cell(sparse):
    """To a hundredth of a decibel, and none where one cell alone is received."""
    found = PointReader(sparse).nearest((0, 0, WIDE.rows, WIDE.cols))
    levels = np.full((3, found.point.size), np.nan)
    for k, cell in enumerate(IDS):
        own = read_levels(sparse.level_parts[cell][0], WIDE)
        levels[k, np.searchsorted(found.point, own.point)] = own.level_dbm
    ordered = np.sort(np.where(np.isnan(levels), -np.inf, levels), axis=0)
    np.testing.assert_array_equal(found.best_dbm, ordered[2].astype(np.float32))
    alone = np.isneginf(ordered[1])
    assert 0 < alone.sum() < alone.size
    assert np.isnan(found.second_dbm[alone]).all()
    np.testing.assert_array_equal(found.second_dbm[~alone], ordered[1][~alone].astype(np.float32))


def test_no_more_is_read_than_may_hold_the_nearest(sparse, monkeypatch):
    """Near a point little is read; a window without one is grown until nothing can be nearer."""
    read, reader = [], PointReader(sparse)
    own = reader._reader.read
    monkeypatch.setattr(reader._reader, "read", lambda window: read.append(window) or own(window))
    point = sparse.points().point
    middle = next(
        (int(row), int(col)) for row, col in zip(*np.divmod(point, WIDE.cols), strict=True)
        if 40 < row < 250 and 40 < col < 200
    )  # fmt: skip
    reader.nearest((*middle, 1, 1))
    assert read == [(middle[0] - 32, middle[1] - 32, 65, 65)]
    points = sparse.points()
    every = np.hypot(points.row[:, None, None] - np.arange(WIDE.rows)[:, None],
                     points.col[:, None, None] - np.arange(WIDE.cols)).min(axis=0)  # fmt: skip
    inner = every[45:-45, 45:-45]
    row, col = (int(n) + 45 for n in np.unravel_index(inner.argmax(), inner.shape))
    assert every[row, col] > 25
    read.clear()
    found = reader.nearest((row, col, 1, 1))
    reach = min(read[-1][2] // 2, read[-1][3] // 2)
    assert every[row, col] < reach + 1
    away = np.hypot(*(np.divmod(found.point[0], WIDE.cols) - np.array([row, col])))
    assert away == pytest.approx(every[row, col])


@pytest.mark.parametrize(
    ("window", "margin", "expected"),
    [
        ((100, 100, 20, 30), 8, (92, 92, 36, 46)),
        ((0, 0, 20, 30), 8, (0, 0, 28, 38)),
        ((280, 240, 20, 20), 8, (272, 232, 28, 28)),
        ((5, 6, 20, 30), 8, (0, 0, 33, 44)),
        ((270, 220, 20, 30), 80, (190, 140, 110, 120)),
    ],
)
def test_a_window_grows_within_the_lattice(window, margin, expected):
    assert cell_levels._grown(window, margin, WIDE) == expected


@pytest.mark.parametrize(
    ("window", "outer"),
    [
        ((3, 4, 2, 3), (1, 2, 6, 7)),
        ((3, 4, 2, 3), (3, 4, 2, 3)),
        ((0, 0, 4, 5), (0, 0, 6, 8)),
        ((0, 4, 4, 6), (0, 3, 8, 7)),
        ((5, 5, 5, 7), (2, 4, 8, 8)),
        ((5, 0, 1, 12), (2, 0, 6, 12)),
        ((0, 5, 10, 1), (0, 3, 10, 5)),
        ((2, 3, 4, 4), (0, 0, 10, 12)),
    ],
)
def test_how_far_is_seen_beyond_a_window(window, outer):
    """Brute force over the pixels that were not read; further than the lattice where all were."""
    lattice = Lattice(CRS, 0.0, 100.0, 10.0, 10, 12)
    (top, left, rows, cols), (low, west, high, wide) = window, outer
    unread = np.ones((lattice.rows, lattice.cols), dtype=bool)
    unread[low : low + high, west : west + wide] = False
    row, col = np.mgrid[top : top + rows, left : left + cols]
    seen = np.broadcast_to(cell_levels._seen_px(window, outer, lattice), row.shape)
    if not unread.any():
        assert seen.min() > np.hypot(lattice.rows, lattice.cols)
        return
    beyond = np.argwhere(unread)
    away = np.hypot(row[..., None] - beyond[:, 0], col[..., None] - beyond[:, 1]).min(axis=-1)
    np.testing.assert_array_equal(seen, away)


def test_a_database_without_points_in_reach_reads_all_of_it(tmp_path):
    """The only point lies in the opposite corner; without any there is no nearest one."""
    row, col = np.array([299]), np.array([259])
    database = write_points(tmp_path / "one", WIDE, row, col)
    found = PointReader(database).nearest((0, 0, 2, 3))
    assert found.point.tolist() == [299 * 260 + 259]
    assert np.all(found.near == 0)
    away_m = 10.0 * np.hypot(299 - np.arange(2)[:, None], 259 - np.arange(3)[None, :])
    half_m = half_width_of("residential")
    np.testing.assert_allclose(found.edge_m, away_m - half_m, rtol=1e-6)
    assert np.isnan(found.second_dbm).sum() == 0
