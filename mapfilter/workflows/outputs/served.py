"""Best servers of rasters and points of a database, thinned to what a picture can show."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Bools, Floats, Floats32, Ints, Ints32
from mapfilter.database.parquet import Window, WindowReader
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import same_crs
from mapfilter.lattice import Lattice
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.report.ground import BaseMap
from mapfilter.workflows.inputs.on_lattice import pixels_on

MOST_PX = 1200
"""Pixels along the longer side of a thinned area; a map in a picture is some 1 000 wide."""
MOST_READ_PX = 1_000_000_000
"""Of larger sets of rasters (pixels times cells) pictures show the levels at the points."""

_BLOCK_PX = 1024
_READ_PX = 40_000_000
_NEARLY_ALL = (0.01, 0.99)
_AROUND = 0.15
_LEAST_PX = 20
_COLUMNS = ("row", "col", "best_server", "best_level_dbm", "margin_db", "on_square")


@dataclass(frozen=True, eq=False)
class BestServers:
    """The strongest cell at every pixel of an area, thinned to what a picture shows."""

    lattice: Lattice
    server: Ints32
    """Index into the database's cells, (rows, cols); -1 where none is received."""
    level_dbm: Floats32
    """NaN where nothing is predicted."""
    margin_db: Floats32
    """Above the second best; infinite where there is none, NaN where none is received."""

    @classmethod
    def nowhere(cls, lattice: Lattice) -> BestServers:
        """Return a lattice without any served pixel."""
        shape = lattice.rows, lattice.cols
        unknown = np.full(shape, np.nan, dtype=np.float32)
        return cls(lattice, np.full(shape, -1, dtype=np.int32), unknown, unknown.copy())


@dataclass(frozen=True, eq=False)
class ServedPoints:
    """The points of a database, at most one for each pixel of a picture.

    In a database without cells all count as served by a first one.
    """

    window: Window
    """Their pixels on the database's lattice."""
    step: int
    """Pixels of that lattice along a side of a pixel of the picture."""
    best: BestServers
    """At the pixels that hold a point."""
    number: Ints
    """Points at each pixel."""
    on_square: Bools
    counts: Ints
    """Points that each cell serves best, all of them."""

    def places(self, cell: int | None = None) -> tuple[Floats, Floats]:
        """Return east and north of the points, or of those that a cell serves."""
        server = self.best.server
        row, col = np.nonzero(server >= 0 if cell is None else server == cell)
        east_m, north_m = self.best.lattice.east_north(row, col)
        return np.asarray(east_m), np.asarray(north_m)

    def window_about(self, rows: tuple[int, int], cols: tuple[int, int]) -> Window:
        """Return a window of the database's lattice about some pixels (first, last), with room."""
        around = int(_AROUND * max(rows[1] - rows[0], cols[1] - cols[0], _LEAST_PX)) + 1
        top, left, high, wide = self.window
        first_row = self.step * max(rows[0] - around, 0)
        first_col = self.step * max(cols[0] - around, 0)
        last_row = min(self.step * (rows[1] + around + 1), high)
        last_col = min(self.step * (cols[1] + around + 1), wide)
        return top + first_row, left + first_col, last_row - first_row, last_col - first_col

    def crowded_window(self) -> Window:
        """Return a window of nearly all points; the whole if that is less than twice as large."""
        if not self.number.any():
            return self.window
        low, high = _NEARLY_ALL
        ends = []
        for axis in (1, 0):
            share = np.cumsum(self.number.sum(axis=axis)) / self.number.sum()
            ends.append((int(np.argmax(share > low)), int(np.argmax(share >= high))))
        found = self.window_about(*ends)
        is_small = 2 * found[2] * found[3] < self.window[2] * self.window[3]
        return found if is_small else self.window


def thinned_lattice(lattice: Lattice) -> tuple[Lattice, int]:
    """Return a lattice of larger pixels over another, and how many times larger they are.

    Examples
    --------
    >>> lattice, step = thinned_lattice(Lattice("EPSG:32635", 0.0, 0.0, 5.0, 3000, 1000))
    >>> step, lattice.rows, lattice.cols, lattice.resolution_m
    (3, 1000, 334, 15.0)
    """
    step = ceil(max(lattice.rows, lattice.cols) / MOST_PX)
    rows, cols = ceil(lattice.rows / step), ceil(lattice.cols / step)
    side_m = step * lattice.resolution_m
    return replace(lattice, resolution_m=side_m, rows=rows, cols=cols), step


def best_servers(
    rasters: RxLevRasters, database: RadioRouteDatabase, area: Lattice | None = None
) -> BestServers:
    """Return the best server, its level and its margin over a database, or some of its area.

    Levels below the database's floor do not count. Of large areas every second, third... pixel is
    taken, block by block.

    Raises
    ------
    InputError
        Rasters and database are of different areas, or a raster is damaged.
    """
    window = common_window(rasters.lattice, area or database.lattice, str(database.path))
    lattice, step = thinned_lattice(rasters.lattice.window(*window))
    found = BestServers.nowhere(lattice)
    shape = lattice.rows, lattice.cols
    best_dbm, second_dbm = (np.full(shape, -np.inf, dtype=np.float32) for _ in range(2))
    # The middle of a larger pixel is one of the rasters' own.
    thinned = replace(rasters, lattice=lattice, resampling="nearest") if step > 1 else rasters
    top, left = (0, 0) if step > 1 else window[:2]
    ids = [cell_id for cell_id in rasters.cell_ids if cell_id in database.plan]
    # Together, as bands of one file often lie pixel by pixel, and reading one reads all.
    at_a_time = max(_READ_PX // _BLOCK_PX**2, 1)
    for row, col, rows, cols in lattice.tiles(max(_BLOCK_PX // step, 1)):
        at, here = (top + row, left + col, rows, cols), np.s_[row : row + rows, col : col + cols]
        for first in range(0, len(ids), at_a_time):
            some = ids[first : first + at_a_time]
            levels = thinned.read_levels_dbm(database.plan, at, some)
            for cell_id, level_dbm in zip(some, levels, strict=True):
                level_dbm[np.isnan(level_dbm)] = -np.inf
                better = level_dbm > best_dbm[here]
                beaten_dbm = np.where(better, best_dbm[here], level_dbm)
                second_dbm[here] = np.maximum(second_dbm[here], beaten_dbm)
                best_dbm[here][better] = level_dbm[better]
                found.server[here][better] = database.plan.index(cell_id)
    floor_dbm = np.float32(database.floor_dbm)
    second_dbm[second_dbm < floor_dbm] = -np.inf
    received, known = best_dbm >= floor_dbm, np.isfinite(best_dbm)
    found.server[~received] = -1
    found.level_dbm[known] = best_dbm[known]
    found.margin_db[received] = best_dbm[received] - second_dbm[received]
    return found


def served_points(database: RadioRouteDatabase, window: Window | None = None) -> ServedPoints:
    """Return the points of a database, or of a window of its lattice, read block by block.

    Raises
    ------
    StoreError
        A part of the database is damaged.
    """
    top, left, rows, cols = window or (0, 0, database.lattice.rows, database.lattice.cols)
    lattice, step = thinned_lattice(database.lattice.window(top, left, rows, cols))
    best = BestServers.nowhere(lattice)
    number = np.zeros(best.server.shape, dtype=np.int64)
    on_square = np.zeros(best.server.shape, dtype=np.bool_)
    counts = np.zeros(len(database.cell_ids), dtype=np.int64)
    ids = pa.array(database.cell_ids, type=pa.string())
    reader = WindowReader([database.points_part], _COLUMNS, database.lattice)
    for row, col, height, width in database.lattice.window(top, left, rows, cols).tiles(_BLOCK_PX):
        read = reader.read((top + row, left + col, height, width))
        if not read or not len(read["row"]):
            continue
        at = (read["row"] - top) // step, (read["col"] - left) // step
        server = np.zeros(len(read["row"]), dtype=np.int32)
        if database.cell_ids:
            server = pc.index_in(read["best_server"].cast(pa.string()), value_set=ids).to_numpy()
            counts += np.bincount(server, minlength=len(counts))
        margin_db = np.asarray(read["margin_db"])
        best.server[at], best.level_dbm[at] = server, read["best_level_dbm"]
        best.margin_db[at] = np.where(np.isnan(margin_db), np.inf, margin_db)
        on_square[at] = read["on_square"]
        np.add.at(number, at, 1)
    return ServedPoints((top, left, rows, cols), step, best, number, on_square, counts)


def common_window(lattice: Lattice, part: Lattice, where: str) -> Window:
    """Return the window of a lattice that lies on another, which ``where`` names.

    Raises
    ------
    InputError
        There are none.
    """
    found = pixels_on(lattice, part.bounds_m) if same_crs(lattice.crs, part.crs) else None
    if found is None:
        expected = "rasters of the database's area and CRS"
        raise fail(InputError, where, expected, "others", "built from other rasters")
    return found


def street_map(database: RadioRouteDatabase, points: ServedPoints) -> BaseMap:
    """Return the base map of some points, with the attribution of their database."""
    lattice = points.best.lattice
    return BaseMap(
        lattice.bounds_m,
        points_m=np.stack(points.places(), axis=-1),
        attribution=database.attribution,
        resolution_m=lattice.resolution_m,
        whole_m=database.lattice.bounds_m,
    )
