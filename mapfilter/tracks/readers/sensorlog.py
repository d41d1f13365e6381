"""CSV of SensorLog for iPhone and Apple Watch: all sensors in one row, in Apple's units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapfilter._constants import GRAVITY_MPS2
from mapfilter._types import Floats
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain.mapped import add_rows
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.kept_rows import changed_rows, only
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text

_AXES = ("x", "y", "z")
_TIME = "loggingtime"
_ACCELERATION = tuple(f"accelerometeracceleration{axis}" for axis in _AXES)
_USER = tuple(f"motionuseracceleration{axis}" for axis in _AXES)
_GRAVITY = tuple(f"motiongravity{axis}" for axis in _AXES)
_RATES = ("motionrotationrate", "gyrorotation")
_FIELDS = ("motionmagneticfield", "magnetometer")
"""Of the gyroscope and the magnetometer: calibrated ones first."""
_LATITUDE, _LONGITUDE = "locationlatitude", "locationlongitude"
_OLDEST_S = 10.0
_KPA_HPA = 10.0


def _named(names: Sequence[str]) -> dict[str, str]:
    """Return columns by their names without the unit in brackets."""
    return {name.partition("(")[0].strip(): name for name in reversed(names)}


def _matches(text: Text) -> bool:
    names = _named(header_names(text.first_line, likely_separator(text.first_line)))
    held = (_ACCELERATION, _USER, (_LATITUDE, _LONGITUDE), *(_axes(one) for one in _RATES))
    return _TIME in names and any(set(some) <= names.keys() for some in held)


def _axes(sensor: str) -> tuple[str, ...]:
    return tuple(f"{sensor}{axis}" for axis in _AXES)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "SensorLog"
    rows = header_columns(text.data, reading, text.line)
    names = _named(rows.names)
    time_s, zoned = rows.times_of_part(names.get(_TIME, _TIME), zone=options.zone)
    reading.clock = Clock("utc") if zoned else Clock("local", options.zone)
    _add_positions(rows, reading, names, time_s, zoned=zoned)
    _add_forces(rows, reading, names, time_s)
    for sensor, unit, some in (("gyroscope", "radps", _RATES), ("magnetometer", "ut", _FIELDS)):
        named = [_axes(one) for one in some if set(_axes(one)) <= names.keys()]
        found = [[rows.number(names[axis]) for axis in axes] for axes in named]
        if found:
            # Columns may be there without values.
            parts = next(
                (one for one in found if _holds(one, zeros=sensor != "gyroscope")), found[0]
            )
            _add_axes(rows, reading, sensor, unit, time_s, parts)
    for table, column, name, factor in (
        ("barometer", "pressure_hpa", "altimeterpressure", _KPA_HPA),
        ("steps", "count", "pedometernumberofsteps", 1.0),
        ("compass", "magnetic_deg", "locationmagneticheading", 1.0),
    ):
        if name in names:
            value = factor * rows.number(names[name])
            # Negative or 0 where there is none.
            known = (value >= 0) if table != "barometer" else value > 0
            add_rows(reading, table, {"time_s": time_s, column: value}, rows, known)


def _add_positions(
    rows: Columns, reading: Reading, names: dict[str, str], time_s: Floats, *, zoned: bool
) -> None:
    """Add positions at their own times; every row repeats the last one."""
    if not {_LATITUDE, _LONGITUDE} <= names.keys():
        return

    def number(name: str) -> Floats:
        return rows.number(names.get(name, name))

    own_s = number("locationtimestamp_since1970")
    measured_s = np.where(np.isfinite(own_s), own_s, time_s) if zoned else time_s
    position = {
        "time_s": measured_s,
        "lat_deg": number(_LATITUDE),
        "lon_deg": number(_LONGITUDE),
        "altitude_m": number("locationaltitude"),
        "accuracy_m": _not_negative(number("locationhorizontalaccuracy")),
        "speed_mps": _not_negative(number("locationspeed")),
        "course_deg": _not_negative(number("locationcourse")),
    }
    stamp_s = own_s if np.isfinite(own_s).any() else time_s
    new = changed_rows({**position, "time_s": stamp_s}, ("time_s", "lat_deg", "lon_deg"))
    new &= np.isfinite(position["lat_deg"]) & np.isfinite(position["lon_deg"])
    old = new & (time_s - measured_s > _OLDEST_S)
    reading.refuse(rows.line[old], f"positions: measured more than {_OLDEST_S:g} s before the row")
    reading.add("positions", *only(position, rows.line, new & ~old))


def _not_negative(values: Floats) -> Floats:
    """Return values without those below 0, which mean that there is none."""
    return np.where(values < 0, np.nan, values)


def _add_forces(rows: Columns, reading: Reading, names: dict[str, str], time_s: Floats) -> None:
    """Add specific forces: Apple's accelerations are in g, and of the opposite sign."""

    def force(columns: tuple[str, ...]) -> list[Floats]:
        return [-GRAVITY_MPS2 * rows.number(names[name]) for name in columns]

    gravity = force(_GRAVITY) if set(_GRAVITY) <= names.keys() else None
    if gravity is not None:
        _add_axes(rows, reading, "gravity", "mps2", time_s, gravity)
    total = force(_ACCELERATION) if set(_ACCELERATION) <= names.keys() else None
    measured = total is not None and _holds(total, zeros=False)
    if not measured and gravity is not None and set(_USER) <= names.keys():
        total = [part + rest for part, rest in zip(gravity, force(_USER), strict=True)]
    if total is None:
        return
    _add_axes(rows, reading, "accelerometer", "mps2", time_s, total)
    reading.note(
        "accelerations in g, turned into m/s², with the sign of Android's (upward at rest)"
    )


def _holds(parts: list[Floats], *, zeros: bool) -> bool:
    """Return whether a sensor has values; ``zeros`` says whether 0 in all rows is one."""
    return bool((np.isfinite(parts) & (zeros | np.not_equal(parts, 0))).any())


def _add_axes(
    rows: Columns, reading: Reading, sensor: str, unit: str, time_s: Floats, parts: list[Floats]
) -> None:
    """Add a sensor of three axes; all are 0 where it has no value, or a gyroscope rests."""
    there = np.isfinite(parts[0])
    if sensor != "gyroscope":
        there &= np.abs(parts).sum(axis=0) > 0
    columns = {f"{axis}_{unit}": part for axis, part in zip(_AXES, parts, strict=True)}
    add_rows(reading, sensor, {"time_s": time_s, **columns}, rows, there)


FORMAT = Format(
    "sensorlog",
    "a SensorLog CSV",
    "SensorLog for iPhone and Apple Watch (CSV)",
    "accelerometer, gravity, gyroscope, magnetometer, compass, barometer, steps, positions",
    _matches,
    _read,
    by_rows=True,
)
