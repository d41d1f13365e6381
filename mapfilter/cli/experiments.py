"""Commands that run experiments, and that measure."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import (
    PARTIAL,
    BoxOption,
    ClusterOption,
    ConfigOption,
    DryRunOption,
    JsonOption,
    OutOption,
    ResumeOption,
    SeedOption,
    SetOption,
    WorkersOption,
    check_custom_filter,
    named_defaults,
    numbers,
    refuse,
    seeded,
)
from mapfilter.errors import Stopped
from mapfilter.experiments.papers import PAPERS
from mapfilter.workflows.outputs.guard import stopped_text
from mapfilter.workflows.outputs.progress_bars import rate_bar
from mapfilter.workflows.outputs.terminal import print_message, print_result

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
        typer.Option(
            "--vary",
            metavar="KEY=V1,V2,...",
            help="Values of a numeric option that the sweep uses; repeatable.",
        ),
    ] = None,
    dry_run: DryRunOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run filters over a grid of noises and options; exit code 3 if it was stopped on the way."""
    from mapfilter.workflows.sweep import forecast_sweep, load_sweep, run_sweep, vary_axes
    from mapfilter.workflows.sweeps.tables import brief, brief_pairs

    loaded = load_sweep(config, seeded(settings, seed, "sweep.seed"), out=out)
    check_custom_filter(loaded)
    axes = vary_axes(vary or ())
    if dry_run:
        with named_defaults(config, settings):
            forecast = forecast_sweep(loaded, axes, workers=workers)
        print_result(forecast, as_json)
        return
    try:
        with named_defaults(config, settings), rate_bar("sweep", "runs") as progress:
            result = run_sweep(
                loaded, axes, workers=workers, cluster=cluster, resume=resume, progress=progress
            )
    except (KeyboardInterrupt, Stopped) as error:
        print_message(stopped_text(error))
        raise typer.Exit(PARTIAL) from None
    pairs = [pair.row for pair in result.pairs] if as_json else brief_pairs(result.pairs)
    shown = asdict(result) | {"pairs": pairs} | ({} if as_json else {"cells": brief(result.cells)})
    print_result(shown, as_json)


def reproduce(
    paper: Annotated[
        str,
        typer.Argument(metavar="PAPER", help=f"{', '.join(_FIRST)} or {_LAST}."),
    ],
    area_map: Annotated[
        str | None,
        typer.Option("--map", metavar="FILE", help="An .osm.pbf file; default: a synthetic city."),
    ] = None,
    bbox: BoxOption = None,
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
    runs: Annotated[
        int | None, typer.Option("--runs", min=1, help="Runs; medians are reported. Default: 5.")
    ] = None,
    peers: Annotated[
        bool,
        typer.Option(
            "--peers", help="Filter: a step beside NumPy, particles, Stone Soup and filterpy."
        ),
    ] = False,
    memory: Annotated[
        bool, typer.Option("--memory", help="The most memory that the stage's tasks take.")
    ] = False,
    threads: Annotated[
        int,
        typer.Option("--threads", min=1, max=64, help="Filter: a step divided among threads."),
    ] = 1,
    device: Annotated[
        str,
        typer.Option(
            "--device", help="Filter: gpu for a step on a graphics processor beside the processor."
        ),
    ] = "cpu",
    as_json: JsonOption = False,
) -> None:
    """Measure how fast a stage is on this machine, or what memory it takes."""
    from mapfilter.workflows.bench import RUNS, run_bench

    if memory:
        refuse({"--runs": runs}, "bench --memory")
    found = run_bench(
        stage, runs=runs or RUNS, peers=peers, memory=memory, threads=threads, device=device
    )
    print_result(found, as_json)
