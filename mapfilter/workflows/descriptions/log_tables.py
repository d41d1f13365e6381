"""What ``mapfilter info`` tells of a folder with tables of a log, but without ``log.json``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mapfilter._words import number_of
from mapfilter.errors import MapfilterError
from mapfilter.radio.tables import read_table
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.sensors import MOTION_TABLES

_SUFFIXES = (".csv", ".parquet")
_PLACED = {"positions", "places", "gnss", "pseudoranges"}
_TRUTH = "truth"


def tables_info(folder: Path) -> dict[str, Any] | None:
    """Describe the tables of a folder that has some of a log's names; None where it has none.

    Each is described by its rows, or by its columns where it is no recording, and what is lacking
    so that the folder is a log, or its tables one journey to be located.
    """
    files = sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    named = [p for p in files if p.stem in TABLES and p.suffix in _SUFFIXES]
    if not named:
        return None
    told, held, recordings = {}, set[str](), list[Path]()
    for file in files:
        tables, told[file.name] = _described(file)
        if tables:
            recordings.append(file)
            held |= tables if file.stem != _TRUTH else set()
    lacking = [f"log.json with the CRS, beside {named[0].name}, for a track log"]
    if not held & MOTION_TABLES:
        lacking.append("motion: steps, speeds or an odometer")
    if "radio" not in held and not held & _PLACED:
        lacking.append("cells with levels, or positions")
    found: dict[str, Any] = {"kind": "tables", "tables": told, "lacking": lacking}
    if recordings:
        options = (f"--{'truth' if one.stem == _TRUTH else 'log'} {one.name}" for one in recordings)
        found["use"] = f"mapfilter replay --db DB {' '.join(options)}"
    return found


def _described(file: Path) -> tuple[set[str], str]:
    """Return the tables of a recording, or none, and what the file holds in words."""
    try:
        if format_of(file) is not None:
            tables = read_recording(file).tables
            rows = (f"{name}: {number_of(len(t), 'row')}" for name, t in tables.items())
            return set(tables), ", ".join(rows)
        if file.suffix in (".csv", ".txt"):
            table = read_table(file, "a table")
            columns = ", ".join(name.strip() for name in table.header)
            return set(), f"{number_of(len(table.rows), 'row')} of {columns}"
    except MapfilterError as error:
        return set(), f"not read: {error.faults[0]}"
    return set(), "of another kind"
