"""The files of a replay and pictures, and how those of an older one make way."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from mapfilter.errors import OutputError, fail

ESTIMATES = ("estimate.parquet", "estimate.gpx", "estimate.geojson")
FIGURES = "figures.json"
SUMMARY = "summary.json"

PICTURES = ("candidates.png", "belief.png", "track.png", "error.png", "evidence.png")

_OF_ONE_LOG = {*ESTIMATES, FIGURES, *PICTURES}


def clear_results(out: Path) -> None:
    """Remove what an older replay wrote into a folder, so that no figures of two replays mix.

    A folder in it is one of that replay's when it is called as the log that its figures are of,
    and holds nothing else. All other files stay.

    Raises
    ------
    OutputError
        A file cannot be removed.
    """
    try:
        for name in (*_OF_ONE_LOG, SUMMARY):
            (out / name).unlink(missing_ok=True)
        for inner in sorted(out.iterdir()):
            if _is_result(inner):
                for file in inner.iterdir():
                    file.unlink()
                inner.rmdir()
    except OSError as error:
        what = error.strerror or error
        raise fail(OutputError, str(error.filename or out), "a place to write", what) from error


def clear_pictures(folder: Path, names: Sequence[str]) -> None:
    """Remove older pictures from a folder, so that none shows what is gone.

    Raises
    ------
    OutputError
        One cannot be removed.
    """
    try:
        for name in names:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        what = error.strerror or error
        where = str(error.filename or folder)
        raise fail(OutputError, where, "a picture that can be removed", what) from error


def _is_result(folder: Path) -> bool:
    figures = folder / FIGURES
    if folder.is_symlink() or not figures.is_file():
        return False
    try:
        of = json.loads(figures.read_text(encoding="utf-8")).get("log")
    except (ValueError, AttributeError, RecursionError):
        return False
    return of == folder.name and {file.name for file in folder.iterdir()} <= _OF_ONE_LOG
