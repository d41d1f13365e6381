"""The command that runs accuracy benchmarks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import (
    ConfigOption,
    JsonOption,
    OutOption,
    ResumeOption,
    SetOption,
    find_own_filter,
    given_path,
    refuse,
    toml,
)
from mapfilter.workflows.terminal import print_result, rate_bar


def evaluate(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="global-positioning, audit or ottawa.")
    ],
    map_file: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="An OpenStreetMap file.", callback=given_path),
    ] = None,
    bbox: Annotated[
        str | None, typer.Option("--bbox", metavar="W,S,E,N", help="The box, in degrees.")
    ] = None,
    cases: Annotated[
        list[str] | None,
        typer.Option(
            "--case", metavar="NAME", help="A case; repeatable. Default: all without satellites."
        ),
    ] = None,
    filter_name: Annotated[
        str | None,
        typer.Option(
            "--filter",
            metavar="NAME",
            help="bayes (default), grid, candidate or package.module:Name.",
        ),
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            "--world",
            metavar="NAME",
            help="The simulated world: plain (default), or easy, which flatters.",
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data",
            metavar="DIR",
            help="Folder of the data sets, for ottawa.",
            callback=given_path,
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
    workers: Annotated[int, typer.Option("--workers", min=1, help="Local processes.")] = 2,
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
        load_benchmark,
        run_global_positioning,
    )

    check_benchmark(name, data)
    if name == "ottawa" and data is not None:
        other = None if filter_name == "bayes" else filter_name
        unheeded = {"--map": map_file, "--bbox": bbox, "--case": cases, "--filter": other}
        unheeded |= {"--world": world}
        refuse(unheeded | {"--config": config, "--set": settings}, name)
        _ottawa(data, out, runs, seed, workers, resume, as_json)
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
        _audit(config, given, out, runs or RUNS, seed, cases or (), workers, resume, as_json)
        return
    loaded, fixed = load_benchmark(world or "plain", config, given)
    find_own_filter(loaded)
    folder = (out or loaded.output.dir / name).absolute()
    with rate_bar("evaluate", "batches") as progress:
        result = run_global_positioning(
            loaded,
            folder,
            runs=runs or RUNS,
            seed=seed,
            cases=cases or (),
            workers=workers,
            resume=resume,
            progress=progress,
            fixed=fixed,
        )
    print_result(result, as_json)


def _audit(
    config: Path | None,
    settings: list[str],
    out: Path | None,
    runs: int,
    seed: int,
    cases: Sequence[str],
    workers: int,
    resume: bool,
    as_json: bool,
) -> None:
    from mapfilter.workflows.evaluate import load_benchmark
    from mapfilter.workflows.evaluate_audit import run_audit

    loaded, _ = load_benchmark("easy", config, settings)
    find_own_filter(loaded)
    with rate_bar("evaluate", "batches") as progress:
        result = run_audit(
            config,
            settings,
            (out or loaded.output.dir / "audit").absolute(),
            runs=runs,
            seed=seed,
            names=cases,
            workers=workers,
            resume=resume,
            progress=progress,
        )
    print_result(result, as_json)


def _ottawa(
    data: Path,
    out: Path | None,
    runs: int | None,
    seed: int,
    workers: int,
    resume: bool,
    as_json: bool,
) -> None:
    from mapfilter.workflows.evaluate_ottawa import RUNS, run_ottawa

    folder = (out or Path("out") / "ottawa").absolute()
    with rate_bar("evaluate", "sessions") as progress:
        result = run_ottawa(
            data,
            folder,
            runs=runs or RUNS,
            seed=seed,
            workers=workers,
            resume=resume,
            progress=progress,
        )
    print_result(result, as_json)
