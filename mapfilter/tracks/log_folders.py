"""Which folders are track logs, which hold several, and what one lacks that is none."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from mapfilter._words import likely_of_no_file
from mapfilter.errors import Faults, InputError, MapfilterError, fail
from mapfilter.tracks.schema import TABLES

HEAD = "log.json"
SUFFIXES = (".parquet", ".csv")
"""Of the files of tables."""


def is_log(path: str | Path) -> bool:
    """Return whether a path is a folder with a track log."""
    return (Path(path) / HEAD).is_file()


def has_tables(folder: Path) -> bool:
    """Return whether a folder has a file with the name of a table of a log."""
    return bool(_table_files(folder))


def _table_files(folder: Path) -> list[Path]:
    """Return the files of a folder that have the name of a table of a log."""
    return [path for path in table_places(folder) if path.is_file()]


def table_places(folder: Path) -> Iterator[Path]:
    """Yield where tables of a log may lie in a folder."""
    yield from (folder / f"{table}{suffix}" for table in TABLES for suffix in SUFFIXES)


def files_in(folder: Path) -> list[Path]:
    """Return the files of a folder that are not hidden, by name."""
    return [p for p in sorted(folder.iterdir()) if p.is_file() and not p.name.startswith(".")]


def list_logs(path: str | Path) -> list[Path]:
    """Return the log that ``path`` is, or the logs in it, by name; InputError without any."""
    path = Path(path)
    if is_log(path):
        return [path]
    inner = sorted(path.iterdir()) if path.is_dir() else []
    faults = Faults()
    for folder in inner:
        if _table_files(folder) and not is_log(folder):
            faults.found.extend(no_log(folder, "a track log").faults)
    faults.raise_if_any(InputError)
    found = [folder for folder in inner if is_log(folder)]
    if not found:
        raise no_log(path, "a track log, or a folder of logs")
    return found


def no_log(path: Path, expected: str) -> MapfilterError:
    """Return the error for a path that is no log, and what it lacks."""
    tables = _table_files(path)
    if tables:
        got = f"{tables[0].name} without a {HEAD} beside it"
        expected = f'{HEAD} with the CRS, such as {{"crs": "EPSG:32635"}}'
        hint = "left out when the log was made by hand, or recordings: name the files with --log"
        return fail(InputError, str(path), expected, got, hint)
    if path.is_file():
        hint = "name the folder that it lies in"
        if path.stem not in TABLES and path.name != HEAD:
            hint = f"convert it first: mapfilter convert {path.name} --out LOG"
        return fail(InputError, str(path), expected, "a file", hint)
    if path.is_dir():
        hint = (
            "a radio-route database, which --db names"
            if (path / "points.parquet").is_file()
            else ""
        )
        if inner := sorted(path.glob(f"*/*/{HEAD}"))[:1]:
            hint = f"the logs are in {inner[0].parent.parent}"
        return fail(InputError, str(path), expected, "a folder without any", hint)
    return fail(InputError, str(path), expected, "nothing", likely_of_no_file(path))
