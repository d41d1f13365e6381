"""Measured levels from CSV files: any with a column map, OpenCellID uploads, Tower Collector.

A bad row is counted and located, and loses nothing else: a quote that is never closed ends with its
line, a wrong byte spoils one field, a line of another length is refused alone.
"""

from __future__ import annotations

import csv
import difflib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.cell_rules import RANGES
from mapfilter.survey.measurement_rows import LONGEST_LINE, Rows, number, open_text, whole

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
