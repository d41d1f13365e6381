"""Measured levels with positions: drive tests and walks, from whatever logged them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Literal

import numpy as np

from mapfilter._types import Bools, Floats, Ints, Ints32
from mapfilter.errors import Fault, InputError, fail
from mapfilter.geodesy import project, projected_crs, utm_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.survey.measurement_files import (
    DIALECTS,
    Identity,
    Rows,
    header_of,
    mapped,
    open_text,
    read_csv,
    whole,
)

FIRST_WORD = "BEGIN"
"""How a log begins."""
_LONGEST_LINE = 4096
_KEY = re.compile(r'(\w[\w ]*)=\s*("[^"]*"|[^,]*)')
_LEVEL = re.compile(r"^(>?)\s*(-?\d+)\s*dBm$")


def read_antennas_log(path: Path) -> Rows:
    """Read a log: each record has a serving cell, up to six neighbours, and one position.

    A level written with ``>`` is a bound, no level: it is counted and left out.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    rows = Rows(path)
    time, operator = "", ""
    heard: list[tuple[int, dict[str, str]]] = []
    with open_text(path) as stream:
        line = 0
        while text := stream.readline(_LONGEST_LINE):
            line += 1
            kind = text.split(",", 1)[0].strip()
            values = {key.strip(): value.strip(' "\r\n') for key, value in _KEY.findall(text)}
            if kind == "Record":
                _unplaced(rows, heard)
                time, operator, heard = values.get("Time", ""), values.get("Operator", ""), []
            elif kind == "ACTIVE GSM" or kind == "GSM":
                rows.read += 1
                heard.append((line, values))
            elif kind == "Best Location":
                place = values.get("Lat", ""), values.get("Lon", "")
                for cell_line, cell in heard:
                    _add(rows, cell_line, cell, place, _iso(time), operator)
                heard = []
    _unplaced(rows, heard)
    return rows


def _add(
    rows: Rows, line: int, cell: dict[str, str], place: tuple[str, str], time: str, operator: str
) -> None:
    parts = (whole(operator[:3]), whole(operator[3:]), whole(cell.get("LAC", "")),
             whole(cell.get("CID", "")))  # fmt: skip
    mcc, mnc, lac, ci = parts
    if mcc is None or mnc is None or lac is None or ci is None:
        rows.aside["rows of cells without identity"] += 1
        return
    found = _LEVEL.match(cell.get("Signal", ""))
    if found is None:
        rows.refuse(line, "Signal", "a level such as -67dBm", repr(cell.get("Signal", "")[:40]))
        return
    if found[1]:
        rows.aside["levels that are only bounds (>)"] += 1
        return
    identity: Identity = (mcc, mnc, lac, ci)
    name = "-".join(map(str, identity))
    rows.identities.setdefault(name, identity)
    rows.add(line, name, place, found[2], time=time)


def _unplaced(rows: Rows, heard: list[tuple[int, dict[str, str]]]) -> None:
    for line, _ in heard:
        rows.refuse(line, "Best Location", "a position after the cells", "none", "the log cut off")


def _iso(time: str) -> str:
    """Return a time such as ``2014-09-24 19:21:42:61 GMT+05:30`` in ISO 8601, else ''."""
    text = re.sub(r":(\d{1,3}) GMT", lambda found: f".{found[1]:0>3} ", time)
    try:
        return datetime.strptime(text, "%Y-%m-%d %H:%M:%S.%f %z").isoformat()
    except ValueError:
        return time


Format = Literal["auto", "csv", "opencellid", "towercollector", "antennas"]

SESSION_GAP_S = 1800.0
"""A longer silence begins a new session."""
_SUFFIXES = (".csv", ".log", ".tsv")


@dataclass(frozen=True, eq=False)
class Measurements:
    """Levels heard at places, with the session that each belongs to.

    A session is one drive or walk: what is left out together when a map is validated.

    Parameters
    ----------
    crs : str
        Projected CRS of the positions.
    cell_ids : tuple of str
        Cells heard, sorted.
    identities : mapping of str to (mcc, mnc, lac, ci)
        Of the cells whose identity the files tell; lac is the tac in LTE.
    sessions : tuple of str
        Names of the sessions.
    cell, session : numpy.ndarray of int32, shape (N,)
        Indices into ``cell_ids`` and ``sessions``.
    time_s : numpy.ndarray, shape (N,)
        Unix seconds, UTC; NaN where unknown.
    east_m, north_m, level_dbm : numpy.ndarray, shape (N,)
    accuracy_m : numpy.ndarray, shape (N,)
        Of the position, as the receiver tells it; NaN where unknown.
    notes : tuple of str
        Which rows were left out, and why.
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

    def __len__(self) -> int:
        return len(self.level_dbm)

    def where(self, kept: Bools, *notes: str) -> Measurements:
        """Return some of the rows; cells and sessions keep their places."""
        return replace(
            self,
            cell=self.cell[kept],
            session=self.session[kept],
            time_s=self.time_s[kept],
            east_m=self.east_m[kept],
            north_m=self.north_m[kept],
            level_dbm=self.level_dbm[kept],
            accuracy_m=self.accuracy_m[kept],
            notes=(*self.notes, *notes),
        )

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
) -> Measurements:
    """Read files of measurements; each file, session column and long silence begins a session.

    Bad rows are counted and told in the notes, and lose nothing else. Exact repetitions are left
    out.

    Parameters
    ----------
    files : sequence of Path or str
        Files, or folders whose .csv, .tsv and .log files are taken.
    crs : str, optional
        Projected CRS for the positions; the UTM zone of the measurements when left out.
    format : {"auto", "csv", "opencellid", "towercollector", "antennas"}
        ``auto`` tells each file by its first line.
    columns : mapping of str to str, optional
        For "csv": which column holds which of :data:`~mapfilter.survey.measurement_files.FIELDS`.
    session_gap_s : float

    Raises
    ------
    InputError
        A file cannot be read, is of another kind, or none of its rows is any good; with the first
        faults of each.
    """
    tables = []
    faults: list[Fault] = []
    for path in _expanded(files):
        try:
            table = _read(path, format, columns)
        except InputError as error:
            faults.extend(error.faults)
            continue
        tables.append(table)
        if not table.cell:
            faults.extend(table.faults or (_nothing(table),))
    if faults:
        raise InputError(tuple(faults))
    if crs is None:
        crs = utm_crs(
            float(np.median(np.concatenate([table.lon_deg for table in tables]))),
            float(np.median(np.concatenate([table.lat_deg for table in tables]))),
        )
    return _joined(tables, projected_crs(crs), session_gap_s)


def _read(path: Path, wanted: Format, columns: Mapping[str, str] | None) -> Rows:
    if columns:
        return read_csv(path, mapped(columns))
    kind = _kind(header_of(path)) if wanted == "auto" else wanted
    return read_antennas_log(path) if kind == "antennas" else read_csv(path, DIALECTS[kind])


def _kind(header: Sequence[str]) -> Literal["csv", "opencellid", "towercollector", "antennas"]:
    if header[:1] == (FIRST_WORD.lower(),):
        return "antennas"
    if {"cellid", "signal", "lat"} <= set(header):
        return "opencellid"
    return "towercollector" if {"cell_id", "dbm", "lat"} <= set(header) else "csv"


def _expanded(files: Sequence[Path | str]) -> list[Path]:
    found: list[Path] = []
    for path in map(Path, files):
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() in _SUFFIXES)
            if not inside:
                raise fail(InputError, str(path), f"files {', '.join(_SUFFIXES)}", "none")
            found += inside
        else:
            found.append(path)
    if not found:
        raise fail(InputError, "measurements", "at least one file", "none")
    return found


def _nothing(table: Rows) -> Fault:
    told = "; ".join(f"{count} {what}" for what, count in table.aside.items())
    got = f"{table.read} rows" + (f": {told}" if told else "")
    return Fault(str(table.path), "at least one level with cell and position", got)


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
    lon_deg = np.concatenate([table.lon_deg for table in tables])
    lat_deg = np.concatenate([table.lat_deg for table in tables])
    east_m, north_m = project(crs, lon_deg, lat_deg)
    joined = Measurements(
        crs,
        cells,
        {cell: identity for table in tables for cell, identity in table.identities.items()},
        tuple(names),
        np.concatenate(cell),
        np.concatenate(session),
        np.concatenate([table.time_s for table in tables]),
        east_m,
        north_m,
        np.concatenate([table.level_dbm for table in tables]),
        np.concatenate([table.accuracy_m for table in tables]),
        tuple(note for table in tables for note in table.told()),
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


def _sessions(table: Rows, gap_s: float) -> Ints:
    """Return the session of each row of a file, counted from 0 in the order of the rows."""
    named = np.array(table.session)
    time_s = np.array(table.time_s)
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
