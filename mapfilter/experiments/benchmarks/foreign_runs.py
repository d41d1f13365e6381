"""Global positioning in the foreign and the harsh world: batches of runs, kept as they finish."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapfilter._io import read_json, write_json
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter._resume import start_or_resume
from mapfilter.experiments.benchmarks.foreign import ForeignWorld, RouteRuns
from mapfilter.experiments.benchmarks.global_positioning import (
    BATCHES,
    HEAD,
    ROUTES_PER_BATCH,
    informed,
)
from mapfilter.experiments.benchmarks.journeys import Walk
from mapfilter.experiments.benchmarks.scores import CaseResult, Row, score, summarise
from mapfilter.experiments.benchmarks.world_cases import CASES_OF
from mapfilter.positioning.estimate import PositionedTrack
from mapfilter.positioning.filter import FilterOptions, locate
from mapfilter.propagation.shadowing import named_rng
from mapfilter.tracks.log import TrackLog

_VERSION = 1


@dataclass(frozen=True)
class ForeignBatch:
    """Runs of some cases over some routes.

    Parameters
    ----------
    first, end : int
        Numbers of the routes.
    fixed : frozenset of str
        Options of the filter that were set for all cases.
    """

    world: ForeignWorld
    choice: FilterOptions
    cases: tuple[str, ...]
    first: int
    end: int
    fixed: frozenset[str] = frozenset()


def run_batch(batch: ForeignBatch) -> list[Row]:
    """Do the runs of a batch and return their rows."""
    rows = []
    for route in range(batch.first, batch.end):
        runs = RouteRuns(batch.world, route)
        for name in batch.cases:
            walked, _, found = positioned(batch, runs, name)
            case = CASES_OF[batch.world.name][name]
            rows.append({**score(case, walked, found), "route": route})
    return rows


def positioned(
    batch: ForeignBatch, runs: RouteRuns, name: str
) -> tuple[Walk, TrackLog, PositionedTrack]:
    """Return truth, log and estimate of one run, to be scored or drawn."""
    world, case = batch.world, CASES_OF[batch.world.name][name]
    walked, log = runs.run(case)
    filter_ = world.filter(informed(batch.choice, case, batch.fixed), case, runs.route)
    rng = named_rng(world.seed, "filter", name, str(runs.route))
    return walked, log, locate(log, filter_, rng)


def foreign_benchmark(
    world: ForeignWorld,
    choice: FilterOptions,
    cases: Sequence[str],
    runs: int,
    out: Path,
    *,
    executor: Executor | None = None,
    in_flight: int = 4,
    resume: bool = False,
    progress: Progress | None = None,
    fixed: frozenset[str] = frozenset(),
) -> list[CaseResult]:
    """Run cases of a foreign world and return one row of the table for each.

    Parameters
    ----------
    cases : sequence of str
        Names out of :data:`mapfilter.experiments.benchmarks.world_cases.CASES_OF`.
    runs : int
        Routes for each case, each with a ground truth of its own.
    out, executor, in_flight, resume, progress, fixed
        As for :func:`mapfilter.experiments.benchmarks.global_positioning.benchmark`.

    Raises
    ------
    ConfigError
        There is something else to resume.
    """
    head = {
        "version": _VERSION,
        "filter": repr(choice),
        "cases": list(cases),
        "seed": world.seed,
        "fixed": sorted(fixed),
        "world": world.sha256,
    }
    folder = out / BATCHES
    folder.mkdir(parents=True, exist_ok=True)
    start_or_resume(out / HEAD, head, folder.glob("*.json"), resume=resume)
    tasks, kept = [], dict[int, list[Row]]()
    for first in range(0, runs, ROUTES_PER_BATCH):
        end = min(first + ROUTES_PER_BATCH, runs)
        done = _finished(folder / f"{first:06d}.json", (end - first) * len(cases))
        if resume and done is not None:
            kept[first] = done
        else:
            tasks.append(ForeignBatch(world, choice, tuple(cases), first, end, fixed))
    results = ordered_results(
        executor or SerialExecutor(), run_batch, tasks, in_flight=in_flight, progress=progress
    )
    for task, rows in zip(tasks, results, strict=True):
        write_json(folder / f"{task.first:06d}.json", {"rows": rows})
        kept[task.first] = rows
    every = [row for first in sorted(kept) for row in kept[first]]
    known = CASES_OF[world.name]
    return [
        summarise(known[name], choice.name, [row for row in every if row["case"] == name])
        for name in cases
    ]


def _finished(file: Path, rows: int) -> list[Any] | None:
    """Return the rows of a batch that was finished, or None."""
    if not file.is_file():
        return None
    found = read_json(file).get("rows")
    return found if isinstance(found, list) and len(found) == rows else None
