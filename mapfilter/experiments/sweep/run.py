"""Running a sweep: batches go to an executor, and what is finished lies on disk at once."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from mapfilter._io import ensure_writable_folder, sha256_file
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter._resume import start_or_resume
from mapfilter.database.store import open_database
from mapfilter.errors import StoreError, fail
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.experiments.sweep import table
from mapfilter.experiments.sweep.journeys import filter_rng, heard, sensed, true_path, truth_of
from mapfilter.experiments.sweep.plan import Radio, Run, SweepPlan
from mapfilter.experiments.sweep.world import SweepWorld, open_world, write_world
from mapfilter.positioning.filter import Filter, FilterOptions, locate
from mapfilter.tracks.log import TrackLog

RUNS = "runs.parquet"
HEAD = "sweep.json"
UNFINISHED = "unfinished"

_VERSION = 1
_DETERMINED_BY = {
    "plan_sha256": "plan",
    "world_sha256": "world (streets, cells or levels)",
    "databases_sha256": "database",
    "version": "version of mapfilter",
}
_WORLDS, _LOCATORS, _PATHS = 1, 32, 2


@dataclass(frozen=True)
class Batch:
    """Runs that one worker does in one go.

    Parameters
    ----------
    plan : SweepPlan
    world : Path
        Folder of the world.
    world_sha256 : str
        By which no worker takes an older world for this one.
    databases : tuple of (Path, str)
        Folder and SHA-256 of the manifest of each, in the order of the plan's names.
    first, end : int
        Numbers of the runs.
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

    Raises
    ------
    MapfilterError
        World or database cannot be read.
    """
    plan = batch.plan
    databases = dict(zip(plan.databases, batch.databases, strict=True))
    rows = []
    runs = plan.select(batch.first, batch.end)
    for (radio, period_s, route), alike in groupby(runs, key=_journey):
        log = _heard(batch.world, batch.world_sha256, plan, route, radio, period_s)
        truth = truth_of(log.truth)
        for run in alike:
            filter_ = _filter(*databases[run.database], run.reading.choice)
            found = locate(sensed(plan, log, run), filter_, filter_rng(plan.seed, run)).estimate
            last = str(found.status[-1]) if len(found) else ""
            rows.append(table.row(run, accuracy(found, truth), last))
    return table.to_table(rows)


def sweep(
    plan: SweepPlan,
    world: SweepWorld,
    databases: Mapping[str, Path],
    out: Path,
    *,
    executor: Executor | None = None,
    in_flight: int = 4,
    resume: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Do all runs of a plan and return the path of their table.

    Parameters
    ----------
    plan : SweepPlan
    world : SweepWorld
        With levels for each of the plan's radios.
    databases : mapping of str to Path
        Folder of each of the plan's databases.
    out : Path
        Gets ``runs.parquet`` and ``sweep.json``; what is unfinished lies in ``unfinished``.
    executor : Executor, optional
        Does the batches; without one, this process. Its workers must reach ``out`` and the
        databases by the same paths.
    in_flight : int
        Batches that are handed out at once.
    resume : bool
        Keep what a sweep of the same plan over the same world has finished.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    ConfigError
        There is something else to resume.
    MapfilterError
        A database cannot be read, or the output cannot be written.
    """
    unfinished = out / UNFINISHED
    stamp = write_world(world, unfinished / "world")
    manifests = {name: sha256_file(databases[name] / "manifest.json") for name in plan.databases}
    head = {
        "version": _VERSION,
        "runs": plan.runs,
        "plan_sha256": plan.digest,
        "world_sha256": stamp,
        "databases_sha256": manifests,
        "plan": plan.told,
    }
    batches = unfinished / "batches"
    parts = [
        (batches / f"{number:06d}.parquet", first, end)
        for number, (first, end) in enumerate(plan.batches())
    ]
    older = [out / RUNS, *(batches.glob("*") if batches.is_dir() else ())]
    resumed = start_or_resume(out / HEAD, head, older, resume=resume, names=_DETERMINED_BY)
    if resumed and table.is_part(out / RUNS, plan.runs):
        shutil.rmtree(unfinished, ignore_errors=True)
        return out / RUNS
    ensure_writable_folder(batches)
    todo = [part for part in parts if not table.is_part(part[0], part[2] - part[1])]
    opened = tuple((databases[name], manifests[name]) for name in plan.databases)
    place = unfinished / "world"
    tasks = [Batch(plan, place, stamp, opened, first, end) for _, first, end in todo]
    done = plan.runs - sum(end - first for _, first, end in todo)
    if progress is not None:
        progress(done, plan.runs)
    found = ordered_results(executor or SerialExecutor(), run_batch, tasks, in_flight=in_flight)
    for (path, first, end), rows in zip(todo, found, strict=True):
        table.write_part(rows, path)
        done += end - first
        if progress is not None:
            progress(done, plan.runs)
    table.join_parts((path for path, _, _ in parts), out / RUNS)
    shutil.rmtree(unfinished, ignore_errors=True)
    return out / RUNS


def _journey(run: Run) -> tuple[Radio, float, int]:
    return run.radio, run.report_period_s, run.route


@lru_cache(maxsize=_WORLDS)
def _world(folder: Path, sha256: str) -> SweepWorld:
    if sha256_file(folder / "world.json") != sha256:
        raise fail(StoreError, str(folder), "the world of this sweep", "another", "two at once")
    return open_world(folder)


@lru_cache(maxsize=_LOCATORS)
def _filter(path: Path, sha256: str, choice: FilterOptions) -> Filter[Any]:  # noqa: ARG001
    return choice.over(open_database(path), ways=False)


@lru_cache(maxsize=_PATHS)
def _true_path(folder: Path, sha256: str, plan: SweepPlan, number: int) -> pd.DataFrame:
    return true_path(_world(folder, sha256), plan, number)


@lru_cache(maxsize=_PATHS)
def _heard(
    folder: Path, sha256: str, plan: SweepPlan, number: int, radio: Radio, report_period_s: float
) -> TrackLog:
    truth = _true_path(folder, sha256, plan, number)
    return heard(_world(folder, sha256), plan, truth, number, radio, report_period_s)
