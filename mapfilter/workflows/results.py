"""Files that a replay writes, by name; those of an older one in a folder."""

from __future__ import annotations

from pathlib import Path

from mapfilter._io import read_json
from mapfilter.errors import StoreError

ESTIMATES = ("estimate.parquet", "estimate.gpx", "estimate.geojson")
FIGURES = "figures.json"
REPLAY_HTML = "replay.html"
SUMMARY = "summary.json"

PICTURES = ("candidates.png", "belief.png", "track.png", "error.png", "evidence.png")

_OF_ONE_LOG = {*ESTIMATES, FIGURES, REPLAY_HTML, *PICTURES}


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
