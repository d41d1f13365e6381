"""Build a radio-route database from rasters and roads, tile by tile."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import ExitStack
from dataclasses import asdict, replace
from numbers import Real
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._alone import writing_alone
from mapfilter._arguments import (
    FUNCTION,
    PATH,
    Argument,
    Count,
    Setting,
    WholeNumber,
    check_arguments,
    executor_argument,
    items,
)
from mapfilter._io import atomic_dir, ensure_writable_folder
from mapfilter._parallel import Progress, SerialExecutor
from mapfilter._resume import FinishedParts
from mapfilter.database.build_job import BuildJob
from mapfilter.database.defaults import MARGIN_DB, TILE_PX
from mapfilter.database.floor import FLOOR_DBM, floor_of
from mapfilter.database.manifest import InputFile, check_database_replaceable
from mapfilter.database.measured import MeasuredParts, Readings, deviations_at_points
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.sources import LatticeRoutes, Routes, cut_by_tile
from mapfilter.database.store import open_written
from mapfilter.database.tiles import roads_tile, tile_windows
from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import ARRAYS, RxLevRasters
from mapfilter.roads.lattice import RouteLattice

PIXELS_A_TASK = 16_000_000
"""Pixels of a task: some eight tiles of 30 cells, which share most of their files."""

_OTHER_PLANS = ((pd.DataFrame | PATH, "read_cell_plan reads a plan from a table or a file"),)
_OTHER_ROUTES = (
    (pd.DataFrame | PATH, "read_routes reads them from a map, a layer or a GeoDataFrame"),
)


def work_key(
    rasters_sha256: str,
    rasters: RxLevRasters,
    plan: CellPlan,
    routes_digest: str,
    parameters: Mapping[str, Any],
) -> str:
    """Return a checksum of everything that the tiles of a build depend on."""
    # As they are read: values without data, headers and CRS may be declared, not in the files.
    files = [repr(replace(one, path=Path(one.path.name), parts=())) for one in rasters.files]
    read_as = (rasters.cell_ids, asdict(rasters.lattice), rasters.quantity, rasters.factor, files)
    cells = [asdict(cell) for cell in plan.cells]
    of_tiles = {name: value for name, value in parameters.items() if name != "margin_db"}
    parts = (rasters_sha256, read_as, rasters.resampling, cells, routes_digest, of_tiles)
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def build(
    rasters: RxLevRasters,
    plan: CellPlan,
    routes: RouteLattice | Routes,
    out: Path | str,
    *,
    margin_db: float = MARGIN_DB,
    floor_dbm: float | None = None,
    tile_px: int = TILE_PX,
    inputs: Sequence[InputFile] = (),
    attribution: str | None = None,
    measured: tuple[Readings, RxLevRasters] | None = None,
    executor: Executor | None = None,
    in_flight: int = 8,
    pixels_a_task: int = PIXELS_A_TASK,
    writers: int = 1,
    resume: bool = False,
    progress: Progress | None = None,
) -> RadioRouteDatabase:
    """Build a database folder and open it.

    A point belongs to the best server of each layer (:mod:`mapfilter.radio.layers`) and to every
    cell at most ``margin_db`` weaker than that of its own. All levels
    above the floor are kept, so the margin can be changed when the database is read; points with
    no cell above the floor are left out and counted. Levels are kept to 0.01 dB.

    Parameters
    ----------
    rasters : RxLevRasters
        Levels, or losses that are subtracted from the plan's EIRP. Their lattice is the database's.
    plan : CellPlan
        The same cells as in the rasters.
    routes : RouteLattice or Routes
        Aligned with the rasters' lattice; points beyond it are left out and counted. Of layers
        (:class:`mapfilter.database.sources.LayerRoutes`) the workers lay the points of each tile.
    out : Path or str
        The folder; an older database is replaced once the new one is complete.
    margin_db : float
        Default margin of readers (dB, >= 0).
    floor_dbm : float, optional
        Weakest level that is kept (dBm); by default that of the plan's technologies
        (:func:`mapfilter.database.floor.floor_of`).
    tile_px : int
        Side of the tiles that are processed at a time. Points are stored tile by tile along the
        Z-order curve, and along it within each tile.
    inputs : sequence of InputFile
        Files that roads and rasters were made from, for the record; the rasters are added.
    attribution : str, optional
        Attribution that the licence of the map demands; that of a route lattice by default.
    measured : (Readings, RxLevRasters), optional
        Of rasters that a survey made: its readings, and the rasters of its deviations.
    executor : Executor, optional
        Where tiles are read; the result does not depend on it.
    in_flight : int
        Tasks submitted at a time, :data:`mapfilter.database.build_job.TASKS_A_WORKER` for each
        worker.
    pixels_a_task : int
        Most pixels that a task reads, of all cells that reach its tiles; with 0 it has one tile.
        Tiles of a task read a file that reaches several of them once. The last tasks are smaller.
    writers : int
        Threads that write parts of the database while tiles are made elsewhere; with 1 this one
        writes them in turn with the tiles.
    resume : bool
        Take over the tiles that an interrupted build of the same inputs has finished.
    progress : callable, optional
        Called with tiles done and tiles in all.

    Raises
    ------
    InputError
        Rasters and plan hold different cells, rasters and roads do not align or overlap, metres of
        their CRS are not metres on the ground (Web Mercator), cells lie more than 50 km outside, a
        parameter is out of range, or no point has a level above the floor.
    OutputError
        The folder cannot be written, holds other files than a database, or another build is
        writing it.
    ConfigError
        An argument is of another type.
    """
    check_arguments(
        "build",
        Argument("rasters", rasters, RxLevRasters, "rasters of open_rasters", ARRAYS),
        Argument("plan", plan, CellPlan, "a cell plan of read_cell_plan", _OTHER_PLANS),
        Argument("routes", routes, RouteLattice | Routes, "routes of read_routes", _OTHER_ROUTES),
        Argument("out", out, PATH, "the path of a folder"),
        keywords=[
            Argument("margin_db", margin_db, Real, "dB"),
            Argument("floor_dbm", floor_dbm, Real | None, "dBm"),
            Setting("tile_px", tile_px, int),
            *items("inputs", inputs, InputFile, "InputFile"),
            Setting("attribution", attribution, str | None),
            Argument("measured", measured, tuple | None, "readings and rasters of deviations"),
            executor_argument(executor),
            Setting("in_flight", in_flight, Count),
            Setting("pixels_a_task", pixels_a_task, WholeNumber),
            Setting("writers", writers, Count),
            Setting("resume", resume, bool),
            Argument("progress", progress, FUNCTION, "a function"),
        ],
    )
    floor_dbm = floor_of(plan, floor_dbm)
    check_parameters(margin_db, floor_dbm, tile_px)
    job = BuildJob.of(rasters, plan, routes, floor_dbm, tile_px)
    out = Path(out)
    check_database_replaceable(out)
    parameters = {"margin_db": float(margin_db), "floor_dbm": floor_dbm, "tile_px": tile_px}
    with ExitStack() as stack:
        # The rasters are hashed while the first tiles are made.
        digest = _aside(rasters.sha256)

        def key() -> str:
            laid = job.routes.digest()
            return work_key(digest.result(), rasters, job.plan, laid, parameters)

        finished = stack.enter_context(FinishedParts(out, key, keep=resume, name="tile"))
        folder = stack.enter_context(atomic_dir(out))
        made = job.made(executor or SerialExecutor(), finished, in_flight, pixels_a_task)
        crs, ids = rasters.lattice.crs, job.plan.ids
        written = write_parts(folder, crs, ids, made, len(job.windows), writers, progress)
        if written.received == 0:
            expected = f"a level of at least {floor_dbm:g} dBm at a point"
            got, hint = "none", "floor too high, or rasters hold no data along the roads"
            if not written.points:
                got = "no point of the roads on the rasters"
                hint = "roads beside the rasters, or narrower than their pixels"
            raise fail(InputError, str(rasters.path), expected, got, hint)
        counts = {
            "points": written.received,
            "points_below_floor": written.below_floor,
            "points_off_rasters": job.off_rasters(written.points),
            "points_without_level": written.points - written.received - written.below_floor,
        }
        inputs = (*inputs, InputFile("rasters", rasters.path.name, digest.result()))
        parts = None
        if measured is not None:
            readings, deviation = measured
            deviation = replace(deviation, lattice=rasters.lattice)
            parts = MeasuredParts(readings, deviations_at_points(folder, deviation, ids))
        stated = _attribution(routes) if attribution is None else attribution
        head = Head(rasters.lattice, job.plan, parameters, stated, inputs, counts, parts)
        head.write(folder, written.parts)
    return open_written(out)


def build_roads(
    routes: RouteLattice | Routes,
    out: Path | str,
    *,
    tile_px: int = TILE_PX,
    inputs: Sequence[InputFile] = (),
    attribution: str | None = None,
    progress: Progress | None = None,
) -> RadioRouteDatabase:
    """Build a database of roads alone, and open it: for positioning by map and dead reckoning.

    It holds all points of the roads, and no cells. Parameters and errors are those of
    :func:`build`.
    """
    check_parameters(MARGIN_DB, FLOOR_DBM, tile_px)
    source = cut_by_tile(routes)
    lattice, out = source.lattice, Path(out)
    windows = [w for w in tile_windows(lattice, tile_px) if source.holds(lattice.window(*w))]
    check_database_replaceable(out)
    parameters = {"margin_db": MARGIN_DB, "floor_dbm": FLOOR_DBM, "tile_px": tile_px}
    ensure_writable_folder(out.parent)
    with writing_alone(out), atomic_dir(out) as folder:
        tiles = (roads_tile(source.part(lattice.window(*window)), lattice) for window in windows)
        written = write_parts(folder, lattice.crs, (), tiles, len(windows), progress=progress)
        if written.points == 0:
            expected = "a point near a way or in a square"
            hint = "roads beside the area, or narrower than its pixels"
            raise fail(InputError, "roads", expected, "none", hint)
        counts = {"points": written.points, "points_below_floor": 0, "points_off_rasters": 0}
        plan = CellPlan(lattice.crs, ())
        stated = _attribution(routes) if attribution is None else attribution
        head = Head(lattice, plan, parameters, stated, tuple(inputs), counts)
        head.write(folder, written.parts)
    return open_written(out)


def _attribution(routes: RouteLattice | Routes) -> str:
    laid = routes.points if isinstance(routes, LatticeRoutes) else routes
    return laid.attribution if isinstance(laid, RouteLattice) else ""


def _aside(function: Callable[[], str]) -> Future[str]:
    """Run a function in a daemon thread, which an interrupted build does not wait for."""
    future: Future[str] = Future()

    def run() -> None:
        try:
            future.set_result(function())
        except BaseException as error:
            future.set_exception(error)

    Thread(target=run, daemon=True).start()
    return future


def check_parameters(margin_db: float, floor_dbm: float, tile_px: int) -> None:
    """Raise InputError with every parameter that is out of range."""
    faults = Faults()
    if not (np.isfinite(margin_db) and margin_db >= 0):
        faults.add("margin_db", "dB >= 0", margin_db)
    if not -200 <= floor_dbm <= 0:
        faults.add("floor_dbm", "dBm in -200..0", floor_dbm, "sign left out, or raw RXLEV")
    if tile_px < 1:
        faults.add("tile_px", "pixels >= 1", tile_px)
    faults.raise_if_any(InputError)
