"""Track logs on disk: a folder with ``log.json`` and tables, Parquet or CSV.

``log.json`` holds the format, its version, the CRS, the start and the checksums of the tables. A
folder made by hand needs only ``{"crs": "EPSG:…"}`` in it; a table that is absent is empty. An
almanac beside it (``almanac.txt``, YUMA) gives the places of satellites whose rows have none.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict
from difflib import get_close_matches
from math import inf, isnan, nan
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._arguments import PATH, Argument, Entries, Setting, check_arguments
from mapfilter._inputs import shown
from mapfilter._io import atomic_dir, sha256_file
from mapfilter._json_files import (
    check_part,
    check_replaceable,
    check_version,
    read_json,
    write_json,
)
from mapfilter.errors import Faults, InputError, StoreError, fail
from mapfilter.gnss.almanacs import read_yuma
from mapfilter.tracks.imu_noise import parse_imu_noise
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.log_folders import HEAD, SUFFIXES, is_log, no_log, table_places
from mapfilter.tracks.schema import OPTIONAL, SCHEMA, TABLES
from mapfilter.tracks.sensors import (
    FOLDER,
    SENSOR_COLUMNS,
    Form,
    check_sensors,
    write_sensors,
)
from mapfilter.tracks.table_files import read_table

ALMANAC = "almanac.txt"

FORMAT = "mapfilter track log"
VERSION = 1
_KEYS = ("format", "version", "crs", "start_utc_s", "notes", "imu", "vehicle", "parts")
_WRITTEN = {
    f"{name}{suffix}"
    for name in (*TABLES, *(f"{FOLDER}/{sensor}" for sensor in SENSOR_COLUMNS))
    for suffix in SUFFIXES
}
_ARROW = {"number": pa.float64(), "integer": pa.int64(), "text": pa.string()}


def _checked_parts(folder: Path, head: dict[str, Any]) -> dict[str, Path]:
    """Return the tables that the head lists, unless one is missing, cut off or changed."""
    faults = Faults()
    paths = {}
    allowed = {f"{table}{suffix}": table for table in TABLES for suffix in SUFFIXES}
    listed = head["parts"] if isinstance(head["parts"], list) else [head["parts"]]
    for part in listed:
        if isinstance(part, dict) and str(part.get("path")).startswith(f"{FOLDER}/"):
            continue
        if not isinstance(part, dict) or str(part.get("path")) not in allowed:
            faults.add(f"{folder / HEAD}, parts", "tables of a log", shown(part))
            continue
        paths[allowed[str(part["path"])]] = path = folder / str(part["path"])
        check_part(path, part, faults)
    faults.raise_if_any(StoreError)
    return paths


def _parts_by_name(folder: Path) -> dict[str, Path]:
    """Return the tables of a log made by hand; InputError for tables present twice or misspelt."""
    faults = Faults()
    paths = {}
    # What cannot be read is named by its reader: a link to nothing, a pipe, a folder.
    there = [path for path in table_places(folder) if path.exists() or path.is_symlink()]
    for table in TABLES:
        found = [path for path in there if path.stem == table]
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


def _others(folder: Path, used: Collection[Path]) -> list[Path]:
    """Return the files of a log's folder that are not read, but for hidden ones."""
    known = {HEAD, ALMANAC, *(path.name for path in used)}
    return [
        path
        for path in sorted(folder.iterdir())
        if path.name not in known and not path.name.startswith(".") and path.is_file()
    ]


def write_log(
    log: TrackLog,
    folder: str | Path,
    format: Form = "parquet",  # noqa: A002
    sensors: Mapping[str, pd.DataFrame] | None = None,
) -> None:
    """Write a log as a folder, in one step; equal logs give equal bytes.

    Parameters
    ----------
    folder : str or Path
        Replaced when it is there; must be absent, empty or a log that mapfilter wrote.
    format : {"parquet", "csv"}
        Of the tables.
    sensors : mapping of str to pandas.DataFrame, optional
        Tables of raw sensors, see :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.

    Raises
    ------
    OutputError
        The folder cannot be written, or holds files that no log of mapfilter lists.
    ConfigError
        There is no log, or no path, or another argument is of another type.
    InputError
        A table of ``sensors`` is none of a log, or lacks a column.
    """
    check_arguments(
        "write_log",
        Argument("log", log, TrackLog, "a log of read_log or make_log"),
        Argument("folder", folder, PATH, "the path of a folder"),
        keywords=[
            Setting("format", format, Form),
            Entries("sensors", sensors, pd.DataFrame, "a table", "the table of each sensor"),
        ],
    )
    check_sensors(sensors or {})
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
                columns = [column for column in SCHEMA[table] if column.name in rows]
                schema = pa.schema([(column.name, _ARROW[column.kind]) for column in columns])
                plain = pa.Table.from_pandas(rows, schema, preserve_index=False)
                pq.write_table(plain.replace_schema_metadata(None), path, compression="zstd")
            part = {"path": path.name, "sha256": sha256_file(path)}
            parts.append(part | {"bytes": path.stat().st_size, "rows": len(rows)})
        parts += write_sensors(new, sensors or {}, format)
        head: dict[str, Any] = {
            "format": FORMAT,
            "version": VERSION,
            "crs": log.crs,
            "start_utc_s": None if isnan(log.start_utc_s) else log.start_utc_s,
            "notes": list(log.notes),
        }
        if log.imu is not None:
            head["imu"] = asdict(log.imu)
        if log.vehicle is not None:
            head["vehicle"] = log.vehicle
        head["parts"] = parts
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
        raise no_log(folder, f"a track log (a folder with {HEAD})")
    where = str(folder / HEAD)
    head = read_json(folder / HEAD)
    start_utc_s = _check_head(head, where)
    paths = _checked_parts(folder, head) if "parts" in head else _parts_by_name(folder)
    tables = {table: read_table(table, path) for table, path in paths.items()}
    notes = [note for read in tables.values() for note in read.notes]
    others = _others(folder, paths.values())
    ignored = (f"{path}: not a table of a log, not read" for path in others)
    beside = folder / ALMANAC
    return make_log(
        head.get("crs"),
        **{table: read.rows for table, read in tables.items()},
        almanac=read_yuma(beside) if beside.exists() or beside.is_symlink() else None,
        start_utc_s=start_utc_s,
        notes=(*head.get("notes", ()), *ignored, *notes),
        imu=parse_imu_noise(head.get("imu"), f"{where}, imu"),
        vehicle=head.get("vehicle"),
        names={"log": where} | {table: str(path) for table, path in paths.items()},
        row_numbers={table: read.row_numbers for table, read in tables.items()},
    )


def check_log_replaceable(folder: Path) -> None:
    """Raise OutputError where a folder holds other files than a log that mapfilter wrote."""
    check_replaceable(folder, HEAD, FORMAT, _WRITTEN.__contains__)


def _check_head(head: dict[str, Any], where: str) -> float:
    """Check all but the tables of a head, and return its start."""
    if head.get("format", FORMAT) != FORMAT:
        raise fail(StoreError, f"{where}, format", FORMAT, head["format"])
    check_version(f"{where}, version", head.get("version", VERSION), VERSION)
    faults = Faults()
    for key in head:
        if key not in _KEYS:
            faults.add(f"{where}, {key}", f"one of {', '.join(_KEYS)}", "an unknown key")
    start = head.get("start_utc_s")
    if start is not None and (isinstance(start, bool) or not isinstance(start, int | float)):
        faults.add(f"{where}, start_utc_s", "UTC seconds, or null", shown(start))
    vehicle = head.get("vehicle")
    if not (vehicle is None or isinstance(vehicle, bool)):
        faults.add(f"{where}, vehicle", "true, false or null", shown(vehicle))
    notes = head.get("notes", [])
    if not (isinstance(notes, list) and all(isinstance(note, str) for note in notes)):
        faults.add(f"{where}, notes", "a list of texts", shown(notes))
    faults.raise_if_any(InputError)
    try:
        return nan if start is None else float(start)
    except OverflowError:
        return inf
