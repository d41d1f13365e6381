"""Columns of a plain CSV by field: found by name or by a map, in the units of the fields."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mapfilter._header_units import HeaderUnit, header_unit
from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError
from mapfilter.radio.transmitter_lists import CELLS_OF_NODE
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.plain.fields import FIELDS, check_fields
from mapfilter.tracks.readers.plain.headers import stated_fields
from mapfilter.tracks.readers.recorded.identities import available, parse_identities
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.kept_rows import only
from mapfilter.tracks.readers.texts.numbers import MISSING

_AZIMUTHS = ("azimuth", "compass", "compass_azimuth")
_DIRECTIONS = (
    *("compass_deg", "heading_rad", "turn_rad", "turn_deg"),
    *("yaw_rate_radps", "yaw_rate_degps"),
)
SIGNALS = ("signal", "signal_strength", "signal strength", "signalstrength", "strength")
"""Columns that may hold levels, by their values, beside those of :data:`NAMED_CELLS`."""
NAMED_CELLS = ("ci", "cell", "cgi")
_USUAL_DBM, _MOSTLY = (-150.0, -20.0), 0.9
_OF_CELLS = ("cell_id", "cellid")
_DECIMAL = re.compile(r"-?[0-9]{1,20}(\.0*)?|0x[0-9a-f]{1,9}", re.ASCII | re.IGNORECASE)
_HEXADECIMAL = re.compile(r"[0-9a-f]{4,9}", re.ASCII | re.IGNORECASE)
_OF_NODE = re.compile(r"(?:\d|[1-9]\d|1\d\d|2[0-4]\d|25[0-5])(?:\.0*)?", re.ASCII)
_CELLS = ("cell", "cgi", "ci", "level_dbm", "bars")
_OF_TECHNOLOGIES: Mapping[str, tuple[str, ...]] = {
    "lac": ("lac", "tac"),
    "ci": ("ci", "cid", "eci", "nci"),
    "bsic": ("bsic", "psc", "pci"),
    "arfcn": FIELDS["arfcn"],
    "level_dbm": ("rsrp", "rscp", "ss_rsrp", "ssrsrp"),
}
"""Columns of one field that each hold the cells of some technologies."""


@dataclass(frozen=True)
class Mapped:
    """Columns by field.

    Parameters
    ----------
    rows : Columns
    own : mapping of str to str
        Columns of fields by a user's map; other fields have columns of their usual names.
    stated : mapping of str to str
        Columns of other fields, whose headers state quantity and unit.
    beside : tuple of str
        Columns that are used with those of fields.
    date : str
        That of the days of the times, which are joined with it; "" for none.
    """

    rows: Columns
    own: Mapping[str, str]
    stated: Mapping[str, str]
    beside: tuple[str, ...] = ()
    date: str = ""

    def names(self, field: str) -> tuple[str, ...]:
        """Return the names of columns that may hold a field."""
        if field in self.own:
            return (self.own[field].lower(),)
        if field in self.stated:
            return (self.stated[field],)
        # A column that a user names for one field is no other one's.
        taken = {column.lower() for column in (*self.own.values(), *self.stated.values())}
        return tuple(name for name in FIELDS[field] if name not in taken)

    @property
    def taken(self) -> frozenset[str]:
        """The columns that hold fields."""
        found = (self.rows.find(*self.names(field)) for field in FIELDS)
        return frozenset(name for name in found if name is not None)

    def has(self, *fields: str) -> bool:
        """Return whether there are columns of all these fields."""
        return all(self.rows.find(*self.names(field)) is not None for field in fields)

    def holds(self, *fields: str) -> bool:
        """Return whether there are numbers in the columns of all these fields.

        Columns of logs with fixed ones may be empty.
        """
        return self.has(*fields) and all(
            bool(np.isfinite(self.rows.number(*self.names(field))).any()) for field in fields
        )

    def prefers(self, field: str, other: str) -> bool:
        """Return whether a field is read before another of the same quantity: if it holds some."""
        return self.has(field) and (not self.has(other) or self.holds(field))

    def number(self, field: str) -> Floats:
        """Return a field's numbers, NaN where missing; by the unit in the column's name."""
        values = self.rows.number(*self.names(field))
        unit, column = self.unit(field), self.rows.find(*self.names(field))
        factor = 1.0 if unit is None else unit.factor
        if factor == 1.0 and field not in self.stated:
            return values
        if unit is None:
            self.rows.reading.note(f"{field}: column {column}")
            return values
        note = f"{field}: {unit.unit} by the name of its column ({column})"
        note += ", converted" if factor != 1.0 else ""
        if field == "heading_rad":
            note += "; counter-clockwise from grid east (a compass is compass_deg)"
        self.rows.reading.note(note)
        return values * factor

    def unit(self, field: str) -> HeaderUnit | None:
        """Return the unit that the name of a field's column states."""
        column = self.rows.find(*self.names(field))
        return None if column is None else header_unit(field, column)

    def radians(self, name: str, per: str = "") -> Floats:
        """Return a field that may be in degrees as radians."""
        if self.prefers(f"{name}_deg{per}", f"{name}_rad{per}"):
            return np.radians(self.number(f"{name}_deg{per}"))
        return self.number(f"{name}_rad{per}")

    def whole(self, field: str) -> Floats:
        """Return a field's whole numbers, NaN where missing in the columns of all technologies."""
        values = np.full(len(self.rows), np.nan)
        for name in self.columns(field):
            values = np.where(np.isnan(values), available(*self.rows.whole(name)), values)
        return values

    def columns(self, field: str) -> list[str]:
        """Return the column of a field, and those of it for cells of other technologies."""
        there = [name for name in self.names(field) if self.rows.has(name)]
        own = _OF_TECHNOLOGIES.get(field, ())
        return there[:1] + [name for name in there[1:] if name in own]

    def texts(self, field: str) -> np.ndarray:
        """Return a field's texts, "" where missing."""
        return self.rows.texts(*self.names(field))


def add_rows(
    reading: Reading,
    table: str,
    columns: Mapping[str, np.ndarray],
    rows: Columns,
    there: np.ndarray,
) -> None:
    """Add the rows of a table that hold something of it."""
    if there.any():
        reading.add(table, *only(columns, rows.line, there))


def mapped_columns(rows: Columns, reading: Reading, options: ReadOptions) -> Mapped:
    """Return the columns of a file, with the part of a user's map that is of it.

    Raises
    ------
    InputError
        A field or column that does not exist or is there twice, a unit of another quantity in a
        column's name, no column of times.
    """
    elsewhere = {
        field
        for field, column in options.columns.items()
        if options.shared and field in FIELDS and column.lower() not in rows.names
    }
    own = {field: name for field, name in options.columns.items() if field not in elsewhere}
    mapped, faults = Mapped(rows, own, _stated(rows, own)), Faults()
    where, present = f"{reading.path} header", f"{', '.join(rows.names)[:300]}"
    check_fields(own, faults)
    for field, column in own.items():
        if field not in FIELDS:
            continue
        if column.lower() not in rows.names:
            faults.add(where, f"a column {column} for {field}", present)
        elif rows.names.count(column.lower()) > 1:
            faults.add(where, f"one column {column}", "several")
    for field in FIELDS:
        unit = mapped.unit(field)
        if unit is not None and not unit.unit:
            hint = "another quantity, or a name to be written without brackets"
            got = f"{unit.written} in {rows.find(*mapped.names(field))}"
            faults.add(where, f"{unit.known} for {field}", got, hint)
    if not mapped.has("time") and "time" not in own:
        hint = "--column time=COLUMN"
        faults.add(where, "a column of times", present, hint)
    faults.raise_if_any(InputError)
    mapped = _with_sectors(_with_signals(_with_azimuths(mapped, reading), reading), reading)
    return _with_names(mapped, reading)


def _with_azimuths(mapped: Mapped, reading: Reading) -> Mapped:
    """Return columns with azimuths without a unit as those of a compass, where they are degrees.

    Beside steps without another direction they tell which way these went; an azimuth is clockwise
    from north by its meaning, as a heading need not be. Beside cells it may be that of an antenna.
    """
    name = mapped.rows.find(*_AZIMUTHS)
    walked = mapped.has("steps") or mapped.has("step_m")
    others = any(mapped.has(field) for field in (*_DIRECTIONS, *_CELLS))
    if name is None or not walked or others or mapped.rows.names.count(name) > 1:
        return mapped
    if name in {column.lower() for column in mapped.own.values()}:
        return mapped
    azimuth = mapped.rows.number(name)
    known = azimuth[np.isfinite(azimuth)]
    in_degrees = known.size and known.min() >= -180 and 2 * np.pi < known.max() <= 360
    if not (in_degrees or reading.columns.get("compass_deg") == name):
        return mapped
    reading.note(f"{name}: taken for degrees clockwise from north, by its values")
    return replace(mapped, stated={**mapped.stated, "compass_deg": name})


def _with_signals(mapped: Mapped, reading: Reading) -> Mapped:
    """Return columns with signals without a unit as levels beside cells, where they look like dBm.

    By their values they may also be bars, ASU, or per cent.
    """
    name = mapped.rows.find(*SIGNALS)
    if name is None or mapped.has("level_dbm") or not any(map(mapped.has, NAMED_CELLS)):
        return mapped
    if name in {column.lower() for column in mapped.own.values()}:
        return mapped
    level = mapped.rows.number(name)
    known = level[np.isfinite(level)]
    low, high = _USUAL_DBM
    in_dbm = known.size and np.mean((known >= low) & (known <= high)) > _MOSTLY
    if not (in_dbm or reading.columns.get("level_dbm") == name):
        return mapped
    reading.note(f"{name}: taken for levels in dBm, by its values")
    return replace(mapped, stated={**mapped.stated, "level_dbm": name})


def _with_sectors(mapped: Mapped, reading: Reading) -> Mapped:
    """Return columns with small numbers of cells beside those of nodes as cells of these.

    Beside whole identities they are what these end in.
    """
    name = "cell"
    owned = name in {column.lower() for column in mapped.own.values()}
    beside = mapped.has("enodeb") or mapped.has("ci")
    if mapped.rows.names.count(name) != 1 or owned or not beside or mapped.has("sector"):
        return mapped
    texts = mapped.rows.texts(name)
    known = np.unique(texts[~mapped.rows.flags(name, true=MISSING)])
    small = known.size and all(_OF_NODE.fullmatch(str(text)) for text in known)
    if small and mapped.has("ci"):
        whole, (number, there) = mapped.whole("ci"), mapped.rows.whole(name)
        known_both = there & (whole >= CELLS_OF_NODE)
        same = np.mod(whole[known_both], CELLS_OF_NODE) == number[known_both]
        small = same.size and same.mean() > _MOSTLY
    if not (small or reading.columns.get("sector") == name):
        return mapped
    reading.note(f"{name}: taken for the numbers of cells within their nodes")
    return replace(mapped, stated={**mapped.stated, "sector": name})


def _with_names(mapped: Mapped, reading: Reading) -> Mapped:
    """Return columns with ids of cells as whole identities or a plan's names, if no numbers."""
    name = mapped.rows.find(*_OF_CELLS)
    owned = name in {column.lower() for column in mapped.own.values()}
    if name is None or owned or any(map(mapped.has, ("cell", "cgi"))):
        return mapped
    # Later parts of a large file are read as the first one.
    before = [field for field in ("cgi", "cell") if reading.columns.get(field) == name]
    field = before[0] if before else _names_in(mapped, name)
    if not field:
        return mapped
    meaning = "identities, as 262-01-1234-5678"
    if field == "cell":
        meaning = "the plan's names of cells, as they are no numbers"
    reading.note(f"{name}: taken for {meaning}")
    return replace(mapped, stated={**mapped.stated, field: name})


def _names_in(mapped: Mapped, name: str) -> str:
    """Return the field of most texts of a column: whole identities, a plan's names, "" of numbers.

    Hexadecimal ones have four digits or more, and the network's numbers beside them: A1 and C101
    are names else.
    """
    words = {word.strip() for word in set(mapped.rows.texts(name))} - {""}
    kinds = [_DECIMAL, _HEXADECIMAL] if any(map(mapped.has, ("lac", "mcc", "mnc"))) else [_DECIMAL]
    numbers = sum(any(kind.fullmatch(word) for kind in kinds) for word in words)
    if len(words) <= 2 * numbers:
        return ""
    whole = np.isfinite(parse_identities(np.array(sorted(words), dtype=object))["ci"])
    return "cgi" if whole.mean() > _MOSTLY else "cell"


def _stated(rows: Columns, own: Mapping[str, str]) -> dict[str, str]:
    """Return columns whose headers state quantity and unit, of fields without another column."""
    usual = {field: name for field, some in FIELDS.items() if (name := rows.find(*some))}
    columns = [*usual.values(), *(name.lower() for name in own.values())]
    return stated_fields(rows.names, {*usual, *own}, columns)
