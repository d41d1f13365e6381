"""Commands that show results in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapfilter.cli.options import JsonOption, given_path
from mapfilter.workflows.outputs.progress_bars import progress_bar
from mapfilter.workflows.outputs.terminal import print_result


def _given_paths(paths: list[Path]) -> list[Path]:
    """Refuse what cannot be a path."""
    for path in paths:
        given_path(path)
    return paths


def view(
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT...",
            help="Results of replay --html (folders or pages), side by side; or one database. "
            "A result of bound beside them adds its layers.",
            callback=_given_paths,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The page (view.html).", callback=given_path),
    ] = None,
    street_map: Annotated[
        str | None,
        typer.Option(
            "--map",
            metavar="FILE",
            help="OpenStreetMap file, or embedded map (helsinki), whose buildings are drawn.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show replays side by side, or a database, as one HTML page."""
    from mapfilter.workflows.views import run_view

    print_result(run_view(results, out, street_map), as_json)


def film(
    result: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT", help="Result of replay --html, or a page.", callback=given_path
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="FILE",
            help="The film: .gif, or .mp4 where ffmpeg is found.",
            callback=given_path,
        ),
    ] = Path("replay.gif"),
    run: Annotated[int, typer.Option("--run", min=0, help="Of several runs, from 0.")] = 0,
    pictures: Annotated[
        int, typer.Option("--pictures", min=1, help="How many, evenly chosen; at most 240.")
    ] = 150,
    as_json: JsonOption = False,
) -> None:
    """Draw a replay as a film, GIF or MP4."""
    from mapfilter.workflows.film import run_film

    with progress_bar("film") as progress:
        found = run_film(result, out.absolute(), run=run, pictures=pictures, progress=progress)
    print_result(found, as_json)
