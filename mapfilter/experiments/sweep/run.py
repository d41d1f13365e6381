"""Running a sweep: batches go to an executor, and what is finished lies on disk at once."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from pathlib import Path

import pandas as pd
import pyarrow as pa

from mapfilter._io import ensure_writable_folder, sha256_file
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter._resume import check_same, kept_when_stopped, start_or_resume, with_code
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import MapfilterError
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.evaluation.claims import claimed_radii
from mapfilter.experiments.sweep import table
from mapfilter.experiments.sweep.journeys import filter_rng, radio_log, sensed, true_path, truth_of
from mapfilter.experiments.sweep.plan import Radio, Run, SweepPlan
from mapfilter.experiments.sweep.world import SweepWorld, opened_world, scored_filter, write_world
from mapfilter.positioning.log_options import LogStatement, fitted_to_statement
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import TrackLog

RUNS = "runs.parquet"
UNFINISHED = "unfinished"

_VERSION = 2
_DETERMINED_BY = {
    "plan_sha256": "plan",
    "world_sha256": "world (streets, cells or levels)",
    "databases_sha256": "database",
    "version": "version of the sweep",
}
_PATHS = 2
_TRIAL_RUNS = 8


@dataclass(frozen=True)
class Batch:
    """Runs, from ``first`` to before ``end``, that one worker does in one go.

    Folders of the world and the databases, in the order of the plan's names, stand with the SHA-256
    of their heads, by which no worker takes older ones for these.
    """

    plan: SweepPlan
    world: Path
    world_sha256: str
    databases: tuple[tuple[Path, str], ...]
    first: int
    end: int


def run_batch(batch: Batch) -> pa.Table:
    """Do the runs of a batch and return their rows.

    World and databases are opened once by each worker and kept.
    """
    plan = batch.plan
    databases = dict(zip(plan.databases, batch.databases, strict=True))
    rows = []
    runs = plan.select(batch.first, batch.end)
    for (radio, period_s, route), alike in groupby(runs, key=_journey):
        log = _radio_log(batch.world, batch.world_sha256, plan, route, radio, period_s)
        truth, stated = truth_of(log.truth), LogStatement.of_log(log)
        for run in alike:
            # As where the logs of a simulation are replayed.
            choice, _ = fitted_to_statement(run.reading.choice, stated)
            filter_ = scored_filter(*databases[run.database], choice)
            found = locate(sensed(plan, log, run), filter_, filter_rng(plan.seed, run)).estimate
            figures = accuracy(found, truth), claimed_radii(found, truth)
            last = str(found.status[-1]) if len(found) else ""
            rows.append(table.row(run, *figures, last, plan.varied))
    return table.to_table(rows, table.schema_of(key for key, _ in plan.varied))


def sweep(
    plans: SweepPlan | Sequence[SweepPlan],
    world: SweepWorld,
    databases: Mapping[str, Path],
    out: Path,
    *,
    executor: Executor | None = None,
    in_flight: int = 4,
    resume: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Do all runs of a sweep and return the path of their table, for :func:`.table.read_runs`.

    Parameters
    ----------
    plans : SweepPlan or sequence of SweepPlan
        Several where options are varied: they name the same databases and the same varied options.
    world : SweepWorld
        With levels for each of the plans' radios.
    databases : mapping of str to Path
        Folder of each of the plans' databases.
    out : Path
        Gets ``runs.parquet`` and ``sweep.json``; unfinished parts lie in ``unfinished``.
    executor : Executor, optional
        Does the batches; without one, this process. Its workers must reach ``out`` and the
        databases by the same paths.
    in_flight : int
        Batches that are handed out at once.
    resume : bool
        Keep the finished parts of a sweep of the same plans over the same world.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    MapfilterError
        There is something else to resume, a database cannot be read, or the output not written.
    """
    grid = (plans,) if isinstance(plans, SweepPlan) else tuple(plans)
    schema = table.schema_of(key for key, _ in grid[0].varied)
    total = sum(plan.runs for plan in grid)
    unfinished = out / UNFINISHED
    stamp = write_world(world, unfinished / "world")
    manifests = {name: sha256_file(databases[name] / "manifest.json") for name in grid[0].databases}
    head = {
        "version": _VERSION,
        "runs": total,
        "plan_sha256": [plan.digest for plan in grid],
        "world_sha256": stamp,
        "databases_sha256": manifests,
        "plan": [plan.as_json for plan in grid],
    }
    finished, begun = out / table.HEAD, unfinished / table.HEAD
    if resume and finished.is_file() and not begun.is_file():
        try:
            check_same(finished, head, _DETERMINED_BY)
        except MapfilterError:
            _remove(unfinished)
            raise
        if table.is_whole(out / RUNS):
            _remove(unfinished)
            return out / RUNS
    batches = unfinished / "batches"
    opened = tuple((databases[name], digest) for name, digest in manifests.items())
    tasks = [
        Batch(plan, unfinished / "world", stamp, opened, first, end)
        for plan in grid
        for first, end in plan.batches()
    ]
    parts = [batches / f"{number:06d}.part" for number in range(len(tasks))]
    # Results of an older sweep stay until these are whole.
    start_or_resume(begun, head, batches.glob("*"), resume=resume, names=_DETERMINED_BY)
    ensure_writable_folder(batches)

    def rows_of(part: Path, task: Batch) -> pa.Table | None:
        return table.read_part(part, task.end - task.first, schema)

    every = list(zip(parts, tasks, strict=True))
    todo = [(part, task) for part, task in every if rows_of(part, task) is None]
    done = total - sum(task.end - task.first for _, task in todo)
    if progress is not None:
        progress(done, total)
    found = ordered_results(
        executor or SerialExecutor(), run_batch, [task for _, task in todo], in_flight=in_flight
    )
    with kept_when_stopped("batches"):
        for (part, task), rows in zip(todo, found, strict=True):
            table.write_part(rows, part)
            done += task.end - task.first
            if progress is not None:
                progress(done, total)
    # A batch that was damaged meanwhile is done again.
    whole = (rows_of(part, task) or run_batch(task) for part, task in every)
    table.join_parts(whole, out / RUNS, schema)
    table.note_whole(out / RUNS, with_code(head))
    _remove(unfinished)
    return out / RUNS


def _remove(unfinished: Path) -> None:
    """Remove the unfinished parts of a sweep, and the folder unless it holds something else."""
    for part in ("world", "batches"):
        shutil.rmtree(unfinished / part, ignore_errors=True)
    with suppress(OSError):
        (unfinished / table.HEAD).unlink(missing_ok=True)
        unfinished.rmdir()


def sweep_runs(
    plans: SweepPlan | Sequence[SweepPlan],
    world: SweepWorld,
    databases: Mapping[str, RadioRouteDatabase],
    *,
    executor: Executor | None = None,
    in_flight: int = 4,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Do all runs of a sweep and return one row for each run; nothing is kept on disk.

    Parameters
    ----------
    plans, world, executor, in_flight, progress
        As for :func:`sweep`; see :meth:`SweepWorld.of` for a world of your own objects.
    databases : mapping of str to RadioRouteDatabase
        Each of the plans' databases.

    Returns
    -------
    pandas.DataFrame
        The columns of :data:`mapfilter.experiments.sweep.table.SCHEMA` and those of varied options.
        :func:`mapfilter.evaluation.success_cells.success_cells` gives success rates with intervals.
    """
    folders = {name: database.path for name, database in databases.items()}
    with tempfile.TemporaryDirectory(prefix="mapfilter-sweep-") as name:
        done = sweep(
            plans,
            world,
            folders,
            Path(name),
            executor=executor,
            in_flight=in_flight,
            progress=progress,
        )
        return table.read_runs(done)


def seconds_per_run(plan: SweepPlan, world: SweepWorld, databases: Mapping[str, Path]) -> float:
    """Measure a few runs of a plan in this process, after one that opens files and compiles."""
    with tempfile.TemporaryDirectory(prefix="mapfilter-trial-") as name:
        folder = Path(name) / "world"
        stamp = write_world(world, folder)
        opened = tuple(
            (databases[name], sha256_file(databases[name] / "manifest.json"))
            for name in plan.databases
        )
        for runs in (1, min(_TRIAL_RUNS, plan.runs)):
            began_s = time.perf_counter()
            run_batch(Batch(plan, folder, stamp, opened, 0, runs))
        return (time.perf_counter() - began_s) / runs


def _journey(run: Run) -> tuple[Radio, float, int]:
    return run.radio, run.report_period_s, run.route


@lru_cache(maxsize=_PATHS)
def _true_path(folder: Path, sha256: str, plan: SweepPlan, number: int) -> pd.DataFrame:
    return true_path(opened_world(folder, sha256), plan, number)


@lru_cache(maxsize=_PATHS)
def _radio_log(
    folder: Path, sha256: str, plan: SweepPlan, number: int, radio: Radio, report_period_s: float
) -> TrackLog:
    truth = _true_path(folder, sha256, plan, number)
    return radio_log(opened_world(folder, sha256), plan, truth, number, radio, report_period_s)
