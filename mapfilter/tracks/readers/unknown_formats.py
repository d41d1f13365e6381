"""What is said of a file of no known format: what it most likely is, and how it can be read."""

from __future__ import annotations

import itertools
import re
import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from mapfilter._header_units import parted_unit
from mapfilter.errors import InputError, MapfilterError, fail, listed
from mapfilter.tracks.readers.format import Format
from mapfilter.tracks.readers.plain.fields import by_unit, usual_fields
from mapfilter.tracks.readers.plain.headers import likely_fields, stated_fields
from mapfilter.tracks.readers.plain.unused import OF_WHEELS
from mapfilter.tracks.readers.texts.separated_values import header_names, likely_separator
from mapfilter.tracks.readers.texts.text import Text

_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
_CELLS, _PLACES = {"cell", "cgi", "ci"}, {"lat_deg", "lon_deg", "east_m", "north_m"}
_OF_PLANS = ("eirp", "antenna"), ("azimut", "tilt", "height")
_LIST = "docs/howto/recordings.rst lists them"
JSON = ('{"', '[{"')
_FIELD_OF_UNIT = {
    "km/h": "wheel_speed_kmh",
    "m/s": "wheel_speed_mps",
    "deg/s": "yaw_rate_degps",
    "rad/s": "yaw_rate_radps",
    "dbm": "level_dbm",
}
"""Fields that a column whose name is of another language may be, by its unit."""
_ENDS = {"lat_deg": ("lat", "latitude"), "lon_deg": ("lon", "long", "lng", "longitude")}
_NUMBER = re.compile(r"[+-]?\d{1,20}(?:[.,]\d{0,20})?", re.ASCII)
_PARTED = re.compile(r"[._ :/]")
"""Last parts of names of columns, and what they are parted by."""
_MESSAGES = "messages of an autopilot; export one kind as CSV (mavlogdump.py, types GPS)"
_LAYOUTS = (
    (
        re.compile(r"\Atype,\s*local number,\s*message,", re.IGNORECASE),
        "all messages of a FIT file; export GPX, or its records alone (FitCSVTool, data record)",
    ),
    (re.compile(r",mavlink_\w", re.IGNORECASE), _MESSAGES),
    (re.compile(r"\A\d{4}-\d\d-\d\d [\d:.]+: \w+ \{TimeUS : "), _MESSAGES),
    (re.compile(r"\AFMT, ?\d+, ?\d+, ?[A-Z]"), _MESSAGES),
    (
        re.compile(r"\A#[A-Z0-9]{3,30}A,[A-Z0-9_]{1,16},"),
        "messages of a NovAtel receiver; export NMEA, or RINEX",
    ),
)
"""First lines of exports whose columns are no quantities, and what to do."""
RAW_FRAMES = "raw frames of a bus; decode them by its DBC (cantools), export signals as CSV"
_JSON = "JSON without records of places or cells; export GPX, or a table as CSV"
NOT_READ = {
    ".nmf": "a Nemo log that is no text of Nemo file format 2; export it as CSV, map the columns",
    ".dt1": "a Nemo log of version 1; export it as CSV, and map the columns",
    ".trp": "a binary TEMS log; export it as tab-delimited text",
    ".ntm": "a list of cells of NetMonster, no journey; as [cells] plan with names of its columns",
    ".asc": RAW_FRAMES,
    ".blf": RAW_FRAMES,
    ".mf4": "a measurement of a bus; export its signals as CSV (asammdf)",
    ".mdf": "a measurement of a bus; export its signals as CSV (asammdf)",
    ".vbo": "a VBOX file without its date or positions; export CSV, GPX or NMEA",
    ".kml": "no KML that can be read; export GPX, or a table as CSV",
    ".kmz": "no KML that can be read; export GPX, or a table as CSV",
    ".geojson": "GeoJSON without points that have times; export GPX, or a table as CSV",
    ".json": _JSON,
    ".jsonl": _JSON,
    ".ndjson": _JSON,
    ".fit": "a FIT file; export GPX",
    ".tcx": "no TCX file with places; export GPX",
    ".igc": "an IGC file; export GPX",
    ".gpkg": "no GeoPackage; export its table as CSV",
    ".pos": "a solution of RTKLIB without its line of names; write it with its output header",
    ".ubx": "binary messages of a u-blox receiver; export NMEA, or RINEX",
    ".sbf": "binary messages of a Septentrio receiver; export NMEA, or RINEX",
    ".ulg": "a log of PX4; write its tables as CSV (ulog2csv), and give vehicle_gps_position",
    ".bin": _MESSAGES,
    ".tlog": _MESSAGES,
    ".bag": "a bag of ROS; write its topics as CSV (rostopic echo -b BAG -p TOPIC)",
    ".db3": "a bag of ROS 2; write its topics as CSV",
    ".mcap": "a bag of ROS 2; write its topics as CSV",
    ".xlsx": "no workbook that can be read; export it as CSV",
    ".xls": "no workbook that can be read; export it as CSV",
    ".ods": "no workbook that can be read; export it as CSV",
}
"""Suffixes of formats that are not read, and what to do."""


def _other_separators(path: Path, text: Text, find_format: Callable[[Text], Format | None]) -> str:
    """Return the hint for a file that would be of a known format with other separators."""
    head = "\n".join(text.head)
    for own, other in itertools.permutations("\t;, ", 2):
        if own not in head:
            continue
        if own == " " and any(one in text.first_line for one in _SEPARATORS if one != own):
            # Blanks between words of a table's header separate nothing.
            continue
        found = find_format(Text(path, head.replace(own, other).encode()))
        if found is not None:
            return f"{found.title} with {_SEPARATORS[own]} where {_SEPARATORS[other]} should be"
    return ""


def unknown_format(
    path: Path, text: Text, find_format: Callable[[Text], Format | None]
) -> MapfilterError:
    """Return the error for a file of no known format."""
    separator = likely_separator(text.first_line)
    names = header_names(text.first_line, separator)
    is_table = len(names) > 1 and not text.first_line.lstrip().startswith(("{", "[", "<"))
    known = (hint for layout, hint in _LAYOUTS if layout.search(text.first_line))
    # The columns of what was taken from another form are those of a CSV.
    hint = "" if text.made_of else NOT_READ.get(path.suffix.lower(), "") or next(known, "")
    hint = hint or _other_separators(path, text, find_format)
    if text.first_line.lstrip().startswith(JSON):
        hint = hint or NOT_READ[".json"]
    if is_table and not hint and _is_plan(names):
        hint = "a list of cells, no journey: name it as [cells] plan"
    if is_table and not hint and _is_of_numbers(names):
        hint = "a table without a line of names: write one above it, such as time,lat,lon,rsrp"
    if is_table and not hint:
        raw = {"databytes", "data bytes", "dlc"} & set(names) or {"id", "d1", "d2"} <= set(names)
        hint = RAW_FRAMES if raw else other_names(names)
    got = f"none of them; it begins with {text.first_line[:60]!r}"
    if is_table:
        got = f"none of them, but a table with the columns {listed([n for n in names if n])}"
    return fail(InputError, str(path), f"a recording in a known format ({_LIST})", got, hint)


def _is_of_numbers(names: Sequence[str]) -> bool:
    """Return whether most names of columns are numbers: values of the first row."""
    numbers = sum(_NUMBER.fullmatch(name) is not None for name in names)
    return 2 * numbers > len(names)


def _is_plan(names: Sequence[str]) -> bool:
    """Return whether the columns of a table are those of antennas."""
    return all(any(part in name for name in names for part in some) for some in _OF_PLANS)


def other_names(names: Sequence[str]) -> str:
    """Return the hint for a table whose columns are not known, with the fields they resemble."""
    usual, stated = usual_fields(names), stated_fields(names, (), ())
    found = {*usual, *stated}
    others = [name for name in names if name and name not in (*usual.values(), *stated.values())]
    likely = {name: fields for name in others if (fields := likely_fields(name, found))}
    if _CELLS & found and not _PLACES & found.union(*likely.values()):
        # Beside cells alone a phone's speed is no motion, a vehicle's is.
        likely = {name: [OF_WHEELS.get(one, one) for one in some] for name, some in likely.items()}
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
    ended = {
        field: next((name for name in others if _ends_as(parted_unit(name)[0], field)), "")
        for field in (*_ENDS, "time")
        if field not in found and not any(field in fields for fields in likely.values())
    }
    such += [shlex.quote(f"{field}={name}") for field, name in ended.items() if name]
    if not such and not {"lat_deg", "lon_deg"} <= found:
        such = ["lat_deg=LATITUDE", "lon_deg=LONGITUDE"]
    times = ""
    if "time" not in found:
        times = "a CSV without a column of times; "
        such += [] if "time" not in ended or ended["time"] else ["time=COLUMN"]
    option = (
        f"--column FIELD=COLUMN (track.columns in a configuration), such as {' and '.join(such)}"
    )
    return f"{times}a CSV with other names of columns: {option}"


def _ends_as(name: str, field: str) -> bool:
    """Return whether a column's name ends in a usual one of a field; of times, holds it."""
    if field == "time":
        return "time" in name
    _, *others = _PARTED.split(name)
    return bool(others) and others[-1] in _ENDS[field]


def _pairs(name: str, fields: Sequence[str]) -> str:
    """Return what names a column's field, by its unit where that is open."""
    pairs = [f"{field}={name}" for field in fields]
    return pairs[0] if len(pairs) == 1 else f"({by_unit(fields, pairs)})"
