"""Plain CSV: columns by their usual names, or by a map from fields to columns."""

from __future__ import annotations

import re

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.columns import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.csv_cells import add_cells
from mapfilter.tracks.readers.csv_fields import FIELDS, usual_fields
from mapfilter.tracks.readers.csv_headers import stated_fields
from mapfilter.tracks.readers.csv_mapped import Mapped, add_rows, mapped_columns, with_dates
from mapfilter.tracks.readers.csv_odometry import add_odometry, speeds_of
from mapfilter.tracks.readers.csv_unused import unused_columns, unused_note
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recording import Clock, Reading
from mapfilter.tracks.readers.text import Text

_UNIX_S = 1e8

_SPEEDS = ("speed_mps", "speed_kmh")
_CONTENT = (
    *(("lat_deg", "lon_deg"), ("east_m", "north_m"), ("step_m",), ("level_dbm",), ("bars",)),
    *(("acc_x",), ("gyr_x",), ("mag_x",), ("pressure_hpa",), ("wheel_speed_mps",)),
    *(("wheel_speed_kmh",), ("steps",)),
    *((speed,) for speed in _SPEEDS),
)
_VITAL = (
    *("step_m", "heading_rad", "turn_rad", "turn_deg", "compass_deg", "steps", "level_dbm", "bars"),
    *("yaw_rate_radps", "yaw_rate_degps", "wheel_speed_mps", "wheel_speed_kmh"),
)
"""Fields that must hold numbers where a column has them."""
_TIMES = "seconds, Unix time, or ISO 8601 such as 2026-05-01T10:00:00+02:00"


def _matches(text: Text) -> bool:
    names = header_names(text.first_line, likely_separator(text.first_line))
    found = {*usual_fields(names), *stated_fields(names, (), ())}
    return "time" in found and any(found.issuperset(fields) for fields in _CONTENT)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "CSV"
    rows = header_columns(text.data, reading, text.line)
    mapped = with_dates(mapped_columns(rows, reading, options))
    rows = mapped.rows
    reading.named = tuple(mapped.own)
    reading.tallies.columns |= {
        field: column for field in _VITAL if (column := rows.find(*mapped.names(field))) is not None
    }
    time_s = _times(mapped, reading, options)
    reading.columns |= mapped.stated
    reading.columns |= {field: name.lower() for field, name in mapped.own.items()}
    reading.last_s = max([reading.last_s, *time_s[np.isfinite(time_s)][-1:].tolist()])
    if mapped.has("lat_deg", "lon_deg"):
        names = ("lat_deg", "lon_deg", "altitude_m", "accuracy_m", "course_deg")
        columns = {name: mapped.number(name) for name in names}
        there = np.isfinite(columns["lat_deg"]) | np.isfinite(columns["lon_deg"])
        columns |= {"time_s": time_s, "speed_mps": speeds_of(mapped, "speed")}
        add_rows(reading, "positions", columns, rows, there)
    if mapped.has("east_m", "north_m"):
        columns = {name: mapped.number(name) for name in ("east_m", "north_m", "heading_rad")}
        there = np.isfinite(columns["east_m"])
        add_rows(reading, "places", {"time_s": time_s, **columns}, rows, there)
    elif mapped.has("step_m"):
        moved = ("step_m", "heading_rad", "turn_rad", "compass_deg")
        columns = {name: mapped.number(name) for name in moved}
        columns["turn_rad"] = mapped.radians("turn")
        there = np.isfinite(columns["step_m"])
        add_rows(reading, "motion", {"time_s": time_s, **columns}, rows, there)
    add_odometry(mapped, reading, time_s)
    _add_sensors(mapped, reading, time_s)
    add_cells(mapped, reading, time_s)
    reading.fields = tuple(field for field in FIELDS if mapped.has(field))
    reading.unread = unused_columns(mapped, time_s)
    if reading.unread:
        reading.ignore(unused_note(reading.unread))


def _times(mapped: Mapped, reading: Reading, options: ReadOptions) -> Floats:
    """Return UTC seconds, or seconds from an unknown start where they are small numbers."""
    number = mapped.number("time") if len(mapped.rows) else np.zeros(0)
    known = number[np.isfinite(number)]
    if known.size >= 0.5 * len(number) and known.size and abs(float(np.median(known))) < _UNIX_S:
        reading.clock = Clock("monotonic")
        return number
    reading.notes[:] = [note for note in reading.notes if "taken as missing" not in note]
    names = mapped.names("time")
    # A zone that is given is that of the local times of all files.
    rows, name = mapped.rows, mapped.rows.find(*names) or ""
    zone = "UTC" if "utc" in name else options.zone
    time_s, zoned = rows.times(*names, zone=zone)
    reading.clock = Clock("utc") if zoned else Clock("local", zone)
    if len(time_s) and not np.isfinite(time_s).any():
        texts = mapped.texts("time").tolist()
        at = next((row for row, text in enumerate(texts) if text), 0)
        where = f"{reading.path} row {mapped.rows.line[at]}, time"
        raise fail(
            InputError, where, _TIMES, repr(texts[at][:40] or "nothing"), _of_time(texts[at])
        )
    return time_s


def _of_time(text: str) -> str:
    """Return the likely mistake behind a text that is no time."""
    if re.match(r"\d{1,2}[-/]\d{1,2}[-/]\d{2,4}", text.strip()):
        return "day or month first? Write 2021-03-04, or 4.3.2021 with dots"
    if re.match(r"\d{1,2}:\d\d", text.strip()):
        return "a time of day without its date; write 2026-05-01T08:00:00, or seconds"
    return ""


def _add_sensors(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    sensors = (("acc", "accelerometer", "mps2"), ("gyr", "gyroscope", "radps"))
    for short, sensor, unit in (*sensors, ("mag", "magnetometer", "ut")):
        if mapped.has(*(f"{short}_{axis}" for axis in "xyz")):
            columns = {f"{axis}_{unit}": mapped.number(f"{short}_{axis}") for axis in "xyz"}
            there = np.isfinite(columns[f"x_{unit}"])
            add_rows(reading, sensor, {"time_s": time_s, **columns}, mapped.rows, there)
    for field, table, column in (
        ("pressure_hpa", "barometer", "pressure_hpa"),
        ("steps", "steps", "count"),
    ):
        if mapped.has(field):
            value = mapped.number(field)
            columns = {"time_s": time_s, column: value}
            add_rows(reading, table, columns, mapped.rows, np.isfinite(value))
    if mapped.has("steps") and not mapped.has("step_m"):
        _add_courses(mapped, reading, time_s)


def _add_courses(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    """Add what gives counted steps a direction: a compass, turns, or a rate of turning."""
    magnetic = mapped.number("compass_deg")
    if column := mapped.rows.find(*mapped.names("compass_deg")):
        reading.tallies.columns["magnetic_deg"] = column
    columns = {"time_s": time_s, "magnetic_deg": magnetic}
    add_rows(reading, "compass", columns, mapped.rows, np.isfinite(magnetic))
    turn = mapped.radians("turn")
    rate = mapped.radians("yaw_rate", "ps")
    # A row with steps alone has an unknown turn; one without either is none of motion.
    turned = np.isfinite(turn) | np.isfinite(rate)
    there = turned | (np.isfinite(mapped.number("steps")) & turned.any())
    columns = {"time_s": time_s, "turn_rad": turn, "yaw_rate_radps": rate}
    add_rows(reading, "turns", columns, mapped.rows, there)


FORMAT = Format(
    "csv",
    "a plain CSV",
    "any program; columns by their usual names, or ``--column FIELD=COLUMN``",
    "positions, places, motion, wheel speed and yaw rate, cells, inertial sensors, pressure",
    _matches,
    _read,
    by_rows=True,
)
