"""Commands that run experiments, and that measure."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import (
    PARTIAL,
    ClusterOption,
    ConfigOption,
    JsonOption,
    OutOption,
    ResumeOption,
    SeedOption,
    SetOption,
    WorkersOption,
    find_own_filter,
    numbers,
    seeded,
)
from mapfilter.experiments.papers import PAPERS
from mapfilter.workflows.terminal import print_result, rate_bar, say

*_FIRST, _LAST = PAPERS


def sweep(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    workers: WorkersOption = 1,
    cluster: ClusterOption = None,
    resume: ResumeOption = False,
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", metavar="KEY=V1,V2,...", help="Values of any numeric option."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Count the runs and estimate the time, no more.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Run filters over a grid of noises and options; exit code 3 if it was stopped on the way."""
    from mapfilter.workflows.sweep import brief, forecast_sweep, load_sweep, run_sweep, vary_axes

    loaded = load_sweep(config, seeded(settings, seed, "sweep.seed"), out=out)
    find_own_filter(loaded)
    axes = vary_axes(vary or ())
    if dry_run:
        print_result(forecast_sweep(loaded, axes, workers=workers), as_json)
        return
    try:
        with rate_bar("sweep", "runs") as progress:
            result = run_sweep(
                loaded, axes, workers=workers, cluster=cluster, resume=resume, progress=progress
            )
    except KeyboardInterrupt:
        say("stopped; finished batches are kept: go on with --resume")
        raise typer.Exit(PARTIAL) from None
    told = asdict(result) | ({} if as_json else {"cells": brief(result.cells)})
    print_result(told, as_json)


def reproduce(
    paper: Annotated[
        str,
        typer.Argument(metavar="PAPER", help=f"{', '.join(_FIRST)} or {_LAST}."),
    ],
    area_map: Annotated[
        str | None,
        typer.Option("--map", metavar="FILE", help="An .osm.pbf file; else a made city."),
    ] = None,
    bbox: Annotated[
        str | None, typer.Option("--bbox", metavar="W,S,E,N", help="Degrees; else the map's own.")
    ] = None,
    layout: Annotated[
        Path | None,
        typer.Option("--layout", metavar="FILE", help="Network and satellites (TOML)."),
    ] = None,
    trials: Annotated[
        int | None,
        typer.Option("--trials", min=1, help="Runs in each cell, or trials; else the paper's."),
    ] = None,
    seed: SeedOption = None,
    out: OutOption = None,
    workers: WorkersOption = 1,
    cluster: ClusterOption = None,
    as_json: JsonOption = False,
) -> None:
    """Repeat a paper's experiments: figure, table, and every reading of what it leaves open."""
    from mapfilter.experiments.papers import find_paper
    from mapfilter.workflows.reproduce import brief_figures, run_reproduce

    with rate_bar("reproduce", find_paper(paper).unit) as progress:
        found = run_reproduce(
            paper,
            (out or Path("out") / paper).absolute(),
            map_name=area_map,
            bbox=numbers(bbox, 4, "--bbox"),
            layout_file=layout,
            trials=trials,
            seed=seed or 0,
            workers=workers,
            cluster=cluster,
            progress=progress,
        )
    print_result(found if as_json else brief_figures(found), as_json)


def bench(
    stage: Annotated[
        str, typer.Argument(metavar="[NAME]", help="build, filter, fusion or sweep.")
    ] = "build",
    runs: Annotated[int, typer.Option("--runs", min=1, help="Runs that medians are of.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Tell how fast a stage is on this machine."""
    from mapfilter.workflows.bench import run_bench

    print_result(run_bench(stage, runs=runs), as_json)
