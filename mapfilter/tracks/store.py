"""Track logs on disk: a folder with ``log.json`` and up to four tables, Parquet or CSV.

``log.json`` holds the format, its version, the CRS, the start and the checksums of the tables. A
folder made by hand needs only ``{"crs": "EPSG:…"}`` in it; a table that is absent is empty.
"""

from __future__ import annotations

import warnings
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
from mapfilter.errors import Faults, InputError, StoreError, fail
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.schema import SCHEMA, TABLES

FORMAT = "mapfilter track log"
VERSION = 1

_HEAD = "log.json"
_KEYS = ("format", "version", "crs", "start_utc_s", "notes", "parts")
_ARROW = {"number": pa.float64(), "integer": pa.int64(), "text": pa.string()}


def write_log(log: TrackLog, folder: Path, format: Literal["parquet", "csv"] = "parquet") -> None:  # noqa: A002
    """Write a log as a folder, in one step; equal logs give equal bytes.

    Parameters
    ----------
    log : TrackLog
    folder : Path
        Replaced when it is there; must be absent, empty or a log that mapfilter wrote.
    format : {"parquet", "csv"}
        Of the tables.

    Raises
    ------
    OutputError
        The folder cannot be written, or holds files that no log of mapfilter lists.
    """
    check_log_replaceable(folder)
    with atomic_dir(folder) as new:
        parts = []
        for table in TABLES:
            rows = getattr(log, table)
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
        write_json(new / _HEAD, head)


def read_log(folder: Path) -> TrackLog:
    """Read a log that :func:`write_log` or a person made.

    Raises
    ------
    InputError
        There is no log, or its tables do not make sense; with every fault.
    StoreError
        A file is missing, cut off or changed since it was written, or of a newer version.
    """
    if not is_log(folder):
        got = "a folder without it" if folder.is_dir() else "no such folder"
        raise fail(InputError, str(folder), f"a track log (a folder with {_HEAD})", got)
    where = str(folder / _HEAD)
    head = read_json(folder / _HEAD)
    _check_head(head, where)
    paths = _checked_parts(folder, head) if "parts" in head else _parts_by_name(folder)
    tables = {table: _read_table(path) for table, path in paths.items()}
    names = {table: str(path) for table, path in paths.items()}
    return make_log(
        head.get("crs"),
        **tables,
        start_utc_s=_start_utc_s(head),
        notes=head.get("notes", ()),
        names=names,
    )


def is_log(path: Path) -> bool:
    """Tell whether a path is a folder that holds a track log."""
    return (path / _HEAD).is_file()


def check_log_replaceable(folder: Path) -> None:
    """See that replacing a folder loses nothing but a log that mapfilter wrote.

    Raises
    ------
    OutputError
        It holds other files, a log made by hand among them.
    """
    check_replaceable(folder, _HEAD, FORMAT)


def list_logs(path: Path) -> list[Path]:
    """Return the log that ``path`` is, or the logs that lie in it, by name.

    Raises
    ------
    InputError
        There is none.
    """
    if is_log(path):
        return [path]
    found = sorted(p for p in path.iterdir() if is_log(p)) if path.is_dir() else []
    if not found:
        got = "a folder without any" if path.is_dir() else "no such folder"
        raise fail(InputError, str(path), "a track log, or a folder of logs", got)
    return found


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


def _checked_parts(folder: Path, head: dict[str, Any]) -> dict[str, Path]:
    """Return the tables that the head lists, after a look at their sizes and checksums."""
    faults = Faults()
    paths = {}
    allowed = {f"{table}.{suffix}": table for table in TABLES for suffix in ("parquet", "csv")}
    listed = head["parts"] if isinstance(head["parts"], list) else [head["parts"]]
    for part in listed:
        if not isinstance(part, dict) or part.get("path") not in allowed:
            faults.add(f"{folder / _HEAD}, parts", "tables of a log", repr(part))
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


def _parts_by_name(folder: Path) -> dict[str, Path]:
    faults = Faults()
    paths = {}
    for table in TABLES:
        found = [folder / f"{table}.{suffix}" for suffix in ("parquet", "csv")]
        found = [path for path in found if path.is_file()]
        if len(found) > 1:
            faults.add(str(folder), f"one file of {table}", "both Parquet and CSV")
        elif found:
            paths[table] = found[0]
    faults.raise_if_any(InputError)
    return paths


def _read_table(path: Path) -> pd.DataFrame:
    try:
        if path.suffix == ".csv":
            return _read_csv(path)
        table = pq.read_table(path)
        return table.to_pandas(types_mapper={pa.int64(): pd.Int64Dtype()}.get)
    except pd.errors.EmptyDataError as error:
        raise fail(InputError, str(path), "a header line", "an empty file", "cut off") from error
    except (
        pa.ArrowException,
        pd.errors.ParserError,
        pd.errors.ParserWarning,
        UnicodeDecodeError,
        OSError,
    ) as error:
        got = str(error).splitlines()[0]
        raise fail(InputError, str(path), "a readable table", got, "cut off") from error


def _read_csv(path: Path) -> pd.DataFrame:
    with warnings.catch_warnings():
        # pandas only warns when rows have more fields than the header, and drops the rest.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        return pd.read_csv(
            path, dtype=str, keep_default_na=False, index_col=False, encoding="utf-8-sig"
        )
