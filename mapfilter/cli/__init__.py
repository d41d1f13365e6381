"""The command line: parses, calls one workflow, prints. Logs and progress go to stderr."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from mapfilter._io import VERSION
from mapfilter.cli.databases import bound, build, check, export, info, merge, predict
from mapfilter.cli.evaluate import evaluate
from mapfilter.cli.experiments import bench, reproduce, sweep
from mapfilter.cli.options import DONE
from mapfilter.cli.tracks import demo, replay, simulate
from mapfilter.workflows.terminal import guarded

__all__ = ["app", "main"]

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Find where a phone or a vehicle is without GNSS.",
)

for _command in (
    demo,
    check,
    predict,
    build,
    merge,
    export,
    info,
    bound,
    simulate,
    replay,
    sweep,
    reproduce,
    evaluate,
    bench,
):
    app.command()(_command)


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        sys.stdout.write(f"mapfilter {VERSION}\n")
        raise typer.Exit(DONE)


def main() -> None:
    """Run the command line; a user's error is one clear message and exit code 2."""
    sys.exit(guarded(app))
