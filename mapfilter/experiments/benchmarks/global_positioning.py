"""Global positioning from an unknown start, on any map: routes and radio are drawn anew.

Runs go in batches: one reality of the radio, several routes, all cases over the same journeys.
Finished batches lie on disk, so that what was stopped can go on.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mapfilter._io import read_json, write_json
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.journeys import displaced_walk, log_of, walk
from mapfilter.experiments.benchmarks.resuming import begin
from mapfilter.experiments.benchmarks.satellites import TOLD, spoofer_of, with_satellites
from mapfilter.experiments.benchmarks.scores import (
    CaseResult,
    Row,
    score,
    score_window,
    summarise,
)
from mapfilter.experiments.benchmarks.world import BenchmarkWorld
from mapfilter.positioning.bayes_options import BayesOptions
from mapfilter.positioning.locators import FilterChoice
from mapfilter.radio.shadowing import named_rng

ROUTES_PER_REALITY = 5
HEAD, BATCHES = "benchmark.json", "batches"
_VERSION = 1


@dataclass(frozen=True)
class Batch:
    """Runs of all cases over the routes of one reality.

    Parameters
    ----------
    world : BenchmarkWorld
    choice : FilterChoice
    cases : tuple of str
    seed : int
    first, end : int
        Numbers of the routes.
    """

    world: BenchmarkWorld
    choice: FilterChoice
    cases: tuple[str, ...]
    seed: int
    first: int
    end: int


def run_batch(batch: Batch) -> list[Row]:
    """Do the runs of a batch and return their rows."""
    rows = []
    world, number = batch.world.streets, batch.first // ROUTES_PER_REALITY
    reality_seed = int(named_rng(batch.seed, "reality", str(number)).integers(2**62))
    for error_db in sorted({CASES[name].level_error_db for name in batch.cases}):
        levels = batch.world.reality(reality_seed, error_db)
        for route in range(batch.first, batch.end):
            for name in batch.cases:
                case = CASES[name]
                if case.level_error_db != error_db:
                    continue
                make = displaced_walk if case.recovery_within_m > 0 else walk
                walked = make(world.network, batch.seed, route)
                log = log_of(case, walked, levels, world.plan, world.lattice.crs, batch.seed, route)
                log = with_satellites(
                    case, log, walked, batch.world.skyline(case), batch.seed, route
                )
                locate = batch.world.locator(
                    told(batch.choice, name), thinned=case.missing_ways > 0
                )
                found = locate(log, named_rng(batch.seed, "filter", name, str(route)))
                scored_at = named_rng(batch.seed, "score", name, str(route))
                row = {**score(case, walked, found, scored_at), "route": route}
                if case.satellites is not None:
                    row |= score_window(walked, found, spoofer_of(walked, batch.seed, route).from_s)
                rows.append(row)
    return rows


def told(choice: FilterChoice, case: str) -> FilterChoice:
    """Return a filter that knows the data sheet of a case's dead reckoning."""
    match choice.options:
        case BayesOptions() as options:
            known = replace(options, motion=CASES[case].told, smooth=CASES[case].smooth)
            if CASES[case].satellites is not None:
                known = replace(known, satellites=TOLD)
            return replace(choice, options=known)
    return choice


def benchmark(
    world: BenchmarkWorld,
    choice: FilterChoice,
    cases: Sequence[str],
    runs: int,
    seed: int,
    out: Path,
    *,
    executor: Executor | None = None,
    in_flight: int = 4,
    resume: bool = False,
    progress: Progress | None = None,
) -> list[CaseResult]:
    """Run the cases and return one row of the table for each.

    Parameters
    ----------
    world : BenchmarkWorld
    choice : FilterChoice
    cases : sequence of str
        Names out of :data:`mapfilter.experiments.benchmarks.cases.CASES`.
    runs : int
        Routes for each case; five share a reality of the radio.
    seed : int
    out : Path
        Folder in which finished batches are kept.
    executor : Executor, optional
    in_flight : int
    resume : bool
        Keep what the same benchmark has finished.
    progress : callable, optional
        Called with runs done and runs in all.

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
        "world": world.sha256,
    }
    (out / BATCHES).mkdir(parents=True, exist_ok=True)
    begin(out / HEAD, head, (out / BATCHES).glob("*.json"), resume=resume)
    tasks, kept = [], dict[int, list[Row]]()
    for first in range(0, runs, ROUTES_PER_REALITY):
        end = min(first + ROUTES_PER_REALITY, runs)
        done = _finished(out / BATCHES / f"{first:06d}.json", (end - first) * len(cases))
        if resume and done is not None:
            kept[first] = done
        else:
            tasks.append(Batch(world, choice, tuple(cases), seed, first, end))
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
