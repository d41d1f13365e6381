"""``mapfilter bench sweep``: runs per second, what each part of a run costs, and how it scales."""

from __future__ import annotations

import contextlib
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from statistics import median

from mapfilter._cluster import cluster_executor
from mapfilter._parallel import SerialExecutor, local_executor
from mapfilter.database.store import open_database
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.evaluation.claims import claimed_radii
from mapfilter.experiments.papers.khalaf_allah_2007 import MAP_SETTINGS, ONE_SIGMA_TRANS_M, plans
from mapfilter.experiments.sweep.journeys import filter_rng, radio_log, sensed, true_path, truth_of
from mapfilter.experiments.sweep.plan import SweepPlan
from mapfilter.experiments.sweep.run import sweep
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.positioning.loop import locate
from mapfilter.workflows.bench import median_seconds
from mapfilter.workflows.build import run_build
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.reproduce import paper_config
from mapfilter.workflows.sweeps.plan import sweep_world

_PROCESSES, _TIMED = 2, 12


@dataclass(frozen=True)
class SweepBench:
    """Seconds are medians over the repetitions, which take turns; ratios are of these.

    Parameters
    ----------
    runs, epochs : int
        The task: the candidate filter of Khalaf-Allah 2007 on the embedded map, so many runs of
        so many epochs.
    route_s, radio_s : float
        Making a route with its truth, and what is received along it: once for all runs on it.
    sensed_s, located_s, scored_s : float
        A run's inertial unit, its filter, and its score, per run.
    filter_step_s : float
        The filter, per epoch.
    one_process_s, one_process_runs_per_s : float
        A whole sweep in this process.
    two_processes_s, speedup, efficiency : float
        The same by two worker processes that are already started; the speed-up's half.
    dask_s, dask_ratio : float or None
        The same by two workers of a local Dask cluster, and as a ratio to the processes; None
        without the package.
    """

    runs: int
    epochs: int
    route_s: float
    radio_s: float
    sensed_s: float
    located_s: float
    scored_s: float
    filter_step_s: float
    one_process_s: float
    one_process_runs_per_s: float
    two_processes_s: float
    speedup: float
    efficiency: float
    dask_s: float | None
    dask_ratio: float | None


def bench_sweep(*, runs: int = 3, trials: int = 160) -> SweepBench:
    """Measure a sweep on the embedded map: medians of so many ``runs``.

    ``trials`` are the runs in each of the six cells of its grid.
    """
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        return _bench(Path(name), runs, trials)


def _bench(folder: Path, repetitions: int, trials: int) -> SweepBench:
    config = paper_config(MAP_SETTINGS, folder, "helsinki", None)
    run_predict(config)
    run_build(config)
    whole = plans(trials, 0)[0]
    noises = tuple(noise for noise in whole.noises if noise.sigma_trans_m == ONE_SIGMA_TRANS_M)
    plan = replace(whole, noises=noises, routes=min(trials, 10), draws=max(trials // 10, 1))
    world = sweep_world(config, plan.radios)
    database = config.database_path
    epochs, parts = _parts(plan, world, database)
    with local_executor(_PROCESSES) as two, _dask() as dask:
        executors: dict[str, Executor] = {"one": SerialExecutor(), "two": two, **dask}
        tasks = {
            name: partial(
                sweep,
                plan,
                world,
                {plan.databases[0]: database},
                folder / name,
                executor=executor,
                in_flight=3 * _PROCESSES,
            )
            for name, executor in executors.items()
        }
        seconds = median_seconds(tasks, repetitions)
    dask_s = seconds.get("dask")
    speedup = seconds["one"] / seconds["two"]
    return SweepBench(
        runs=plan.runs,
        epochs=epochs,
        **parts,
        filter_step_s=parts["located_s"] / epochs,
        one_process_s=seconds["one"],
        one_process_runs_per_s=plan.runs / seconds["one"],
        two_processes_s=seconds["two"],
        speedup=speedup,
        efficiency=speedup / _PROCESSES,
        dask_s=dask_s,
        dask_ratio=None if dask_s is None else dask_s / seconds["two"],
    )


def _parts(plan: SweepPlan, world: SweepWorld, database: Path) -> tuple[int, dict[str, float]]:
    """Return epochs of a run, and the seconds that each part of it takes."""
    took: dict[str, list[float]] = {}

    @contextlib.contextmanager
    def timed(part: str) -> Iterator[None]:
        began_s = time.perf_counter()
        yield
        took.setdefault(part, []).append(time.perf_counter() - began_s)

    filter_ = plan.readings[0].choice.over(open_database(database), ways=False)
    epochs = 0
    runs_of_route = plan.runs // plan.routes
    for number in range(plan.routes):
        first = number * runs_of_route
        run = next(plan.select(first, first + 1))
        with timed("route_s"):
            truth = true_path(world, plan, number)
        with timed("radio_s"):
            log = radio_log(world, plan, truth, number, run.radio, run.report_period_s)
        for run in plan.select(first, first + min(runs_of_route, _TIMED)):
            with timed("sensed_s"):
                moved = sensed(plan, log, run)
            with timed("located_s"):
                found = locate(moved, filter_, filter_rng(plan.seed, run)).estimate
            with timed("scored_s"):
                truth = truth_of(log.truth)
                accuracy(found, truth)
                claimed_radii(found, truth)
            epochs = len(found)
    return epochs, {name: median(times) for name, times in took.items()}


@contextlib.contextmanager
def _dask() -> Iterator[dict[str, Executor]]:
    """Give a local Dask cluster, or nothing without the package."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        yield {}
        return
    with cluster_executor(f"local:{_PROCESSES}") as (executor, _):
        yield {"dask": executor}
