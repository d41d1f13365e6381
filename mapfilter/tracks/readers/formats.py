"""The table of formats, finding the format of a file, and reading it."""

from __future__ import annotations

import itertools
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mapfilter._header_units import parted_unit
from mapfilter.errors import ConfigError, InputError, MapfilterError, fail, listed
from mapfilter.tracks.readers import (
    antennas,
    cell_csv,
    gnettrack,
    gnsslogger,
    gpx,
    indoor,
    nemo,
    nmea,
    phone_sensors,
    plain_csv,
    poses,
    rinex,
    rinex_navigation,
    smartloc,
    tems,
)
from mapfilter.tracks.readers.csv_fields import by_unit, usual_fields
from mapfilter.tracks.readers.csv_headers import likely_fields, stated_fields
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.reading import Reading
from mapfilter.tracks.readers.recording import Recording
from mapfilter.tracks.readers.separated_values import header_names, likely_separator
from mapfilter.tracks.readers.text import Text, parts_of, read_text

FORMATS: tuple[Format, ...] = (
    gnettrack.FORMAT,
    cell_csv.TOWER_COLLECTOR,
    cell_csv.UPLOAD,
    cell_csv.CELL_LIST,
    gpx.FORMAT,
    nmea.FORMAT,
    gnsslogger.FORMAT,
    rinex.FORMAT,
    rinex_navigation.FORMAT,
    smartloc.FORMAT,
    smartloc.RAW,
    indoor.FORMAT,
    phone_sensors.PHYPHOX,
    phone_sensors.SENSOR_LOGGER,
    antennas.FORMAT,
    poses.KITTI,
    poses.TUM,
    nemo.FORMAT,
    tems.FORMAT,
    plain_csv.FORMAT,
)
"""All formats, in the order in which a file is compared with them."""

_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
_LIST = "docs/howto/recordings.rst lists them"
_PEEKED_BYTES = 1 << 18
_JSON = ('{"', '[{"')
_FIELD_OF_UNIT = {
    "km/h": "wheel_speed_kmh",
    "m/s": "wheel_speed_mps",
    "deg/s": "yaw_rate_degps",
    "rad/s": "yaw_rate_radps",
    "dbm": "level_dbm",
}
"""Fields that a column whose name is of another language may be, by its unit."""
_KINDS = ("pid", "signal", "signal_name", "signal name", "name", "sensor", "parameter", "variable")
_TIMES = ("time", "timestamp", "timestamps", "seconds", "time_s", "t")
"""Columns of a table with a row for each value, as of loggers of a vehicle's bus."""
_NOT_READ = {
    ".nmf": "a Nemo log that is no text of Nemo file format 2; export it as CSV, map the columns",
    ".dt1": "a Nemo log of version 1; export it as CSV, and map the columns",
    ".trp": "a binary TEMS log; export it as tab-delimited text",
    ".ntm": "a list of cells of NetMonster, no journey; as [cells] plan with names of its columns",
    ".kml": "KML; export GPX, or a table as CSV",
    ".kmz": "KML; export GPX, or a table as CSV",
    ".geojson": "GeoJSON; export GPX, or a table as CSV",
    ".json": "JSON; export GPX, or a table as CSV",
    ".jsonl": "JSON; export GPX, or a table as CSV",
    ".ndjson": "JSON; export GPX, or a table as CSV",
    ".fit": "a FIT file; export GPX",
    ".xlsx": "a spreadsheet; export it as CSV",
    ".xls": "a spreadsheet; export it as CSV",
    ".ods": "a spreadsheet; export it as CSV",
}
"""Suffixes of formats that are not read, and what to do."""


def format_named(name: str) -> Format:
    """Return a format by its name; ConfigError when there is none."""
    for known in FORMATS:
        if known.name == name:
            return known
    names = ", ".join(known.name for known in FORMATS)
    raise fail(ConfigError, "--format", f"one of {names}", repr(name))


def find_format(text: Text) -> Format | None:
    """Return the format that a file looks like, or None."""
    if text.first_line.lstrip().startswith(_JSON):
        return None
    return next((known for known in FORMATS if known.matches(text)), None)


def format_of(path: str | Path) -> Format | None:
    """Return the format that a file looks like by its beginning; None for another file."""
    try:
        return find_format(read_text(Path(path), _PEEKED_BYTES))
    except InputError:
        return None


def read_recording(
    path: str | Path, name: str = "", options: ReadOptions | None = None
) -> Recording:
    """Read a recording of another program.

    Parameters
    ----------
    path : str or Path
        Plain or gzip.
    name : str
        Of a format; "" to find it by the file's content.
    options : ReadOptions, optional

    Raises
    ------
    InputError
        The file is missing, damaged, of no known format, or holds no usable row.
    """
    path = Path(path)
    if path.is_dir():
        raise fail(InputError, str(path), "a file", "a folder", "name the files in it")
    try:
        text = read_text(path)
    except InputError as error:
        hint = _NOT_READ.get(path.suffix.lower(), "")
        raise InputError(tuple(replace(f, hint=hint or f.hint) for f in error.faults)) from error
    found = find_format(text)
    known = format_named(name) if name else found
    own = options is not None and bool(options.columns)
    if own and not name and (known is None or (known is tems.FORMAT and _named(text, options))):
        # The columns of such an export are chosen, and may be named.
        known = plain_csv.FORMAT if _is_of(text, options) else None
    if known is None:
        raise _unknown(path, text)
    reading = Reading(path, notes=list(text.notes))
    options = options or ReadOptions()
    try:
        # Numbers of any size occur in damaged files; what comes of them is checked in the end.
        with np.errstate(all="ignore"):
            for part in parts_of(text) if known.by_rows else (text,):
                known.read(part, reading, options)
        # A large text and the tables need not be in memory at the same time.
        del text
        return reading.done(known.name)
    except InputError as error:
        if found is None or found is known:
            raise
        named = tuple(
            replace(fault, hint=f"this is {found.title}; use --format {found.name}, or none")
            for fault in error.faults
        )
        raise InputError(named) from error


def _named(text: Text, options: ReadOptions | None) -> bool:
    """Return whether a file has every column of a column map."""
    columns = {} if options is None else options.columns
    names = header_names(text.first_line, likely_separator(text.first_line))
    return all(column.lower() in names for column in columns.values())


def _is_of(text: Text, options: ReadOptions | None) -> bool:
    """Return whether a column map may be that of a file: of several it names a column of it."""
    if options is None or not options.shared:
        return True
    names = header_names(text.first_line, likely_separator(text.first_line))
    return any(column.lower() in names for column in options.columns.values())


def _other_separators(path: Path, text: Text) -> str:
    """Return the hint for a file that would be of a known format with other separators."""
    head = "\n".join(text.head)
    for own, other in itertools.permutations("\t;, ", 2):
        if own == " " and any(one in text.first_line for one in _SEPARATORS if one != own):
            # Blanks between words of a table's header separate nothing.
            continue
        found = find_format(Text(path, head.replace(own, other).encode()))
        if own in head and found is not None:
            return f"{found.title} with {_SEPARATORS[own]} where {_SEPARATORS[other]} should be"
    return ""


def _unknown(path: Path, text: Text) -> MapfilterError:
    """Return the error for a file of no known format."""
    separator = likely_separator(text.first_line)
    names = header_names(text.first_line, separator)
    is_table = len(names) > 1 and not text.first_line.lstrip().startswith(("{", "[", "<"))
    hint = _NOT_READ.get(path.suffix.lower(), "") or _other_separators(path, text)
    if text.first_line.lstrip().startswith(_JSON):
        hint = hint or _NOT_READ[".json"]
    if is_table and not hint:
        hint = _other_table(names) or _other_names(names)
    got = f"none of them; it begins with {text.first_line[:60]!r}"
    if is_table:
        got = f"none of them, but a table with the columns {listed([n for n in names if n])}"
    return fail(InputError, str(path), f"a recording in a known format ({_LIST})", got, hint)


def _other_table(names: Sequence[str]) -> str:
    """Return the hint for a table whose rows or first line no map of columns mends; "" for none."""
    if names[0].startswith("wiglewifi"):
        columns = ("time=FirstSeen", "lat_deg=CurrentLatitude", "lon_deg=CurrentLongitude")
        options = " ".join(f"--column {one}" for one in (*columns, "cgi=MAC", "technology=Type"))
        return f"WiGLE, whose names of columns are in the second line: delete the first, {options}"
    value = next((name for name in names if name in ("value", "values")), "")
    kind = next((name for name in names if name in _KINDS), "")
    if value and kind:
        time = next((name for name in names if name in _TIMES), "time")
        pivot = f"pandas.pivot_table(rows, values={value!r}, index={time!r}, columns={kind!r})"
        return f"a row for each value: make a column of each {kind}, as by {pivot}"
    return ""


def _other_names(names: Sequence[str]) -> str:
    """Return the hint for a table whose columns are not known, with the fields they resemble."""
    usual, stated = usual_fields(names), stated_fields(names, (), ())
    found = {*usual, *stated}
    others = [name for name in names if name and name not in (*usual.values(), *stated.values())]
    likely = {name: fields for name in others if (fields := likely_fields(name, found))}
    several = Counter(tuple(fields) for fields in likely.values())
    such = [
        _pairs(name, fields)
        for name, fields in likely.items()
        if several[tuple(fields)] == 1 or fields[0] == "time"
    ]
    such += [
        f"{fields[0]}= one of {', '.join(name for name in likely if tuple(likely[name]) == fields)}"
        for fields, count in several.items()
        if count > 1 and fields[0] != "time"
    ]
    such += [
        shlex.quote(f"{_FIELD_OF_UNIT[unit]}={name}")
        for name in others
        if name not in likely and (unit := parted_unit(name)[1]) in _FIELD_OF_UNIT
    ]
    if not such and not {"lat_deg", "lon_deg"} <= found:
        such = ["lat_deg=LATITUDE", "lon_deg=LONGITUDE"]
    times = ""
    if "time" not in found:
        times = "a CSV without a column of times; "
        such += [] if any("time" in fields for fields in likely.values()) else ["time=COLUMN"]
    option = (
        f"--column FIELD=COLUMN (track.columns in a configuration), such as {' and '.join(such)}"
    )
    return f"{times}a CSV with other names of columns: {option}"


def _pairs(name: str, fields: Sequence[str]) -> str:
    """Return what names a column's field, by its unit where that is open."""
    pairs = [f"{field}={name}" for field in fields]
    return pairs[0] if len(pairs) == 1 else f"({by_unit(fields, pairs)})"
