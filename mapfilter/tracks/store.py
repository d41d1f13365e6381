"""Track logs on disk: a folder with ``log.json`` and up to six tables, Parquet or CSV.

``log.json`` holds the format, its version, the CRS, the start and the checksums of the tables. A
folder made by hand needs only ``{"crs": "EPSG:…"}`` in it; a table that is absent is empty. An
almanac beside it (``almanac.txt``, YUMA) tells where satellites were whose rows do not.
"""

from __future__ import annotations

from math import inf, isnan, nan
from pathlib import Path
from typing import Any, Literal

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._io import (
    atomic_dir,
    check_replaceable,
    check_version,
    read_json,
    sha256_file,
    write_json,
)
from mapfilter.errors import Faults, InputError, MapfilterError, StoreError, fail
from mapfilter.gnss.almanac import read_yuma
from mapfilter.tracks._folder import (
    ALMANAC,
    HEAD,
    checked_parts,
    ignored_files,
    parts_by_name,
    table_files,
)
from mapfilter.tracks._tables import read_table
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.schema import OPTIONAL, SCHEMA, TABLES

FORMAT = "mapfilter track log"
VERSION = 1

_KEYS = ("format", "version", "crs", "start_utc_s", "notes", "parts")
_ARROW = {"number": pa.float64(), "integer": pa.int64(), "text": pa.string()}


def write_log(
    log: TrackLog,
    folder: str | Path,
    format: Literal["parquet", "csv"] = "parquet",  # noqa: A002
) -> None:
    """Write a log as a folder, in one step; equal logs give equal bytes.

    Parameters
    ----------
    log : TrackLog
    folder : str or Path
        Replaced when it is there; must be absent, empty or a log that mapfilter wrote.
    format : {"parquet", "csv"}
        Of the tables.

    Raises
    ------
    OutputError
        The folder cannot be written, or holds files that no log of mapfilter lists.
    """
    folder = Path(folder)
    check_log_replaceable(folder)
    with atomic_dir(folder) as new:
        parts = []
        for table in TABLES:
            rows = getattr(log, table)
            if table in OPTIONAL and rows.empty:
                continue
            path = new / f"{table}.{format}"
            if format == "csv":
                rows.to_csv(path, index=False, lineterminator="\n")
            else:
                pq.write_table(_arrow(table, rows), path, compression="zstd")
            parts.append(
                {
                    "path": path.name,
                    "sha256": sha256_file(path),
                    "bytes": path.stat().st_size,
                    "rows": len(rows),
                }
            )
        head: dict[str, Any] = {
            "format": FORMAT,
            "version": VERSION,
            "crs": log.crs,
            "start_utc_s": None if isnan(log.start_utc_s) else log.start_utc_s,
            "notes": list(log.notes),
            "parts": parts,
        }
        write_json(new / HEAD, head)


def read_log(folder: str | Path) -> TrackLog:
    """Read a log that :func:`write_log` or a person made.

    Raises
    ------
    InputError
        There is no log, or its tables do not make sense; with every fault.
    StoreError
        A file is missing, cut off or changed since it was written, or of a newer version.
    """
    folder = Path(folder)
    if not is_log(folder):
        raise _no_log(folder, f"a track log (a folder with {HEAD})")
    where = str(folder / HEAD)
    head = read_json(folder / HEAD)
    _check_head(head, where)
    paths = checked_parts(folder, head) if "parts" in head else parts_by_name(folder)
    tables = {table: read_table(table, path) for table, path in paths.items()}
    notes = [note for read in tables.values() for note in read.notes]
    beside = folder / ALMANAC
    return make_log(
        head.get("crs"),
        **{table: read.rows for table, read in tables.items()},
        almanac=read_yuma(beside) if beside.is_file() else None,
        start_utc_s=_start_utc_s(head),
        notes=(*head.get("notes", ()), *ignored_files(folder, paths.values()), *notes),
        names={"log": where} | {table: str(path) for table, path in paths.items()},
        row_numbers={table: read.row_numbers for table, read in tables.items()},
    )


def is_log(path: str | Path) -> bool:
    """Tell whether a path is a folder that holds a track log."""
    return (Path(path) / HEAD).is_file()


def check_log_replaceable(folder: Path) -> None:
    """See that replacing a folder loses nothing but a log that mapfilter wrote.

    Raises
    ------
    OutputError
        It holds other files, a log made by hand among them.
    """
    check_replaceable(folder, HEAD, FORMAT)


def list_logs(path: str | Path) -> list[Path]:
    """Return the log that ``path`` is, or the logs that lie in it, by name.

    Raises
    ------
    InputError
        There is none, or a folder in it holds tables without a head.
    """
    path = Path(path)
    if is_log(path):
        return [path]
    inner = sorted(path.iterdir()) if path.is_dir() else []
    faults = Faults()
    for folder in inner:
        if table_files(folder) and not is_log(folder):
            faults.found.extend(_no_log(folder, "a track log").faults)
    faults.raise_if_any(InputError)
    found = [folder for folder in inner if is_log(folder)]
    if not found:
        raise _no_log(path, "a track log, or a folder of logs")
    return found


def _no_log(path: Path, expected: str) -> MapfilterError:
    """Return the error for what is no log, with what would make it one."""
    tables = table_files(path)
    if tables:
        got = f"{tables[0].name} without a {HEAD} beside it"
        expected = f'{HEAD} with the CRS, such as {{"crs": "EPSG:32635"}}'
        return fail(InputError, str(path), expected, got, "left out when the log was made by hand")
    if path.is_file():
        return fail(InputError, str(path), expected, "a file", "name the folder that it lies in")
    got = "a folder without any" if path.is_dir() else "no such folder"
    return fail(InputError, str(path), expected, got)


def _arrow(table: str, rows: pd.DataFrame) -> pa.Table:
    schema = pa.schema([(column.name, _ARROW[column.kind]) for column in SCHEMA[table]])
    return pa.Table.from_pandas(rows, schema, preserve_index=False).replace_schema_metadata(None)


def _check_head(head: dict[str, Any], where: str) -> None:
    if head.get("format", FORMAT) != FORMAT:
        raise fail(StoreError, f"{where}, format", FORMAT, head["format"])
    check_version(f"{where}, version", head.get("version", VERSION), VERSION)
    faults = Faults()
    for key in head:
        if key not in _KEYS:
            faults.add(f"{where}, {key}", f"one of {', '.join(_KEYS)}", "an unknown key")
    start = head.get("start_utc_s")
    if start is not None and (isinstance(start, bool) or not isinstance(start, int | float)):
        faults.add(f"{where}, start_utc_s", "UTC seconds, or null", repr(start))
    notes = head.get("notes", [])
    if not (isinstance(notes, list) and all(isinstance(note, str) for note in notes)):
        faults.add(f"{where}, notes", "a list of texts", repr(notes))
    faults.raise_if_any(InputError)


def _start_utc_s(head: dict[str, Any]) -> float:
    start = head.get("start_utc_s")
    try:
        return nan if start is None else float(start)
    except OverflowError:
        return inf
