"""Files of measurements in any of the formats, read and joined to one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from mapfilter._words import counted, number_of
from mapfilter.errors import Fault, InputError, fail, listed
from mapfilter.geodesy import projected_crs, utm_crs_of
from mapfilter.survey.antennas_log import read_antennas_log
from mapfilter.survey.joined_measurements import joined_measurements
from mapfilter.survey.measurement_files import (
    DIALECTS,
    header_of,
    mapped,
    may_hold_measurements,
    read_csv,
)
from mapfilter.survey.measurement_rows import NotMeasurementsError, Rows
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SESSION_GAP_S

Format = Literal["auto", "csv", "opencellid", "towercollector", "antennas"]
_SUFFIXES = (".csv", ".log", ".tsv")
_RECORDED_SUFFIXES = (
    *(".txt", ".gz", ".nmf", ".gpx", ".rec", ".json", ".jsonl", ".ndjson", ".geojson", ".kml"),
    *(".kmz", ".xlsx", ".xls", ".ods", ".gpkg", ".parquet", ".pq"),
)
"""Of recordings that may hold levels, and of tables in other files."""
_HEAD_OF_LOG = "log.json"
_NO_CELLS = (
    "the column of cells has another name; columns.cell names it (prediction.survey.columns.cell), "
    "or mcc, mnc, lac and ci"
)


def read_measurements(
    files: Sequence[Path | str],
    crs: str | None = None,
    *,
    format: Format = "auto",  # noqa: A002
    columns: Mapping[str, str] | None = None,
    session_gap_s: float = SESSION_GAP_S,
    recorded: Callable[[Path], Rows | None] | None = None,
) -> Measurements:
    """Read files of measurements; each file, session column and long silence begins a session.

    Bad rows are counted in the notes, and lose nothing else. Exact repetitions are left out, and so
    are other texts of a folder, with a note, where it has measurements as well.

    Parameters
    ----------
    files : sequence of Path or str
        Files, or folders whose .csv, .tsv and .log files are taken; with ``recorded`` track logs,
        folders of them, and recordings and tables in other files, too.
    crs : str, optional
        Projected CRS for the positions; the UTM zone of the measurements when left out.
    format : {"auto", "csv", "opencellid", "towercollector", "antennas"}
        ``auto`` recognises each file by its first line.
    columns : mapping of str to str, optional
        For "csv": which column holds which of :data:`~mapfilter.survey.measurement_rows.FIELDS`.
    session_gap_s : float
        A longer silence begins a new session.
    recorded : callable, optional
        With "auto": reads files that are none of these formats; None for those that it does not
        know. Raises NotMeasurementsError for recordings without cells.

    Raises
    ------
    InputError
        A file cannot be read, is of another kind, or has no good row, unless it is one of a folder
        that cannot be a drive test; with the first faults of each.
    """
    tables, strays = [], []
    faults: list[Fault] = []
    named = set(map(Path, files))
    for path in _expanded(files, recorded):
        try:
            table = _read(path, format, columns, recorded)
        except InputError as error:
            if path in named or not isinstance(error, NotMeasurementsError):
                faults.extend(error.faults)
            else:
                strays.append((path, error.faults))
            continue
        if table.cell:
            tables.append(table)
        else:
            aside = "; ".join(counted(count, what) for what, count in table.aside.items())
            got = number_of(table.read, "row") + (f": {aside}" if aside else "")
            expected = "at least one level with cell and position"
            unnamed = any("without identity" in what for what in table.aside)
            hint = _NO_CELLS if unnamed else ""
            found = table.faults or [Fault(str(path), expected, got, hint)]
            if path in named or table.read:
                faults.extend(found)
            else:
                strays.append((path, tuple(found)))
    if not (faults or tables):
        faults = [fault for _, found in strays for fault in found]
    if faults:
        raise InputError(tuple(faults))
    if crs is None:
        lat_deg, lon_deg = np.concatenate([t.columns[1:3] for t in tables], 1)
        crs = utm_crs_of(lon_deg, lat_deg)
    joined = joined_measurements(tables, projected_crs(crs), session_gap_s)
    if not strays:
        return joined
    left = f"{number_of(len(strays), 'file')} without a drive test left out: "
    note = left + listed([path.name for path, _ in strays])
    return replace(joined, notes=(note, *joined.notes))


def _read(
    path: Path,
    kind: Format,
    columns: Mapping[str, str] | None,
    recorded: Callable[[Path], Rows | None] | None,
) -> Rows:
    dialect = mapped(columns) if columns else None
    if dialect is None and kind == "auto":
        own = _kind_of(path)
        if own is None and recorded is not None and (rows := recorded(path)) is not None:
            return rows
        kind = own or "csv"
    if dialect is None and kind == "antennas":
        return read_antennas_log(path)
    try:
        return read_csv(path, dialect or DIALECTS[kind])
    except InputError as error:
        if may_hold_measurements(path):
            raise
        raise NotMeasurementsError(error.faults) from error


def _kind_of(path: Path) -> Format | None:
    """Return the format of a file by its first line; None for none of the own ones."""
    try:
        header = header_of(path)
    except InputError:
        return None
    if header[:1] == ["begin"]:
        return "antennas"
    names = set(header)
    kinds: tuple[tuple[Format, set[str]], ...] = (
        ("opencellid", {"cellid", "signal", "lat"}),
        ("towercollector", {"cell_id", "dbm", "lat"}),
        ("csv", {"level_dbm", "lat", "lon"}),
    )
    return next((kind for kind, needed in kinds if needed <= names), None)


def _expanded(
    files: Sequence[Path | str], recorded: Callable[[Path], Rows | None] | None
) -> list[Path]:
    suffixes = _SUFFIXES if recorded is None else (*_SUFFIXES, *_RECORDED_SUFFIXES)
    found: list[Path] = []

    def is_read(path: Path) -> bool:
        if path.is_dir():
            return recorded is not None and _is_log(path)
        return path.suffix.lower() in suffixes

    for path in map(Path, files):
        if path.is_dir() and not is_read(path):
            held = sorted(path.iterdir())
            inside = list(filter(is_read, held))
            if not inside:
                zipped = any(map(_is_zipped, held))
                hint = "ZIP files, which are not looked into: unpack them" if zipped else ""
                raise fail(InputError, str(path), f"files {', '.join(suffixes)}", "none", hint)
            found += inside
        elif _is_zipped(path):
            hint = "unpack it, and name its folder"
            raise fail(InputError, str(path), "a drive test, or a folder of them", "a ZIP", hint)
        else:
            found.append(path)
    if not found:
        raise fail(InputError, "measurements", "at least one file", "none")
    return found


def _is_zipped(path: Path) -> bool:
    return path.suffix.lower() == ".zip"


def _is_log(folder: Path) -> bool:
    return (folder / _HEAD_OF_LOG).is_file()
