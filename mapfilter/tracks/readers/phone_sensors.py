"""CSV of phyphox and of Sensor Logger: one file for each sensor."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.clocks.times import unix_seconds
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain.fields import usual_fields
from mapfilter.tracks.readers.plain.headers import stated_fields
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text, read_text
from mapfilter.tracks.readers.texts.zipped import has_recording

_AXES = ("x", "y", "z")
_UNITS = {
    "accelerometer": "mps2",
    "linear_acceleration": "mps2",
    "gravity": "mps2",
    "gyroscope": "radps",
    "magnetometer": "ut",
}
_UNIT = re.compile(r"\(([^()]*)\)\s*$")
_PHYPHOX_WORDS = ("m/s", "rad/s", "t)", "hpa", "latitude")
"""Units and names of the sensors that are read, in the headers of their files."""
_OF_POSITIONS = {
    **dict.fromkeys(("lat_deg", "lon_deg", "course_deg"), ")"),
    **dict.fromkeys(("altitude_m", "accuracy_m"), "(m)"),
    "speed_mps": "(m/s)",
}
"""Fields of positions, and how the names of their columns end."""
_EARTH_MPS2, _EARTH_UT = (8.5, 11.5), (15.0, 90.0)
_KILOPASCAL = (30.0, 110.0)
_SENSOR_LOGGER = {
    "totalacceleration": "accelerometer",
    "accelerometeruncalibrated": "accelerometer",
    "accelerometer": "linear_acceleration",
    "gravity": "gravity",
    "gyroscopeuncalibrated": "gyroscope",
    "gyroscope": "gyroscope",
    "magnetometeruncalibrated": "magnetometer",
    "magnetometer": "magnetometer",
}
_OTHERS_IN_JSON = ("location", "orientation", "barometer", "pedometer", "compass")
"""Beginnings of the names of what is read besides."""


def _names(text: Text) -> tuple[str, ...]:
    return header_names(text.first_line, likely_separator(text.first_line))


def _is_phyphox(text: Text) -> bool:
    names = _names(text)
    if len(names) < 2 or names[0] != "time (s)" or not all("(" in name for name in names[1:]):
        return False
    # An export also has files of light, sound and other sensors that are not read.
    if not any(word in name for name in names[1:] for word in _PHYPHOX_WORDS):
        return False
    columns = {**usual_fields(names), **stated_fields(names, (), ())}
    fields = columns.keys() - {"time"}
    if {"lat_deg", "lon_deg"} <= fields <= _OF_POSITIONS.keys():
        units = ((columns[field], unit) for field, unit in _OF_POSITIONS.items() if field in fields)
        return all(name.endswith(unit) for name, unit in units)
    # Others are columns of a table of several sensors, or of a vehicle.
    axes = {name[:-1] for name in fields if name[-2:] in ("_x", "_y", "_z")}
    one = len(axes) == 1 and len(fields) == len(_AXES) and len(_axes_of(_bare(names))) == len(_AXES)
    return not fields or one or fields == {"pressure_hpa"}


def _bare(names: Sequence[str]) -> list[str]:
    """Return names without their units."""
    return [_UNIT.sub("", name).strip() for name in names]


def _axes_of(names: Sequence[str]) -> dict[str, str]:
    """Return the names of the axes x, y and z, which are or end with these."""
    found = {axis: next((n for n in names if n.split()[-1:] == [axis]), "") for axis in _AXES}
    return {axis: name for axis, name in found.items() if name}


def _read_phyphox(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "phyphox", Clock("monotonic")
    rows = header_columns(text.data, reading, text.line)
    units = {name: _UNIT.sub("", name).strip() for name in rows.names}
    rows = replace(rows, names=tuple(units[name] for name in rows.names))
    time_s = _phyphox_time(rows.number("time"), reading)
    titles = " ".join(units)
    if rows.has("latitude", "longitude"):
        columns = {
            "time_s": time_s,
            "lat_deg": rows.number("latitude"),
            "lon_deg": rows.number("longitude"),
            "altitude_m": rows.number("altitude", "height"),
            "speed_mps": rows.number("speed", "velocity"),
            "course_deg": rows.number("direction"),
            "accuracy_m": rows.number("horizontal accuracy"),
        }
        reading.add("positions", columns, rows.line)
        return
    if "hpa" in titles:
        pressure = rows.number("pressure", "x")
        reading.add("barometer", {"time_s": time_s, "pressure_hpa": pressure}, rows.line)
        return
    sensor = "gyroscope" if "rad/s" in titles else "magnetometer" if "t)" in titles else ""
    if not sensor and "m/s" in titles:
        linear = (
            "linear" in titles or "without g" in titles or "linear" in reading.path.name.lower()
        )
        sensor = "linear_acceleration" if linear else "accelerometer"
    _add_axes(rows, reading, sensor, time_s, [name for name in rows.names if name != "time"])


def _add_axes(
    rows: Columns, reading: Reading, sensor: str, time_s: Floats, names: list[str]
) -> None:
    """Add a sensor of three axes, whose names are or end with x, y and z."""
    axes = _axes_of(names)
    if not (sensor and len(axes) == len(_AXES)):
        expected = "axes x, y and z of an accelerometer, gyroscope or magnetometer, or a pressure"
        raise fail(InputError, f"{reading.path} header", expected, ", ".join(names)[:100])
    columns = {f"{axis}_{_UNITS[sensor]}": rows.number(axes[axis]) for axis in _AXES}
    reading.add(sensor, {"time_s": time_s, **columns}, rows.line)


def _phyphox_time(seconds: Floats, reading: Reading) -> Floats:
    """Return UTC seconds where the export's ``meta/time.csv`` is beside the file."""
    path = Path(reading.path).parent / "meta" / "time.csv"
    if not has_recording(path):
        return seconds
    aside = Reading(path)
    try:
        rows = header_columns(read_text(path).data, aside)
    except MapfilterError:
        return seconds
    start = rows.texts("event") == "START"
    at = rows.number("experiment time")[start]
    system = rows.number("system time")[start]
    good = np.isfinite(at) & np.isfinite(system)
    if not good.any():
        reading.note("meta/time.csv without a usable start; times count from an unknown one")
        return seconds
    at, system = at[good], system[good]
    index = np.maximum(np.searchsorted(at, seconds, side="right") - 1, 0)
    reading.clock = Clock("utc")
    reading.note("times are UTC by meta/time.csv")
    return np.asarray(seconds + (system - at)[index])


def _is_sensor_logger(text: Text) -> bool:
    names = set(_names(text))
    held = {"x", "latitude", "pressure", "qx", "steps", "magneticbearing"}
    return {"time", "seconds_elapsed"} <= names and bool(held & names)


def _read_sensor_logger(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "Sensor Logger", Clock("utc")
    rows = header_columns(text.data, reading, text.line)
    if not rows.has("sensor"):
        _add_logged(rows, reading, reading.path.name)
        return
    # Its JSON has the rows of all sensors; each fills columns of its own.
    words = rows.texts("sensor")
    taken: set[str] = set()
    for word in sorted(dict.fromkeys(words.tolist()), key=_uncalibrated_last):
        at = np.flatnonzero(words == word)
        sensor = _of_json(word)
        if not sensor or sensor in taken:
            why = "" if not sensor else f" (a second {sensor})"
            reading.ignore(f"{word or 'no name'}: {number_of(at.size, 'row')} not used{why}")
            continue
        taken.add(sensor)
        held = [name for name in rows.names if (rows.texts(name)[at] != "").any()]
        columns = {name: (name, at, np.arange(at.size)) for name in held}
        _add_logged(rows.picked(columns, rows.line[at]), reading, word)


def _uncalibrated_last(word: str) -> bool:
    return "uncalibrated" in word.lower()


def _of_json(word: str) -> str:
    """Return the sensor of a name in JSON; "" for one that is not read."""
    stem = re.sub(r"[^a-z]", "", word.lower())
    if stem in _SENSOR_LOGGER:
        return _SENSOR_LOGGER[stem]
    return stem if stem.startswith(_OTHERS_IN_JSON) else ""


def _add_logged(rows: Columns, reading: Reading, name: str) -> None:
    """Add what a file of Sensor Logger, or a sensor in its JSON, has; its name tells sensors."""
    time_s = unix_seconds(rows.number("time"))
    if rows.has("latitude", "longitude"):
        speed, course = rows.number("speed"), rows.number("bearing")
        columns = {
            "time_s": time_s,
            "lat_deg": rows.number("latitude"),
            "lon_deg": rows.number("longitude"),
            "altitude_m": rows.number("altitude"),
            "accuracy_m": rows.number("horizontalaccuracy"),
            # -1 where unknown.
            "speed_mps": np.where(speed < 0, np.nan, speed),
            "course_deg": np.where(course < 0, np.nan, course),
            "provider": _provider(name),
        }
        reading.add("positions", columns, rows.line)
    elif rows.has("pressure"):
        pressure = rows.number("pressure")
        typical = np.nanmedian(pressure) if np.isfinite(pressure).any() else np.nan
        if _KILOPASCAL[0] <= typical <= _KILOPASCAL[1]:
            pressure = 10.0 * pressure
            reading.note("barometer: pressures in kPa, turned into hPa")
        reading.add("barometer", {"time_s": time_s, "pressure_hpa": pressure}, rows.line)
    elif rows.has("qx", "qy", "qz", "qw"):
        columns = {f"q{axis}": rows.number(f"q{axis}") for axis in "xyzw"}
        reading.add("orientation", {"time_s": time_s, **columns}, rows.line)
    elif rows.has("steps"):
        reading.add("steps", {"time_s": time_s, "count": rows.number("steps")}, rows.line)
    elif rows.has("magneticbearing"):
        columns = {"time_s": time_s, "magnetic_deg": rows.number("magneticbearing")}
        reading.add("compass", columns, rows.line)
    elif rows.has("x", "y", "z"):
        _add_axes(rows, reading, _sensor(rows, reading, name), time_s, ["x", "y", "z"])
    else:
        got = ", ".join(rows.names)[:100]
        expected = "columns of a sensor or of positions"
        raise fail(InputError, f"{reading.path} header", expected, got)


def _provider(name: str) -> str:
    """Return the provider of positions by the name of their file, such as LocationGps.csv."""
    stem = re.sub(r"[^a-z]", "", name.split(".")[0].lower())
    return next((one for one in ("gps", "network") if stem.endswith(one)), "fused")


def _sensor(rows: Columns, reading: Reading, named: str) -> str:
    """Return the sensor by the file's name, else by what a phone at rest measures."""
    stem = re.sub(r"[^a-z]", "", named.split(".")[0].lower())
    for name, sensor in _SENSOR_LOGGER.items():
        if stem.startswith(name) or stem.endswith(name):
            return sensor
    norm = np.sqrt(sum(rows.number(axis) ** 2 for axis in _AXES))
    typical = float(np.nanmedian(norm)) if np.isfinite(norm).any() else 0.0
    for sensor, (low, high) in (("accelerometer", _EARTH_MPS2), ("magnetometer", _EARTH_UT)):
        if low <= typical <= high:
            reading.note(f"taken for a {sensor} by its values (median {typical:.1f})")
            return sensor
    expected = "the name of a sensor, such as Gyroscope.csv"
    raise fail(InputError, str(reading.path), expected, reading.path.name, "a renamed file")


PHYPHOX = Format(
    "phyphox",
    "a phyphox CSV",
    "phyphox (CSV export; commas, semicolons or tabs, decimal points or commas)",
    "accelerometer, linear acceleration, gyroscope, magnetometer, barometer, positions; "
    "UTC by ``meta/time.csv`` beside the file",
    _is_phyphox,
    _read_phyphox,
    by_rows=True,
)
SENSOR_LOGGER = Format(
    "sensorlogger",
    "a Sensor Logger CSV",
    "Sensor Logger (CSV export, one file for each sensor)",
    "accelerometer, gravity, gyroscope, magnetometer, orientation, compass, barometer, steps, "
    "positions",
    _is_sensor_logger,
    _read_sensor_logger,
    by_rows=True,
)
