"""Names of columns that mean something in the tables of one program only."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapfilter.errors import listed
from mapfilter.tracks.readers.plain.date_parts import of_parts, parts_of_dates
from mapfilter.tracks.readers.plain.served_names import states_serving, with_served_names
from mapfilter.tracks.readers.texts.columns import Columns

_FIT_EPOCH_S = 631_065_600
"""Unix time of 31 December 1989, from which FIT counts seconds."""
_FIT_TIME = "record.timestamp[s]"
_SECONDS = "header.stamp.sec"
_ROS_2 = frozenset((_SECONDS, "header.stamp.nanosec"))
"""The two parts of a time, as converters of bags of ROS 2 write them."""


@dataclass(frozen=True)
class _Program:
    """Names in the tables of a program, in words and with their units.

    Parameters
    ----------
    note : str
        What the names are taken for.
    marks : frozenset of str
        Names that tell such a table.
    meant : mapping of str to str
        Names in words, by those of the program.
    lacks : str
        A name that such a table does not have; "" for none.
    """

    note: str
    marks: frozenset[str]
    meant: Mapping[str, str]
    lacks: str = ""


def _axes(sensor: str, of: str) -> dict[str, str]:
    return {f"field.{of}.{axis}": f"{sensor}_{axis}" for axis in "xyz"}


_ARDUPILOT = {"alt": "altitude [m]", "spd": "speed [m/s]", "gcrs": "course [deg]"}
_FORCES = ("gfx", "gfy", "gfz")
_PROGRAMS = (
    # Forces in g, the magnetic field in µT, the pressure in hPa.
    _Program(
        "gfx, gfy, gfz: taken for forces in g, as of Physics Toolbox",
        frozenset(_FORCES),
        {
            **{name: f"acc_{name[-1]} [g]" for name in _FORCES},
            **{f"b{axis}": f"mag_{axis} [ut]" for axis in "xyz"},
            "p": "pressure [hpa]",
        },
    ),
    # The velocity of an odometry is that of its own frame, ahead and to the left (REP 105).
    _Program(
        "columns as of an odometry of ROS (rostopic echo -p)",
        frozenset(("%time", "field.child_frame_id", "field.twist.twist.linear.x")),
        {
            "%time": "time",
            "field.twist.twist.linear.x": "wheel speed [m/s]",
            "field.twist.twist.angular.z": "yaw rate [rad/s]",
        },
    ),
    _Program(
        "columns as of positions of ROS (rostopic echo -p)",
        frozenset(("%time", "field.latitude", "field.longitude")),
        {"%time": "time", **{f"field.{n}": n for n in ("latitude", "longitude", "altitude")}},
    ),
    _Program(
        "columns as of an inertial sensor of ROS (rostopic echo -p)",
        frozenset(("%time", "field.angular_velocity.x", "field.linear_acceleration.x")),
        {
            "%time": "time",
            **_axes("gyr", "angular_velocity"),
            **_axes("acc", "linear_acceleration"),
        },
    ),
    _Program(
        "columns as of messages of ROS 2",
        _ROS_2,
        {
            _SECONDS: "time",
            "header.stamp.nanosec": "",
            "twist.twist.linear.x": "wheel speed [m/s]",
            "twist.twist.angular.z": "yaw rate [rad/s]",
            **{f"angular_velocity.{axis}": f"gyr_{axis}" for axis in "xyz"},
            **{f"linear_acceleration.{axis}": f"acc_{axis}" for axis in "xyz"},
        },
    ),
    _Program(
        "columns as of positions of PX4 (degrees times 1e7, mm)",
        frozenset(("time_utc_usec", "lat", "lon", "fix_type")),
        {
            "lat": "lat [dege7]",
            "lon": "lon [dege7]",
            "alt": "altitude [mm]",
            "eph": "accuracy [m]",
            "vel_m_s": "speed [m/s]",
        },
    ),
    _Program(
        "columns as of positions of PX4 (degrees, m)",
        frozenset(("time_utc_usec", "latitude_deg", "longitude_deg", "fix_type")),
        {"altitude_msl_m": "altitude [m]", "eph": "accuracy [m]", "vel_m_s": "speed [m/s]"},
    ),
    # Without times that a converter adds those of the GPS week count.
    _Program(
        "columns as of positions of ArduPilot",
        frozenset(("timeus", "gms", "gwk", "lat", "lng")),
        {"gms": "tow [ms]", "gwk": "week", **_ARDUPILOT},
        lacks="timestamp",
    ),
    _Program(
        "columns as of positions of ArduPilot",
        frozenset(("timeus", "gms", "lat", "lng")),
        _ARDUPILOT,
    ),
    _Program(
        "columns as of NAV-PVT of u-blox (mm, mm/s)",
        frozenset(("itow", "lat", "lon", "gspeed")),
        {
            "hmsl": "altitude [mm]",
            "hacc": "accuracy [mm]",
            "gspeed": "speed [mm/s]",
            "headmot": "course [deg]",
        },
    ),
    _Program(
        "columns as of GPSLogger (m, m/s)",
        frozenset(("time", "lat", "lon", "elevation", "speed", "ageofdgpsdata", "dgpsid")),
        {"elevation": "altitude [m]", "speed": "speed [m/s]"},
    ),
    _Program(
        "columns as of gpsd (m, m/s)",
        frozenset(("class", "device", "mode", "time", "lat", "lon")),
        {
            **dict.fromkeys(("altmsl", "alt"), "altitude [m]"),
            "eph": "accuracy [m]",
            "speed": "speed [m/s]",
            "track": "course [deg]",
            "mode": "fix_type",
        },
    ),
    _Program(
        "columns as of OwnTracks (m, km/h)",
        frozenset(("_type", "tst", "lat", "lon")),
        {
            "tst": "timestamp",
            "acc": "accuracy [m]",
            "alt": "altitude [m]",
            "vel": "speed [km/h]",
            "cog": "course [deg]",
        },
    ),
    _Program(
        "columns as of Google's location history (degrees times 1e7)",
        frozenset(("latitudee7", "longitudee7")),
        {
            "timestampms": "timestamp",
            "latitudee7": "lat [dege7]",
            "longitudee7": "lon [dege7]",
            "accuracy": "accuracy [m]",
            "heading": "course [deg]",
            "velocity": "speed [m/s]",
        },
    ),
    _Program(
        "columns as of Mozilla's location service (geosubmit)",
        frozenset(("mobilecountrycode", "mobilenetworkcode", "cellid")),
        {
            "mobilecountrycode": "mcc",
            "mobilenetworkcode": "mnc",
            "locationareacode": "lac",
            "primaryscramblingcode": "psc",
            "radiotype": "radio",
            "signalstrength": "level [dbm]",
            "timingadvance": "ta",
        },
    ),
    _Program(
        "columns as of records of FIT (semicircles, seconds since 1989-12-31)",
        frozenset((_FIT_TIME, "record.position_lat[semicircles]")),
        {
            _FIT_TIME: "time",
            "record.position_lat[semicircles]": "lat [semicircles]",
            "record.position_long[semicircles]": "lon [semicircles]",
            **{f"record.{n}altitude[m]": "altitude [m]" for n in ("enhanced_", "")},
            **{f"record.{n}speed[m/s]": "speed [m/s]" for n in ("enhanced_", "")},
        },
    ),
)


def full_names(names: Sequence[str], own: Collection[str] = ()) -> tuple[str, ...]:
    """Return names of columns with those of a program in words; those of ``own`` stay.

    Examples
    --------
    >>> full_names(["time", "gfx", "gfy", "gfz", "p"])
    ('time', 'acc_x [g]', 'acc_y [g]', 'acc_z [g]', 'pressure [hpa]')
    >>> full_names(["time", "p"])
    ('time', 'p')
    """
    known = _program(names)
    found = tuple(names)
    if known is not None:
        meant = {name: word for name, word in known.meant.items() if name not in own}
        # Of names that mean the same the first one is read.
        words = [meant[name] for name in names if name in meant]
        first = {meant[name]: name for name in reversed(names) if name in meant}
        twice = {word for word in words if words.count(word) > 1}
        found = tuple(
            meant[name]
            if name in meant and (meant[name] not in twice or first[meant[name]] == name)
            else name
            for name in names
        )
    return of_parts(with_served_names(found, own), own)


def with_full_names(rows: Columns, own: Collection[str]) -> Columns:
    """Return columns of which the names of a program are in words, with a note.

    Times in parts (year, month, …) become one column.
    """
    known = _program(rows.names)
    names = full_names(rows.names, own)
    if names == rows.names:
        return rows
    served = with_served_names(rows.names, own)
    renamed = [old for old, new in zip(rows.names, served, strict=True) if old != new]
    if renamed:
        rows.reading.note(f"taken for those of the serving cell: {listed(renamed)}")
    if known is not None:
        rows.reading.note(known.note)
        if known.marks >= _ROS_2:
            seconds, nanoseconds = (rows.number(name) for name in sorted(_ROS_2, key=len))
            rows = rows.filled(_SECONDS, _texts(seconds + nanoseconds / 1e9))
        if _FIT_TIME in known.marks and _FIT_TIME not in own:
            rows = rows.filled(_FIT_TIME, _texts(rows.number(_FIT_TIME) + _FIT_EPOCH_S))
    found = replace(parts_of_dates(rows, own), names=names)
    # A cell without an identity would be a neighbour.
    states = any(map(states_serving, renamed)) and not found.has("role")
    return found.with_column("role", "serving") if states else found


def _program(names: Sequence[str]) -> _Program | None:
    found = (one for one in _PROGRAMS if one.marks <= set(names) and one.lacks not in names)
    return next(found, None)


def _texts(numbers: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(numbers), numbers.astype(np.str_), "").astype(object)
