"""Commands that learn from journeys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import (
    ConfigOption,
    DatabaseArgument,
    JsonOption,
    ResumeOption,
    SeedOption,
    SetOption,
    WorkersOption,
    given_path,
    refuse,
    seeded,
    toml,
)
from mapfilter.errors import ConfigError, fail
from mapfilter.workflows.outputs.progress_bars import progress_bar
from mapfilter.workflows.outputs.terminal import print_message, print_result

_ALL = "all"


def learn(
    database: DatabaseArgument,
    logs: Annotated[
        Path | None, typer.Option("--logs", metavar="LOGS", help="A log, or a folder of logs.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DB2", help="The report; with --accept the changed database."
        ),
    ] = None,
    accept: Annotated[
        str | None,
        typer.Option(
            "--accept",
            metavar="PATCH",
            help="Write the database with the accepted changes of a patch; all: with all found.",
        ),
    ] = None,
    truth: Annotated[
        bool, typer.Option("--truth/--no-truth", help="Whether ground truth in logs is used.")
    ] = True,
    config: ConfigOption = None,
    settings: SetOption = None,
    workers: WorkersOption = 1,
    resume: ResumeOption = False,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find what is wrong with a database from journeys, and propose a patch."""
    from mapfilter.config.load import load_config
    from mapfilter.workflows.learn import run_accept, run_learn

    folder = (out or Path("learned")).absolute()
    if logs is None:
        if accept is None or accept == _ALL:
            hint = "journeys to learn from, or a patch to accept"
            raise fail(ConfigError, "learn", "--logs LOGS, or --accept PATCH", "neither", hint)
        of_journeys: dict[str, object]
        of_journeys = {"--config": config, "--set": settings, "--resume": resume or None}
        of_journeys |= {"--workers": workers if workers > 1 else None, "--seed": seed}
        refuse(of_journeys | {"--no-truth": None if truth else "it"}, "--accept PATCH")
        patch = given_path(Path(accept)) or Path(accept)
        with progress_bar("learn") as progress:
            accepted = run_accept(database, patch, folder, progress=progress)
        for note in accepted["notes"]:
            print_message(note)
        print_result(accepted, as_json)
        return
    if accept not in (None, _ALL):
        hint = "call learn once with --logs, then with --accept PATCH"
        raise fail(ConfigError, "--accept", f"{_ALL}, with --logs", repr(accept), hint)
    given = seeded(settings, seed, "journeys.seed")
    given += [f"database.path={toml(str(database))}", f"track.path={toml(str(logs))}"]
    with progress_bar("learn") as progress:
        result = run_learn(
            load_config(config, given),
            folder,
            accept=accept == _ALL,
            use_truth=truth,
            workers=workers,
            resume=resume,
            progress=progress,
        )
    for note in result.notes:
        print_message(note)
    print_result(result, as_json)
