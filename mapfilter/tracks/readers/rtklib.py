"""Solutions of RTKLIB (``.pos``): positions in degrees, standard deviations and velocities.

The layout is that of the manual of RTKLIB 2.4.2, appendix B.1; 2.4.3 adds the velocities.
"""

from __future__ import annotations

import re

import numpy as np

from mapfilter._constants import GPS_EPOCH_S
from mapfilter._types import Floats
from mapfilter.clocks.times import utc_from_gps_s, utc_from_week_s
from mapfilter.errors import InputError, fail
from mapfilter.gnss.almanacs import WEEK_S
from mapfilter.tracks.joining.position_units import RADIUS_68
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import split_blanks, value_columns
from mapfilter.tracks.readers.texts.text import Text

_HEADER = re.compile(
    r"^%\s*(GPST|UTC|JST)[\s,;]+((?:latitude|x-ecef|e-baseline|east)\S*.*)$", re.ASCII
)
_PROGRAM = re.compile(r"^% program\s*:\s*(\S.*)$")
_JST_S = 9 * 3600.0
_WEEK = re.compile(rb"^ ?\d{1,4} \d{1,6}(?:\.\d{0,9})? ", re.MULTILINE)
_PARTED, _PARTS = ["latitude(d'\")", "longitude(d'\")"], (".deg", ".min", ".sec")
_AS_DEGREES = "decimal degrees (solution format Lat/Lon/Height, ddd.ddd of RTKLIB)"


def _header(text: Text) -> re.Match[str] | None:
    """Return the line with the names of the columns; None in another file."""
    if not text.first_line.startswith("%"):
        return None
    return next((found for line in text.head if (found := _HEADER.match(line.strip()))), None)


def _matches(text: Text) -> bool:
    return _header(text) is not None


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    header = _header(text)
    own = [one[1] for line in text.head[:5] if (one := _PROGRAM.match(line.strip()))]
    reading.program = own[0].strip() if own else "RTKLIB"
    if header is None:
        expected = "a line of RTKLIB with the names of columns (output header)"
        raise fail(InputError, str(reading.path), expected, "none")
    names = header[2].replace(",", " ").replace(";", " ").split()
    parted = names[:2] == _PARTED
    if not parted and names[:2] != ["latitude(deg)", "longitude(deg)"]:
        raise fail(InputError, str(reading.path), _AS_DEGREES, " ".join(names[:3]))
    data = re.sub(rb"^%.*$", b"", text.data, flags=re.MULTILINE)
    data = split_blanks(data.replace(b",", b" ").replace(b";", b" "))
    plain = [name.partition("(")[0].lower() for name in names]
    if parted:
        plain[:2] = [f"{name}{part}" for name in plain[:2] for part in _PARTS]
    columns = ["date", "clock", *plain]
    # What follows height and quality may be absent.
    rows = value_columns(
        memoryview(data), reading, columns, " ", text.line, ragged=9 if parted else 5
    )
    weeks = _WEEK.search(data) is not None
    time_s = _weeks_s(rows, header[1]) if weeks else _dates_s(rows, header[1])
    reading.clock = Clock("gps" if header[1] == "GPST" else "utc")
    north_mps, east_mps = (rows.number(name) for name in ("vn", "ve"))
    sd_m = np.sqrt((rows.number("sdn") ** 2 + rows.number("sde") ** 2) / 2)
    positions = {
        "time_s": time_s,
        "lat_deg": _degrees(rows, "latitude"),
        "lon_deg": _degrees(rows, "longitude"),
        "altitude_m": rows.number("height"),
        "accuracy_m": RADIUS_68 * np.where(sd_m > 0, sd_m, np.nan),
        "speed_mps": np.hypot(east_mps, north_mps),
        "course_deg": np.degrees(np.arctan2(east_mps, north_mps)) % 360,
    }
    reading.add("positions", positions, rows.line)


def _degrees(rows: Columns, name: str) -> Floats:
    """Return degrees, also of degrees, minutes and seconds; the sign is that of the degrees."""
    if rows.has(name):
        return rows.number(name)
    degrees, minutes, seconds = (rows.number(f"{name}{part}") for part in _PARTS)
    good = (minutes >= 0) & (minutes < 60) & (seconds >= 0) & (seconds <= 60)
    size = np.abs(degrees) + minutes / 60 + seconds / 3600
    # -0 has a sign, too.
    return np.where(good, np.copysign(size, degrees), np.nan)


def _weeks_s(rows: Columns, system: str) -> Floats:
    """Return UTC seconds of GPS weeks and seconds of the week, which count in another system."""
    week, tow_s = rows.number("date"), rows.number("clock")
    if system == "GPST":
        return utc_from_week_s(week, tow_s)
    late_s = _JST_S if system == "JST" else 0.0
    return np.asarray(GPS_EPOCH_S + WEEK_S * week + tow_s - late_s)


def _dates_s(rows: Columns, system: str) -> Floats:
    """Return UTC seconds of dates and times of day in another system."""
    # Dates have slashes and the year first.
    time_s, _ = rows.joined("date", "clock").times("clock")
    if system == "GPST":
        return utc_from_gps_s(time_s - GPS_EPOCH_S)
    return time_s - (_JST_S if system == "JST" else 0.0)


FORMAT = Format(
    "rtklib",
    "a solution of RTKLIB",
    "RTKLIB and programs with its layout (``.pos``)",
    "positions in degrees, their standard deviations, velocities",
    _matches,
    _read,
)
