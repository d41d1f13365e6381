"""What all worlds of ``evaluate global-positioning`` share: runs, figures and pictures."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._parallel import Progress, SerialExecutor, local_executor, ordered_results
from mapfilter.evaluation.accuracy import RADII
from mapfilter.evaluation.stanford import REGIONS, StanfordCounts
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.global_positioning import (
    Batch,
    located_run,
    run_benchmark,
)
from mapfilter.experiments.benchmarks.results import CaseResult, summarise
from mapfilter.experiments.benchmarks.scores import Row
from mapfilter.experiments.benchmarks.worst_run import explain, worst_row
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.basemap import BaseMap
from mapfilter.report.integrity import plot_coverage, plot_stanford, plot_worst_run
from mapfilter.report.saving import save

PICTURES = "pictures"
POOLED = "pooled"
"""Name of the row of several cases together."""


def run_cases(
    whole: Batch,
    out: Path,
    *,
    workers: int,
    resume: bool = False,
    progress: Progress | None = None,
    base: BaseMap | None = None,
    pooled: Collection[str] = (),
) -> list[CaseResult]:
    """Do all runs of a benchmark and return one row of the table for each case.

    Parameters
    ----------
    whole : Batch
        All runs.
    out : Path
        Gets finished batches, and pictures where there is a map to draw them on: a Stanford diagram
        and the worst run of each case, and the coverage of all cases.
    workers : int
        Local processes.
    resume, progress
        As for :func:`mapfilter.experiments.benchmarks.global_positioning.run_benchmark`.
    base : BaseMap, optional
        From :func:`street_base`; without it nothing is drawn.
    pooled : collection of str
        Cases that get one more row together, ``pooled``, if two or more of them were run.
    """
    with local_executor(workers) as executor:
        rows = run_benchmark(
            whole,
            out,
            executor=executor,
            in_flight=2 * workers,
            resume=resume,
            progress=progress,
        )
        of_all = {name: [row for row in rows if row["case"] == name] for name in whole.cases}
        # Of few routes with one case each, some cases have none.
        by_case = {name: found for name, found in of_all.items() if found}
        results = [
            summarise(whole.city.case(name), whole.choice.name, found)
            for name, found in by_case.items()
        ]
        if base is not None:
            draw_cases(whole, by_case, results, base, out / PICTURES, executor)
    together = [name for name in by_case if name in pooled]
    if len(together) > 1:
        every = [row for name in together for row in by_case[name]]
        results.append(summarise(Case(POOLED), whole.choice.name, every))
    return results


def street_base(streets: SweepWorld, attribution: str) -> BaseMap:
    """Return the streets of a city as ground for maps, with the attribution of their source."""
    network = streets.network
    ends = np.stack([network.east_m, network.north_m], axis=1)
    lines = np.stack([ends[network.node_a], ends[network.node_b]], axis=1)
    return BaseMap(streets.lattice.bounds_m, tuple(lines), attribution=attribution)


def draw_cases(
    whole: Batch,
    rows: Mapping[str, Sequence[Row]],
    results: Sequence[CaseResult],
    base: BaseMap,
    folder: Path,
    executor: Executor | None = None,
) -> list[Path]:
    """Draw the Stanford diagram and the worst run of each case, and the coverage of all.

    Returns
    -------
    list of Path
        ``CASE-stanford.png``, ``CASE-worst.png`` and ``coverage.png``.
    """
    made = [folder / "coverage.png"]
    save(_coverage(results), made[0])
    names = list(rows)
    limit_m = whole.integrity.alert_limit_m
    for name in names:
        known = [row for row in rows[name] if row["available"] is not None]
        counts = StanfordCounts(*(sum(row[region] for row in known) for region in REGIONS))
        bins = [bin_ for row in known for bin_ in row["stanford"]]
        title = f"{name}: {counts.epochs} epochs of {len(rows[name])} runs"
        made.append(folder / f"{name}-stanford.png")
        save(plot_stanford(bins, counts, limit_m, title=title), made[-1])
    worst = {name: int(worst_row(rows[name])["route"]) for name in names}
    tasks = [
        replace(whole, cases=(name,), first=route, end=route + 1, one_case=False)
        for name, route in worst.items()
    ]
    found = ordered_results(executor or SerialExecutor(), run_again, tasks, in_flight=2)
    for name, (estimate, truth) in zip(names, found, strict=True):
        story = explain(estimate, truth) if truth is not None else None
        if truth is None or story is None:
            continue
        made.append(folder / f"{name}-worst.png")
        drawn = plot_worst_run(
            estimate,
            truth,
            base,
            (story.index, story.first, story.last),
            limit_m,
            title=f"{name}, run {worst[name]}: {story.what}",
            reason=story.reason,
        )
        save(drawn, made[-1])
    return made


def run_again(batch: Batch) -> tuple[TrackEstimate, Truth | None]:
    """Repeat the one run of a batch; return its estimate and its truth."""
    runs = batch.city.on_route(batch.first, batch.fixed)
    run = located_run(batch, runs, batch.cases[0], batch.first)
    return run.found.estimate, Truth.of_table(run.walked.truth)


def _coverage(results: Sequence[CaseResult]) -> Any:
    def triple(result: CaseResult, share: int) -> tuple[float, float, float]:
        name = f"coverage_{share}"
        figures = vars(result)
        return figures[name], figures[f"{name}_low"], figures[f"{name}_high"]

    cases = {result.name: [triple(result, share) for share in RADII] for result in results}
    return plot_coverage(cases, RADII, title="Coverage of the radii, 95 % intervals over journeys")
