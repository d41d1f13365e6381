"""Which files of a folder are the tables of a log, and which are taken for nothing."""

from __future__ import annotations

from collections.abc import Collection
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from mapfilter._io import sha256_file
from mapfilter.errors import Faults, InputError, StoreError
from mapfilter.tracks.schema import TABLES

HEAD = "log.json"
ALMANAC = "almanac.txt"

_SUFFIXES = (".parquet", ".csv")


def checked_parts(folder: Path, head: dict[str, Any]) -> dict[str, Path]:
    """Return the tables that the head lists, after a look at their sizes and checksums.

    Raises
    ------
    StoreError
        A table is missing, cut off or changed.
    """
    faults = Faults()
    paths = {}
    allowed = {f"{table}{suffix}": table for table in TABLES for suffix in _SUFFIXES}
    listed = head["parts"] if isinstance(head["parts"], list) else [head["parts"]]
    for part in listed:
        if not isinstance(part, dict) or part.get("path") not in allowed:
            faults.add(f"{folder / HEAD}, parts", "tables of a log", repr(part))
            continue
        name = part["path"]
        path = folder / name
        if not path.is_file():
            faults.add(str(path), "a table of the log", "no such file")
        elif path.stat().st_size != part.get("bytes"):
            size, bytes_ = path.stat().st_size, part.get("bytes")
            hint = "cut off" if isinstance(bytes_, int) and size < bytes_ else "changed by hand"
            faults.add(str(path), f"{bytes_} bytes", f"{size} bytes", hint)
        elif sha256_file(path) != part.get("sha256"):
            faults.add(str(path), f"SHA-256 {part.get('sha256')}", "another", "changed or damaged")
        paths[allowed[name]] = path
    faults.raise_if_any(StoreError)
    return paths


def parts_by_name(folder: Path) -> dict[str, Path]:
    """Return the tables of a log made by hand.

    Raises
    ------
    InputError
        A table is there twice, or a file is called almost as a table that is missing.
    """
    faults = Faults()
    paths = {}
    for table in TABLES:
        found = [path for path in table_files(folder) if path.stem == table]
        if len(found) > 1:
            faults.add(str(folder), f"one file of {table}", "both Parquet and CSV")
        elif found:
            paths[table] = found[0]
    absent = [table for table in TABLES if table not in paths]
    for path in _others(folder, paths.values()):
        near = get_close_matches(path.stem.lower(), absent, 1, 0.6)
        if near and not faults.found:
            expected = f"tables called {', '.join(TABLES)} (.csv or .parquet)"
            faults.add(str(path), expected, path.name, f"{near[0]}.csv")
    faults.raise_if_any(InputError)
    return paths


def table_files(folder: Path) -> list[Path]:
    """Return the files of a folder that are called as tables of a log."""
    named = (folder / f"{table}{suffix}" for table in TABLES for suffix in _SUFFIXES)
    return [path for path in named if path.is_file()]


def ignored_files(folder: Path, used: Collection[Path]) -> tuple[str, ...]:
    """Return a note for each file of a log's folder that is not read; hidden ones do not count."""
    return tuple(f"{path}: not a table of a log, not read" for path in _others(folder, used))


def _others(folder: Path, used: Collection[Path]) -> list[Path]:
    known = {HEAD, ALMANAC, *(path.name for path in used)}
    return [
        path
        for path in sorted(folder.iterdir())
        if path.name not in known and not path.name.startswith(".") and path.is_file()
    ]
