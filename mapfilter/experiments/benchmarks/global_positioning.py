"""Global positioning from an unknown start, on any map: routes and radio are drawn anew.

Runs go in batches of a few routes, each with a ground truth of its own; all cases run over the same
journeys. Finished batches lie on disk, so that what was stopped can go on.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mapfilter._io import read_json, write_json
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter._resume import start_or_resume
from mapfilter.experiments.benchmarks.cases import CASES, Case
from mapfilter.experiments.benchmarks.journeys import (
    TOWN_HEIGHT,
    displaced_walk,
    log_of,
    spoofer_of,
    walk,
    with_satellites,
)
from mapfilter.experiments.benchmarks.scores import (
    CaseResult,
    Row,
    score,
    score_window,
    summarise,
)
from mapfilter.experiments.benchmarks.world import BenchmarkWorld
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.filter import FilterOptions, locate
from mapfilter.propagation.shadowing import named_rng
from mapfilter.simulation.reports import Levels

ROUTES_PER_BATCH = 2
HEAD, BATCHES = "benchmark.json", "batches"
_VERSION = 2


@dataclass(frozen=True)
class Batch:
    """Runs of all cases over some routes.

    Parameters
    ----------
    first, end : int
        Numbers of the routes.
    fixed : frozenset of str
        Options of the filter and errors of dead reckoning that were set for all cases.
    """

    world: BenchmarkWorld
    choice: FilterOptions
    cases: tuple[str, ...]
    seed: int
    first: int
    end: int
    fixed: frozenset[str] = frozenset()


def run_batch(batch: Batch) -> list[Row]:
    """Do the runs of a batch and return their rows."""
    return [row for route in range(batch.first, batch.end) for row in _run_route(batch, route)]


def _run_route(batch: Batch, route: int) -> list[Row]:
    """Run all cases on one route and in one ground truth."""
    world, streets, settings = batch.world, batch.world.streets, batch.world.settings
    truth_seed = int(named_rng(batch.seed, "ground truth", str(route)).integers(2**62))
    rows: list[Row] = []
    truths: dict[float | None, Levels] = {}
    for name in batch.cases:
        case = CASES[name]
        error_db = None if "level_error_db" in batch.fixed else case.level_error_db
        if error_db not in truths:
            truths[error_db] = world.ground_truth(truth_seed, error_db)
        levels = truths[error_db]
        make = displaced_walk if case.recovery_within_m > 0 else walk
        walked = make(streets, settings.journey, batch.seed, route)
        log = log_of(case, walked, levels, streets, settings, batch.seed, route, batch.fixed)
        skyline = world.skyline(case)
        log = with_satellites(case, log, walked, skyline, batch.seed, route, world.reception)
        choice = informed(batch.choice, case, batch.fixed)
        filter_ = world.filter(choice, thinned=case.missing_ways > 0)
        found = locate(log, filter_, named_rng(batch.seed, "filter", name, str(route)))
        row = {**score(case, walked, found), "route": route}
        if case.satellites is not None:
            row |= score_window(walked, found, spoofer_of(walked, batch.seed, route).from_s)
        rows.append(row)
    return rows


def informed(
    choice: FilterOptions, case: Case, fixed: frozenset[str] = frozenset()
) -> FilterOptions:
    """Return a filter with what the case's data sheet states; nothing else is known to it.

    Parameters
    ----------
    fixed : frozenset of str
        Options that were set for all cases.
    """
    if not isinstance(choice, BayesFilter):
        return choice
    stated = {**case.data_sheet, **(TOWN_HEIGHT if case.satellites is not None else {})}
    known: dict[str, Any] = {name: value for name, value in stated.items() if name not in fixed}
    return replace(choice, smooth=case.smooth, **known)


def benchmark(
    world: BenchmarkWorld,
    choice: FilterOptions,
    cases: Sequence[str],
    runs: int,
    seed: int,
    out: Path,
    *,
    executor: Executor | None = None,
    in_flight: int = 4,
    resume: bool = False,
    progress: Progress | None = None,
    fixed: frozenset[str] = frozenset(),
) -> list[CaseResult]:
    """Run the cases and return one row of the table for each.

    Parameters
    ----------
    cases : sequence of str
        Names out of :data:`mapfilter.experiments.benchmarks.cases.CASES`.
    runs : int
        Routes for each case, each with a ground truth of its own.
    out : Path
        Folder in which finished batches are kept.
    resume : bool
        Keep what the same benchmark has finished.
    progress : callable, optional
        Called with batches done and batches in all.
    fixed : frozenset of str
        Options of the filter and errors of dead reckoning that hold in all cases.

    Raises
    ------
    ConfigError
        There is something else to resume.
    """
    head = {
        "version": _VERSION,
        "filter": repr(choice),
        "cases": list(cases),
        "seed": seed,
        "fixed": sorted(fixed),
        "world": world.sha256,
    }
    (out / BATCHES).mkdir(parents=True, exist_ok=True)
    start_or_resume(out / HEAD, head, (out / BATCHES).glob("*.json"), resume=resume)
    tasks, kept = [], dict[int, list[Row]]()
    for first in range(0, runs, ROUTES_PER_BATCH):
        end = min(first + ROUTES_PER_BATCH, runs)
        done = _finished(out / BATCHES / f"{first:06d}.json", (end - first) * len(cases))
        if resume and done is not None:
            kept[first] = done
        else:
            tasks.append(Batch(world, choice, tuple(cases), seed, first, end, fixed))
    results = ordered_results(
        executor or SerialExecutor(), run_batch, tasks, in_flight=in_flight, progress=progress
    )
    for task, rows in zip(tasks, results, strict=True):
        write_json(out / BATCHES / f"{task.first:06d}.json", {"rows": rows})
        kept[task.first] = rows
    every = [row for first in sorted(kept) for row in kept[first]]
    return [
        summarise(CASES[name], choice.name, [row for row in every if row["case"] == name])
        for name in cases
    ]


def _finished(file: Path, rows: int) -> list[Any] | None:
    """Return the rows of a batch that was finished, or None."""
    if not file.is_file():
        return None
    found = read_json(file).get("rows")
    return found if isinstance(found, list) and len(found) == rows else None
