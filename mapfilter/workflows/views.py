"""Views: replays and databases as HTML files that open in a browser, without a server."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from mapfilter._inputs import shown
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import Faults, InputError
from mapfilter.viewing.bundle import database_bundle
from mapfilter.viewing.merge import side_by_side
from mapfilter.viewing.page import read_page, write_page
from mapfilter.workflows.pictures import REPLAY_HTML

VIEW_HTML = "view.html"

_MANIFEST = "manifest.json"
_SHOWN = {
    "switched": "converged",
    "switch_time_s": "converged after, s",
    "switch_distance_m": "converged after, m",
    "error_at_switch_m": "error then, m",
    "error_mean_m": "mean error, m",
    "error_67_m": "error at 67 %, m",
    "error_95_m": "error at 95 %, m",
    "final_status": "status at the end",
}
"""Figures of a run that a page shows, and their names there."""


def run_view(paths: Sequence[Path], out: Path | None = None) -> dict[str, Any]:
    """Show results of replays side by side, or a database.

    Parameters
    ----------
    paths : sequence of Path
        Results of ``replay --html`` (folders, or the HTML files in them), all over one database;
        or one database.
    out : Path, optional
        The HTML file; ``view.html`` in the working folder when left out.

    Returns
    -------
    dict
        The file, its size in MB, and what it shows.

    Raises
    ------
    MapfilterError
        A result has no view, or is of another database; or the file cannot be written.
    """
    file = (out or Path(VIEW_HTML)).absolute()
    if len(paths) == 1 and (paths[0] / _MANIFEST).is_file():
        database = open_database(paths[0])
        bundle = database_view(database)
    else:
        pages = pages_of(paths)
        bundle = side_by_side([(shown(str(page)), read_page(page)) for page in pages])
    write_page(bundle, file)
    return view_figures(bundle, file)


def database_view(database: RadioRouteDatabase) -> dict[str, Any]:
    """Return the bundle of a database."""
    return database_bundle(f"Database {database.path.name}", database)


def run_figures(figures: Mapping[str, Any]) -> dict[str, str]:
    """Return the figures of a run as a page shows them."""
    found: dict[str, str] = {}
    for name, label in _SHOWN.items():
        value = figures.get(name)
        if isinstance(value, bool):
            found[label] = "yes" if value else "no"
        elif isinstance(value, float):
            if isfinite(value):
                found[label] = f"{value:.1f}"
        elif value is not None:
            found[label] = str(value)
    return found


def view_figures(bundle: Mapping[str, Any], file: Path) -> dict[str, Any]:
    """Return what a page shows, for the terminal."""
    return {
        "html": file,
        "megabytes": round(file.stat().st_size / 1e6, 2),
        "runs": [run["name"] for run in bundle["runs"]],
        "cells": len(bundle["cells"]),
        "open": file.as_uri(),
    }


def pages_of(paths: Sequence[Path]) -> list[Path]:
    """Return the pages of results: files, those of folders, or of the folders in them.

    Raises
    ------
    InputError
        A result has none.
    """
    found: list[Path] = []
    faults = Faults()
    for path in paths:
        pages = [path] if path.is_file() else sorted(path.glob(REPLAY_HTML))
        pages = pages or sorted(path.glob(f"*/{REPLAY_HTML}"))
        if not pages:
            expected = f"a result with {REPLAY_HTML}, or a database"
            what = "a folder without any" if path.is_dir() else "nothing there"
            hint = "run mapfilter replay with --html"
            faults.add(shown(str(path)), expected, what, hint)
        found += pages
    faults.raise_if_any(InputError)
    return found
