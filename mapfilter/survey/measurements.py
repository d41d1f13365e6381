"""Measured levels with positions: drive tests and walks of any logging program."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from mapfilter._types import Bools, Floats, Ints, Ints32
from mapfilter.errors import Fault, InputError, fail, listed
from mapfilter.geodesy import project, projected_crs, utm_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.survey.measurement_files import (
    DIALECTS,
    header_of,
    mapped,
    read_antennas_log,
    read_csv,
)
from mapfilter.survey.measurement_rows import Identity, Rows

Format = Literal["auto", "csv", "opencellid", "towercollector", "antennas"]

SESSION_GAP_S = 1800.0
"""A longer silence begins a new session."""
_FILES_NAMED = 3
_SUFFIXES = (".csv", ".log", ".tsv")
_RECORDED_SUFFIXES = (".txt", ".gz")
_HEAD_OF_LOG = "log.json"


@dataclass(frozen=True, eq=False)
class Measurements:
    """Levels received at places, with the session that each belongs to.

    A session is one drive or walk: what is left out together when a map is validated.

    Parameters
    ----------
    crs : str
        Projected CRS of the positions.
    cell_ids : tuple of str
        Cells received, sorted.
    identities : mapping of str to (mcc, mnc, lac, ci)
        Of the cells whose identity is in the files; lac is the tac in LTE.
    cell, session : numpy.ndarray of int32, shape (N,)
        Indices into ``cell_ids`` and ``sessions``.
    time_s : numpy.ndarray, shape (N,)
        Unix seconds, UTC; NaN where unknown.
    accuracy_m : numpy.ndarray, shape (N,)
        Of the position, as the receiver reported it; NaN where unknown.
    notes : tuple of str
        Which rows were left out, and why.
    serving : numpy.ndarray of bool, shape (N,)
        Whether the cell was the serving one. Where a file does not tell, the only cell of its time
        was. None where this is not known of any row.
    timing_advance : numpy.ndarray, shape (N,)
        Steps, NaN where it was not reported; None as for ``serving``.
    """

    crs: str
    cell_ids: tuple[str, ...]
    identities: Mapping[str, Identity]
    sessions: tuple[str, ...]
    cell: Ints32
    session: Ints32
    time_s: Floats
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    accuracy_m: Floats
    notes: tuple[str, ...] = ()
    serving: Bools | None = None
    timing_advance: Floats | None = None

    def __len__(self) -> int:
        return len(self.level_dbm)

    def where(self, kept: Bools, *notes: str) -> Measurements:
        """Return some of the rows; cells and sessions keep their places."""
        columns = ("cell", "session", "time_s", "east_m", "north_m", "level_dbm", "accuracy_m")
        more = ("serving", "timing_advance") if self.serving is not None else ()
        some = {name: getattr(self, name)[kept] for name in (*columns, *more)}
        return replace(self, **some, notes=(*self.notes, *notes))

    def accurate(self, accuracy_m: float) -> Measurements:
        """Return the rows whose position is at least so accurate, or of unknown accuracy."""
        kept = ~(self.accuracy_m > accuracy_m)
        if kept.all():
            return self
        count = int((~kept).sum())
        return self.where(
            kept, f"{count} rows left out: positions less accurate than {accuracy_m:g} m"
        )


def named_after(measurements: Measurements, plan: CellPlan) -> Measurements:
    """Return the measurements with the plan's ids for the cells whose identity the plan has."""
    ids = {(cell.mcc, cell.mnc, cell.lac, cell.ci): cell.id for cell in plan.cells}
    new = [
        cell_id
        if cell_id in plan or cell_id not in measurements.identities
        else ids.get(measurements.identities[cell_id], cell_id)
        for cell_id in measurements.cell_ids
    ]
    names, places = np.unique(np.array(new), return_inverse=True)
    known = zip(measurements.cell_ids, new, strict=True)
    identities = {
        name: measurements.identities[old] for old, name in known if old in measurements.identities
    }
    return replace(
        measurements,
        cell_ids=tuple(names.tolist()),
        identities=identities,
        cell=places[measurements.cell].astype(np.int32),
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

    Bad rows are counted in the notes, and lose nothing else. Exact repetitions are left out.

    Parameters
    ----------
    files : sequence of Path or str
        Files, or folders whose .csv, .tsv and .log files are taken; with ``recorded`` track logs
        and folders of them, too.
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
        know.

    Raises
    ------
    InputError
        A file cannot be read, is of another kind, or has no good row; with the first faults of
        each.
    """
    tables = []
    faults: list[Fault] = []
    for path in _expanded(files, recorded):
        try:
            table = _read(path, format, columns, recorded)
        except InputError as error:
            faults.extend(error.faults)
            continue
        tables.append(table)
        if not table.cell:
            aside = "; ".join(f"{count} {what}" for what, count in table.aside.items())
            got = f"{table.read} rows" + (f": {aside}" if aside else "")
            expected = "at least one level with cell and position"
            faults.extend(table.faults or (Fault(str(path), expected, got),))
    if faults:
        raise InputError(tuple(faults))
    if crs is None:
        lat_deg, lon_deg = np.median(np.concatenate([t.columns[1:3] for t in tables], 1), axis=1)
        crs = utm_crs(float(lon_deg), float(lat_deg))
    return _joined(tables, projected_crs(crs), session_gap_s)


def _read(
    path: Path,
    kind: Format,
    columns: Mapping[str, str] | None,
    recorded: Callable[[Path], Rows | None] | None,
) -> Rows:
    if columns:
        return read_csv(path, mapped(columns))
    if kind == "auto":
        own = _kind_of(path)
        if own is None and recorded is not None and (rows := recorded(path)) is not None:
            return rows
        kind = own or "csv"
    return read_antennas_log(path) if kind == "antennas" else read_csv(path, DIALECTS[kind])


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
            inside = sorted(filter(is_read, path.iterdir()))
            if not inside:
                raise fail(InputError, str(path), f"files {', '.join(suffixes)}", "none")
            found += inside
        else:
            found.append(path)
    if not found:
        raise fail(InputError, "measurements", "at least one file", "none")
    return found


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
    of_session = np.concatenate(session)
    joined = Measurements(
        crs,
        cells,
        {cell: identity for table in tables for cell, identity in table.identities.items()},
        tuple(names),
        np.concatenate(cell),
        of_session,
        time_s,
        east_m,
        north_m,
        level_dbm,
        accuracy_m,
        _notes(tables),
        np.where(np.isnan(role), _alone(of_session, time_s), role > 0).astype(np.bool_),
        timing_advance,
    )
    placed = np.isfinite(east_m) & np.isfinite(north_m)
    if not placed.all():
        count = int((~placed).sum())
        if count == len(placed):
            got = f"{lat_deg[0]:g}, {lon_deg[0]:g} and {count - 1} more"
            hint = "latitude and longitude swapped, or another area"
            raise fail(InputError, "measurements", f"places where {crs} is used", got, hint)
        joined = joined.where(placed, f"{count} rows left out: {crs} has no such places")
    return _once(joined)


def _alone(session: Ints32, time_s: Floats) -> Bools:
    """Return which rows are the only ones of their session and time."""
    known = np.isfinite(time_s)
    keys = np.column_stack([session[known], time_s[known]])
    _, which, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    found = np.zeros(len(time_s), dtype=np.bool_)
    found[known] = count[which] == 1
    return found


def _notes(tables: Sequence[Rows]) -> tuple[str, ...]:
    """Return remarks by file; what more than three files share is summed up."""
    files = Counter(what for table in tables for what in table.aside)
    shared = [what for what, count in files.items() if count > _FILES_NAMED]
    found = []
    for what in shared:
        of = [table for table in tables if what in table.aside]
        total, names = sum(table.aside[what] for table in of), [table.path.name for table in of]
        found.append(f"{total} {what} in {len(of)} files ({listed(names)})")
        example = next((note for note in of[0].notes() if what in note), "")
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
    return rows.where(kept, f"{len(rows) - len(first)} rows left out: given twice")


@dataclass(frozen=True, eq=False)
class Points:
    """Mean level and position of a cell's readings in each square and session, shape (N,) each.

    Readings of one session in one square count once, however long it stood still there.
    ``measured_at``, shape (M, 2), is east and north of every reading.
    """

    cell_id: str
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    session: Ints
    measured_at: Floats

    def __len__(self) -> int:
        return len(self.level_dbm)

    @property
    def places(self) -> Floats:
        """Positions, shape (N, 2)."""
        return np.column_stack([self.east_m, self.north_m])

    def thinned(self, most: int) -> Points:
        """Return at most so many of the points, evenly taken."""
        if len(self) <= most:
            return self
        return self.some(np.linspace(0, len(self) - 1, most).astype(np.int64))

    def some(self, kept: Ints | Bools) -> Points:
        """Return some of the points."""
        columns = self.east_m[kept], self.north_m[kept], self.level_dbm[kept], self.session[kept]
        return Points(self.cell_id, *columns, self.measured_at)


def points_by_cell(measurements: Measurements, square_m: float, most: int) -> dict[str, Points]:
    """Return the points of each cell that was received.

    The side of the squares is doubled for a cell until it has at most ``most`` points.
    """
    order = np.argsort(measurements.cell, kind="stable")
    edges = np.searchsorted(measurements.cell[order], np.arange(len(measurements.cell_ids) + 1))
    found = {}
    for i, cell_id in enumerate(measurements.cell_ids):
        own = order[edges[i] : edges[i + 1]]
        if not own.size:
            continue
        columns = measurements.east_m, measurements.north_m, measurements.level_dbm
        east_m, north_m, level_dbm = (column[own] for column in columns)
        side_m = square_m
        while True:
            keys = [
                measurements.session[own],
                np.floor(north_m / side_m),
                np.floor(east_m / side_m),
            ]
            table = np.column_stack(keys).astype(np.int64)
            squares, which = np.unique(table, axis=0, return_inverse=True)
            if len(squares) <= most:
                break
            side_m *= 2
        count = np.bincount(which)
        found[cell_id] = Points(
            cell_id,
            np.bincount(which, east_m) / count,
            np.bincount(which, north_m) / count,
            np.bincount(which, level_dbm) / count,
            squares[:, 0],
            np.column_stack([east_m, north_m]),
        )
    return found
