"""One tile of a build: its points, and the levels of all cells at them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from mapfilter._code import code_digest
from mapfilter._types import Floats, Floats32, Ints, Ints32
from mapfilter.database.floor import DECIMALS, FLOOR_DBM
from mapfilter.database.parquet import Window, dictionary, point_geometry
from mapfilter.database.sources import RoutePart
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.rasters.sampling import Places, levels_at
from mapfilter.roads.index import load_kernel
from mapfilter.roads.lattice import RouteLattice

_MAX_TILES = 64
"""Tiles of a group, however few cells reach them."""
_AT_POINTS = ("best", "best_level_dbm", "margin_db")
_AT_LEVELS = ("cell", "which", "level_dbm", "below_best_db")


@dataclass(frozen=True, slots=True, eq=False)
class TileTask:
    """Inputs of a tile, small enough to be sent to a worker.

    ``plan`` has the cells of the ``rasters`` that reach the tile (any cell where none does), whose
    numbers in the whole plan are ``numbers``, and whose layers in it are ``layers``; ``window``
    lies on the rasters' lattice.
    """

    rasters: RxLevRasters
    plan: CellPlan
    numbers: tuple[int, ...]
    layers: tuple[int, ...]
    window: Window
    part: RoutePart
    floor_dbm: float

    @property
    def pixels(self) -> int:
        """Pixels that are read, of all cells together; those of one where none reaches the tile."""
        return self.window[2] * self.window[3] * max(len(self.numbers), 1)


@dataclass(frozen=True, slots=True, eq=False)
class TileLevels:
    """Levels at a tile's N points: L of them in all.

    Of each point: the strongest cell (of equals the first in the plan; -1 when none is above the
    floor), its level (of one weaker than the floor, too; NaN without any), and its margin over the
    second strongest (NaN without one). Of each level, sorted by both: its cell, and the index of
    its point; the level, rounded to 0.01 dB; and how much weaker it is than the strongest of its
    layer.
    """

    best: Ints32
    best_level_dbm: Floats32
    margin_db: Floats32
    cell: Ints32
    which: Ints32
    level_dbm: Floats32
    below_best_db: Floats32

    def of_cells(self, numbers: Sequence[int]) -> TileLevels:
        """Return the same with other numbers of the cells."""
        # The last one is that of "none".
        number = np.array([*numbers, -1], dtype=np.int32)
        return replace(self, best=number[self.best], cell=number[self.cell])


@dataclass(frozen=True, slots=True, eq=False)
class TileRows:
    """A finished tile: its points as of :func:`places_table`, also without a level; the levels."""

    places: pa.Table
    levels: TileLevels

    def to_bytes(self) -> bytes:
        """Return the tile as two Arrow streams, one after the other."""
        levels = self.levels
        points = self.places
        for name in _AT_POINTS:
            points = points.append_column(name, pa.array(getattr(levels, name)))
        rows = pa.table({name: getattr(levels, name) for name in _AT_LEVELS})
        sink = pa.BufferOutputStream()
        for table in (points, rows):
            with pa.ipc.new_stream(sink, table.schema) as stream:
                stream.write_table(table)
        return bytes(sink.getvalue().to_pybytes())

    @classmethod
    def from_bytes(cls, data: bytes) -> TileRows:
        """Return the tile that :meth:`to_bytes` wrote."""
        source = pa.BufferReader(data)
        points = pa.ipc.open_stream(source).read_all()
        rows = pa.ipc.open_stream(source).read_all()
        columns = {name: points[name].to_numpy() for name in _AT_POINTS}
        columns |= {name: rows[name].to_numpy() for name in _AT_LEVELS}
        return cls(points.drop_columns(list(_AT_POINTS)), TileLevels(**columns))


def grouped(
    tasks: Iterable[TileTask], max_pixels: int, total: int = 0, shares: int = 1
) -> Iterator[list[TileTask]]:
    """Yield the tasks in groups, in order, each made when it is due.

    Parameters
    ----------
    tasks : iterable of TileTask
    max_pixels : int
        Pixels that a group reads; one tile is a group however many it reads.
    total : int
        Number of tasks, where it is known.
    shares : int
        A group has at most this part of the tasks that are left, so that the last ones are small
        and all workers end at about one time.
    """
    group: list[TileTask] = []
    pixels, left, most = 0, total, _MAX_TILES
    for task in tasks:
        if group and (pixels + task.pixels > max_pixels or len(group) >= most):
            yield group
            left -= len(group)
            group, pixels = [], 0
        if not group and total:
            most = min(max(-(-left // shares), 1), _MAX_TILES)
        group.append(task)
        pixels += task.pixels
    if group:
        yield group


def get_ready_to_read() -> None:
    """Load what the first tile takes, the kernel that lays points above all, while nothing waits.

    A worker does it when it starts; each process does it once.
    """
    code_digest()
    load_kernel()
    read_tiles([])


def read_tiles(tasks: Sequence[TileTask]) -> list[bytes]:
    """Make some tiles, on a worker."""
    return [tile.to_bytes() for tile in tiles_of(tasks)]


def read_tile(task: TileTask) -> TileRows:
    """Lay the points of a tile, and read its levels."""
    return next(tiles_of([task]))


def tiles_of(tasks: Sequence[TileTask]) -> Iterator[TileRows]:
    """Lay the points of some tiles near each other, and read their levels: each file once."""
    laid = [_laid(task) for task in tasks]
    read = levels_at([places for _, places in laid])
    for task, (table, _) in zip(tasks, laid, strict=True):
        level = read.pop(0).astype(np.float64)
        levels = received_levels(level, task.floor_dbm, np.array(task.layers, dtype=np.int64))
        yield TileRows(table, levels.of_cells(task.numbers))


def _laid(task: TileTask) -> tuple[pa.Table, Places]:
    routes = task.part if isinstance(task.part, RouteLattice) else task.part()
    table = places_table(routes, task.rasters.lattice)
    row, col = (table[name].to_numpy().astype(np.int64) for name in ("row", "col"))
    ids, (top, left, _, _) = task.plan.ids if task.numbers else (), task.window
    return table, Places(task.rasters, task.plan, ids, task.window, row - top, col - left)


def roads_tile(part: RoutePart, lattice: Lattice) -> TileRows:
    """Return a tile of roads alone, without levels."""
    routes = part if isinstance(part, RouteLattice) else part()
    none = np.empty((0, len(routes)))
    return TileRows(places_table(routes, lattice), received_levels(none, FLOOR_DBM))


def received_levels(level_dbm: Floats, floor_dbm: float, layer: Ints | None = None) -> TileLevels:
    """Return the levels above the floor of those of shape (cells, points), NaN where unknown.

    ``layer`` (cells,) are the numbers of their layers (:mod:`mapfilter.radio.layers`); None where
    all are of one.

    Examples
    --------
    >>> received = received_levels(np.array([[-80.0, -99.0], [-70.5, np.nan]]), -104.0)
    >>> received.best.tolist(), received.margin_db.tolist()
    ([1, 0], [9.5, nan])
    """
    level = np.round(level_dbm, DECIMALS)
    strength = np.where(level >= floor_dbm, level, -np.inf)
    if not len(strength):
        strength = np.full((1, *strength.shape[1:]), -np.inf)
    best = strength.argmax(axis=0)
    best_dbm = strength.max(axis=0)
    received = np.isfinite(best_dbm)
    strongest_dbm = np.where(received, best_dbm, np.fmax.reduce(level, axis=0, initial=np.nan))
    second_dbm = np.full_like(best_dbm, -np.inf)
    if len(strength) > 1:
        second_dbm = np.partition(strength, -2, axis=0)[-2]
    with np.errstate(invalid="ignore"):
        margin = np.where(np.isfinite(second_dbm), best_dbm - second_dbm, np.nan)
    cell, which = np.nonzero(np.isfinite(strength))
    kept_dbm = strength[cell, which]
    leading_dbm = best_dbm[which]
    if layer is not None and layer.any():
        numbers, own = np.unique(layer, return_inverse=True)
        of_layers = [strength[own == number].max(axis=0) for number in range(numbers.size)]
        leading_dbm = np.stack(of_layers)[own[cell], which]
    return TileLevels(
        np.where(received, best, -1).astype(np.int32),
        strongest_dbm.astype(np.float32),
        np.round(margin, DECIMALS).astype(np.float32),
        cell.astype(np.int32),
        which.astype(np.int32),
        kept_dbm.astype(np.float32),
        np.round(leading_dbm - kept_dbm, DECIMALS).astype(np.float32),
    )


def tile_windows(lattice: Lattice, tile_px: int) -> list[Window]:
    """Return the windows of a lattice's tiles along the Z-order curve."""
    windows = lattice.tiles(tile_px)
    row, col = (np.array([window[axis] for window in windows]) // tile_px for axis in (0, 1))
    return [windows[i] for i in np.argsort(z_order(row, col)).tolist()]


def places_table(routes: RouteLattice, lattice: Lattice) -> pa.Table:
    """Return points without their levels, along the Z-order curve.

    Rows, columns and point numbers are those of ``lattice``, which the routes are aligned with.
    """
    row, col = lattice.row_col(*routes.east_north_m)
    order = np.argsort(z_order(row, col))
    row, col = row[order], col[order]
    return pa.table(
        {
            "point": row * lattice.cols + col,
            "row": row.astype(np.int32),
            "col": col.astype(np.int32),
            "way_id": routes.way_id[order],
            "way_class": dictionary(routes.way_class[order], routes.class_names),
            "on_square": routes.on_square[order],
            "distance_to_way_m": routes.distance_to_way_m[order],
            # Of the database's pixels, so that no tile differs from the whole by a rounding.
            "geometry": point_geometry(*lattice.east_north(row, col)),
        }
    )


def z_order(row: Ints, col: Ints) -> NDArray[np.uint64]:
    """Return positions along the Z-order (Morton) curve: the bits of row and col in turns.

    Examples
    --------
    >>> z_order(np.array([0, 0, 1, 1, 0]), np.array([0, 1, 0, 1, 2])).tolist()
    [0, 1, 2, 3, 4]
    """
    return (_spread(row) << np.uint64(1)) | _spread(col)


def _spread(number: Ints) -> NDArray[np.uint64]:
    """Put a zero between any two bits of 32-bit numbers."""
    bits = np.asarray(number).astype(np.uint64)
    for shift, mask in (
        (16, 0x0000FFFF0000FFFF),
        (8, 0x00FF00FF00FF00FF),
        (4, 0x0F0F0F0F0F0F0F0F),
        (2, 0x3333333333333333),
        (1, 0x5555555555555555),
    ):
        bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
    return bits
