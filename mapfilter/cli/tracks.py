"""Commands on journeys: the whole chain, simulated logs, located logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import (
    PARTIAL,
    ConfigOption,
    JsonOption,
    OutOption,
    SeedOption,
    SetOption,
    find_own_filter,
    seeded,
    toml,
)
from mapfilter.errors import ConfigError, fail
from mapfilter.workflows.terminal import print_result, progress_bar, say


def demo(
    out: OutOption = None,
    seed: SeedOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the whole chain on the embedded map of central Helsinki."""
    from mapfilter.workflows.demo import run_demo

    with progress_bar("demo") as progress:
        result = run_demo(
            (out or Path("mapfilter-demo")).absolute(), settings or (), seed=seed, progress=progress
        )
    print_result(result, as_json)


def simulate(
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate journeys along the streets, with ground truth."""
    from mapfilter.config.load import load_config
    from mapfilter.workflows.simulate import run_simulate

    settings = seeded(settings, seed, "journeys.seed")
    with progress_bar("simulate") as progress:
        result = run_simulate(load_config(config, settings, out=out), progress)
    print_result(result, as_json)


def replay(
    database: Annotated[Path | None, typer.Option("--db", metavar="DB", help="Database.")] = None,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="LOG", help="A log, or a folder of logs.")
    ] = None,
    filter_name: Annotated[
        str | None,
        typer.Option(
            "--filter",
            metavar="NAME",
            help="candidate, bayes, grid or a custom filter, package.module:Name; "
            "without a map ekf, iekf, rbukf, ukf, ckf.",
        ),
    ] = None,
    without: Annotated[
        str | None,
        typer.Option(
            "--without",
            metavar="KINDS",
            help="What to leave out: gnss (fixes, pseudoranges), ta, tdoa, neighbours, radio.",
        ),
    ] = None,
    smooth: Annotated[
        bool,
        typer.Option(
            "--smooth", help="Smooth the track by the whole log (forward filtering, backward pass)."
        ),
    ] = False,
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Locate one log, or every log of a folder; exit code 3 if done in part."""
    from mapfilter.config.load import load_config
    from mapfilter.workflows.replay import replay_facts, run_replay

    given = seeded(settings, seed, "journeys.seed")
    for key, value in (("database.path", database), ("track.path", log)):
        if value is not None:
            given.append(f"{key}={toml(str(value))}")
    if filter_name is not None:
        given.append(f"filter.name={toml(filter_name)}")
    if without is not None:
        given.append(f"track.without={toml([kind.strip() for kind in without.split(',')])}")
    if smooth:
        given += ["filter.bayes.smooth=true", "filter.smooth=true"]
    loaded = load_config(config, given)
    find_own_filter(loaded)
    name = loaded.filter.name
    if smooth and (name in ("candidate", "grid") or ":" in name):
        raise fail(ConfigError, "--smooth", "bayes, ekf, iekf, rbukf, ukf, ckf", name)
    folder = (out or loaded.output.dir / "replay").absolute()
    with progress_bar("replay") as progress:
        result = run_replay(loaded, folder, progress=progress)
    print_result(replay_facts(result), as_json)
    for warning in result.warnings:
        say(warning)
    if result.partial:
        raise typer.Exit(PARTIAL)
