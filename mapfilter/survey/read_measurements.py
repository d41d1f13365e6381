"""Files of measurements in any of the formats, read and joined to one table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from mapfilter._types import Bools, Floats, Ints, Ints32
from mapfilter._words import counted, number_of
from mapfilter.errors import Fault, InputError, fail, listed
from mapfilter.geodesy import project, projected_crs, utm_crs_of
from mapfilter.survey.antennas_log import read_antennas_log
from mapfilter.survey.measurement_files import (
    DIALECTS,
    header_of,
    mapped,
    may_hold_measurements,
    read_csv,
)
from mapfilter.survey.measurement_rows import NotMeasurementsError, Rows, most_frequent
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SESSION_GAP_S

Format = Literal["auto", "csv", "opencellid", "towercollector", "antennas"]
_FILES_NAMED = 3
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
    joined = _joined(tables, projected_crs(crs), session_gap_s)
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


def _joined(tables: Sequence[Rows], crs: str, gap_s: float) -> Measurements:
    cells = tuple(sorted({cell for table in tables for cell in table.cells}))
    places = {cell: i for i, cell in enumerate(cells)}
    names: list[str] = []
    session: list[Ints32] = []
    for table in tables:
        own = _sessions(table, gap_s)
        session.append((own + len(names)).astype(np.int32))
        count = int(own.max()) + 1
        stem = table.path.stem
        names += [stem] if count == 1 else [f"{stem}#{i + 1}" for i in range(count)]
    cell = [np.array([places[c] for c in t.cells], dtype=np.int32)[t.cell] for t in tables]
    columns = np.ascontiguousarray(np.concatenate([table.columns for table in tables], axis=1))
    time_s, lat_deg, lon_deg, level_dbm, accuracy_m, timing_advance, role = columns
    east_m, north_m = project(crs, lon_deg, lat_deg)
    of_session, of_cell = np.concatenate(session), np.concatenate(cell)
    joined = Measurements(
        crs,
        cells,
        {cell: identity for table in tables for cell, identity in table.identities.items()},
        tuple(names),
        of_cell,
        of_session,
        time_s,
        east_m,
        north_m,
        level_dbm,
        accuracy_m,
        _notes(tables),
        np.where(np.isnan(role), _alone(of_session, time_s, of_cell), role > 0).astype(np.bool_),
        timing_advance,
        most_frequent(table.technologies for table in tables),
        most_frequent(table.codes for table in tables),
    )
    placed = np.isfinite(east_m) & np.isfinite(north_m)
    if not placed.all():
        count = int((~placed).sum())
        if count == len(placed):
            got = f"{lat_deg[0]:g}, {lon_deg[0]:g} and {count - 1} more"
            hint = "latitude and longitude swapped, or another area"
            raise fail(InputError, "measurements", f"places where {crs} is used", got, hint)
        joined = joined.where(
            placed, f"{number_of(count, 'row')} left out: {crs} has no such places"
        )
    return _once(joined)


def _alone(session: Ints32, time_s: Floats, cell: Ints32) -> Bools:
    """Return which rows are of the only cell of their session and time."""
    known = np.isfinite(time_s)
    keys = np.column_stack([session[known], time_s[known]])
    which = np.unique(keys, axis=0, return_inverse=True)[1]
    # A cell may be given twice, or read twice in a second.
    cells = np.unique(np.column_stack([which, cell[known]]), axis=0)[:, 0]
    found = np.zeros(len(time_s), dtype=np.bool_)
    found[known] = np.bincount(cells)[which] == 1
    return found


def _notes(tables: Sequence[Rows]) -> tuple[str, ...]:
    """Return remarks by file; what more than three files share is summed up."""
    files = Counter(what for table in tables for what in table.aside)
    shared = [what for what, count in files.items() if count > _FILES_NAMED]
    found = []
    for what in shared:
        of = [table for table in tables if what in table.aside]
        total, names = sum(table.aside[what] for table in of), [table.path.name for table in of]
        found.append(f"{counted(total, what)} in {len(of)} files ({listed(names)})")
        noted = counted(of[0].aside[what], what)
        example = next((note for note in of[0].notes() if noted in note), "")
        if (at := example.find(", such as ")) >= 0:
            found[-1] += example[at:]
    kept = (
        replace(t, aside=Counter({w: n for w, n in t.aside.items() if w not in shared}))
        for t in tables
    )
    return (*found, *(note for table in kept for note in table.notes()))


def _sessions(table: Rows, gap_s: float) -> Ints:
    """Return the session of each row of a file, counted from 0 in the order of the rows."""
    named = np.array(table.session)
    time_s = table.columns[0]
    order = np.lexsort((time_s, named))
    with np.errstate(invalid="ignore"):
        begins = (np.diff(named[order]) != 0) | (np.diff(time_s[order]) > gap_s)
    ranks = np.empty(len(order), dtype=np.int64)
    ranks[order] = np.concatenate([[0], np.cumsum(begins)])
    return ranks


def _once(rows: Measurements) -> Measurements:
    """Leave out rows that repeat another in everything."""
    table = np.column_stack(
        [rows.session, rows.cell, rows.time_s, rows.east_m, rows.north_m, rows.level_dbm]
    )
    # A row without a time may be a second, equal reading.
    table[np.isnan(rows.time_s), 2] = -1.0 - np.flatnonzero(np.isnan(rows.time_s))
    _, first = np.unique(table, axis=0, return_index=True)
    if len(first) == len(rows):
        return rows
    kept = np.zeros(len(rows), dtype=np.bool_)
    kept[first] = True
    return rows.where(kept, f"{number_of(len(rows) - len(first), 'row')} left out: given twice")
