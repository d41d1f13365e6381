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

from mapfilter._types import Floats
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
    # Some weight for each, as a way outside a tile may reach points in it.
    weight = np.array([job.routes.weight(job.covered(window)) for window in job.windows])
    share = weight + 0.01 * weight.mean() + 1e-9
    share /= share.sum()
    if len(share) <= _SAMPLED_TILES:
        drawn, scale = np.arange(len(share)), np.ones(len(share))
    else:
        middle = (np.arange(_SAMPLED_TILES) + 0.5) / _SAMPLED_TILES
        drawn = share.cumsum().searchsorted(middle).clip(max=len(share) - 1)
        scale = 1 / share[drawn] / _SAMPLED_TILES
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
    of_levels = levels / max(sum(tile.levels for tile in found), 1)
    waiting = min(levels, ROWS_IN_MEMORY + max(tile.levels for tile in found))
    return BuildEstimate(
        round(points),
        round(levels),
        round(size),
        round(peak_memory_bytes() + waiting * _BYTES_PER_LEVEL_IN_MEMORY),
        float(scale @ [tile.seconds for tile in found]) + writing_s * of_levels,
    )


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
    part = _parquet_bytes(points.slice(0, 1))
    all_rows = float(scale @ [tile.points_rows.num_rows for tile in found])
    size = part + (_parquet_bytes(points) - part) * all_rows / max(points.num_rows, 1)
    size += _parquet_bytes(cells_table(plan)) + len(geo_metadata(plan.crs, None))
    rows_bytes, drawn = 0.0, sum(tile.levels for tile in found)
    for cell, some in by_cell.items():
        table = levels_table(plan.ids[cell], some)
        part = _parquet_bytes(table.slice(0, 1))
        rows_bytes += _parquet_bytes(table) - part
    all_rows = float(scale @ [tile.levels for tile in found])
    return float(size + part * len(plan.ids) + rows_bytes * all_rows / max(drawn, 1))


def _parquet_bytes(table: pa.Table) -> int:
    sink = pa.BufferOutputStream()
    write_columns(table, sink)
    return int(sink.getvalue().size)
