"""Roads times rasters: building a radio-route database tile by tile."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from mapfilter._io import atomic_dir, check_replaceable, write_json
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter.database.manifest import (
    CELLS,
    FORMAT,
    MANIFEST,
    VERSION,
    InputFile,
    describe_part,
)
from mapfilter.database.parts import (
    ROWS_IN_MEMORY,
    PartWriter,
    levels_tables,
    places_table,
    points_table,
    z_order,
)
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database, write_cells
from mapfilter.database.tiles import Tile, pixel_offset, read_tile
from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.rasters import RxLevRasters, check_against_plan
from mapfilter.roads.lattice import RouteLattice

MARGIN_DB = 6.0
FLOOR_DBM = -104.0
TILE_PX = 256

_SAMPLED_TILES = 4
_BYTES_PER_POINT_IN_MEMORY = 120
_BYTES_PER_LEVEL_IN_MEMORY = 40


@dataclass(frozen=True, slots=True)
class BuildEstimate:
    """What a build would give, extrapolated from a few of its tiles.

    Parameters
    ----------
    points : int
        Points of the route lattice on the rasters; exact, those that hear nothing included.
    levels : int
        Rows of all cells together.
    bytes : int
        Size of the database on disk.
    memory_bytes : int
        Most memory that the writing process needs.
    seconds : float
        Time with one worker.
    """

    points: int
    levels: int
    bytes: int
    memory_bytes: int
    seconds: float


def build(
    rasters: RxLevRasters,
    plan: CellPlan,
    routes: RouteLattice,
    out: Path | str,
    *,
    margin_db: float = MARGIN_DB,
    floor_dbm: float = FLOOR_DBM,
    tile_px: int = TILE_PX,
    inputs: Sequence[InputFile] = (),
    attribution: str = "",
    executor: Executor | None = None,
    in_flight: int = 8,
    progress: Progress | None = None,
) -> RadioRouteDatabase:
    """Build a database folder and open it.

    A point belongs to its best server and to every cell at most ``margin_db`` weaker. All levels
    above the floor are kept, so the margin can be chosen anew when the database is read; a point
    that hears no cell above the floor is left out and counted. Levels are kept to 0.01 dB.

    Parameters
    ----------
    rasters : RxLevRasters
        Levels, or losses that are taken from the plan's EIRP. Their lattice is the database's.
    plan : CellPlan
        The same cells as in the rasters.
    routes : RouteLattice
        Aligned with the rasters' lattice; points beyond it are left out and counted.
    out : Path or str
        The folder; an older one is replaced once the new one is whole.
    margin_db, floor_dbm : float
    tile_px : int
        Side of the tiles that the work is done by. Points are stored tile by tile along the
        Z-order curve, and along it within each tile.
    inputs : sequence of InputFile
        What the roads and the rasters were made from, for the record; the rasters are added.
    attribution : str
        Whose map the roads come from, as its licence wants it shown.
    executor : Executor, optional
        Where tiles are read; the result does not depend on it.
    in_flight : int
        Tiles handed to it at a time; twice its workers keeps all of them busy.
    progress : callable, optional
        Called with tiles done and tiles in all.

    Raises
    ------
    InputError
        Rasters and plan hold different cells, rasters and roads do not align or overlap, a
        parameter is out of range, or no point hears any cell.
    OutputError
        The folder cannot be written, or holds other files than a database.
    """
    _check_parameters(margin_db, floor_dbm, tile_px)
    plan = plan.to_crs(rasters.lattice.crs)
    places, tiles = _cut_into_tiles(rasters, plan, routes, floor_dbm, tile_px)
    out = Path(out)
    check_replaceable(out, MANIFEST, FORMAT)
    recorded = [*inputs, InputFile("rasters", rasters.path.name, rasters.sha256())]
    with atomic_dir(out) as folder:
        with PartWriter(folder, rasters.lattice.crs, plan.ids) as writer:
            start, heard = 0, 0
            results = ordered_results(
                executor or SerialExecutor(),
                read_tile,
                tiles,
                in_flight=in_flight,
                progress=progress,
            )
            for tile, levels in zip(tiles, results, strict=True):
                writer.add(places.slice(start, tile.row.size), levels)
                start += tile.row.size
                heard += int((levels.best >= 0).sum())
            if heard == 0:
                expected = f"a level of at least {floor_dbm:g} dBm at a point"
                hint = "floor too high, or rasters hold no data along the roads"
                raise fail(InputError, str(rasters.path), expected, "none", hint)
            parts = writer.finish()
        write_cells(plan, folder / CELLS)
        parts.insert(0, describe_part(folder, folder / CELLS, len(plan.ids)))
        write_json(
            folder / MANIFEST,
            {
                "format": FORMAT,
                "version": VERSION,
                "software": f"mapfilter {version('mapfilter')}",
                "crs": rasters.lattice.crs,
                "lattice": asdict(rasters.lattice),
                "cells": list(plan.ids),
                "parameters": {
                    "margin_db": float(margin_db),
                    "floor_dbm": float(floor_dbm),
                    "tile_px": tile_px,
                },
                "attribution": attribution,
                "inputs": [asdict(file) for file in recorded],
                "counts": {
                    "points": heard,
                    "points_below_floor": len(places) - heard,
                    "points_off_rasters": len(routes) - len(places),
                },
                "parts": parts,
            },
        )
    return open_database(out)


def dry_run(
    rasters: RxLevRasters,
    plan: CellPlan,
    routes: RouteLattice,
    *,
    margin_db: float = MARGIN_DB,
    floor_dbm: float = FLOOR_DBM,
    tile_px: int = TILE_PX,
) -> BuildEstimate:
    """Estimate a build from up to four of its tiles, writing nothing.

    Parameters and errors are those of :func:`build`.
    """
    _check_parameters(margin_db, floor_dbm, tile_px)
    plan = plan.to_crs(rasters.lattice.crs)
    places, tiles = _cut_into_tiles(rasters, plan, routes, floor_dbm, tile_px)
    starts = np.cumsum([0, *(tile.row.size for tile in tiles)])
    chosen = np.unique(np.linspace(0, len(tiles) - 1, _SAMPLED_TILES).round().astype(int))
    began_s = time.perf_counter()
    points, levels, size = 0, 0, 0
    for i in chosen.tolist():
        found = read_tile(tiles[i])
        some = places.slice(int(starts[i]), tiles[i].row.size)
        size += _parquet_bytes(points_table(some, found, plan.ids))
        size += sum(_parquet_bytes(table) for _, table in levels_tables(some, found, plan.ids))
        points += tiles[i].row.size
        levels += found.cell.size
    seconds = time.perf_counter() - began_s
    scale = len(places) / points
    waiting = min(levels * scale, ROWS_IN_MEMORY + levels / len(chosen))
    window = tile_px * tile_px * 4 * min(len(plan.ids), 128) * 2
    memory = len(places) * _BYTES_PER_POINT_IN_MEMORY + waiting * _BYTES_PER_LEVEL_IN_MEMORY
    return BuildEstimate(
        len(places),
        round(levels * scale),
        round(size * scale),
        round(memory + window),
        seconds * scale,
    )


def _check_parameters(margin_db: float, floor_dbm: float, tile_px: int) -> None:
    faults = Faults()
    if not (np.isfinite(margin_db) and margin_db >= 0):
        faults.add("margin_db", "dB >= 0", margin_db)
    if not -200 <= floor_dbm <= 0:
        faults.add("floor_dbm", "dBm in -200..0", floor_dbm, "sign left out, or raw RXLEV")
    if tile_px < 1:
        faults.add("tile_px", "pixels >= 1", tile_px)
    faults.raise_if_any(InputError)


def _cut_into_tiles(
    rasters: RxLevRasters, plan: CellPlan, routes: RouteLattice, floor_dbm: float, tile_px: int
) -> tuple[pa.Table, list[Tile]]:
    """Return the points tile by tile, and the tiles that hold any, in the same order."""
    check_against_plan(rasters, plan)
    down, right = pixel_offset(rasters, routes)
    lattice = rasters.lattice
    row, col = routes.row.astype(np.int64) + down, routes.col.astype(np.int64) + right
    on_rasters = np.flatnonzero(lattice.contains(row, col))
    row, col = row[on_rasters], col[on_rasters]
    if not on_rasters.size:
        hint = "files of different areas"
        raise fail(InputError, str(rasters.path), "points of the roads", "none", hint)
    tile = z_order(row // tile_px, col // tile_px)
    order = np.lexsort((z_order(row, col), tile))
    row, col, tile = row[order], col[order], tile[order]
    places = places_table(routes, lattice, on_rasters[order])
    starts: NDArray[np.int64] = np.flatnonzero(np.diff(tile, prepend=tile[:1] + np.uint64(1)))
    tiles = []
    for start, end in zip(starts, np.append(starts[1:], row.size), strict=True):
        top, left = int(row[start] // tile_px * tile_px), int(col[start] // tile_px * tile_px)
        rows, cols = min(tile_px, lattice.rows - top), min(tile_px, lattice.cols - left)
        inside = row[start:end] - top, col[start:end] - left
        tiles.append(Tile(rasters, plan, (top, left, rows, cols), *inside, floor_dbm))
    return places, tiles


def _parquet_bytes(table: Any) -> int:
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    return int(sink.getvalue().size)
