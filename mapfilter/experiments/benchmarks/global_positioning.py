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
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.propagation.shadowing import named_rng
from mapfilter.simulation.reports import Levels

ROUTES_PER_BATCH = 2
HEAD, BATCHES = "benchmark.json", "batches"
_VERSION = 2


@dataclass(frozen=True)
class Batch:
    """Runs of all cases over the routes from ``first`` to before ``end``."""

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
    """Return a filter with what the case's data sheet states, of options that are not fixed."""
    if not isinstance(choice, BayesFilter):
        return replace(choice, smooth=case.smooth) if isinstance(choice, KalmanFilter) else choice
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
    """Run the cases, on so many routes each, and return one row of the table for each.

    Finished batches are kept in ``out``; to resume another benchmark is a ConfigError. ``progress``
    counts batches; ``fixed`` are options of the filter and errors of dead reckoning that hold in
    all cases.
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
    parts, tasks = [], []
    for first in range(0, runs, ROUTES_PER_BATCH):
        end = min(first + ROUTES_PER_BATCH, runs)
        parts.append(out / BATCHES / f"{first:06d}.json")
        if not (resume and len(_rows(parts[-1])) == (end - first) * len(cases)):
            tasks.append((parts[-1], Batch(world, choice, tuple(cases), seed, first, end, fixed)))
    results = ordered_results(
        executor or SerialExecutor(),
        run_batch,
        [task for _, task in tasks],
        in_flight=in_flight,
        progress=progress,
    )
    for (part, _), rows in zip(tasks, results, strict=True):
        write_json(part, {"rows": rows})
    every = [row for part in parts for row in _rows(part)]
    return [
        summarise(CASES[name], choice.name, [row for row in every if row["case"] == name])
        for name in cases
    ]


def _rows(part: Path) -> list[Any]:
    found = read_json(part).get("rows") if part.is_file() else None
    return found if isinstance(found, list) else []
