"""Rows of one measurement file, and what was refused of it; all readers end here.

A bad row is counted and located, and loses nothing else: a quote that is never closed ends with its
line, a wrong byte spoils one field, a line of another length is refused alone.
"""

from __future__ import annotations

import csv
import difflib
import math
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from mapfilter.errors import Fault, Faults, InputError, fail
from mapfilter.radio.cell_rules import RANGES, id_fault

LONGEST_LINE = 1 << 16
_TOLD = 20
_SHOWN = 3
_LATEST_S = 4_102_444_800.0
_UNAVAILABLE = 2_000_000_000.0
_LEVEL_DBM = (-170.0, -10.0)

Identity = tuple[int, int, int, int]
"""mcc, mnc, lac (tac in LTE) and ci."""


@dataclass(slots=True)
class Rows:
    """Good rows as columns, the faults of bad ones, and counts of what is set aside.

    Positions are degrees (WGS 84), times Unix seconds (NaN where unknown), accuracies metres (NaN
    where unknown). ``cell`` and ``session`` are numbers given in ``cells`` and ``sessions``.
    """

    path: Path
    read: int = 0
    cells: dict[str, int] = field(default_factory=dict)
    sessions: dict[str, int] = field(default_factory=dict)
    cell: array[int] = field(default_factory=lambda: array("i"))
    session: array[int] = field(default_factory=lambda: array("i"))
    time_s: array[float] = field(default_factory=lambda: array("d"))
    lat_deg: array[float] = field(default_factory=lambda: array("d"))
    lon_deg: array[float] = field(default_factory=lambda: array("d"))
    level_dbm: array[float] = field(default_factory=lambda: array("d"))
    accuracy_m: array[float] = field(default_factory=lambda: array("d"))
    identities: dict[str, Identity] = field(default_factory=dict)
    refused: int = 0
    faults: list[Fault] = field(default_factory=list)
    aside: Counter[str] = field(default_factory=Counter)

    def refuse(self, line: int, name: str, expected: str, got: object, hint: str = "") -> None:
        """Count a bad row and keep what is wrong with the first ones."""
        self.refused += 1
        if len(self.faults) < _TOLD:
            self.faults.append(Fault(f"{self.path} row {line}, {name}", expected, str(got), hint))

    def add(
        self,
        line: int,
        cell: str,
        place: tuple[str, str],
        level: str,
        *,
        time: str = "",
        accuracy: str = "",
        session: str = "",
    ) -> None:
        """Check one row given as texts, and keep it or refuse it.

        ``place`` is latitude and longitude. A time or accuracy that makes no sense becomes
        unknown: the level is as good without.
        """
        if cell not in self.cells and (wrong := id_fault(cell)) is not None:
            self.refuse(line, "cell", *wrong)
            return
        lat_deg, lon_deg, level_dbm = number(place[0]), number(place[1]), number(level)
        for name, text, value in (
            ("lat", place[0], lat_deg), ("lon", place[1], lon_deg), ("level_dbm", level, level_dbm)
        ):  # fmt: skip
            if not math.isfinite(value):
                self.refuse(line, name, "a number", repr(text[:40]) if text else "nothing")
                return
        if (told := place_fault(lat_deg, lon_deg)) is not None:
            self.refuse(line, "lat, lon", *told)
            return
        if not _LEVEL_DBM[0] <= level_dbm <= _LEVEL_DBM[1]:
            expected = f"dBm in {_LEVEL_DBM[0]:g}..{_LEVEL_DBM[1]:g}"
            self.refuse(line, "level_dbm", expected, level[:40], _level_hint(level_dbm))
            return
        time_s, accuracy_m = unix_seconds(time), number(accuracy)
        if time and math.isnan(time_s):
            self.aside["times not understood (levels kept)"] += 1
        self.cell.append(self.cells.setdefault(cell, len(self.cells)))
        self.session.append(self.sessions.setdefault(session, len(self.sessions)))
        self.time_s.append(time_s)
        self.lat_deg.append(lat_deg)
        self.lon_deg.append(lon_deg)
        self.level_dbm.append(level_dbm)
        self.accuracy_m.append(accuracy_m if 0 < accuracy_m < _UNAVAILABLE else math.nan)

    def told(self) -> list[str]:
        """Say how many rows were refused or set aside, and where the first are."""
        notes = []
        if self.refused:
            some = "; ".join(str(fault) for fault in self.faults[:_SHOWN])
            more = "; …" if self.refused > _SHOWN else ""
            notes.append(
                f"{self.path.name}: {self.refused} of {self.read} rows left out: {some}{more}"
            )
        notes += [f"{self.path.name}: {count} {what}" for what, count in self.aside.items()]
        return notes


def number(text: str) -> float:
    """Return a number, or NaN when the text is none.

    Examples
    --------
    >>> number("-71.5"), number("1_0"), number("")
    (-71.5, nan, nan)
    """
    try:
        return float("" if "_" in text else text)
    except ValueError:
        return math.nan


def whole(text: str) -> int | None:
    """Return a whole number ≥ 0 that is no marker of an unavailable value, else None."""
    value = number(text)
    if not (0 <= value < 2**36) or value != int(value) or value == 2**31 - 1:
        return None
    return int(value)


def unix_seconds(text: str) -> float:
    """Return Unix seconds of an ISO 8601 time (UTC unless it says so) or of s, ms or µs; else NaN.

    Examples
    --------
    >>> unix_seconds("1599319703000"), unix_seconds("2020-09-05T15:28:23Z")
    (1599319703.0, 1599319703.0)
    """
    value = number(text)
    if math.isfinite(value):
        scale = 1e6 if value > 1e14 else 1e3 if value > 1e11 else 1.0
        return value / scale if 0 < value / scale < _LATEST_S else math.nan
    try:
        moment = datetime.fromisoformat(text)
        aware = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
        seconds = aware.timestamp()
    except (ValueError, OverflowError):
        return math.nan
    return seconds if 0 < seconds < _LATEST_S else math.nan


def place_fault(lat_deg: float, lon_deg: float) -> tuple[str, str, str] | None:
    """Return (expected, found, likely mistake) when a position is none, else None."""
    got = f"{lat_deg:g}, {lon_deg:g}"
    expected = "degrees in -90..90 and -180..180"
    if abs(lat_deg) > 180 or abs(lon_deg) > 180:
        return expected, got, "metres given for degrees"
    if abs(lat_deg) > 90:
        return expected, got, "latitude and longitude swapped"
    if lat_deg == 0 and lon_deg == 0:
        return "a position", got, "no fix yet"
    return None


def open_text(path: Path) -> TextIO:
    """Open a file as text in which a wrong byte spoils only its own row.

    Raises
    ------
    InputError
        It is missing, empty, a folder, or in UTF-16.
    """
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


def _level_hint(level: float) -> str:
    if abs(level) >= _UNAVAILABLE:
        return "the marker of a level that was not available"
    if 0 <= level <= 97:
        return "RXLEV or ASU given for dBm"
    return ""


FIELDS = (
    "cell", "mcc", "mnc", "lac", "ci", "lat", "lon", "level_dbm", "time", "accuracy_m", "session",
)  # fmt: skip
"""What a column map may name."""
_IDENTITY = ("mcc", "mnc", "lac", "ci")
_REQUIRED = ("lat", "lon", "level_dbm")
_WITHOUT_IDENTITY = "rows of cells without identity"


@dataclass(frozen=True)
class Dialect:
    """Names of the columns of one kind of file.

    Parameters
    ----------
    columns : mapping of str to tuple of str
        Column or columns that hold each of :data:`FIELDS`; of several, the first that is not empty.
    technology : str
        Column with the radio technology, where the level may be an ASU; "" when it is always dBm.
    required : tuple of str
        Fields without which a file is none of the kind.
    """

    columns: Mapping[str, tuple[str, ...]]
    technology: str = ""
    required: tuple[str, ...] = _REQUIRED


PLAIN = Dialect({name: (name,) for name in FIELDS})
"""Columns named as the fields are."""
OPENCELLID = Dialect(
    {
        "mcc": ("mcc",), "mnc": ("mnc",), "lac": ("lac", "tac"), "ci": ("cellid",),
        "lat": ("lat",), "lon": ("lon",), "level_dbm": ("signal",), "time": ("measured_at",),
        "accuracy_m": ("rating",),
    },
    technology="act",
    required=(*_REQUIRED, *_IDENTITY),
)  # fmt: skip
"""The CSV that OpenCellID takes, as uploaders write it; levels in dBm or as ASU."""
TOWER_COLLECTOR = Dialect(
    {
        "mcc": ("mcc",), "mnc": ("mnc",), "lac": ("lac",), "ci": ("cell_id",),
        "lat": ("lat",), "lon": ("lon",), "level_dbm": ("dbm",), "time": ("measured_at",),
        "accuracy_m": ("accuracy",),
    },
    required=(*_REQUIRED, *_IDENTITY),
)  # fmt: skip
"""What Tower Collector exports."""
DIALECTS: Mapping[str, Dialect] = {
    "csv": PLAIN, "opencellid": OPENCELLID, "towercollector": TOWER_COLLECTOR,
}  # fmt: skip
_GSM, _LTE = ("GSM", "GPRS", "EDGE"), ("LTE", "LTE+", "LTE_CA", "NR")


def mapped(columns: Mapping[str, str]) -> Dialect:
    """Return a dialect whose columns have other names; those that are named must be there.

    Parameters
    ----------
    columns : mapping of str to str
        Field (one of :data:`FIELDS`) to the name of its column.
    """
    named = {name: (column,) for name, column in columns.items()}
    return Dialect({**PLAIN.columns, **named}, required=(*_REQUIRED, *columns))


def read_csv(path: Path, dialect: Dialect) -> Rows:
    """Read a file of measurements; bad rows are refused one by one.

    Raises
    ------
    InputError
        The file cannot be read, or its header lacks a column, each with its likely meaning.
    """
    rows = Rows(path)
    lines = _lines(path)
    header_text = next((text for _, text in lines if text is not None and text.strip()), None)
    if header_text is None:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "no text file")
    separator = max(",;\t", key=header_text.count)
    header = [name.strip().lower() for name in _split(header_text, separator)]
    places = _places(path, header, dialect)
    known: dict[tuple[str, ...], str] = {}
    for line, text in lines:
        if text is not None and not text.strip():
            continue
        rows.read += 1
        fields = None if text is None else _split(text, separator)
        if fields is None:
            rows.refuse(line, "line", f"at most {LONGEST_LINE} characters", "more")
            continue
        if len(fields) < len(header) or any(fields[len(header) :]):
            hint = "a line cut off" if len(fields) < len(header) else "a separator in a field"
            rows.refuse(line, "fields", str(len(header)), len(fields), hint)
            continue
        _add(rows, line, _Fields(fields, places, separator != ","), known)
    return rows


def header_of(path: Path) -> tuple[str, ...]:
    """Return the names in the first line of a file, in lower case.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    for _, text in _lines(path):
        if text is not None and text.strip():
            separator = max(",;\t", key=text.count)
            return tuple(name.strip().lower() for name in _split(text, separator))
    return ()


@dataclass(frozen=True, slots=True)
class _Fields:
    """The texts of one line by field."""

    texts: list[str]
    places: Mapping[str, tuple[int, ...]]
    decimal_commas: bool

    def __getitem__(self, name: str) -> str:
        for place in self.places.get(name, ()):
            if text := self.texts[place].strip():
                return text
        return ""

    def numeric(self, name: str) -> str:
        text = self[name]
        return text.replace(",", ".") if self.decimal_commas and "." not in text else text


def _add(rows: Rows, line: int, fields: _Fields, known: dict[tuple[str, ...], str]) -> None:
    given = tuple(map(fields.__getitem__, ("cell", *_IDENTITY)))
    cell = known.get(given)
    if cell is None:
        cell = _identified(rows, line, given)
        if cell is None:
            return
        known[given] = cell
    level = fields.numeric("level_dbm")
    technology = fields["technology"].upper()
    if technology and (dbm := _from_asu(number(level), technology)) is not None:
        rows.aside["levels given as ASU (turned into dBm)"] += 1
        level = repr(dbm)
    rows.add(
        line,
        cell,
        (fields.numeric("lat"), fields.numeric("lon")),
        level,
        time=fields["time"],
        accuracy=fields.numeric("accuracy_m"),
        session=fields["session"],
    )


def _identified(rows: Rows, line: int, given: tuple[str, ...]) -> str | None:
    """Return the cell that a row tells, or refuse the row or set it aside."""
    cell, *texts = given
    mcc, mnc, lac, ci = map(whole, texts)
    if mcc is None or mnc is None or lac is None or ci is None:
        if not cell:
            rows.aside[_WITHOUT_IDENTITY] += 1
        return cell or None
    identity = (mcc, mnc, lac, ci)
    for name, value in zip(_IDENTITY, identity, strict=True):
        if not RANGES[name].holds(value):
            rows.refuse(line, name, RANGES[name].expected, value)
            return None
    cell = cell or "-".join(map(str, identity))
    rows.identities.setdefault(cell, identity)
    return cell


def _from_asu(asu: float, technology: str) -> float | None:
    """Turn an arbitrary strength unit into dBm: 3GPP TS 27.007 +CSQ for GSM, +CESQ for LTE."""
    if technology in _GSM and 0 <= asu <= 31:
        return -113.0 + 2 * asu
    if technology in _LTE and 0 <= asu <= 97:
        return asu - 140.0
    return None


def _lines(path: Path) -> Iterator[tuple[int, str | None]]:
    """Yield line numbers and texts; None for a line too long to be one."""
    with open_text(path) as stream:
        line = 0
        while text := stream.readline(LONGEST_LINE):
            line += 1
            if len(text) < LONGEST_LINE or text.endswith("\n"):
                yield line, text.rstrip("\r\n")
                continue
            while (more := stream.readline(LONGEST_LINE)) and not more.endswith("\n"):
                pass
            yield line, None


def _split(text: str, separator: str) -> list[str]:
    if '"' not in text:
        return text.split(separator)
    try:
        return next(csv.reader([text], delimiter=separator), [])
    except csv.Error:
        return []


def _places(path: Path, header: list[str], dialect: Dialect) -> dict[str, tuple[int, ...]]:
    """Return where each field is in a line, or raise with every column that is not there."""
    faults = Faults()
    where = f"{path} header"
    named = {**dialect.columns, "technology": (dialect.technology,)}
    places = {
        name: tuple(header.index(column.lower()) for column in columns if column.lower() in header)
        for name, columns in named.items()
    }
    for name in dialect.required:
        if not places.get(name):
            columns = " or ".join(named.get(name, (name,)))
            near = difflib.get_close_matches(columns.lower(), header, n=1, cutoff=0.5)
            expected = f"a column {columns}" + (f" for {name}" if columns != name else "")
            faults.add(where, expected, "none", f"{near[0]} meant" if near else "")
    told = set(_IDENTITY) <= set(dialect.required)
    if not (told or places.get("cell") or all(places.get(name) for name in _IDENTITY)):
        faults.add(where, "a column cell, or mcc, mnc, lac and ci", "none", "name the columns")
    for column in {header[place] for some in places.values() for place in some}:
        if header.count(column) > 1:
            faults.add(where, f"one column {column}", f"{header.count(column)}")
    faults.raise_if_any(InputError)
    return places
