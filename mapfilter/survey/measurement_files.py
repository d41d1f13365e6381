"""Files of measured levels: CSV of any columns, of OpenCellID and Tower Collector, and logs.

A bad row is counted and located, and loses nothing else: a quote that is never closed ends with its
line, a wrong byte spoils one field, a line of another length is refused alone.
"""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.cell_rules import RANGES
from mapfilter.survey.measurement_rows import Rows, number, open_text, whole

_LONGEST_LINE = 1 << 16
_WITHOUT_IDENTITY = "rows of cells without identity"
_IDENTITY = ("mcc", "mnc", "lac", "ci")
_REQUIRED = ("lat", "lon", "level_dbm")
FIELDS = ("cell", *_IDENTITY, *_REQUIRED, "time", "accuracy_m", "session")
"""What a column map may name."""


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


def mapped(columns: Mapping[str, str]) -> Dialect:
    """Return the dialect of a map from :data:`FIELDS` to columns; these columns are required."""
    own = {name: (name,) for name in FIELDS}
    named = {name: (column,) for name, column in columns.items()}
    return Dialect({**own, **named}, required=(*_REQUIRED, *columns))


def _upload(lac: tuple[str, ...], ci: str, level: str, accuracy: str, act: str = "") -> Dialect:
    columns = {name: (name,) for name in ("mcc", "mnc", "lat", "lon")}
    columns |= {"ci": (ci,), "level_dbm": (level,), "accuracy_m": (accuracy,)}
    return Dialect({**columns, "lac": lac, "time": ("measured_at",)}, act, (*_REQUIRED, *_IDENTITY))


DIALECTS: Mapping[str, Dialect] = {
    "csv": mapped({}),
    "opencellid": _upload(("lac", "tac"), "cellid", "signal", "rating", "act"),
    "towercollector": _upload(("lac",), "cell_id", "dbm", "accuracy"),
}
"""Columns named as the fields are; uploads to OpenCellID; exports of Tower Collector."""
_GSM, _LTE = ("GSM", "GPRS", "EDGE"), ("LTE", "LTE+", "LTE_CA", "NR")


def read_csv(path: Path, dialect: Dialect) -> Rows:
    """Read a file of measurements; bad rows are refused one by one.

    Raises
    ------
    InputError
        The file cannot be read, or its header lacks a column, each with its likely meaning.
    """
    rows = Rows(path)
    lines = _lines(path)
    separator, header = _header(lines)
    if not header:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "no text file")
    places = _places(path, header, dialect)
    known: dict[tuple[str, ...], str] = {}
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
        _add(rows, line, found, known)
    return rows


def header_of(path: Path) -> list[str]:
    """Return the names in the first line of a file, in lower case."""
    return _header(_lines(path))[1]


def _header(lines: Iterator[tuple[int, str | None]]) -> tuple[str, list[str]]:
    """Return the separator and the names of the first line that is not blank."""
    text = next((text for _, text in lines if text is not None and text.strip()), "")
    separator = max(",;\t", key=text.count)
    return separator, [name.strip().lower() for name in _split(text, separator)] if text else []


def _add(
    rows: Rows, line: int, found: Mapping[str, str], known: dict[tuple[str, ...], str]
) -> None:
    given = tuple(found[name] for name in ("cell", *_IDENTITY))
    cell = known.get(given) or _identified(rows, line, given)
    if cell is None:
        return
    known[given] = cell
    level, technology = found["level_dbm"], found["technology"].upper()
    if technology and (dbm := _from_asu(number(level), technology)) is not None:
        rows.aside["levels given as ASU (turned into dBm)"] += 1
        level = repr(dbm)
    place = found["lat"], found["lon"]
    rest = {"time": found["time"], "accuracy": found["accuracy_m"], "session": found["session"]}
    rows.add(line, cell, place, level, **rest)


def _identified(rows: Rows, line: int, given: tuple[str, ...]) -> str | None:
    """Return the cell of a row, or refuse the row or set it aside."""
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
    return asu - 140.0 if technology in _LTE and 0 <= asu <= 97 else None


def _lines(path: Path) -> Iterator[tuple[int, str | None]]:
    """Yield line numbers and texts; None for a line too long to be one."""
    with open_text(path) as stream:
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
    named = {**dialect.columns, "technology": (dialect.technology,)}
    places = dict.fromkeys(FIELDS, ()) | {
        name: tuple(header.index(column.lower()) for column in columns if column.lower() in header)
        for name, columns in named.items()
    }
    for name in dialect.required:
        if not places.get(name):
            columns = " or ".join(named.get(name, (name,)))
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


_LONGEST_LOG_LINE = 4096
_KEY = re.compile(r'(\w[\w ]*)=\s*("[^"]*"|[^,]*)')
_LEVEL = re.compile(r"^(>?)\s*(-?\d+)\s*dBm$")


def read_antennas_log(path: Path) -> Rows:
    """Read a log of *Antennas*: records of a serving cell, up to six neighbours, and one position.

    A level written with ``>`` is a bound, no level: it is counted and left out.
    """
    rows, line = Rows(path), 0
    time, operator = "", ""
    received: list[tuple[int, dict[str, str]]] = []

    def drop_unplaced() -> None:
        for at, _ in received:
            rows.refuse(
                at, "Best Location", "a position after the cells", "none", "the log cut off"
            )
        received.clear()

    with open_text(path) as stream:
        while text := stream.readline(_LONGEST_LOG_LINE):
            line += 1
            kind = text.split(",", 1)[0].strip()
            values = {key.strip(): value.strip(' "\r\n') for key, value in _KEY.findall(text)}
            if kind == "Record":
                drop_unplaced()
                time, operator = values.get("Time", ""), values.get("Operator", "")
            elif kind in ("ACTIVE GSM", "GSM"):
                rows.read += 1
                received.append((line, values))
            elif kind == "Best Location":
                place = values.get("Lat", ""), values.get("Lon", "")
                for at, cell in received:
                    _add_logged(rows, at, cell, place, _iso(time), operator)
                received.clear()
    drop_unplaced()
    return rows


def _add_logged(
    rows: Rows, line: int, cell: dict[str, str], place: tuple[str, str], time: str, operator: str
) -> None:
    texts = (operator[:3], operator[3:], cell.get("LAC", ""), cell.get("CID", ""))
    mcc, mnc, lac, ci = map(whole, texts)
    signal = cell.get("Signal", "")
    found = _LEVEL.match(signal)
    if mcc is None or mnc is None or lac is None or ci is None:
        rows.aside[_WITHOUT_IDENTITY] += 1
    elif found is None:
        rows.refuse(line, "Signal", "a level such as -67dBm", repr(signal[:40]))
    elif found[1]:
        rows.aside["levels that are only bounds (>)"] += 1
    else:
        name = f"{mcc}-{mnc}-{lac}-{ci}"
        rows.identities.setdefault(name, (mcc, mnc, lac, ci))
        rows.add(line, name, place, found[2], time=time)


def _iso(time: str) -> str:
    """Return a time such as ``2014-09-24 19:21:42:61 GMT+05:30`` in ISO 8601, else as it is."""
    text = re.sub(r":(\d{1,3}) GMT", lambda found: f".{found[1]:0>3} ", time)
    try:
        return datetime.strptime(text, "%Y-%m-%d %H:%M:%S.%f %z").isoformat()
    except ValueError:
        return time
