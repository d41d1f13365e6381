"""Builds of made areas of growing size: python benchmarks/country.py make|build FOLDER --km2 N ...

``make`` writes, for each size, a raster for each cell as planning tools export them, cut at 2 km
from its site; one cell per square kilometre, pixels of 5 m; it goes on where it was stopped.
``build`` builds a database of each with the made streets of ``benchmarks/metropolis.py``: by one
process, by two, and by two workers of Dask, in turns. For each build it prints, as JSON:

``start_s``
    Seconds by the clock until all workers have started and imported what they need.
``build_s``
    Seconds by the clock of the build by these workers.
``processor_s``
    Seconds of the processors, start and workers included.
``memory_bytes``
    Most memory that this process has taken in any build so far.
``points``, ``levels``, ``bytes``
    Of the database.

At the end it prints medians, and the slopes of the logarithm of ``build_s`` over that of the levels
from size to size. The databases of all ways have to be equal to the byte. The most memory of a
build is measured by ``mapfilter bench build --memory``.
"""

import argparse
import json
import os
import resource
import shutil
import time
from concurrent.futures import Executor
from pathlib import Path
from statistics import median

import numpy as np
from metropolis import CRS, FLOOR_DBM, NORTH_M, PIXEL_M, WEST_M, Radio, made_plan, made_ways

from mapfilter._parallel import executor_of, local_executor
from mapfilter.database.build import build
from mapfilter.database.estimate import peak_memory_bytes
from mapfilter.database.sources import LayerRoutes
from mapfilter.database.store import open_database
from mapfilter.database.tiles import get_ready_to_read
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.index import HALF_WIDTH_M
from mapfilter.roads.route_points import RouteSource

REACH_PX = 400
CELLS_PER_KM2 = 1.0
MOST_ROUNDS = 40
MAKERS = 2
WAYS = {"one process": (1, None), "two processes": (2, None), "Dask, two workers": (1, "local:2")}
"""Workers and cluster of each way to build."""


def lattice_of(km2: float) -> Lattice:
    """Return a square of so many square kilometres."""
    side_px = 2 * round(np.sqrt(km2) * 1000 / PIXEL_M / 2)
    return Lattice(CRS, WEST_M, NORTH_M, PIXEL_M, side_px, side_px)


def plan_of(lattice: Lattice) -> CellPlan:
    """Return the cells of an area."""
    return made_plan(lattice, 2, 1, CELLS_PER_KM2)


def made(folder: Path, km2: float) -> None:
    """Write the rasters of an area by two processes; those that are there already are kept."""
    (folder / "rasters").mkdir(parents=True, exist_ok=True)
    with local_executor(MAKERS) as executor:
        shares = [executor.submit(made_share, folder, km2, first) for first in range(MAKERS)]
        for share in shares:
            share.result()


def made_share(folder: Path, km2: float, first: int) -> None:
    """Write the rasters of each second cell of an area."""
    lattice = lattice_of(km2)
    plan = plan_of(lattice)
    radio = Radio.of(plan, lattice)
    for number in range(first, len(plan), MAKERS):
        cell = plan.cells[number]
        file = folder / "rasters" / f"{cell.id}.tif"
        if file.exists():
            continue
        window = window_of(cell, lattice)
        row, col = np.divmod(np.arange(window.rows * window.cols), window.cols)
        level = radio.levels(np.array([number]), *window.east_north(row, col))
        shape = level.reshape(window.rows, window.cols)
        write_rasters(file, window, [(cell.id, shape)], [cell.id])


def window_of(cell: Cell, lattice: Lattice) -> Lattice:
    """Return the part of an area within the reach of a cell."""
    row, col = (int(one) for one in lattice.row_col(cell.east_m, cell.north_m))
    top, left = max(row - REACH_PX, 0), max(col - REACH_PX, 0)
    bottom, right = min(row + REACH_PX, lattice.rows), min(col + REACH_PX, lattice.cols)
    return lattice.window(top, left, bottom - top, right - left)


def processor_s() -> float:
    """Return the processor time of this process and of those that it started and that ended."""
    who = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
    return sum(used.ru_utime + used.ru_stime for used in map(resource.getrusage, who))


def process_of(task: int, wait_s: float = 0.3) -> int:  # noqa: ARG001
    """Return the process that this runs in, once it is ready, as before a build's first tile."""
    get_ready_to_read()
    time.sleep(wait_s)
    return os.getpid()


def start_workers(executor: Executor, count: int) -> None:
    """Start all workers of an executor: each has done a task."""
    # A worker that is ready first would do the tasks of the others if it did not wait. Tasks have
    # numbers as Dask computes equal ones once.
    found: set[int] = set()
    for first in range(0, MOST_ROUNDS * count, count):
        tasks = [executor.submit(process_of, first + number) for number in range(count)]
        found |= {task.result() for task in tasks}
        if len(found) == count:
            return
    raise SystemExit(f"{len(found)} of {count} workers started")


def built(folder: Path, km2: float, way: str) -> dict[str, float]:
    """Build the database of an area; return its size, and seconds by clock and processors."""
    workers, cluster = WAYS[way]
    lattice = lattice_of(km2)
    plan, ways = plan_of(lattice), made_ways(lattice, 1)
    rasters = open_rasters(folder / "rasters")
    layers = RouteSource.of(ways, None, None, HALF_WIDTH_M, crs=lattice.crs)
    out = folder / "database"
    # An older one is compared with its checksums before it is replaced.
    shutil.rmtree(out, ignore_errors=True)
    began_s, used_s = time.perf_counter(), processor_s()
    with executor_of(workers, cluster) as (executor, at_once):
        start_workers(executor, at_once)
        ready_s = time.perf_counter()
        database = build(
            rasters,
            plan,
            LayerRoutes(layers, rasters.lattice),
            out,
            floor_dbm=FLOOR_DBM,
            executor=executor,
            in_flight=4 * at_once,
            writers=at_once,
        )
        done_s = time.perf_counter()
    parts = database.manifest["parts"]
    return {
        "start_s": ready_s - began_s,
        "build_s": done_s - ready_s,
        "processor_s": processor_s() - used_s,
        "memory_bytes": peak_memory_bytes(),
        "points": int(database.manifest["counts"]["points"]),
        "levels": sum(part["rows"] for part in parts if part.get("cell") is not None),
        "bytes": sum(part["bytes"] for part in parts),
    }


def compare(folder: Path, km2: float, runs: int, ways: list[str]) -> dict[str, object]:
    """Build an area in several ways that take turns; return medians, and all bytes being equal."""
    found: dict[str, list[dict[str, float]]] = {way: [] for way in ways}
    digests = set()
    for run in range(runs):
        for way in ways:
            one = built(folder, km2, way)
            found[way].append(one)
            digests.add(open_database(folder / "database").generation)
            print(json.dumps({"km2": km2, "way": way, "run": run, **one}), flush=True)
    if len(digests) > 1:
        raise SystemExit(f"{folder}: {len(digests)} different databases")
    return {way: {key: median(one[key] for one in some) for key in some[0]}
            for way, some in found.items()}  # fmt: skip


def main() -> None:
    """Make areas, or build them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["make", "build"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--km2", type=float, nargs="+", default=[125.0, 500.0, 2000.0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--way", action="append", choices=list(WAYS), help="may be repeated")
    given = parser.parse_args()
    table: dict[float, dict[str, object]] = {}
    for km2 in given.km2:
        area = given.folder / f"{km2:g}"
        if given.what == "make":
            made(area, km2)
        else:
            table[km2] = compare(area, km2, given.runs, given.way or list(WAYS))
    if table:
        print(json.dumps({"medians": table, "slopes": slopes(table)}))


def slopes(table: dict[float, dict[str, object]]) -> dict[str, float]:
    """Return, for each way, the power of the levels by which seconds grow from area to area."""
    found = {}
    for way in next(iter(table.values())):
        rows = [row[way] for row in table.values()]
        seconds, levels = (np.log([row[key] for row in rows]) for key in ("build_s", "levels"))  # type: ignore[index]
        found[way] = float(np.polyfit(levels, seconds, 1)[0]) if len(rows) > 1 else float("nan")
    return found


if __name__ == "__main__":
    main()
