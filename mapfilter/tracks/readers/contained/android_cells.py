"""Cells as Android writes them as texts (``CellInfo.toString()``), in a column or in logcat."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence

from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.tables import as_table
from mapfilter.tracks.readers.texts.separated_values import likely_separator
from mapfilter.tracks.readers.texts.text import Text

_MARK = re.compile(rb"Cell(?:Identity|SignalStrength)(?:Lte|Nr|Gsm|Wcdma|Tdscdma)\s?[:{=]")
"""Not the name of a column alone."""
_CELL = re.compile(r"CellIdentity(Lte|Nr|Gsm|Wcdma|Tdscdma)\b")
_REGISTERED = re.compile(r"mRegistered\s?=\s?(YES|NO|true|false)", re.IGNORECASE)
_VALUE = re.compile(r"\b(\w{1,30})\s?=\s?(-?\d{1,19}|0x[0-9a-fA-F]{1,8})\b")
_LEVEL = re.compile(r"CellSignalStrength(Lte|Nr|Gsm|Wcdma|Tdscdma)\b(?=:|\s?\{)")
_PRIMARY = re.compile(r"primary=CellSignalStrength(\w{1,8})")
_UNAVAILABLE = ("2147483647", "9223372036854775807", "-2147483648")
_TECHNOLOGIES = {"Lte": "LTE", "Nr": "NR", "Gsm": "GSM", "Wcdma": "UMTS", "Tdscdma": "UMTS"}
_FIELDS = {
    "mcc": ("mMcc",),
    "mnc": ("mMnc",),
    "lac": ("mTac", "mLac"),
    "ci": ("mCi", "mNci", "mCid"),
    "bsic": ("mPci", "mPsc", "mBsic"),
    "arfcn": ("mEarfcn", "mNrArfcn", "mNrarfcn", "mUarfcn", "mArfcn"),
    "level_dbm": (),
    "timing_advance": ("ta", "mTa", "timingAdvance"),
}
"""Columns, and the names of their values in Android's texts of any version."""
_LEVELS = {"LTE": ("rsrp",), "NR": ("ssRsrp",), "GSM": ("rssi",), "UMTS": ("rscp", "ss")}
"""Levels in dBm; of UMTS the second one was an ASU in old versions, which is not negative."""
_COLUMNS = ("role", "technology", *_FIELDS)
_YEARLESS = re.compile(r"\d\d-\d\d \d\d:\d\d:\d\d")
_STAMP = re.compile(
    r"(?:(\d{4}-\d\d-\d\d)[ T](\d\d:\d\d:\d\d(?:\.\d{1,9})?)(?:\s([+-]\d{4}))?"
    r"|\s{0,20}(\d{9,10}\.\d{1,9}))\s"
)
"""Times of logcat: with ``-v year``, also with zone, or ``-v epoch``."""
_WITH_YEAR = (
    "a logcat without years; log with -v epoch (or year), or write the year before each date"
)


def has_android_cells(text: Text) -> bool:
    """Return whether a text holds cells, or their levels, as Android writes them."""
    return is_of_cells(text.data[: 1 << 18])


def android_table(text: Text) -> Text:
    """Return the cells of a log as a text of CSV, a row for each.

    Other columns of a CSV are repeated in the rows of each cell.

    Raises
    ------
    InputError
        Lines of a logcat have no time with a year, or a field is too long.
    """
    separator = likely_separator(text.first_line)
    if not _is_of_cells(text.first_line):
        try:
            header = next(csv.reader([text.first_line], delimiter=separator), [])
            if len(header) > 1:
                return _of_columns(text, header, separator)
        except csv.Error as error:
            hint = "cut off, or a quotation mark without its second one"
            raise fail(InputError, str(text.path), "rows of CSV", error, hint) from error
    lines = text.data.decode("utf-8", "replace").splitlines()
    rows = [row for line in lines for row in _of_line(line)]
    if not rows:
        first = next((line for line in lines if _is_of_cells(line)), "")
        hint = "write a time before each line, as logcat -v epoch does"
        if _YEARLESS.match(first.strip()):
            hint = _WITH_YEAR
        got = repr(first[:30])
        raise fail(InputError, str(text.path), "lines that begin with date and time", got, hint)
    return as_table(text, ("time", *_COLUMNS), rows, "cells of Android")


def _of_line(line: str) -> Iterator[list[str]]:
    stamp = _STAMP.match(line)
    if stamp is None:
        return
    date, clock, zone, epoch = stamp.groups("")
    time = epoch or f"{date} {clock}{zone}"
    for cell in _cells(line):
        yield [time, *cell]


def _of_columns(text: Text, header: Sequence[str], separator: str) -> Text:
    """Return a CSV with a column of cells as one with a row for each cell."""
    lines = (line + "\n" for line in text.data.decode("utf-8", "replace").splitlines())
    table = list(csv.reader((line for line in lines if line.strip()), delimiter=separator))[1:]
    width = len(header)
    of_cells = {at for row in table for at, value in enumerate(row) if _is_of_cells(value)}
    others = [at for at in range(width) if at not in of_cells]

    def rows() -> Iterator[list[str]]:
        for row in table:
            told = " ".join(value for value in row if _is_of_cells(value))
            kept = [row[at] if at < len(row) else "" for at in others]
            for cell in list(_cells(told)) or [_level_alone(told)]:
                yield [*kept, *cell]

    names = {header[at].strip().lower() for at in others}
    # Of two columns of a name neither would be read.
    own = [name if name not in names else f"android {name}" for name in _COLUMNS]
    return as_table(text, (*(header[at] for at in others), *own), rows(), "cells of Android")


def is_of_cells(data: bytes) -> bool:
    """Return whether bytes hold a cell, or its level."""
    return _MARK.search(data) is not None


def _is_of_cells(text: str) -> bool:
    # Most texts are none, and have no such word.
    return "Cell" in text and is_of_cells(text.encode())


def _cells(text: str) -> Iterator[list[str]]:
    """Yield the columns of each cell in a text, "" where a value is not available."""
    found = list(_CELL.finditer(text))
    before = 0
    for at, cell in enumerate(found):
        end = found[at + 1].start() if at + 1 < len(found) else len(text)
        registered = _REGISTERED.findall(text[before : cell.start()])
        before = cell.end()
        role = ""
        if registered:
            role = "serving" if registered[-1].lower() in ("yes", "true") else "neighbour"
        technology = _TECHNOLOGIES[cell[1]]
        yield [role, technology, *_values(text[cell.start() : end], technology)]


def _level_alone(text: str) -> list[str]:
    """Return the columns of a level without a cell: of the primary one, else of the first."""
    found = list(_LEVEL.finditer(text))
    primary = _PRIMARY.search(text)
    best = [""] * len(_COLUMNS)
    for at, level in enumerate(found):
        end = found[at + 1].start() if at + 1 < len(found) else len(text)
        technology = _TECHNOLOGIES[level[1]]
        values = _values(text[level.start() : end], technology)
        known = values[list(_FIELDS).index("level_dbm")]
        is_primary = primary is not None and primary[1] == level[1]
        if known and (is_primary or not best[1]):
            best = ["", technology, *values]
    return best


def _values(text: str, technology: str) -> list[str]:
    values = dict(_VALUE.findall(text))
    columns = []
    for column, names in _FIELDS.items():
        of = _LEVELS[technology] if column == "level_dbm" else names
        known = (values[name] for name in of if values.get(name, "") not in ("", *_UNAVAILABLE))
        columns.append(next((one for one in known if column != "level_dbm" or one[0] == "-"), ""))
    return columns
