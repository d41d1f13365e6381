"""``mapfilter bench --memory``: the most memory that the tasks of a stage take.

Each task runs in a process of its own, as the peak of a process never falls; and twice, as kernels
may be compiled the first time. The smaller peak counts.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter.database.estimate import peak_memory_bytes
from mapfilter.database.store import open_database
from mapfilter.experiments.papers.khalaf_allah_2007 import MAP_SETTINGS, plans
from mapfilter.experiments.sweep.run import sweep
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.tracks.store import read_log
from mapfilter.workflows.bench import build_made, made_rasters
from mapfilter.workflows.benchmarks.filter import JITTER, make_world, step_inputs, whole_step
from mapfilter.workflows.benchmarks.fusion import bench_fusion
from mapfilter.workflows.build import run_build
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.reproduce import paper_config
from mapfilter.workflows.sweeps.plan import sweep_world

_RASTERS, _SIDE_PX, _POINTS = 10, 3000, 100_000
_TRACKS, _LENGTH_M, _TRIALS = 1, 1940.0, 10
TASKS = {
    "build": ("build",),
    "filter": ("track", "smoothed track", "100000 particles", "1000000 particles"),
    "fusion": ("fusion",),
    "sweep": ("sweep",),
}


@dataclass(frozen=True)
class TaskMemory:
    """Memory of a process that does one task, in bytes.

    Parameters
    ----------
    task : str
        Its name.
    loaded_memory_bytes : int
        The peak once its libraries are imported.
    peak_memory_bytes : int
        The peak in all.
    """

    task: str
    loaded_memory_bytes: int
    peak_memory_bytes: int


@dataclass(frozen=True)
class MemoryBench:
    """Peak memory by task of a stage, on generated inputs or the embedded map.

    Parameters
    ----------
    stage : str
        The stage.
    tasks : list of TaskMemory
        ``build``: 10 rasters of 3000 by 3000 pixels, 100 000 points. ``filter``: a walk
        of 1940 m with levels, located and also smoothed; a step of so many particles. ``fusion``:
        the tables of that stage. ``sweep``: its runs, one after the other.
    """

    stage: str
    tasks: list[TaskMemory]


def bench_memory(stage: str) -> MemoryBench:
    """Measure each task of a stage, one of :data:`TASKS`, in a process of its own."""
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        folder = Path(name)
        given = _inputs(stage, folder)
        return MemoryBench(stage, [_in_a_process(task, given) for task in TASKS[stage]])


def _inputs(stage: str, folder: Path) -> list[Path]:
    """Make what the tasks of a stage read, and return the paths."""
    if stage == "build":
        return [made_rasters(folder / "rasters.tif", _RASTERS, _SIDE_PX)[0].path]
    if stage == "filter":
        given = [f"journeys.count={_TRACKS}", f"journeys.length_m={_LENGTH_M}"]
        database, logs = make_world(folder, given)
        return [database, logs[0]]
    if stage == "sweep":
        config = paper_config(MAP_SETTINGS, folder, "helsinki", None)
        run_predict(config)
        run_build(config)
    return [folder]


def _in_a_process(task: str, given: list[Path]) -> TaskMemory:
    code = (
        "import sys; from pathlib import Path;"
        "from mapfilter.workflows.benchmarks.memory import done;"
        "print(*done(sys.argv[1], [Path(name) for name in sys.argv[2:]]))"
    )
    command = [sys.executable, "-c", code, task, *map(str, given)]
    found = []
    for _ in range(2):
        run = subprocess.run(command, check=True, capture_output=True, text=True)
        loaded, peak = map(int, run.stdout.split())
        found.append(TaskMemory(task, loaded, peak))
    return min(found, key=lambda one: one.peak_memory_bytes)


def done(task: str, given: list[Path]) -> tuple[int, int]:
    """Do a task, and return this process's peak memory (bytes) before and after."""
    loaded = peak_memory_bytes()
    if task == "build":
        build_made(given[0], _POINTS)
    elif task == "fusion":
        bench_fusion(runs=1)
    elif task == "sweep":
        _swept(given[0])
    else:
        _located(task, *given)
    return loaded, peak_memory_bytes()


def _swept(folder: Path) -> None:
    plan = plans(_TRIALS, 0)[0]
    config = paper_config(MAP_SETTINGS, folder, "helsinki", None)
    databases = {plan.databases[0]: config.database_path}
    sweep(plan, sweep_world(config, plan.radios), databases, folder / "sweep")


def _located(task: str, database: Path, log: Path) -> None:
    rng = np.random.default_rng(0)
    if task.endswith("track"):
        options = BayesFilter(smooth=task.startswith("smoothed"))
        locate(read_log(log), options.over(open_database(database)), rng)
        return
    model = BayesFilter().over_area(open_area(open_database(database))).model
    given, belief = step_inputs(model, read_log(log), int(task.split()[0]))
    whole_step(given, belief, np.array(JITTER, np.float32), rng)
