"""``mapfilter bench``: how fast stages are on this machine, as ratios within one run."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from mapfilter._device import open_device
from mapfilter._parallel import local_executor
from mapfilter._types import Floats
from mapfilter.database.build import build
from mapfilter.database.build_job import BuildJob
from mapfilter.database.estimate import dry_run, peak_memory_bytes
from mapfilter.database.tiles import read_tile
from mapfilter.errors import ConfigError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.lattice import RouteLattice

if TYPE_CHECKING:
    from mapfilter.workflows.benchmarks.device import DeviceBench
    from mapfilter.workflows.benchmarks.filter import FilterBench
    from mapfilter.workflows.benchmarks.fusion import FusionBench
    from mapfilter.workflows.benchmarks.memory import MemoryBench
    from mapfilter.workflows.benchmarks.peers import PeersBench
    from mapfilter.workflows.benchmarks.sweep import SweepBench
    from mapfilter.workflows.benchmarks.threads import ThreadsBench

CRS = "EPSG:32629"
STAGES = ("build", "filter", "fusion", "sweep")
RUNS = 5
_FLOOR_DBM = -104.0
_BLOCK_PX = 256


@dataclass(frozen=True)
class BuildBench:
    """Seconds are medians over the runs, which take turns; ratios are of these.

    Parameters
    ----------
    rasters, side_px, points, runs : int
        The task: so many square rasters of so many pixels a side, and points on them.
    read_s : float
        Only reading all bands.
    join_s, join_ratio : float
        Reading them, and putting the levels at the points together.
    build_s, build_ratio : float
        A whole build with writing, in one process.
    two_processes_s, speedup : float
        The same by two worker processes that are already started.
    peak_memory_bytes : int
        Of a process that opens the rasters and builds.
    estimated_seconds, estimated_bytes, estimated_memory_bytes, bytes
        What ``--dry-run`` estimates of the same build, and the size that it has.
    """

    rasters: int
    side_px: int
    points: int
    runs: int
    read_s: float
    join_s: float
    join_ratio: float
    build_s: float
    build_ratio: float
    two_processes_s: float
    speedup: float
    peak_memory_bytes: int
    estimated_seconds: float
    estimated_bytes: int
    estimated_memory_bytes: int
    bytes: int


def run_bench(
    stage: str,
    *,
    rasters: int = 10,
    side_px: int = 3000,
    points: int = 100_000,
    runs: int = RUNS,
    peers: bool = False,
    memory: bool = False,
    threads: int = 1,
    device: str = "cpu",
) -> (
    BuildBench
    | FilterBench
    | FusionBench
    | SweepBench
    | PeersBench
    | MemoryBench
    | ThreadsBench
    | DeviceBench
):
    """Measure a stage on generated inputs; a filter and a sweep on the embedded map.

    ``peers`` is whether a step of the filter is compared with other packages instead, ``memory``
    whether the memory of the stage's tasks is measured instead. With ``threads`` above 1 a step of
    the filter is divided among as many instead; with the ``device`` ``gpu`` it is compared with
    that on a graphics processor instead.
    """
    if stage not in STAGES:
        raise fail(ConfigError, "bench", f"one of {', '.join(STAGES)}", repr(stage))
    if peers + memory + (threads > 1) + (device != "cpu") > 1:
        expected = "one of --peers, --memory, --threads and --device"
        raise fail(ConfigError, "bench", expected, "several")
    if device != "cpu":
        if stage != "filter":
            raise fail(ConfigError, "bench --device", "the stage filter", stage)
        opened = open_device(device, "bench --device")
        from mapfilter.workflows.benchmarks.device import bench_device

        return bench_device(opened, runs=runs)
    if memory:
        from mapfilter.workflows.benchmarks.memory import bench_memory

        return bench_memory(stage)
    if (peers or threads > 1) and stage != "filter":
        given = "--peers" if peers else "--threads"
        raise fail(ConfigError, f"bench {given}", "the stage filter", stage)
    if threads > 1:
        from mapfilter.workflows.benchmarks.threads import bench_threads

        return bench_threads(threads, runs=runs)
    if peers:
        from mapfilter.workflows.benchmarks.peers import bench_peers

        return bench_peers(runs=runs)
    if stage == "filter":
        from mapfilter.workflows.benchmarks.filter import bench_filter

        return bench_filter(runs=runs)
    if stage == "fusion":
        from mapfilter.workflows.benchmarks.fusion import bench_fusion

        return bench_fusion(runs=runs)
    if stage == "sweep":
        from mapfilter.workflows.benchmarks.sweep import bench_sweep

        return bench_sweep(runs=runs)
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        return _bench_build(Path(name), rasters, side_px, points, runs)


def made_rasters(path: Path, cells: int, side_px: int) -> tuple[RxLevRasters, CellPlan]:
    """Write rasters of cells spread over a square: distance law, and noise over 4 pixels."""
    lattice = Lattice(CRS, 500_000.0, 4_600_000.0, 5.0, side_px, side_px)
    plan = made_plan(lattice, cells)
    items = ((cell.id, _levels(cell, lattice, seed)) for seed, cell in enumerate(plan.cells))
    write_rasters(path, lattice, items, plan.ids)
    return open_rasters(path), plan


def made_plan(lattice: Lattice, cells: int) -> CellPlan:
    """Return cells spread over a lattice."""
    west, south, east, north = lattice.bounds_m
    places = np.random.default_rng(1).uniform((west, south), (east, north), (cells, 2)).tolist()
    return CellPlan(
        lattice.crs,
        tuple(
            Cell(f"C{n}", f"S{n}", east_m, north_m, 30.0, None, 55.0, 900.0, antenna="omni")
            for n, (east_m, north_m) in enumerate(places)
        ),
    )


def made_routes(lattice: Lattice, points: int) -> RouteLattice:
    """Return points on a grid of streets, two pixels wide, as many as asked or a few less."""
    size = lattice.rows * lattice.cols
    spacing = max(round(4 * size / points), 3)
    row = np.arange(lattice.rows)[:, None] % spacing < 2
    col = np.arange(lattice.cols)[None, :] % spacing < 2
    chosen = np.flatnonzero(row | col)
    chosen = chosen[np.linspace(0, chosen.size - 1, min(points, chosen.size)).astype(np.int64)]
    rows, cols = np.divmod(chosen, lattice.cols)
    street = rows // spacing * 10_000 + cols // spacing + 1
    return RouteLattice(
        lattice,
        rows.astype(np.int32),
        cols.astype(np.int32),
        street.astype(np.int64),
        np.zeros(chosen.size, np.int16),
        ("residential",),
        np.full(chosen.size, 2.5, np.float32),
        np.zeros(chosen.size, np.bool_),
    )


def build_made(rasters_path: Path, points: int) -> int:
    """Build from generated rasters; return the most memory (bytes) that this process has taken."""
    rasters = open_rasters(rasters_path)
    plan = made_plan(rasters.lattice, len(rasters.cell_ids))
    build(rasters, plan, made_routes(rasters.lattice, points), rasters_path.with_name("peak"))
    return peak_memory_bytes()


def _bench_build(folder: Path, cells: int, side_px: int, points: int, runs: int) -> BuildBench:
    rasters, plan = made_rasters(folder / "rasters.tif", cells, side_px)
    routes = made_routes(rasters.lattice, points)
    job = BuildJob.of(rasters, plan, routes, _FLOOR_DBM, _BLOCK_PX)

    def read() -> None:
        for row, col, rows, cols in rasters.lattice.tiles(_BLOCK_PX):
            rasters.read((row, col, rows, cols))

    def join() -> None:
        for number in range(len(job.windows)):
            read_tile(job.task(number))

    with local_executor(2) as two:

        def in_two() -> None:
            build(rasters, plan, routes, folder / "db", executor=two, in_flight=8, writers=2)

        tasks: dict[str, Callable[[], object]] = {
            "read": read,
            "join": join,
            "build": lambda: build(rasters, plan, routes, folder / "db"),
            "two": in_two,
        }
        seconds = median_seconds(tasks, runs)
    estimate = dry_run(rasters, plan, routes)
    size = sum(part.stat().st_size for part in (folder / "db").rglob("*.parquet"))
    return BuildBench(
        cells,
        side_px,
        len(routes),
        runs,
        seconds["read"],
        seconds["join"],
        seconds["join"] / seconds["read"],
        seconds["build"],
        seconds["build"] / seconds["read"],
        seconds["two"],
        seconds["build"] / seconds["two"],
        _peak_memory_bytes(rasters.path, points),
        estimate.seconds,
        estimate.bytes,
        estimate.memory_bytes,
        size,
    )


def _levels(cell: Cell, lattice: Lattice, seed: int) -> Floats:
    """Return levels by a distance law (35 dB a decade), with noise over 4 pixels."""
    west, _, _, north = lattice.bounds_m
    centres = (np.arange(lattice.rows) + 0.5) * lattice.resolution_m
    east_m, north_m = west + centres - cell.east_m, north - centres - cell.north_m
    distance_m = np.hypot(east_m[None, :], north_m[:, None]) + 10
    coarse = np.random.default_rng(seed).normal(0, 6, (-(-lattice.rows // 4),) * 2)
    noise = np.kron(coarse, np.ones((4, 4)))[: lattice.rows, : lattice.cols]
    return np.asarray(45 - 35 * np.log10(distance_m) + noise)


def _peak_memory_bytes(rasters: Path, points: int) -> int:
    code = (
        "import sys; from pathlib import Path; from mapfilter.workflows.bench import build_made;"
        "print(build_made(Path(sys.argv[1]), int(sys.argv[2])))"
    )
    command = [sys.executable, "-c", code, str(rasters), str(points)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return int(done.stdout)


def median_seconds(
    tasks: Mapping[str, Callable[[], object]],
    runs: int,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, float]:
    """Return the median seconds that each task takes over ``runs``; the tasks take turns."""
    took_s: dict[str, list[float]] = {name: [] for name in tasks}
    for turn in range(runs + 1):
        for name, task in tasks.items():
            began_s = clock()
            task()
            # The first of each opens files, compiles and starts processes.
            if turn > 0:
                took_s[name].append(clock() - began_s)
    return {name: median(times) for name, times in took_s.items()}
