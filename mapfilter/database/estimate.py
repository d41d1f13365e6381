"""Estimate the size and time of a build from a few of its tiles."""

from __future__ import annotations

import contextlib
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from mapfilter._types import Floats, Ints
from mapfilter.database.build import check_parameters
from mapfilter.database.build_job import BuildJob
from mapfilter.database.defaults import MARGIN_DB, TILE_PX
from mapfilter.database.floor import floor_of
from mapfilter.database.parquet import geo_metadata, write_columns
from mapfilter.database.parts import (
    ROWS_IN_MEMORY,
    LevelsRows,
    levels_rows,
    levels_table,
    points_table,
)
from mapfilter.database.sources import LatticeRoutes, Routes
from mapfilter.database.store import cells_table
from mapfilter.database.tiles import read_tile
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.lattice import RouteLattice

_SAMPLED_TILES = 16
_LEAST_SHARE = 0.01
"""Of the mean weight, for each tile: a way outside it may reach points in it."""
_BYTES_PER_LEVEL_IN_MEMORY = 40
_BYTES_OF_A_PROCESS = 350 << 20


@dataclass(frozen=True, slots=True)
class BuildEstimate:
    """Size and time of a build, extrapolated from a few of its tiles.

    Parameters
    ----------
    points : int
        Points of the routes on the rasters, with or without a level; exact for a route lattice.
    levels : int
        Rows of all cells together.
    bytes : int
        Size of the database on disk.
    memory_bytes : int
        Peak memory of a process that does it alone: of this one while reading a few tiles, and the
        rows that wait to be written.
    seconds : float
        Time with one worker.
    """

    points: int
    levels: int
    bytes: int
    memory_bytes: int
    seconds: float


def dry_run(
    rasters: RxLevRasters,
    plan: CellPlan,
    routes: RouteLattice | Routes,
    *,
    margin_db: float = MARGIN_DB,
    floor_dbm: float | None = None,
    tile_px: int = TILE_PX,
) -> BuildEstimate:
    """Estimate a build from up to sixteen of its tiles, writing nothing.

    Tiles are drawn systematically, with a chance proportional to the points expected in them
    (Hansen & Hurwitz 1943, On the theory of sampling from finite populations): a sum over all
    tiles is the mean of the drawn tiles' values per point expected, times all points expected.

    Parameters and errors are those of :func:`mapfilter.database.build.build`.
    """
    floor_dbm = floor_of(plan, floor_dbm)
    check_parameters(margin_db, floor_dbm, tile_px)
    job = BuildJob.of(rasters, plan, routes, floor_dbm, tile_px)
    weight = np.array([job.routes.weight(job.covered(window)) for window in job.windows])
    drawn, scale = drawn_tiles(weight)
    # The first read opens files and compiles, which is not part of a tile's work.
    read_tile(job.task(int(drawn[0])))
    found = [_sample(job, number) for number in drawn.tolist()]
    points = float(scale @ [tile.places for tile in found])
    if isinstance(job.routes, LatticeRoutes):
        points = float(weight.sum())
    levels = float(scale @ [tile.levels for tile in found])
    began_s = time.perf_counter()
    size = _bytes(found, scale, job.plan)
    writing_s = time.perf_counter() - began_s
    of_levels = _ratio(levels, sum(tile.levels for tile in found))
    waiting = min(levels, ROWS_IN_MEMORY + max(tile.levels for tile in found))
    return BuildEstimate(
        round(points),
        round(levels),
        round(size),
        round(peak_memory_bytes() + waiting * _BYTES_PER_LEVEL_IN_MEMORY),
        float(scale @ [tile.seconds for tile in found]) + writing_s * of_levels,
    )


def drawn_tiles(weight: Floats) -> tuple[Ints, Floats]:
    """Return which tiles stand for all, given the points expected in each, and for how many.

    Of up to sixteen tiles that is each, for itself; of more, sixteen, some of them several times.
    """
    if len(weight) <= _SAMPLED_TILES:
        return np.arange(len(weight)), np.ones(len(weight))
    share = weight + _LEAST_SHARE * max(weight.mean(), 1.0)
    share /= share.sum()
    middle = (np.arange(_SAMPLED_TILES) + 0.5) / _SAMPLED_TILES
    drawn = share.cumsum().searchsorted(middle)
    return drawn, 1 / share[drawn] / _SAMPLED_TILES


def peak_memory_bytes() -> int:
    """Return the peak memory of this process, or a usual figure where it is not known."""
    with contextlib.suppress(OSError):
        # Under Linux getrusage begins with the peak of the process that started this one.
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        for line in status.splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    try:
        import resource
    except ImportError:
        return _BYTES_OF_A_PROCESS
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


class _Sample(NamedTuple):
    """One tile as it would be written."""

    places: int
    levels: int
    points_rows: pa.Table
    levels_rows: dict[int, LevelsRows]
    seconds: float


def _sample(job: BuildJob, number: int) -> _Sample:
    began_s = time.perf_counter()
    tile, ids = read_tile(job.task(number)), job.plan.ids
    points = points_table(tile.places, tile.levels, ids)
    levels = dict(levels_rows(tile.places, tile.levels))
    seconds = time.perf_counter() - began_s
    return _Sample(tile.places.num_rows, tile.levels.cell.size, points, levels, seconds)


def _bytes(found: list[_Sample], scale: Floats, plan: CellPlan) -> float:
    """Return the size of all parts: rows as they compress in the drawn tiles, and the footers."""
    by_cell: dict[int, list[LevelsRows]] = {}
    for tile in found:
        for cell, rows in tile.levels_rows.items():
            by_cell.setdefault(cell, []).append(rows)
    points = pa.concat_tables([tile.points_rows for tile in found]).unify_dictionaries()
    footer, rows_bytes = _part_bytes(points)
    all_rows = float(scale @ [tile.points_rows.num_rows for tile in found])
    size = footer + rows_bytes * _ratio(all_rows, points.num_rows)
    size += _parquet_bytes(cells_table(plan)) + len(geo_metadata(plan.crs, None))
    all_rows = float(scale @ [tile.levels for tile in found])
    more = _ratio(all_rows, sum(tile.levels for tile in found))
    for cell, some in by_cell.items():
        footer, rows_bytes = _part_bytes(levels_table(plan.ids[cell], some))
        size += rows_bytes * more
    # Cells that no drawn tile receives may have a part all the same.
    return size + footer * len(plan.ids)


def _part_bytes(table: pa.Table) -> tuple[int, int]:
    """Return the size of a part with one row, and what the other rows take."""
    footer = _parquet_bytes(table.slice(length=1))
    return footer, _parquet_bytes(table) - footer


def _ratio(whole: float, of_drawn: int) -> float:
    return whole / of_drawn if of_drawn else 0.0


def _parquet_bytes(table: pa.Table) -> int:
    sink = pa.BufferOutputStream()
    write_columns(table, sink)
    return int(sink.getvalue().size)
