"""Tables of cells: reading them, and the columns of other layouts that are fields of a plan."""

from __future__ import annotations

import csv
import difflib
import io
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from mapfilter._io import read_input
from mapfilter.errors import Faults, InputError, fail

_LARGEST_BYTES = 1 << 26
_MOST_FIELDS = 5_000_000
_SEPARATORS = (",", ";", "\t")


@dataclass(frozen=True, slots=True)
class Table:
    """The header and the rows of a file, each row with its line; blank lines are left out."""

    path: Path
    separator: str
    header: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]

    def number(self, text: str) -> float | None:
        """Return a finite number or None; decimal commas are read where they separate nothing."""
        return number(text, decimal_comma=self.separator != ",")

    def whole_rows(self, columns: int, faults: Faults) -> Iterator[tuple[int, list[str]]]:
        """Yield the rows that have so many fields; the others are faults."""
        for line, texts in self.rows:
            if len(texts) == columns:
                yield line, texts
                continue
            hint = "a decimal comma, or an unquoted separator"
            if len(texts) < columns:
                hint = "the line is cut off"
            faults.add(f"{self.path} row {line}, fields", f"{columns}", f"{len(texts)}", hint)


def number(text: str, *, decimal_comma: bool = False) -> float | None:
    """Return a text as a finite number, or None.

    Examples
    --------
    >>> number("60.5"), number("60,5"), number("60,5", decimal_comma=True), number("1_0")
    (60.5, None, 60.5, None)
    """
    if decimal_comma and text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
    try:
        value = float("?" if "_" in text else text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def read_table(path: Path, what: str) -> Table:
    """Read a table in UTF-8 whose first line names its columns; commas, semicolons or tabs.

    Parameters
    ----------
    what : str
        For messages, such as ``"a cell plan"``.

    Raises
    ------
    InputError
        The file is missing, empty, too large or no such text.
    """
    try:
        text = read_input(path, _LARGEST_BYTES, what).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        got = f"other bytes at offset {error.start}"
        hint = "saved in a Windows code page, or no text file"
        raise fail(InputError, str(path), "text in UTF-8", got, hint) from error
    if "\0" in text:
        raise fail(InputError, str(path), "text in UTF-8", "NUL characters", "no text file")
    head = next((line for line in text.splitlines() if line.strip()), "")
    separator = max(_SEPARATORS, key=head.count)
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=separator)
    lines: list[tuple[int, list[str]]] = []
    fields = 0
    try:
        for row in reader:
            if any(field.strip() for field in row):
                lines.append((reader.line_num, row))
                fields += len(row)
                if fields > _MOST_FIELDS:
                    got = f"more in the first {reader.line_num} lines"
                    raise fail(InputError, str(path), f"{what} of at most 5e6 fields", got)
    except csv.Error as error:
        raise fail(InputError, f"{path} row {reader.line_num}", "CSV", error) from error
    if not lines:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "an empty file")
    header = tuple(name.strip() for name in lines[0][1])
    return Table(path, separator, header, tuple(lines[1:]))


Layout = Literal["plan", "atoll", "opencellid"]

Columns = Mapping[str, tuple[str, ...]]
"""By field, the names that its column may have; the first that is there counts."""

COLUMNS = (
    *("cell", "site", "lat", "lon", "height_m", "azimuth_deg", "downtilt_deg"),
    *("mechanical_downtilt_deg", "antenna", "beamwidth_deg", "max_attenuation_db"),
    *("vertical_beamwidth_deg", "side_lobe_db", "eirp_dbm", "frequency_mhz", "indoor"),
    *("penetration_loss_db", "mcc", "mnc", "lac", "ci", "arfcn", "bsic"),
)
"""Columns of a file that mapfilter writes, in order."""
ATOLL: Columns = {
    "cell": ("TX_ID", "TX_NAME"),
    "site": ("SITE_NAME", "SITE"),
    "lat": ("LATITUDE",),
    "lon": ("LONGITUDE",),
    "east": ("X",),
    "north": ("Y",),
    "height_m": ("HEIGHT",),
    "azimuth_deg": ("AZIMUT", "AZIMUTH"),
    "downtilt_deg": ("ELECTRICAL_TILT",),
    "mechanical_downtilt_deg": ("TILT", "MECHANICAL_TILT"),
    "antenna": ("ANTENNA_NAME",),
    "eirp_dbm": ("EIRP",),
    "frequency_mhz": ("FREQUENCY",),
    "mcc": ("MCC",),
    "mnc": ("MNC",),
    "lac": ("LAC",),
    "ci": ("CELL_IDENTITY", "CI"),
    "arfcn": ("CONTROL_CHANNEL", "BCCH"),
    "bsic": ("BSIC",),
}
OPENCELLID: Columns = {
    "lat": ("lat",),
    "lon": ("lon",),
    "mcc": ("mcc",),
    "mnc": ("net", "mnc"),
    "lac": ("area", "lac"),
    "ci": ("cell", "cellid"),
}
OPENCELLID_HEADER = (
    *("radio", "mcc", "net", "area", "cell", "unit", "lon", "lat", "range", "samples"),
    *("changeable", "created", "updated", "averageSignal"),
)
"""Of the downloads of OpenCellID and of the Mozilla Location Service; the former leave it out."""
_OWN: Columns = {name: (name,) for name in (*COLUMNS, "east", "north", "crs")}
LAYOUTS: Mapping[Layout, Columns] = {
    "plan": _OWN,
    "atoll": {name: (*ATOLL.get(name, ()), name) for name in _OWN},
    "opencellid": OPENCELLID,
}

_RADIOS = {"GSM", "UMTS", "LTE", "CDMA", "NR"}
_IDENTITY = ("mcc", "mnc", "lac", "ci")


@dataclass(frozen=True, slots=True)
class Arranged:
    """A table with the fields of a cell plan as columns.

    ``shown`` names fields in messages, with the file's own column; ``notes`` counts the values that
    were filled in; ``decimal_comma`` allows commas in numbers.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]
    shown: Mapping[str, str]
    notes: tuple[str, ...]
    decimal_comma: bool


def arrange(
    table: Table,
    layout: Layout,
    columns: Mapping[str, str],
    defaults: Mapping[str, float],
    faults: Faults,
) -> Arranged:
    """Pick the columns of a cell plan from a list of another layout.

    Parameters
    ----------
    layout : {"plan", "atoll", "opencellid"}
        Names the columns that ``columns`` does not.
    columns : mapping of str to str
        Column of the file, by field.
    defaults : mapping of str to float
        For fields without a column, or empty ones.
    faults : Faults
        Rows of another length are added, and left out.
    """
    header = table.header
    if layout == "opencellid" and header and header[0].upper() in _RADIOS:
        table = replace(table, rows=((1, list(header)), *table.rows))
        header = OPENCELLID_HEADER
    picked = _pick(table, header, layout, columns)
    fields = [*picked, *(name for name in defaults if name not in picked)]
    composed = "cell" not in picked and all(name in picked for name in _IDENTITY)
    filled: Counter[str] = Counter()
    found = []
    for line, texts in table.whole_rows(len(header), faults):
        values = {name: texts[at].strip() for name, at in picked.items()}
        for name, default in defaults.items():
            if not values.get(name):
                values[name] = repr(default)
                filled[name] += 1
        if composed:
            values["cell"] = "-".join(values[name] for name in _IDENTITY)
        found.append((line, list(values.values())))
    notes = tuple(
        f"{name} = {defaults[name]:g} for {count} of {len(found)} cells without one"
        for name, count in sorted(filled.items())
    )
    shown = {name: f"{header[at]} ({name})" for name, at in picked.items() if header[at] != name}
    names = (*fields, "cell") if composed else tuple(fields)
    return Arranged(names, tuple(found), shown, notes, table.separator != ",")


def _pick(
    table: Table, header: tuple[str, ...], layout: Layout, columns: Mapping[str, str]
) -> dict[str, int]:
    """Return the place of each field's column."""
    faults = Faults()
    places = {name: at for at, name in reversed(list(enumerate(header)))}
    folded = {name.casefold(): at for name, at in places.items()}
    picked = {}
    for field, name in columns.items():
        if name in places:
            picked[field] = places[name]
        else:
            near = difflib.get_close_matches(name, places, n=1, cutoff=0.5)
            hint = f"{near[0]} meant" if near else ""
            faults.add(f"{table.path} header", f"a column {name} ({field})", "none", hint)
    faults.raise_if_any(InputError)
    for field, names in LAYOUTS[layout].items():
        at = next((folded[name.casefold()] for name in names if name.casefold() in folded), None)
        if at is not None:
            picked.setdefault(field, at)
    if {"lat", "lon", "east", "north"} <= picked.keys():
        surplus = ("lat", "lon") if {"east", "north"} & columns.keys() else ("east", "north")
        picked = {field: at for field, at in picked.items() if field not in surplus}
    return picked
