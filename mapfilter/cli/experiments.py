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
    refuse,
    seeded,
)
from mapfilter.workflows.terminal import print_result, rate_bar, say


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
        typer.Argument(
            metavar="PAPER",
            help="khalaf-allah-2007, fritsche-klein-2009, zhang-2006, tesa or dlr.",
        ),
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
    from mapfilter.workflows.reproduce import run_reproduce
    from mapfilter.workflows.reproduce_dlr import DLR, run_reproduce_dlr
    from mapfilter.workflows.reproduce_fusion import FUSION_PAPERS, run_reproduce_fusion
    from mapfilter.workflows.reproduce_tesa import TESA, run_reproduce_tesa
    from mapfilter.workflows.sweep import brief

    if paper in FUSION_PAPERS:
        with rate_bar("reproduce", "parts") as progress:
            fused = run_reproduce_fusion(
                paper,
                (out or Path("out") / paper).absolute(),
                layout_file=layout,
                trials=trials,
                seed=seed or 0,
                progress=progress,
            )
        print_result(fused, as_json)
        return
    if paper in (TESA, DLR):
        refuse({"--map": area_map, "--bbox": bbox, "--layout": layout}, paper)
        run = run_reproduce_tesa if paper == TESA else run_reproduce_dlr
        with rate_bar("reproduce", "trials") as progress:
            tried = run(
                (out or Path("out") / paper).absolute(),
                trials=trials,
                seed=seed or 0,
                workers=workers,
                cluster=cluster,
                progress=progress,
            )
        # The table holds the rows, too.
        shown = {key: own for key, own in asdict(tried).items() if as_json or key != "rows"}
        print_result(shown, as_json)
        return
    with rate_bar("reproduce", "runs") as progress:
        result = run_reproduce(
            paper,
            (out or Path("out") / paper).absolute(),
            map_name=area_map,
            bbox=numbers(bbox, 4, "--bbox"),
            trials=trials or 100,
            seed=seed or 0,
            workers=workers,
            cluster=cluster,
            progress=progress,
        )
    told = asdict(result) | ({} if as_json else {"success": brief(result.success)})
    print_result(told, as_json)


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
