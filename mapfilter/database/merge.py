"""Merge databases: add areas or cells, replace cells by newer ones, leave cells out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from mapfilter._io import atomic_dir
from mapfilter._parallel import Progress
from mapfilter._types import Floats, Ints
from mapfilter.database.manifest import InputFile, check_database_replaceable
from mapfilter.database.measured import MeasuredParts, merged_parts
from mapfilter.database.merge_notes import names_apart
from mapfilter.database.parquet import Window, WindowReader, point_geometry
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.sources import note_misaligned, overlap, pixels_between
from mapfilter.database.store import open_database
from mapfilter.database.tiles import (
    TileRows,
    received_levels,
    tile_windows,
    z_order,
)
from mapfilter.errors import Faults, InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.layers import layer_numbers

_PLACE = ("row", "col", "way_id", "way_class", "on_square", "distance_to_way_m")


def merge(
    databases: Sequence[RadioRouteDatabase],
    out: Path | str,
    *,
    without: Sequence[str] = (),
    progress: Progress | None = None,
) -> RadioRouteDatabase:
    """Write a database of all points and cells of some databases, tile by tile, and open it.

    Within its area a later database overrides earlier ones for all cells in its cell table. So new
    cells or areas are added, and rebuilt ones replace the older ones, without building the rest
    again. Databases of the same inputs but for cells or area give, merged, the parts that one
    build of all would have given. Of a cell in several cell tables the last entry is kept
    (:func:`mapfilter.database.merge_notes.merge_notes` tells which differ). What
    surveys measured is kept where all of the databases have it.

    Parameters
    ----------
    databases : sequence of RadioRouteDatabase
        One or more, with one CRS, one resolution, aligned pixels, and the same margin and floor.
    out : Path or str
        The folder, possibly one of those merged; an older database is replaced once the new one is
        complete.
    without : sequence of str
        Cells to leave out.
    progress : callable, optional
        Called with tiles done and tiles in all.

    Raises
    ------
    InputError
        The databases do not fit each other, a cell to leave out is unknown, or nothing is left.
    StoreError
        A part is damaged.
    OutputError
        The folder cannot be written, or holds other files than a database.
    """
    lattice, plan = _check(databases, without)
    parameters = databases[0].manifest["parameters"]
    windows = [
        window
        for window in tile_windows(lattice, parameters["tile_px"])
        if any(overlap(lattice, database.lattice, window) for database in databases)
    ]
    out = Path(out)
    check_database_replaceable(out)
    names = names_apart([database.path for database in databases])
    inputs = tuple(
        InputFile("database", name, database.generation)
        for name, database in zip(names, databases, strict=True)
    )
    attribution = "; ".join(dict.fromkeys(filter(None, (d.attribution for d in databases))))
    with atomic_dir(out) as folder:
        tiles = _tiles(databases, lattice, plan, windows)
        written = write_parts(folder, lattice.crs, plan.ids, tiles, len(windows), progress=progress)
        if written.received == 0:
            raise fail(InputError, "merge", "a point with a level of a cell", "none")
        # No database holds points without a level, so they cannot be counted.
        counts = dict.fromkeys(("points", "points_below_floor", "points_off_rasters"))
        counts["points"] = written.received
        measured = _measured(databases, lattice, plan, without)
        head = Head(lattice, plan, parameters, attribution, inputs, counts, measured)
        head.write(folder, written.parts)
    return open_database(out)


def _measured(
    databases: Sequence[RadioRouteDatabase],
    lattice: Lattice,
    plan: CellPlan,
    without: Sequence[str],
) -> MeasuredParts | None:
    """Return what the surveys measured; None where one of the databases has no survey."""
    parts = [found for database in databases if (found := database.measured()) is not None]
    if len(parts) < len(databases):
        return None
    shifts = [pixels_between(lattice, database.lattice) for database in databases]
    parts = [
        _not_overridden(part, database.lattice, databases[number:])
        for number, (part, database) in enumerate(zip(parts, databases, strict=True), start=1)
    ]
    return merged_parts(parts, shifts, plan.ids, without)


def _not_overridden(
    part: MeasuredParts, lattice: Lattice, later: Sequence[RadioRouteDatabase]
) -> MeasuredParts:
    """Return what a survey measured without the deviations of levels that later ones override."""
    found = part.deviations
    kept = np.ones(len(found), dtype=np.bool_)
    for other in later:
        top, left = pixels_between(lattice, other.lattice)
        inside = (found.row >= top) & (found.row < top + other.lattice.rows)
        inside &= (found.col >= left) & (found.col < left + other.lattice.cols)
        known = np.array([name in other.plan for name in found.cell_ids], dtype=np.bool_)
        kept &= ~(inside & known[found.cell])
    return replace(part, deviations=found.some(kept))


@dataclass(frozen=True)
class _Source:
    """One of the databases, read by windows of the merged lattice; so are its results."""

    database: RadioRouteDatabase
    lattice: Lattice

    @cached_property
    def _points(self) -> WindowReader:
        return WindowReader([self.database.points_part], _PLACE, self.database.lattice)

    @cached_property
    def _cells(self) -> dict[str, WindowReader]:
        parts, own = self.database.level_parts, self.database.lattice
        columns = ("row", "col", "level_dbm")
        return {cell_id: WindowReader(files, columns, own) for cell_id, files in parts.items()}

    def places(self, window: Window) -> pa.Table | None:
        """Return the places in a window; None without any."""
        rows = self._rows(self._points, window)
        if not rows:
            return None
        row, col = rows["row"], rows["col"]
        return pa.table(
            {
                "point": row * self.lattice.cols + col,
                "row": row.astype(np.int32),
                "col": col.astype(np.int32),
                **{name: rows[name] for name in _PLACE[2:]},
                "geometry": point_geometry(*self.lattice.east_north(row, col)),
            }
        )

    def levels(self, window: Window) -> Iterator[tuple[str, Ints, Floats]]:
        """Yield the cells with a level in a window, with the points there and their levels."""
        for cell_id, reader in self._cells.items():
            rows = self._rows(reader, window)
            if rows and rows["row"].size:
                yield cell_id, rows["row"] * self.lattice.cols + rows["col"], rows["level_dbm"]

    def _rows(self, reader: WindowReader, window: Window) -> dict[str, Any]:
        down, right = pixels_between(self.lattice, self.database.lattice)
        row, col, rows, cols = window
        found: dict[str, Any] = reader.read((row - down, col - right, rows, cols))
        if found:
            found["row"] = found["row"].astype(np.int64) + down
            found["col"] = found["col"].astype(np.int64) + right
        return found


def _tiles(
    databases: Sequence[RadioRouteDatabase],
    lattice: Lattice,
    plan: CellPlan,
    windows: Sequence[Window],
) -> Iterator[TileRows]:
    sources = [_Source(database, lattice) for database in databases]
    floor_dbm, layer = databases[0].floor_dbm, layer_numbers(plan.cells)
    for window in windows:
        inside = [(source, overlap(lattice, source.database.lattice, window)) for source in sources]
        covering = [(source, part) for source, part in inside if part is not None]
        places = _places(covering)
        point = places["point"].to_numpy()
        by_cell = _levels(covering, plan, point, lattice.cols)
        cells = sorted(by_cell)
        level = [by_cell[cell] for cell in cells] or [np.full(point.size, np.nan)]
        levels = received_levels(np.stack(level), floor_dbm, layer[cells] if cells else None)
        yield TileRows(places, levels.of_cells(cells) if cells else levels)


def _places(covering: Sequence[tuple[_Source, Window]]) -> pa.Table:
    """Return the places of a tile; of one in several databases, the row of the last one."""
    found = (source.places(window) for source, window in covering)
    tables = [table for table in found if table is not None]
    if not tables:
        return pa.table({name: np.empty(0, np.int64) for name in ("point", "row", "col")})
    table = pa.concat_tables(tables).unify_dictionaries().combine_chunks()
    point = table["point"].to_numpy()
    # The first among the rows in reversed order is the last.
    _, last = np.unique(point[::-1], return_index=True)
    chosen = point.size - 1 - last
    order = z_order(table["row"].to_numpy()[chosen], table["col"].to_numpy()[chosen]).argsort()
    return table.take(pa.array(chosen[order]))


def _levels(
    covering: Sequence[tuple[_Source, Window]], plan: CellPlan, point: Ints, cols: int
) -> dict[int, Floats]:
    """Return the levels of each cell at the places of a tile, NaN where unknown."""
    sorter = point.argsort()
    row, col = np.divmod(point, cols)
    by_cell: dict[int, Floats] = {}
    for source, (top, left, height, width) in covering:
        own = (row >= top) & (row < top + height) & (col >= left) & (col < left + width)
        for cell_id in source.database.cell_ids:
            if cell_id in plan and (older := by_cell.get(plan.index(cell_id))) is not None:
                older[own] = np.nan
        for cell_id, points, level_dbm in source.levels((top, left, height, width)):
            if cell_id in plan:
                level = by_cell.setdefault(plan.index(cell_id), np.full(point.size, np.nan))
                level[sorter[np.searchsorted(point, points, sorter=sorter)]] = level_dbm
    return by_cell


def _check(
    databases: Sequence[RadioRouteDatabase], without: Sequence[str]
) -> tuple[Lattice, CellPlan]:
    """Return the lattice and the plan of all together."""
    faults = Faults()
    if not databases:
        raise fail(InputError, "merge", "at least one database", "none")
    first, cells = databases[0], dict[str, Cell]()
    for database in databases:
        _note_misfit(first, database, faults)
        for cell in database.plan.cells:
            older = cells.get(cell.id, cell)
            places = [(one.east_m, one.north_m) for one in (older, cell)]
            if places[0] != places[1]:
                where, hint = f"{database.path}, cell {cell.id!r}", "databases of other networks"
                faults.add(where, "one place", "another one in an earlier database", hint)
            cells[cell.id] = cell
    for cell_id in without:
        if cell_id not in cells:
            faults.add("without", "a cell of the databases", repr(cell_id))
    left = tuple(cell for cell in cells.values() if cell.id not in set(without))
    for database in databases:
        if not database.cell_ids:
            hint = "roads alone are not merged: build them together"
            faults.add(str(database.path), "a database with cells", "none", hint)
    if not left and not faults.found:
        faults.add("without", "a cell that is left", "none")
    faults.raise_if_any(InputError)
    base = first.lattice
    corner = np.array([pixels_between(base, database.lattice) for database in databases])
    size = [(database.lattice.rows, database.lattice.cols) for database in databases]
    (top, left_col), (bottom, right) = corner.min(axis=0), (corner + size).max(axis=0)
    lattice = Lattice(
        base.crs,
        base.west_m + int(left_col) * base.resolution_m,
        base.north_m - int(top) * base.resolution_m,
        base.resolution_m,
        int(bottom - top),
        int(right - left_col),
    )
    return lattice, CellPlan(base.crs, left)


def _note_misfit(first: RadioRouteDatabase, other: RadioRouteDatabase, faults: Faults) -> None:
    where = f"{other.path}, compared with {first.path}"
    for name in ("margin_db", "floor_dbm"):
        if getattr(first, name) != getattr(other, name):
            expected = f"{name} {getattr(first, name):g}"
            faults.add(where, expected, f"{getattr(other, name):g}", "built with other parameters")
    note_misaligned(first.lattice, other.lattice, where, "rasters of another lattice", faults)
