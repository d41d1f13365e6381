"""Roads times rasters: building a radio-route database tile by tile."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pyarrow as pa

from mapfilter._io import atomic_dir, check_replaceable, ensure_writable_folder
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter.database.manifest import FORMAT, MANIFEST, InputFile
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.sources import LatticeRoutes, Routes, check_aligned, overlap
from mapfilter.database.store import open_database
from mapfilter.database.tiles import (
    TileRows,
    TileTask,
    read_tiles,
    tile_windows,
)
from mapfilter.database.windows import Window
from mapfilter.errors import Faults, InputError, OutputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters, check_against_plan
from mapfilter.roads.lattice import RouteLattice

_CHECKSUM_BYTES = 4


def work_key(
    rasters_sha256: str,
    rasters: RxLevRasters,
    plan: CellPlan,
    routes_digest: str,
    parameters: Mapping[str, Any],
) -> str:
    """Return a checksum of all that the tiles of a build depend on."""
    read_as = (rasters.cell_ids, asdict(rasters.lattice), rasters.quantity, rasters.factor)
    parts = (
        version("mapfilter"), pa.__version__, rasters_sha256, read_as, rasters.resampling,
        [asdict(cell) for cell in plan.cells], routes_digest,
        {name: value for name, value in parameters.items() if name != "margin_db"},
    )  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


class FinishedTiles:
    """A hidden folder beside a database, with one file per finished tile.

    It is left when the build is killed or interrupted or a worker dies, and removed when the build
    is done, its inputs are wrong, or it cannot be written.

    Parameters
    ----------
    database : Path
        The folder that is being built.
    key : callable
        Gives a checksum of the inputs, when it is first needed: tiles of others are never taken.
    keep : bool
        Take tiles that are there already.
    """

    def __init__(self, database: Path, key: Callable[[], str], *, keep: bool = False) -> None:
        self._database, self._key = database, key
        self.keep = keep

    @cached_property
    def folder(self) -> Path:
        """Where the tiles lie; emptied at first, unless they are kept."""
        folder = self._database.parent / f".{self._database.name}.tiles-{self._key()[:16]}"
        if not self.keep:
            shutil.rmtree(folder, ignore_errors=True)
        return folder

    def __enter__(self) -> FinishedTiles:
        ensure_writable_folder(self._database.parent)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        # Where nobody asked for the folder there is none, and its name may take long to be known.
        asked = "folder" in vars(self)
        if asked and (kind is None or issubclass(kind, InputError | OutputError)):
            shutil.rmtree(self.folder, ignore_errors=True)

    def missing(self, total: int) -> list[int]:
        """Return the tiles, of so many, that are still to be made."""
        return [n for n in range(total) if not self.keep or self.load(n) is None]

    def load(self, number: int) -> TileRows | None:
        """Return a finished tile, or None when there is none or its file is damaged."""
        try:
            data = self._file(number).read_bytes()
        except OSError:
            return None
        checksum, rows = data[:_CHECKSUM_BYTES], data[_CHECKSUM_BYTES:]
        if zlib.crc32(rows).to_bytes(_CHECKSUM_BYTES, "big") != checksum:
            return None
        return TileRows.from_bytes(rows)

    def save(self, number: int, rows: bytes) -> None:
        """Put a finished tile on disk.

        Raises
        ------
        OutputError
            It cannot be written.
        """
        file = self._file(number)
        temporary = file.with_name(f"{file.name}.{os.getpid()}")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            temporary.write_bytes(zlib.crc32(rows).to_bytes(_CHECKSUM_BYTES, "big") + rows)
            temporary.replace(file)
        except OSError as error:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            got = error.strerror or error
            raise fail(OutputError, str(file), "a place that can be written", got) from error

    def _file(self, number: int) -> Path:
        return self.folder / f"tile-{number}.arrow"


MARGIN_DB = 6.0
FLOOR_DBM = -104.0
TILE_PX = 256


def build(
    rasters: RxLevRasters,
    plan: CellPlan,
    routes: RouteLattice | Routes,
    out: Path | str,
    *,
    margin_db: float = MARGIN_DB,
    floor_dbm: float = FLOOR_DBM,
    tile_px: int = TILE_PX,
    inputs: Sequence[InputFile] = (),
    attribution: str = "",
    executor: Executor | None = None,
    in_flight: int = 8,
    tiles_a_task: int = 1,
    writers: int = 1,
    resume: bool = False,
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
    routes : RouteLattice or Routes
        Aligned with the rasters' lattice; points beyond it are left out and counted. Given as
        layers (:class:`mapfilter.database.sources.LayerRoutes`), points are laid by the workers,
        tile by tile.
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
        Tasks handed to it at a time; four for each worker keep all of them busy.
    tiles_a_task : int
        Tiles in a task: many where handing one over takes long.
    writers : int
        Cells whose parts are written at a time.
    resume : bool
        Go on where a build of the same inputs stopped. Finished tiles lie beside the folder until
        the build is done.
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
    check_parameters(margin_db, floor_dbm, tile_px)
    job = BuildJob.of(rasters, plan, routes, floor_dbm, tile_px)
    out = Path(out)
    check_replaceable(out, MANIFEST, FORMAT)
    parameters = {"margin_db": float(margin_db), "floor_dbm": float(floor_dbm), "tile_px": tile_px}
    with ExitStack() as stack:
        # The rasters are hashed while the first tiles are made.
        digest = _aside(rasters.sha256)

        def key() -> str:
            laid = job.routes.digest()
            return work_key(digest.result(), rasters, job.plan, laid, parameters)

        finished = stack.enter_context(FinishedTiles(out, key, keep=resume))
        folder = stack.enter_context(atomic_dir(out))
        made = job.made(executor or SerialExecutor(), finished, in_flight, tiles_a_task)
        crs, ids = rasters.lattice.crs, job.plan.ids
        written = write_parts(folder, crs, ids, made, len(job.windows), writers, progress)
        if written.heard == 0:
            expected = f"a level of at least {floor_dbm:g} dBm at a point"
            hint = "floor too high, or rasters hold no data along the roads"
            got = "none"
            if not written.points:
                hint = "roads beside the rasters, or narrower than their pixels"
                got = "no point of the roads on the rasters"
            raise fail(InputError, str(rasters.path), expected, got, hint)
        counts = {
            "points": written.heard,
            "points_below_floor": written.points - written.heard,
            "points_off_rasters": job.off_rasters(written.points),
        }
        inputs = (*inputs, InputFile("rasters", rasters.path.name, digest.result()))
        head = Head(rasters.lattice, job.plan, parameters, attribution, inputs, counts)
        head.write(folder, written.parts)
    return open_database(out)


@dataclass(frozen=True, slots=True, eq=False)
class BuildJob:
    """A build cut into tiles; no tile's points are laid before its turn.

    Parameters
    ----------
    rasters : RxLevRasters
    plan : CellPlan
        In the rasters' CRS.
    routes : Routes
    floor_dbm : float
    windows : tuple of (row, col, rows, cols)
        Tiles on the rasters' lattice that may hold points, along the Z-order curve.
    """

    rasters: RxLevRasters
    plan: CellPlan
    routes: Routes
    floor_dbm: float
    windows: tuple[Window, ...]

    @classmethod
    def of(
        cls,
        rasters: RxLevRasters,
        plan: CellPlan,
        routes: RouteLattice | Routes,
        floor_dbm: float,
        tile_px: int,
    ) -> BuildJob:
        """Check that the inputs fit each other, and cut them.

        Raises
        ------
        InputError
            As :func:`build`.
        """
        source = LatticeRoutes(routes) if isinstance(routes, RouteLattice) else routes
        check_against_plan(rasters, plan)
        check_aligned(rasters.lattice, source.lattice, f"{rasters.path} and roads")
        job = cls(rasters, plan.to_crs(rasters.lattice.crs), source, floor_dbm, ())
        windows = tuple(w for w in tile_windows(rasters.lattice, tile_px) if job._holds(w))
        if not windows:
            hint = "files of different areas"
            raise fail(InputError, str(rasters.path), "points of the roads", "none", hint)
        return cls(rasters, job.plan, source, floor_dbm, windows)

    def task(self, number: int) -> TileTask:
        """Return what a worker needs to make a tile."""
        window = self.windows[number]
        part = self.routes.part(self.covered(window))
        rasters, plan = self.rasters.reaching(window), self.plan
        numbers = tuple(range(len(plan)))
        if rasters is not self.rasters:
            numbers = tuple(sorted(plan.index(cell_id) for cell_id in rasters.cell_ids))
            # A plan of no cells is none.
            plan = CellPlan(plan.crs, tuple(plan.cells[n] for n in numbers or (0,)))
        return TileTask(rasters, plan, numbers, window, part, self.floor_dbm)

    def covered(self, window: Window) -> Lattice:
        """Return the part of a tile that the roads cover."""
        inside = overlap(self.rasters.lattice, self.routes.lattice, window)
        assert inside is not None
        return self.rasters.lattice.window(*inside)

    def made(
        self, executor: Executor, finished: FinishedTiles, in_flight: int, tiles_a_task: int
    ) -> Iterator[TileRows]:
        """Yield the tiles in order: those that are finished already, and the others as made."""
        missing = finished.missing(len(self.windows))
        groups = [missing[n : n + tiles_a_task] for n in range(0, len(missing), tiles_a_task)]
        tasks = ([self.task(number) for number in group] for group in groups)
        results = ordered_results(executor, read_tiles, tasks, in_flight=in_flight)
        made = (rows for group in results for rows in group)
        for number in range(len(self.windows)):
            if missing and number == missing[0]:
                rows = next(made)
                finished.save(missing.pop(0), rows)
                yield TileRows.from_bytes(rows)
            elif (tile := finished.load(number)) is not None:
                yield tile
            else:
                yield TileRows.from_bytes(read_tiles([self.task(number)])[0])

    def off_rasters(self, points: int) -> int:
        """Return how many points lie beyond the rasters, of routes that are laid already."""
        return len(self.routes.points) - points if isinstance(self.routes, LatticeRoutes) else 0

    def _holds(self, window: Window) -> bool:
        inside = overlap(self.rasters.lattice, self.routes.lattice, window)
        return inside is not None and self.routes.holds(self.rasters.lattice.window(*inside))


def _aside(function: Callable[[], str]) -> Future[str]:
    """Run a function in a thread of its own; who stops before it has ended does not wait for it."""
    future: Future[str] = Future()

    def run() -> None:
        try:
            future.set_result(function())
        except BaseException as error:
            future.set_exception(error)

    Thread(target=run, daemon=True).start()
    return future


def check_parameters(margin_db: float, floor_dbm: float, tile_px: int) -> None:
    """Note every parameter that is out of range."""
    faults = Faults()
    if not (np.isfinite(margin_db) and margin_db >= 0):
        faults.add("margin_db", "dB >= 0", margin_db)
    if not -200 <= floor_dbm <= 0:
        faults.add("floor_dbm", "dBm in -200..0", floor_dbm, "sign left out, or raw RXLEV")
    if tile_px < 1:
        faults.add("tile_px", "pixels >= 1", tile_px)
    faults.raise_if_any(InputError)
