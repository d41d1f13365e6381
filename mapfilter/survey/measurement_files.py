"""CSV files of measured levels: of any columns, of OpenCellID and of Tower Collector.

A bad row is counted and located, and loses nothing else: a quote that is never closed ends with its
line, a wrong byte spoils one field, a line of another length is refused alone.
"""

from __future__ import annotations

import csv
import difflib
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mapfilter._header_units import header_unit
from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.asu import LARGEST_ASU, LOST_SIGN, Signs, is_above_asu
from mapfilter.radio.cell_layouts import ALIASES, OF_CARRIERS
from mapfilter.radio.identities import IDENTITY, technology
from mapfilter.radio.level_quantity import LEVELS_EXPECTED, QUALITY, LevelCounts
from mapfilter.radio.tables import number
from mapfilter.survey.measurement_lines import (
    LONGEST_LINE,
    SEPARATORS,
    cut_end,
    is_windows,
    lines_of,
    without_last,
)
from mapfilter.survey.measurement_rows import FIELDS, REQUIRED, Rows
from mapfilter.survey.measurement_times import with_date

_UNAVAILABLE = 1e9
_DATE = "date"
"""A column of days beside times of day."""
_FIRST_LINES = 100
_FEWEST_NUMBERS = 3
_GSM, _LTE = ("GSM", "GPRS", "EDGE"), ("LTE", "LTE+", "LTE_CA", "NR")
_CODES = {name: (name, *ALIASES[name]) for name in ("arfcn", "bsic")}


class Dialect(NamedTuple):
    """Names of the columns of one kind of file.

    Parameters
    ----------
    columns : mapping of str to tuple of str
        Column or columns that hold each of :data:`~mapfilter.survey.measurement_rows.FIELDS`, and
        the radio technology where the level may be an ASU; of several, the first that is not empty.
    required : tuple of str
        Fields without which a file is none of the kind.
    """

    columns: Mapping[str, tuple[str, ...]]
    required: tuple[str, ...] = REQUIRED


def mapped(columns: Mapping[str, str]) -> Dialect:
    """Return the dialect of a map from fields to columns; these columns are required."""
    own = {name: (name,) for name in FIELDS} | _CODES | {"technology": ("technology",)}
    named = {name: (column,) for name, column in columns.items()}
    return Dialect({**own, **named}, tuple(dict.fromkeys((*REQUIRED, *columns))))


def _upload(**columns: str) -> Dialect:
    names = {name: name for name in ("mcc", "mnc", "lat", "lon")} | {"time": "measured_at"}
    split = {name: tuple(text.split()) for name, text in (names | columns).items()}
    return Dialect(split, (*REQUIRED, *IDENTITY))


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
        arfcn="arfcn",
        bsic="psc",
        technology="net_type",
    ),
}
"""Columns named as the fields are; uploads to OpenCellID; exports of Tower Collector."""


def read_csv(path: Path, dialect: Dialect) -> Rows:
    """Read a file of measurements; bad rows are refused one by one."""
    rows = Rows(path)
    windows = is_windows(path)
    if windows:
        rows.remarks.append("no UTF-8; read as Windows-1252")
    lines = lines_of(path, windows=windows)
    separator, header = _header(lines)
    if not header:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "no text file")
    places, signs = _places(path, header, dialect), _Signs()
    is_dbm = all(header[at].endswith("dbm") for at in places["level_dbm"])
    stating = [at for at, name in enumerate(header) if name in OF_CARRIERS]
    families = {OF_CARRIERS[header[at]] for at in stating}
    dates = [at for at, name in enumerate(header) if name == _DATE and at not in places["time"]]
    usual = families.pop() if len(families) == 1 else None
    cut, last = cut_end(path), list[int]()
    for line, text in without_last(lines, last) if cut else lines:
        if text is not None and not text.strip():
            continue
        rows.read += 1
        if text is None:
            rows.refuse(line, "line", f"at most {LONGEST_LINE} characters", "more")
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
            for name in (*REQUIRED, "accuracy_m"):
                if "." not in found[name]:
                    found[name] = found[name].replace(",", ".")
        if dates:
            found["time"] = with_date(found["time"], fields[dates[0]].strip())
        cell = rows.identify(line, found["cell"], [found[name] for name in IDENTITY])
        if not cell:
            continue
        family = found["technology"].upper()
        states = any(fields[at].strip() for at in stating)
        if kind := technology(family) or (usual if states and not family else None):
            rows.technologies[cell, kind] += 1
        signs.add(line, found["level_dbm"], family)
        dbm = None if is_dbm else _from_asu(found["level_dbm"], family)
        if dbm is not None:
            rows.aside["levels given as ASU (turned into dBm)"] += 1
            found["level_dbm"] = repr(dbm)
        rows.add(line, cell, found)
    rows.finish()
    if last:
        rows.read += 1
        rows.refuse(last[0], "line", "a whole row", f"one {cut}")
    column = "".join(header[at] for at in places["level_dbm"][:1])
    signs.check(f"{path}, column {column}")
    return rows


@dataclass(slots=True)
class _Signs:
    """Levels of a column, and where the first one is that is too large for an ASU."""

    levels: array[float] = field(default_factory=lambda: array("d"))
    first: str = ""

    def add(self, line: int, text: str, family: str) -> None:
        level = number(text)
        if level is None or level >= _UNAVAILABLE or technology(family) == "NR":
            return
        self.levels.append(level)
        if not self.first and is_above_asu(level):
            self.first = f"{text[:20]} in line {line}"

    def check(self, where: str) -> None:
        """Raise InputError where levels are a quality, or have no sign: neither dBm nor ASU."""
        signs, counts, levels = Signs(), LevelCounts(), np.array(self.levels)
        signs.add(levels)
        counts.add(levels)
        if counts.are_qualities:
            raise fail(InputError, where, LEVELS_EXPECTED, counts, QUALITY)
        if signs.lost:
            got = f"{signs.positive} of {signs.levels} positive, {signs.above} of them above "
            got += f"{LARGEST_ASU} (first {self.first})"
            expected = f"dBm below 0, or ASU up to {LARGEST_ASU}"
            raise fail(InputError, where, expected, got, LOST_SIGN)


def header_of(path: Path) -> list[str]:
    """Return the names in the first line of a file, in lower case."""
    return _header(lines_of(path))[1]


def may_hold_measurements(path: Path) -> bool:
    """Return whether one of the first lines has numbers in three fields: position and level.

    So has a drive test whose columns have other names. What cannot be read as text may hold one,
    but an empty file.
    """
    try:
        for _, text in islice(lines_of(path), _FIRST_LINES):
            _, fields = _header(iter([(1, text)]))
            if sum(any(map(str.isdigit, one)) for one in fields) >= _FEWEST_NUMBERS:
                return True
    except InputError:
        return not path.is_file() or path.stat().st_size > 0
    return False


def _header(lines: Iterator[tuple[int, str | None]]) -> tuple[str, list[str]]:
    """Return the separator and the names of the first line that is not blank."""
    text = next((text for _, text in lines if text is not None and text.strip()), "")
    separator = max(SEPARATORS, key=text.count)
    return separator, [name.strip().lower() for name in _split(text, separator)] if text else []


def _from_asu(text: str, technology: str) -> float | None:
    """Turn an arbitrary strength unit into dBm: 3GPP TS 27.007 +CSQ for GSM, +CESQ for LTE."""
    asu = number(text) if technology else None
    if asu is None:
        return None
    if technology in _GSM and 0 <= asu <= 31:
        return -113.0 + 2 * asu
    return asu - 140.0 if technology in _LTE and 0 <= asu <= 97 else None


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
            alike = [column for column in header if column[:1] == columns[:1].lower()]
            near = difflib.get_close_matches(columns.lower(), alike, n=1, cutoff=0.5)
            expected = f"a column {columns}" + (f" for {name}" if columns != name else "")
            faults.add(where, expected, "none", f"{near[0]} meant" if near else "")
    for name, some in places.items():
        for column in (header[place] for place in some):
            unit = header_unit(name, column)
            if unit is not None and unit.factor != 1.0:
                hint = QUALITY if name == "level_dbm" and unit.written == "db" else ""
                own = "dBm" if name == "level_dbm" else "metres" if name == "accuracy_m" else name
                faults.add(where, f"{own} for {name}", f"{unit.written} in {column}", hint)
    checked = set(IDENTITY) <= set(dialect.required)
    if not (checked or places["cell"] or all(places[name] for name in IDENTITY)):
        faults.add(where, "a column cell, or mcc, mnc, lac and ci", "none", "name the columns")
    for column in {header[place] for some in places.values() for place in some}:
        if header.count(column) > 1:
            faults.add(where, f"one column {column}", f"{header.count(column)}")
    faults.raise_if_any(InputError)
    return places
