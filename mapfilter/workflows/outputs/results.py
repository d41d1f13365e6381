"""Files that replays and single reports write, by name, and those of older ones in a folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mapfilter._json_files import read_json
from mapfilter.errors import OutputError, StoreError, fail

ESTIMATES = ("estimate.parquet", "estimate.gpx", "estimate.geojson")
FIGURES = "figures.json"
REPLAY_HTML = "replay.html"
SUMMARY = "summary.json"
POSITIONS, PICTURE_OF_REPORTS = "positions.csv", "errors.png"
"""Of single reports."""

PICTURES = ("candidates.png", "belief.png", "track.png", "error.png", "evidence.png")

_OF_ONE_LOG = {*ESTIMATES, FIGURES, REPLAY_HTML, *PICTURES}

_OF_REPLAY, _OF_REPORTS = ("filter", "epochs", "epochs_by_status"), ("database_reports",)
"""Entries that together only the figures of a replay, and only those of single reports have."""


def is_of_replay(figures: Mapping[str, Any]) -> bool:
    """Return whether a replay wrote some figures."""
    return figures.keys() >= set(_OF_REPLAY)


def is_of_reports(figures: Mapping[str, Any]) -> bool:
    """Return whether ``locate`` wrote some figures."""
    return figures.keys() >= set(_OF_REPORTS)


def check_figures_of_replay(out: Path) -> None:
    """Raise OutputError where a folder holds figures that a replay did not write.

    Damaged ones beside its other files are taken for its own.
    """
    _check_figures(out, is_of_replay, "a replay", ESTIMATES)


def check_figures_of_reports(out: Path) -> None:
    """Raise OutputError where a folder holds figures or positions that ``locate`` did not write.

    Damaged figures beside its other files are taken for its own, positions without any are not.
    """
    positions = out / POSITIONS
    if positions.exists() and not (out / FIGURES).exists():
        hint = "a recording, or a table; give another folder by --out"
        expected = "positions of mapfilter locate, or nothing yet"
        raise fail(OutputError, str(positions), expected, f"others, without {FIGURES}", hint)
    _check_figures(out, is_of_reports, "mapfilter locate", (POSITIONS,))


def _check_figures(
    out: Path,
    is_own: Callable[[Mapping[str, Any]], bool],
    whose: str,
    others_of_it: Sequence[str],
) -> None:
    figures = out / FIGURES
    if not figures.is_file():
        return
    try:
        found = read_json(figures)
    except StoreError:
        if any((out / name).is_file() for name in others_of_it):
            return
        found = {}
    if not is_own(found):
        got = "others"
        if is_of_replay(found):
            got = "those of a replay"
        elif is_of_reports(found):
            got = "those of mapfilter locate"
        hint = "results of one command each; give another folder by --out"
        raise fail(OutputError, str(figures), f"figures of {whose}, or nothing yet", got, hint)


def replaced_by_replay(out: Path) -> list[Path]:
    """Return the files that a replay writes into a folder, and those of older ones in it."""
    return [*(out / name for name in _OF_ONE_LOG), *(older_results(out) if out.is_dir() else ())]


def older_reports(out: Path) -> list[Path]:
    """Return the files that an older ``locate`` wrote in a folder."""
    if not (out / FIGURES).is_file():
        return []
    found = (out / name for name in (FIGURES, POSITIONS, PICTURE_OF_REPORTS))
    return [path for path in found if path.is_file()]


def older_results(out: Path) -> list[Path]:
    """Return the files of an older replay in a folder, so that no figures of two replays mix.

    Those of a folder in it are among them where it is named as the log of its figures and holds
    nothing else.
    """
    found = [path for name in (*_OF_ONE_LOG, SUMMARY) if (path := out / name).is_file()]
    for inner in filter(_is_result, sorted(out.iterdir())):
        found += inner.iterdir()
    return found


def _is_result(folder: Path) -> bool:
    figures = folder / FIGURES
    if folder.is_symlink() or not figures.is_file():
        return False
    try:
        of = read_json(figures).get("log")
    except StoreError:
        return False
    return of == folder.name and {file.name for file in folder.iterdir()} <= _OF_ONE_LOG
