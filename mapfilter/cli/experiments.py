"""Commands that measure."""

from __future__ import annotations

from typing import Annotated

import typer

from mapfilter.cli.options import JsonOption
from mapfilter.workflows.terminal import print_result


def bench(
    stage: Annotated[str, typer.Argument(metavar="[NAME]", help="build.")] = "build",
    runs: Annotated[int, typer.Option("--runs", min=1, help="Runs that medians are of.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Tell how fast a stage is on this machine."""
    from mapfilter.workflows.bench import run_bench

    print_result(run_bench(stage, runs=runs), as_json)
