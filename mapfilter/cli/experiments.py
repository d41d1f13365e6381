"""Commands that run experiments, and that measure."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from mapfilter._partial import nothing_left
from mapfilter.cli.options import (
    PARTIAL,
    BoxOption,
    ClusterOption,
    ConfigOption,
    DryRunOption,
    FilterOption,
    JsonOption,
    OutOption,
    ResumeOption,
    SeedOption,
    SetOption,
    WorkersOption,
    check_custom_filter,
    given_path,
    named_defaults,
    numbers,
    refuse,
    seeded,
    toml,
)
from mapfilter.errors import Stopped
from mapfilter.experiments.papers import PAPERS
from mapfilter.workflows.guard import stopped_text
from mapfilter.workflows.progress_bars import rate_bar
from mapfilter.workflows.terminal import print_message, print_result

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
    from mapfilter.workflows.sweep_tables import brief, brief_pairs

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


def evaluate(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="Simulated: global-positioning, audit. Of recordings (--data): all, ottawa, "
            "fingerprints, kitti, mall, smartloc, belgium, mountain-view, denver, single-reports.",
        ),
    ],
    map_file: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="An OpenStreetMap file.", callback=given_path),
    ] = None,
    bbox: BoxOption = None,
    cases: Annotated[
        list[str] | None,
        typer.Option(
            "--case", metavar="NAME", help="A case or set; repeatable. Default: all but satellites."
        ),
    ] = None,
    filter_name: FilterOption = None,
    world: Annotated[
        str | None,
        typer.Option(
            "--world",
            metavar="NAME",
            help="Simulated world: plain (default), foreign, harsh, sensors (faults of phones), or "
            "easy (optimistic figures).",
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data", metavar="DIR", help="Folder of the published data sets.", callback=given_path
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(
            "--runs",
            min=1,
            help="Routes for each case (20); draws of the noise for each session (3).",
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of what is drawn.")] = 0,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Local processes. Default: 2.")
    ] = None,
    resume: ResumeOption = False,
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Benchmark localization accuracy: simulated on any map, or on real sessions."""
    from mapfilter.workflows.evaluate import (
        RUNS,
        check_benchmark,
        main_table,
        run_global_positioning,
    )
    from mapfilter.workflows.evaluate_audit import audit_table, run_audit
    from mapfilter.workflows.evaluate_foreign import load_foreign, other_world, run_foreign
    from mapfilter.workflows.evaluate_ottawa import RUNS as OTTAWA_RUNS
    from mapfilter.workflows.evaluate_ottawa import run_ottawa
    from mapfilter.workflows.evaluate_recorded import ALL, BENCHMARKS, run_all, run_recorded
    from mapfilter.workflows.evaluate_settings import load_benchmark
    from mapfilter.workflows.evaluate_single_reports import SETS, run_single_reports

    check_benchmark(name, data)
    common: dict[str, Any] = {"seed": seed, "workers": workers or 2, "resume": resume}
    result: Any
    if name == "ottawa" and data is not None:
        other = None if filter_name == "bayes" else filter_name
        unused = {"--map": map_file, "--bbox": bbox, "--case": cases, "--filter": other}
        refuse(unused | {"--world": world, "--config": config, "--set": settings}, name)
        folder = (out or Path("out") / "ottawa").absolute()
        with nothing_left(folder), rate_bar("evaluate", "sessions") as progress:
            result = run_ottawa(data, folder, runs=runs or OTTAWA_RUNS, progress=progress, **common)
        print_result(result, as_json)
        return
    if name in (ALL, *BENCHMARKS) and data is not None:
        unused = {"--map": map_file, "--bbox": bbox, "--filter": filter_name, "--world": world}
        refuse(unused | {"--config": config, "--set": settings}, name)
        folder = (out or Path("out") / name).absolute()
        with nothing_left(folder), rate_bar("evaluate", "runs") as progress:
            if name == ALL:
                refuse({"--case": cases, "--runs": runs}, name)
                result = run_all(data, folder, progress=progress, **common)
            else:
                result = run_recorded(
                    name, data, folder, parts=cases or (), runs=runs, progress=progress, **common
                )
        # Units may be hundreds: they are in the JSON and in table.json, as intervals are.
        hidden = ("units", "intervals")
        shown = {key: value for key, value in vars(result).items() if key not in hidden}
        print_result(result if as_json else shown, as_json)
        if name == ALL and (result.missing or result.failed):
            raise typer.Exit(PARTIAL)
        return
    if name == "single-reports" and data is not None:
        unused = {"--map": map_file, "--bbox": bbox, "--filter": filter_name, "--config": config}
        refuse(unused | {"--world": world, "--set": settings}, name)
        refuse({"--runs": runs, "--seed": seed or None, "--resume": resume or None}, name)
        refuse({"--workers": workers}, name)
        folder = (out or Path("out") / name).absolute()
        with nothing_left(folder), rate_bar("evaluate", "runs") as progress:
            result = run_single_reports(data, folder, sets=cases or SETS, progress=progress)
        print_result(result, as_json)
        return
    refuse({"--data": data}, name)
    given = list(settings or ())
    if map_file is not None:
        given.append(f"area.map={toml(str(map_file))}")
    if bbox is not None:
        given.append(f"area.bbox={bbox}")
    if filter_name is not None:
        given.append(f"filter.name={toml(filter_name)}")
    if name == "audit":
        refuse({"--world": world}, name)
        world = "easy"
    foreign = other_world(world)
    loaded, fixed = (
        load_foreign(config, given) if foreign else load_benchmark(world or "plain", config, given)
    )
    check_custom_filter(loaded)
    folder = (out or loaded.output.dir / name).absolute()
    common["runs"] = runs or RUNS
    with nothing_left(folder), rate_bar("evaluate", "batches") as progress:
        common["progress"] = progress
        if name == "audit":
            result = run_audit(config, given, folder, names=cases or (), **common)
        elif foreign:
            result = run_foreign(loaded, foreign, folder, cases=cases or (), fixed=fixed, **common)
        else:
            result = run_global_positioning(
                loaded, folder, cases=cases or (), fixed=fixed, **common
            )
    if not as_json:
        result = audit_table(result) if name == "audit" else main_table(result)
    print_result(result, as_json)
