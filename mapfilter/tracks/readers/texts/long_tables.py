"""Tables with a row for each value: a time, what was measured, and one value or three axes."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mapfilter._header_units import header_unit, quantity_of
from mapfilter._types import Ints
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail, listed
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain.fields import FIELDS, usual_fields
from mapfilter.tracks.readers.plain.headers import likely_fields, stated_fields
from mapfilter.tracks.readers.plain_csv import has_content, read_columns
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text
from mapfilter.tracks.readers.unknown_formats import other_names

_SECONDS = "seconds"
_TIMES = (*FIELDS["time"], _SECONDS, "time_ms", "time_ns", "timestamp_ms", "timestamp_ns")
_KINDS = (
    *("pid", "sensor", "sensor_name", "sensor name", "sensor_type", "sensor type", "sensortype"),
    *("signal", "signal_name", "signal name", "name", "parameter", "variable", "measurement"),
    *("metric", "channel", "field", "type"),
)
_VALUES, _UNITS = ("value", "values", "val"), ("units", "unit")
_AXIS = re.compile(r"(?:(?:values?|val|v|axis|data)[_ \[]?)?([xyzw0-3])\]?")
_NOTHING = re.compile(r"-?0{0,3}(?:[.,]0{1,18})?|nan|n/?a|none|null", re.ASCII | re.IGNORECASE)
_AXES = {"0": "x", "1": "y", "2": "z", "3": "w"}
_PREFIX = re.compile(r"android\.sensor\.|sensor_type_|type_")
_SENSORS = {"accelerometer": "accelerometer", "gyroscope": "gyroscope", "magnet": "magnetometer"}
_OTHERS = ("uncal", "linear", "game", "geomagnetic")
"""Parts of the names of sensors, and of those that measure something else."""
_NUMBERED = {"1": "accelerometer", "2": "magnetometer", "4": "gyroscope", "6": "pressure"}
"""Sensors by Android's numbers of their types."""
_OF_CELLS = {
    *("cell", "cgi", "mcc", "mnc", "lac", "ci", "enodeb", "sector"),
    *("arfcn", "bsic", "role", "technology"),
}
_MOST_NAMES, _HEAD_ROWS = 1000, 400


@dataclass(frozen=True)
class _Layout:
    """Columns of such a table: of times, of names, and by axis ("" for a single one) of values."""

    time: str
    kind: str
    values: dict[str, str]
    unit: str
    beside: tuple[str, ...]


def _layout(names: Sequence[str]) -> _Layout | None:
    """Return the columns of a table with a row for each value; None for another table."""
    time = next((name for name in _TIMES if name in names), "")
    time = time or stated_fields(names, (), ()).get("time", "")
    kind = next((name for name in _KINDS if name in names), "")
    single = next((name for name in _VALUES if name in names), "")
    values = {"": single}
    if not single:
        axes = ((found[1], name) for name in names if (found := _AXIS.fullmatch(name)))
        values = {_AXES.get(axis, axis): name for axis, name in axes}
    if not (time and kind) or not (single or values.keys() >= {"x", "y", "z"}):
        return None
    unit = next((name for name in _UNITS if name in names), "")
    used = {time, kind, unit, *values.values()}
    beside = tuple(name for name in names if name and name not in used and names.count(name) == 1)
    return _Layout(time, kind, values, unit, beside)


def _matches(text: Text) -> bool:
    """Return whether a file is such a table: by its names, where its columns are others, too."""
    separator = likely_separator(text.first_line)
    names = header_names(text.first_line, separator)
    layout = _layout(names)
    if layout is None:
        return False
    if not has_content(names):
        return True
    lines = (line for line in text.head[:_HEAD_ROWS] if line.strip())
    at = names.index(layout.kind)
    rows = [row for line in lines for row in csv.reader([line], delimiter=separator)][1:]
    kinds = {row[at].strip().lower() for row in rows if len(row) > at}
    ends = [f"_{axis}" if axis else "" for axis in layout.values]
    return has_content(["time", *(f"{kind}{end}" for kind in kinds for end in ends)])


def has_columns_of(text: Text, named: Collection[str]) -> bool:
    """Return whether some columns are those of names or of values in such a table."""
    layout = _layout(header_names(text.first_line, likely_separator(text.first_line)))
    if layout is None:
        return False
    return any(name.lower() in (layout.kind, *layout.values.values()) for name in named)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "CSV"
    rows = header_columns(text.data, reading, text.line)
    layout = _layout(rows.names)
    if layout is None:
        expected = "columns of a time, a name, and a value or three axes"
        raise fail(InputError, f"{reading.path} header", expected, listed(rows.names))
    own = {name.lower() for name in options.columns.values()}
    if not len(rows):
        return
    wide, made = _widened(rows, layout, own)
    if not (has_content(wide.names) or own & set(wide.names)):
        expected = f"names in column {layout.kind} that are known as columns of a CSV"
        near = any(likely_fields(name, ()) for name in made)
        hint = "--column FIELD=NAME names them, as wheel_speed_kmh one of speeds in km/h"
        hint = other_names(wide.names) if near else hint
        raise fail(InputError, str(reading.path), expected, listed(made) or "none", hint)
    read_columns(wide, reading, options)


def _widened(rows: Columns, layout: _Layout, own: Collection[str]) -> tuple[Columns, list[str]]:
    """Return a row for each time, with a column for each name, and these columns.

    Names again at a time are rows of their own.
    """
    kind, kinds = _kinds(rows, layout)
    if len(kinds) > _MOST_NAMES:
        got = number_of(len(kinds), "different name")
        where = f"{rows.reading.path}, column {layout.kind}"
        hint = "names and values are exchanged, or names count something"
        raise fail(InputError, where, f"at most {_MOST_NAMES} different names", got, hint)
    moment = rows.texts(layout.time)
    # Values of several cells at a time are in rows of their own.
    beside = usual_fields(layout.beside)
    for field in beside.keys() & _OF_CELLS:
        moment = moment + "\n" + rows.texts(beside[field])
    time = pd.factorize(moment)[0].astype(np.int64)
    same = time * max(len(kinds), 1) + kind
    again = pd.Series(same).groupby(same, sort=False).cumcount().to_numpy(dtype=np.int64)
    group, firsts = pd.factorize(time * (len(rows) + 1) + again)
    first = np.zeros(len(firsts), dtype=np.int64)
    first[group[::-1]] = np.arange(len(rows))[::-1]
    time_name = layout.time
    if time_name == _SECONDS and _SECONDS not in own:
        time_name = "time_s"
    made: dict[str, tuple[str, list[Ints]]] = {}
    for name, value, of in _names(rows, layout, kind, kinds, own):
        made.setdefault(name, (value, []))[1].append(of)
    every = np.arange(len(firsts))
    columns = {
        name: (name, first, every)
        for name in layout.beside
        if name not in made and name != time_name
    }
    columns[time_name] = (layout.time, first, every)
    for name, (value, parts) in made.items():
        if name != time_name:
            of = np.concatenate(parts)
            columns[name] = (value, of, group[of])
    some = number_of(len(made), "column")
    rows.reading.note(f"a row for each value: {some} made of the names in {layout.kind}")
    return rows.picked(columns, rows.line[first]), list(made)


def _kinds(rows: Columns, layout: _Layout) -> tuple[Ints, list[tuple[str, str]]]:
    """Return the number of each row's name and unit, and these; rows without a name are refused."""
    words = rows.mapped(str.lower, layout.kind)
    units = rows.mapped(str.lower, *([layout.unit] if layout.unit else []))
    word, every = pd.factorize(words)
    unit, some = pd.factorize(units)
    number, pairs = pd.factorize(word.astype(np.int64) * max(len(some), 1) + unit)
    rows.reading.refuse(rows.line[words == ""], f"no name in column {layout.kind}")
    return number, [(str(every[p // len(some)]), str(some[p % len(some)])) for p in pairs]


def _names(
    rows: Columns, layout: _Layout, kind: Ints, kinds: list[tuple[str, str]], own: Collection[str]
) -> Iterator[tuple[str, str, Ints]]:
    """Yield the name of each new column, the column of its values, and its rows."""
    taken: set[str] = set()
    rows_of = np.split(np.argsort(kind, kind="stable"), np.cumsum(np.bincount(kind))[:-1])
    single = np.ones(len(rows), dtype=bool)
    for axis in {"y", "z"} & layout.values.keys():
        single &= rows.mapped(_is_nothing, layout.values[axis]).astype(bool)
    for of, (word, unit) in zip(rows_of, kinds, strict=True):
        if not word:
            continue
        if "" in layout.values:
            yield _with_unit(word, unit, own), layout.values[""], of
            continue
        sensor = _sensor(word, layout.kind)
        sensor = word if sensor in taken else sensor
        taken.add(sensor)
        if single[of].all():
            yield _with_unit(sensor, unit, own), layout.values["x"], of
            continue
        for axis, column in layout.values.items():
            yield _with_unit(f"{sensor}_{axis}", unit, own), column, of


def _is_nothing(word: str) -> bool:
    """Return whether a value is missing, or 0."""
    return bool(_NOTHING.fullmatch(word))


def _with_unit(name: str, unit: str, own: Collection[str]) -> str:
    """Return a name with its unit in brackets, unless it states one, or means a field without."""
    field = next(iter(usual_fields([name])), "")
    known = field and (not quantity_of(field) or header_unit(field, name) is not None)
    stated = known or stated_fields([name], (), ())
    return name if not unit or stated or name in own else f"{name} [{unit}]"


def _sensor(word: str, column: str) -> str:
    """Return the name by which a sensor is known, else its own."""
    plain = _PREFIX.sub("", word.strip().lower()).replace(" ", "_")
    if plain.isdigit() and "type" in column:
        return _NUMBERED.get(plain, plain)
    if any(part in plain for part in _OTHERS):
        return plain
    return next((sensor for part, sensor in _SENSORS.items() if part in plain), plain)


FORMAT = Format(
    "long",
    "a table with a row for each value",
    "Car Scanner, loggers of buses and of sensors (CSV)",
    "what a plain CSV holds: names in a column are as those of its columns",
    _matches,
    _read,
)
