"""Columns of a plain CSV whose headers state quantity and unit in words, as ``Speed [km/h]``."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import TypeAlias

from mapfilter._header_units import UNITS, parted_unit, quantity_of
from mapfilter.tracks.readers.plain.fields import FIELDS, is_of_axis, usual_fields
from mapfilter.tracks.readers.plain.foreign_names import BESIDE_PLACES, FOREIGN_QUANTITIES
from mapfilter.tracks.readers.plain.misspelt import meant
from mapfilter.tracks.readers.plain.served_names import served_name

_QUANTITIES: Mapping[str, tuple[str, ...]] = {
    "time": (
        *("time", "timestamp", "date time", "local time", "unix time", "epoch time"),
        *("event time", "message time", "measurement time", "record time", "log time", "fix time"),
        *("elapsed time", "time elapsed", "seconds elapsed", "device time", "gps time", "date"),
        *("tow", "gps tow", "time of week", "gps time of week"),
    ),
    "lat_deg": ("latitude", "lat", "gps latitude", "gps lat"),
    "lon_deg": ("longitude", "lon", "lng", "long", "gps longitude", "gps lon", "gps long"),
    "altitude_m": (
        "altitude",
        "alt",
        "height",
        "elevation",
        "ele",
        "gps altitude",
        "location altitude",
    ),
    "accuracy_m": (
        "accuracy",
        "horizontal accuracy",
        "position accuracy",
        "gps accuracy",
        "location accuracy",
    ),
    "speed_mps": (
        *("speed", "velocity", "gps speed", "gnss speed", "gps velocity", "ground speed"),
        *("speed over ground", "sog", "location speed"),
    ),
    "wheel_speed_mps": (
        *("wheel speed", "vehicle speed", "car speed", "obd speed", "can speed", "odometer speed"),
        *("wheel velocity", "vehicle velocity", "speedometer"),
        *("vehicle speed sensor", "wheel speed sensor"),
    ),
    "course_deg": (
        *("course", "bearing", "gps course", "gps bearing", "course over ground", "cog"),
        *("location bearing", "location orientation"),
    ),
    "odometer_m": (
        *("odometer", "odometer reading", "vehicle odometer", "odo", "mileage", "wheel distance"),
        *("vehicle distance", "total vehicle distance", "distance odometer"),
    ),
    "east_m": ("easting", "east"),
    "north_m": ("northing", "north"),
    "step_m": ("step",),
    "steps": ("steps", "step count", "step counter", "total steps"),
    "turn_rad": ("turn", "turn angle", "heading change"),
    "compass_deg": ("compass", "heading", "azimuth", "compass heading"),
    "yaw_rate_radps": ("yaw rate", "turn rate", "turning rate"),
    "level_dbm": (
        "level",
        "rsrp",
        "rscp",
        "rssi",
        "signal",
        "signal level",
        "signal strength",
        "serving rsrp",
    ),
    "pressure_hpa": (
        "pressure",
        "air pressure",
        "barometer",
        "barometric pressure",
        "atmospheric pressure",
    ),
    **{
        f"{sensor}_{axis}": tuple(f"{word} {axis}" for word in words)
        for sensor, words in (
            ("acc", ("acc", "accel", "accelerometer", "acceleration")),
            ("gyr", ("gyr", "gyro", "gyroscope", "angular velocity", "rate of rotation")),
            ("mag", ("mag", "magnetometer", "magnetic field")),
        )
        for axis in "xyz"
    },
}
QUANTITIES: Mapping[str, tuple[str, ...]] = {
    field: (*words, *FOREIGN_QUANTITIES.get(field, ())) for field, words in _QUANTITIES.items()
}
"""Words for the quantity of a field, in any order; times of the first of several columns."""

_ALSO_MEANT: Mapping[str, tuple[str, ...]] = {
    "east_m": ("utm x", "utm east", "utm easting", "x utm"),
    "north_m": ("utm y", "utm north", "utm northing", "y utm"),
    "cell": ("cell name", "cellname", "serving cell name", "transmitter"),
    "odometer_m": (
        *("distance", "trip distance", "total distance", "distance travelled", "trip"),
        *("distance traveled", "travelled distance", "traveled distance", "cumulative distance"),
    ),
}
"""Words that may mean a quantity, which only a user knows."""
_UNITLESS = ("time", "steps")
"""Fields without a unit, or whose unit is found by their values."""
_IDENTITIES = {"ci", "cgi", "enodeb", "arfcn"}
"""Fields beside which a name of a cell is not needed."""
_OF_PLACES = ("altitude_m", "accuracy_m", "hdop")
"""Fields that are of use beside positions only."""
_COMPASS_UNITS = ("deg", "gon")
"""Radians of a heading count from east elsewhere than in a compass."""
_OTHER_UNIT = {
    "speed_mps": "speed_kmh",
    "wheel_speed_mps": "wheel_speed_kmh",
    "yaw_rate_radps": "yaw_rate_degps",
    "turn_rad": "turn_deg",
    "odometer_m": "odometer_km",
}
"""Fields of the same quantity as others."""
_OTHER_MEANING = {**_OTHER_UNIT, "step_m": "steps"}
"""Fields that a name without a unit may mean as well."""
_LEAST_LETTERS = 3
"""Of an abbreviation."""
_WORD = re.compile(r"[^\W\d_]+")
_Words: TypeAlias = tuple[str, ...]


def _by_words(quantities: Mapping[str, tuple[str, ...]]) -> dict[_Words, dict[str, int]]:
    """Return fields by the sorted words of a quantity, or these as one, and its rank in each."""
    found: dict[_Words, dict[str, int]] = {}
    for field, some in quantities.items():
        for rank, quantity in enumerate(some):
            own = quantity.split()
            for words in (tuple(sorted(own)), ("".join(own),)):
                found.setdefault(words, {}).setdefault(field, rank)
    return found


_BY_WORDS, _ALSO_BY_WORDS = _by_words(QUANTITIES), _by_words(_ALSO_MEANT)


def stated_fields(
    names: Sequence[str], taken: Collection[str], columns: Collection[str]
) -> dict[str, str]:
    """Return the columns whose headers state the quantity and a unit of a field, by field.

    Parameters
    ----------
    names : sequence of str
        Of the columns, in lower case.
    taken : collection of str
        Fields that other columns hold.
    columns : collection of str
        Those columns.

    Examples
    --------
    >>> stated_fields(["time (utc)", "speed [km/h]", "velocity", "yaw_rate_deg_s"], (), ())
    {'time': 'time (utc)', 'speed_mps': 'speed [km/h]', 'yaw_rate_radps': 'yaw_rate_deg_s'}
    """
    found: dict[str, str] = {}
    ranks: dict[str, int] = {}
    for name in names:
        if name in columns:
            continue
        text, unit = parted_unit(name)
        for field, rank in _fields_of(text).items():
            if {field, _OTHER_UNIT.get(field)} & set(taken) or not _fits(field, unit):
                continue
            if rank < ranks.get(field, len(QUANTITIES[field])):
                found[field], ranks[field] = name, rank
    if not {"lat_deg", "lon_deg"} <= {*taken, *found}:
        for field in ("speed_mps", "course_deg"):
            if field in found and parted_unit(found[field])[0] in BESIDE_PLACES:
                del found[field]
    return {field: found[field] for field in QUANTITIES if field in found}


def columns_of(field: str, names: Sequence[str], taken: Collection[str]) -> list[str]:
    """Return all columns whose headers state the quantity and a unit of a field.

    Parameters
    ----------
    field : str
    names : sequence of str
        Of the columns, in lower case.
    taken : collection of str
        Columns of fields.

    Examples
    --------
    >>> columns_of("time", ["time(millisecond)", "datetime(utc)", "lat"], ())
    ['time(millisecond)', 'datetime(utc)']
    """
    parted = ((name, *parted_unit(name)) for name in names)
    return [
        name
        for name, text, unit in parted
        if name not in taken and field in _fields_of(text) and _fits(field, unit)
    ]


def fields_meant(column: str) -> tuple[str, ...]:
    """Return the fields whose quantity a column's name states, or abbreviates, without their unit.

    Examples
    --------
    >>> fields_meant("velocity"), fields_meant("step"), fields_meant("acc"), fields_meant("rpm")
    (('speed_mps', 'speed_kmh'), ('step_m', 'steps'), ('accuracy_m',), ())
    """
    text, unit = parted_unit(column)
    if (not unit and "[" in text) or text in BESIDE_PLACES:
        return ()
    some = [
        one
        for one in _fields_of(text) or _fields_of(text, _ALSO_BY_WORDS) or _abbreviated(text)
        if not unit or unit in UNITS.get(quantity_of(one), ())
    ]
    # One of several units is as good as the other where the header states it.
    others = {} if unit else _OTHER_MEANING
    return tuple(one for field in some for one in (field, others.get(field)) if one)


def likely_fields(column: str, taken: Collection[str]) -> list[str]:
    """Return the fields that a column may be, by the words or the letters of its name.

    Parameters
    ----------
    taken : collection of str
        Fields that other columns hold.
    """
    useless = () if {"lat_deg", "lon_deg"} <= set(taken) else _OF_PLACES
    held = {*taken, *useless}
    if held & _IDENTITIES:
        held.add("cell")
    if stated := [field for field in fields_meant(column) if field not in held]:
        return stated
    # Of several carriers a user knows which is meant.
    if served := [*usual_fields([_of_level(served_name(column))])]:
        return [field for field in served if field not in held]
    near = "" if "[" in column or "(" in column else meant(column, held)
    return [near] if near else []


def _of_level(name: str) -> str:
    return "level_dbm" if name == "level [dbm]" else name


def _fits(field: str, unit: str) -> bool:
    if field in _UNITLESS and not unit:
        return True
    if not quantity_of(field):
        return False
    if field == "compass_deg":
        return unit in _COMPASS_UNITS
    return unit in UNITS[quantity_of(field)]


def _abbreviated(text: str) -> list[str]:
    """Return the field of the only quantity in one word that begins with a text, if any."""
    if len(text) < _LEAST_LETTERS or not text.isalpha():
        return []
    found = {
        field
        for field in {**FIELDS, **QUANTITIES}
        if not is_of_axis(field)
        for name in (*FIELDS.get(field, ()), *QUANTITIES.get(field, ()))
        if name.isalpha() and name.startswith(text)
    }
    return list(found) if len(found) == 1 else []


def _fields_of(text: str, known: Mapping[_Words, dict[str, int]] = _BY_WORDS) -> dict[str, int]:
    """Return the fields whose quantity is written in a text, and by which of its words."""
    every = _WORD.findall(text)
    # A zone is no quantity.
    words = [word for word in every if word != "utc"] or every
    return known.get(tuple(sorted(words)), {})
