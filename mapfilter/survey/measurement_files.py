"""Files of measured levels: CSV of any columns, of OpenCellID and Tower Collector, and logs.

A bad row is counted and located, and loses nothing else: a quote that is never closed ends with its
line, a wrong byte spoils one field, a line of another length is refused alone.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import Fault, Faults, InputError, fail
from mapfilter.geodesy import degree_fault
from mapfilter.radio.cell_rules import RANGES, id_fault
from mapfilter.radio.tables import number

_LONGEST_LINE = 1 << 16
_FAULTS_KEPT = 20
_FAULTS_SHOWN = 3
_LATEST_S = 4_102_444_800.0
_UNAVAILABLE = 2_000_000_000.0
_LEVEL_DBM = (-170.0, -10.0)
_GSM, _LTE = ("GSM", "GPRS", "EDGE"), ("LTE", "LTE+", "LTE_CA", "NR")
_KEY = re.compile(r'(\w[\w ]*)=\s*("[^"]*"|[^,]*)')
_LEVEL = re.compile(r"^(>?)\s*(-?\d+)\s*dBm$")
_IDENTITY = ("mcc", "mnc", "lac", "ci")
_REQUIRED = ("lat", "lon", "level_dbm")
_MOST_STEPS = 3846.0
"""Timing advances: of NR 0 to 3846, fewer of older technologies."""
_YES = ("1", "true", "yes", "neighbour", "neighbor")
_NO = ("0", "false", "no", "serving")
FIELDS = (
    *("cell", *_IDENTITY, *_REQUIRED, "time", "accuracy_m", "session"),
    *("timing_advance", "neighbour"),
)
"""Fields that a column map may name."""

NO_TIME = "times not understood (levels kept)"
_TIMES = "expected ISO 8601 (2026-05-01T10:00:00+02:00) or Unix s, ms or µs"

Identity = tuple[int, int, int, int]
"""mcc, mnc, lac (tac in LTE) and ci."""


@dataclass(slots=True)
class Rows:
    """Good rows as columns, the faults of bad ones, and counts of what is set aside.

    ``cell`` and ``session`` are numbers given in ``cells`` and ``sessions``; ``identified`` is the
    cell of identities that were looked at before, ``odd_time`` the first time not understood.
    """

    path: Path
    read: int = 0
    cells: dict[str, int] = field(default_factory=dict)
    sessions: dict[str, int] = field(default_factory=dict)
    cell: array[int] = field(default_factory=lambda: array("i"))
    session: array[int] = field(default_factory=lambda: array("i"))
    values: array[float] = field(default_factory=lambda: array("d"))
    identities: dict[str, Identity] = field(default_factory=dict)
    identified: dict[tuple[str, ...], str] = field(default_factory=dict)
    refused: int = 0
    faults: list[Fault] = field(default_factory=list)
    aside: Counter[str] = field(default_factory=Counter)
    odd_time: str = ""

    @property
    def columns(self) -> Floats:
        """Return all rows as columns, shape (7, N); what is unknown is NaN.

        Unix seconds, latitude, longitude (WGS 84), level (dBm), accuracy (m), timing advance
        (steps), and 1 for a serving cell, 0 for a neighbour.
        """
        return np.array(self.values).reshape(-1, 7).T

    def refuse(self, line: int, name: str, expected: str, got: object, hint: str = "") -> None:
        """Count a bad row and keep the faults of the first ones."""
        self.refused += 1
        if len(self.faults) < _FAULTS_KEPT:
            self.faults.append(Fault(f"{self.path} row {line}, {name}", expected, str(got), hint))

    def identify(self, line: int, cell: str, texts: Sequence[str]) -> str:
        """Return the cell that mcc, mnc, lac and ci name, or ``cell`` where that is not empty.

        An identity that is not possible refuses the row; a row without any is set aside. Both
        return an empty text.
        """
        given = (cell, *texts)
        if given in self.identified:
            return self.identified[given]
        mcc, mnc, lac, ci = map(_whole, texts)
        if mcc is None or mnc is None or lac is None or ci is None:
            if not cell:
                self.aside["rows of cells without identity"] += 1
            return cell
        identity = (mcc, mnc, lac, ci)
        for name, value in zip(_IDENTITY, identity, strict=True):
            if not RANGES[name].holds(value):
                self.refuse(line, name, RANGES[name].expected, value)
                return ""
        cell = cell or "-".join(map(str, identity))
        self.identities.setdefault(cell, identity)
        self.identified[given] = cell
        return cell

    def add(self, line: int, cell: str, given: Mapping[str, str]) -> None:
        """Check one row, given as texts by :data:`FIELDS`, and keep it or refuse it.

        A time or accuracy that makes no sense becomes unknown: the level is as good without.
        """
        if cell not in self.cells and (wrong := id_fault(cell)) is not None:
            self.refuse(line, "cell", *wrong)
            return
        found = []
        for name in _REQUIRED:
            value = number(given[name])
            if value is None:
                self.refuse(
                    line, name, "a number", repr(given[name][:40]) if given[name] else "nothing"
                )
                return
            found.append(value)
        lat_deg, lon_deg, level_dbm = found
        misplaced = degree_fault(lat_deg, lon_deg)
        if lat_deg == 0 and lon_deg == 0:
            misplaced = "a position", "0, 0", "no fix yet"
        if misplaced is not None:
            self.refuse(line, "lat, lon", *misplaced)
            return
        if not _LEVEL_DBM[0] <= level_dbm <= _LEVEL_DBM[1]:
            expected = f"dBm in {_LEVEL_DBM[0]:g}..{_LEVEL_DBM[1]:g}"
            hint = "RXLEV or ASU given for dBm" if 0 <= level_dbm <= 97 else ""
            if abs(level_dbm) >= _UNAVAILABLE:
                hint = "the marker of a level that was not available"
            self.refuse(line, "level_dbm", expected, given["level_dbm"][:40], hint)
            return
        time_s, accuracy_m = unix_seconds(given["time"]), number(given["accuracy_m"]) or math.nan
        if given["time"] and math.isnan(time_s):
            self.aside[NO_TIME] += 1
            self.odd_time = self.odd_time or f"{given['time'][:40]!r} in line {line}"
        if not 0 < accuracy_m < _UNAVAILABLE:
            accuracy_m = math.nan
        self.cell.append(self.cells.setdefault(cell, len(self.cells)))
        self.session.append(self.sessions.setdefault(given["session"], len(self.sessions)))
        steps = number(given["timing_advance"])
        if steps is None or not 0 <= steps <= _MOST_STEPS:
            steps = math.nan
        said = given["neighbour"].lower()
        serving = 0.0 if said in _YES else 1.0 if said in _NO else math.nan
        self.values.extend((time_s, lat_deg, lon_deg, level_dbm, accuracy_m, steps, serving))

    def notes(self) -> list[str]:
        """Return remarks on how many rows were refused or set aside, and where the first are."""
        found = [f"{count} {what}{self._example(what)}" for what, count in self.aside.items()]
        if self.refused:
            some = "; ".join(str(fault) for fault in self.faults[:_FAULTS_SHOWN])
            more = "; …" if self.refused > _FAULTS_SHOWN else ""
            found.insert(0, f"{self.refused} of {self.read} rows left out: {some}{more}")
        return [f"{self.path.name}: {note}" for note in found]

    def _example(self, what: str) -> str:
        return f", such as {self.odd_time}; {_TIMES}" if what == NO_TIME and self.odd_time else ""


def unix_seconds(text: str) -> float:
    """Return Unix seconds of an ISO 8601 time (UTC by default) or of s, ms or µs; else NaN.

    Examples
    --------
    >>> unix_seconds("1599319703000"), unix_seconds("2020-09-05T15:28:23Z")
    (1599319703.0, 1599319703.0)
    """
    seconds = number(text)
    if seconds is not None:
        seconds /= 1e6 if seconds > 1e14 else 1e3 if seconds > 1e11 else 1.0
    else:
        try:
            moment = datetime.fromisoformat(text)
            seconds = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
        except (ValueError, OverflowError):
            return math.nan
    return seconds if 0 < seconds < _LATEST_S else math.nan


def _whole(text: str) -> int | None:
    """Return a whole number ≥ 0 that is no marker of an unavailable value, else None."""
    value = number(text)
    if value is None or not 0 <= value < 2**36 or value != int(value) or value == 2**31 - 1:
        return None
    return int(value)


class Dialect(NamedTuple):
    """Names of the columns of one kind of file.

    Parameters
    ----------
    columns : mapping of str to tuple of str
        Column or columns that hold each of :data:`FIELDS`, and the radio technology where the level
        may be an ASU; of several, the first that is not empty.
    required : tuple of str
        Fields without which a file is none of the kind.
    """

    columns: Mapping[str, tuple[str, ...]]
    required: tuple[str, ...] = _REQUIRED


def mapped(columns: Mapping[str, str]) -> Dialect:
    """Return the dialect of a map from :data:`FIELDS` to columns; these columns are required."""
    own = {name: (name,) for name in FIELDS}
    named = {name: (column,) for name, column in columns.items()}
    return Dialect({**own, **named}, (*_REQUIRED, *columns))


def _upload(**columns: str) -> Dialect:
    names = {name: name for name in ("mcc", "mnc", "lat", "lon")} | {"time": "measured_at"}
    split = {name: tuple(text.split()) for name, text in (names | columns).items()}
    return Dialect(split, (*_REQUIRED, *_IDENTITY))


DIALECTS: Mapping[str, Dialect] = {
    "csv": mapped({}),
    "opencellid": _upload(
        lac="lac tac",
        ci="cellid",
        level_dbm="signal",
        accuracy_m="rating",
        technology="act",
        timing_advance="ta",
    ),
    "towercollector": _upload(
        lac="lac",
        ci="cell_id",
        level_dbm="dbm",
        accuracy_m="accuracy",
        timing_advance="ta",
        neighbour="neighboring",
    ),
}
"""Columns named as the fields are; uploads to OpenCellID; exports of Tower Collector."""


def read_csv(path: Path, dialect: Dialect) -> Rows:
    """Read a file of measurements; bad rows are refused one by one."""
    rows = Rows(path)
    lines = _lines(path)
    separator, header = _header(lines)
    if not header:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "no text file")
    places = _places(path, header, dialect)
    for line, text in lines:
        if text is not None and not text.strip():
            continue
        rows.read += 1
        if text is None:
            rows.refuse(line, "line", f"at most {_LONGEST_LINE} characters", "more")
            continue
        fields = _split(text, separator)
        if len(fields) < len(header) or any(fields[len(header) :]):
            hint = "a line cut off" if len(fields) < len(header) else "a separator in a field"
            rows.refuse(line, "fields", str(len(header)), len(fields), hint)
            continue
        found = {
            name: next((word for at in some if (word := fields[at].strip())), "")
            for name, some in places.items()
        }
        if separator != ",":
            for name in (*_REQUIRED, "accuracy_m"):
                if "." not in found[name]:
                    found[name] = found[name].replace(",", ".")
        cell = rows.identify(line, found["cell"], [found[name] for name in _IDENTITY])
        if not cell:
            continue
        dbm = _from_asu(found["level_dbm"], found["technology"].upper())
        if dbm is not None:
            rows.aside["levels given as ASU (turned into dBm)"] += 1
            found["level_dbm"] = repr(dbm)
        rows.add(line, cell, found)
    return rows


def header_of(path: Path) -> list[str]:
    """Return the names in the first line of a file, in lower case."""
    return _header(_lines(path))[1]


def _header(lines: Iterator[tuple[int, str | None]]) -> tuple[str, list[str]]:
    """Return the separator and the names of the first line that is not blank."""
    text = next((text for _, text in lines if text is not None and text.strip()), "")
    separator = max(",;\t", key=text.count)
    return separator, [name.strip().lower() for name in _split(text, separator)] if text else []


def _from_asu(text: str, technology: str) -> float | None:
    """Turn an arbitrary strength unit into dBm: 3GPP TS 27.007 +CSQ for GSM, +CESQ for LTE."""
    asu = number(text) if technology else None
    if asu is None:
        return None
    if technology in _GSM and 0 <= asu <= 31:
        return -113.0 + 2 * asu
    return asu - 140.0 if technology in _LTE and 0 <= asu <= 97 else None


def _lines(path: Path) -> Iterator[tuple[int, str | None]]:
    """Yield line numbers and texts; None for a line too long to be one."""
    with _open_text(path) as stream:
        line = 0
        while text := stream.readline(_LONGEST_LINE):
            line += 1
            if len(text) < _LONGEST_LINE or text.endswith("\n"):
                yield line, text.rstrip("\r\n")
                continue
            while (more := stream.readline(_LONGEST_LINE)) and not more.endswith("\n"):
                pass
            yield line, None


def _split(text: str, separator: str) -> list[str]:
    if '"' not in text:
        return text.split(separator)
    try:
        return next(csv.reader([text], delimiter=separator), [])
    except csv.Error:
        return []


def _places(path: Path, header: Sequence[str], dialect: Dialect) -> dict[str, tuple[int, ...]]:
    """Return where each field is in a line, or raise with every column that is not there."""
    faults, where = Faults(), f"{path} header"
    places = dict.fromkeys((*FIELDS, "technology"), ()) | {
        name: tuple(header.index(column.lower()) for column in columns if column.lower() in header)
        for name, columns in dialect.columns.items()
    }
    for name in dialect.required:
        if not places.get(name):
            columns = " or ".join(dialect.columns.get(name, (name,)))
            near = difflib.get_close_matches(columns.lower(), header, n=1, cutoff=0.5)
            expected = f"a column {columns}" + (f" for {name}" if columns != name else "")
            faults.add(where, expected, "none", f"{near[0]} meant" if near else "")
    checked = set(_IDENTITY) <= set(dialect.required)
    if not (checked or places["cell"] or all(places[name] for name in _IDENTITY)):
        faults.add(where, "a column cell, or mcc, mnc, lac and ci", "none", "name the columns")
    for column in {header[place] for some in places.values() for place in some}:
        if header.count(column) > 1:
            faults.add(where, f"one column {column}", f"{header.count(column)}")
    faults.raise_if_any(InputError)
    return places


def read_antennas_log(path: Path) -> Rows:
    """Read a log of *Antennas*: records of a serving cell, up to six neighbours, and one position.

    A level written with ``>`` is a bound, no level: it is counted and left out.
    """
    rows = Rows(path)
    time, operator = "", ""
    received: list[tuple[int, dict[str, str]]] = []

    def drop_unplaced() -> None:
        for at, _ in received:
            rows.refuse(at, "Best Location", "a position after the cells", "none", "cut off")
        received.clear()

    for line, text in _lines(path):
        kind, pairs = (text or "").split(",", 1)[0].strip(), _KEY.findall(text or "")
        values = {key.strip(): value.strip(' "\r\n') for key, value in pairs}
        if kind == "Record":
            drop_unplaced()
            time, operator = values.get("Time", ""), values.get("Operator", "")
        elif kind in ("ACTIVE GSM", "GSM"):
            rows.read += 1
            received.append((line, values | {"neighbour": "0" if kind == "ACTIVE GSM" else "1"}))
        elif kind == "Best Location":
            found = dict.fromkeys(FIELDS, "") | {"time": _iso(time)}
            found |= {"lat": values.get("Lat", ""), "lon": values.get("Lon", "")}
            for at, cell in received:
                _add_logged(rows, at, cell, operator, found)
            received.clear()
    drop_unplaced()
    return rows


def _add_logged(
    rows: Rows, line: int, cell: dict[str, str], operator: str, found: Mapping[str, str]
) -> None:
    texts = (operator[:3], operator[3:], cell.get("LAC", ""), cell.get("CID", ""))
    name, signal = rows.identify(line, "", texts), cell.get("Signal", "")
    level = _LEVEL.match(signal)
    if name and level is None:
        rows.refuse(line, "Signal", "a level such as -67dBm", repr(signal[:40]))
    elif name and level is not None and level[1]:
        rows.aside["levels that are only bounds (>)"] += 1
    elif name and level is not None:
        neighbour = cell["neighbour"]
        rows.add(line, name, {**found, "level_dbm": level[2], "neighbour": neighbour})


def _iso(time: str) -> str:
    """Return a time such as ``2014-09-24 19:21:42:61 GMT+05:30`` in ISO 8601, else as it is."""
    text = re.sub(r":(\d{1,3}) GMT", lambda found: f".{found[1]:0>3} ", time)
    try:
        return datetime.strptime(text, "%Y-%m-%d %H:%M:%S.%f %z").isoformat()
    except ValueError:
        return time


def _open_text(path: Path) -> TextIO:
    """Open a file as text in which an invalid byte invalidates only its own row."""
    try:
        with path.open("rb") as stream:
            head = stream.read(2)
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    if not head:
        raise fail(InputError, str(path), "measurements", "an empty file")
    if head in (b"\xff\xfe", b"\xfe\xff"):
        raise fail(InputError, str(path), "text in UTF-8", "UTF-16", "saved as Unicode by Excel")
    if head == b"\x1f\x8b":
        raise fail(InputError, str(path), "text", "a gzip file", "unpack it first")
    return path.open(encoding="utf-8-sig", errors="replace")
