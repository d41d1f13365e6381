"""Plain CSV: columns by their usual names, or by a map from fields to columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import listed
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain.app_names import full_names, with_full_names
from mapfilter.tracks.readers.plain.attitude import add_attitude
from mapfilter.tracks.readers.plain.cells import add_cells
from mapfilter.tracks.readers.plain.dates import with_dates
from mapfilter.tracks.readers.plain.fields import FIELDS, usual_fields
from mapfilter.tracks.readers.plain.fix_states import fix_column
from mapfilter.tracks.readers.plain.foreign_names import FOREIGN, note_on_foreign
from mapfilter.tracks.readers.plain.headers import stated_fields
from mapfilter.tracks.readers.plain.mapped import (
    NAMED_CELLS,
    SIGNALS,
    Mapped,
    add_rows,
    mapped_columns,
)
from mapfilter.tracks.readers.plain.odometry import add_odometry, add_turns
from mapfilter.tracks.readers.plain.places import (
    add_places,
    hemisphere_columns,
    with_bare_degrees,
)
from mapfilter.tracks.readers.plain.set_back import with_clock_set_right
from mapfilter.tracks.readers.plain.steps import add_steps, are_counted
from mapfilter.tracks.readers.plain.technology import with_technologies
from mapfilter.tracks.readers.plain.times import times_of
from mapfilter.tracks.readers.plain.unit_rows import with_unit_row
from mapfilter.tracks.readers.plain.unused import unused_columns, unused_note
from mapfilter.tracks.readers.plain.value_units import with_value_units
from mapfilter.tracks.readers.plain.weeks import week_column
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text

_SPEEDS = ("speed_mps", "speed_kmh")
_CONTENT = (
    *(("lat_deg", "lon_deg"), ("east_m", "north_m"), ("step_m",), ("level_dbm",), ("bars",)),
    *(
        ("acc_x",),
        ("gyr_x",),
        ("mag_x",),
        ("qx", "qy", "qz"),
        ("pressure_hpa",),
        ("wheel_speed_mps",),
    ),
    *(
        ("odometer_m",),
        ("odometer_km",),
        ("wheel_speed_kmh",),
        ("steps",),
        ("yaw_rate_radps",),
        ("yaw_rate_degps",),
    ),
    *((speed,) for speed in _SPEEDS),
)
_VITAL = (
    *("step_m", "heading_rad", "turn_rad", "turn_deg", "compass_deg", "steps", "level_dbm", "bars"),
    *("yaw_rate_radps", "yaw_rate_degps", "wheel_speed_mps", "wheel_speed_kmh"),
    *("odometer_m", "odometer_km"),
)
"""Fields that must hold numbers where a column has them."""


def _matches(text: Text) -> bool:
    return has_content(header_names(text.first_line, likely_separator(text.first_line)))


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "CSV"
    read_columns(header_columns(text.data, reading, text.line), reading, options)


def has_content(names: Sequence[str]) -> bool:
    """Return whether columns of these names make rows of a journey: times, and what was there."""
    names = full_names(names)
    found = {*usual_fields(names), *stated_fields(names, (), ())}
    if found.intersection(NAMED_CELLS) and not {*SIGNALS}.isdisjoint(names):
        found.add("level_dbm")
    return "time" in found and any(found.issuperset(fields) for fields in _CONTENT)


def read_columns(rows: Columns, reading: Reading, options: ReadOptions) -> None:
    """Read columns by the fields that their names mean, or that a user names.

    Raises
    ------
    InputError
        A field or column that does not exist, a unit of another quantity in a name, no times.
    """
    named = {name.lower() for name in options.columns.values()}
    rows = with_unit_row(rows, named)
    rows = with_value_units(with_full_names(rows, named), named)
    mapped = with_bare_degrees(mapped_columns(rows, reading, options))
    mapped = with_dates(with_technologies(mapped, reading))
    rows = mapped.rows
    hemispheres = hemisphere_columns(rows, mapped.taken)
    week = week_column(mapped)
    beside = (*mapped.beside, *hemispheres.values(), *([week] if week else []))
    if mapped.has("lat_deg", "lon_deg") and (fix := fix_column(rows, mapped.taken)):
        beside += (fix,)
    mapped = replace(mapped, beside=beside)
    _note_repeated(mapped, reading)
    held = {field: rows.find(*mapped.names(field)) or "" for field in FOREIGN}
    if note := note_on_foreign(held, mapped.own):
        reading.note(note)
    reading.named = tuple(mapped.own)
    reading.tallies.columns |= {
        field: column for field in _VITAL if (column := rows.find(*mapped.names(field))) is not None
    }
    time_s = with_clock_set_right(times_of(mapped, reading, options), mapped, reading)
    # Of several columns of times the one that was read, also in later parts.
    best = {"time": reading.columns["time"]} if "time" in reading.columns else {}
    if best and best["time"] not in mapped.names("time"):
        mapped = replace(mapped, stated={**mapped.stated, **best})
    reading.columns |= {**mapped.stated, **best}
    reading.columns |= {field: name.lower() for field, name in mapped.own.items()}
    reading.last_s = max([reading.last_s, *time_s[np.isfinite(time_s)][-1:].tolist()])
    add_places(mapped, reading, time_s, hemispheres)
    if mapped.has("east_m", "north_m"):
        columns = {name: mapped.number(name) for name in ("east_m", "north_m", "heading_rad")}
        there = np.isfinite(columns["east_m"])
        add_rows(reading, "places", {"time_s": time_s, **columns}, rows, there)
    if mapped.has("step_m") and not (are_counted(mapped) or mapped.holds("east_m", "north_m")):
        add_steps(mapped, reading, time_s)
    add_odometry(mapped, reading, time_s)
    add_turns(mapped, reading, time_s)
    _add_sensors(mapped, reading, time_s)
    add_cells(mapped, reading, time_s)
    reading.fields = tuple(field for field in FIELDS if mapped.has(field))
    reading.unread = unused_columns(mapped, time_s)
    if reading.unread:
        reading.ignore(unused_note(reading.unread))


def _note_repeated(mapped: Mapped, reading: Reading) -> None:
    """Note columns of fields whose name two columns have: the first one is read."""
    names = mapped.rows.names
    twice = sorted(name for name in mapped.taken if names.count(name) > 1)
    if twice:
        reading.ignore(f"several columns {listed(twice)}: the first one is read")


def _add_sensors(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    sensors = (("acc", "accelerometer", "mps2"), ("gyr", "gyroscope", "radps"))
    for short, sensor, unit in (*sensors, ("mag", "magnetometer", "ut")):
        if mapped.has(*(f"{short}_{axis}" for axis in "xyz")):
            columns = {f"{axis}_{unit}": mapped.number(f"{short}_{axis}") for axis in "xyz"}
            there = np.logical_or.reduce([np.isfinite(one) for one in columns.values()])
            add_rows(reading, sensor, {"time_s": time_s, **columns}, mapped.rows, there)
    if mapped.has("qx", "qy", "qz"):
        add_attitude(mapped, reading, time_s)
    for field, table, column in (
        ("pressure_hpa", "barometer", "pressure_hpa"),
        ("steps", "steps", "count"),
    ):
        if mapped.has(field):
            value = mapped.number(field)
            columns = {"time_s": time_s, column: value}
            add_rows(reading, table, columns, mapped.rows, np.isfinite(value))
    if are_counted(mapped):
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
    # A row with steps alone has an unknown turn, unless turns have rows of their own; one without
    # either is none of motion.
    turned, stepped = np.isfinite(turn) | np.isfinite(rate), np.isfinite(mapped.number("steps"))
    there = turned | (stepped & (stepped & turned).any())
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
