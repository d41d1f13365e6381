"""The tables of a recording: their columns, units and ranges.

Times are seconds; positions degrees (WGS 84) or metres; the axes of sensors are those of the
device, right-handed.
"""

from __future__ import annotations

import numpy as np

from mapfilter.tracks.readers.recorded.recorded_field import Field
from mapfilter.tracks.readers.recorded.wound import TURN_DEG, TURN_RAD


def _axes(unit: str, most: float, expected: str) -> tuple[Field, ...]:
    return tuple(
        Field(f"{axis}_{unit}", -most, most, expected, required=True) for axis in ("x", "y", "z")
    )


def _text(name: str, *, required: bool = False) -> Field:
    return Field(name, required=required, text=True)


_TIME = Field("time_s", -1e11, 1e11, "seconds", required=True)


def _no_degrees(name: str) -> tuple[tuple[float, float, str], ...]:
    """Return what values of a latitude or longitude may be that are no degrees."""
    whole = (
        f"degrees times 1e6 or 1e7; of 1e7 name the column {name} [degE7]; or semicircles of FIT, "
        f"{name} [semicircles]"
    )
    return (
        (180.0, 18_060.0, "degrees and minutes as one number (NMEA), or metres for degrees"),
        (18_060.0, 1e7, "metres for degrees"),
        (1e7, 2.0**31, whole),
    )


_LATITUDE = Field(
    *("lat_deg", -90, 90, "degrees in -90..90"),
    required=True,
    hints=((90.0, 180.0, "latitude and longitude swapped"), *_no_degrees("lat")),
)
_LONGITUDE = Field(
    *("lon_deg", -180, 180, "degrees in -180..180"),
    required=True,
    hints=(
        (180.0, 360.0, "degrees east of 0 to 360; take 360 from those above 180"),
        *_no_degrees("lon"),
    ),
)
_METRES = "metres"
_EAST, _NORTH = (
    Field(
        *(f"{axis}_m", -1e8, 1e8, _METRES),
        required=True,
        hints=((1e8, 2e9, "degrees times 1e7 for metres"),),
    )
    for axis in ("east", "north")
)
_DEGREES = ((6.3, 360.0, "degrees given for radians"),)
_RATES = ((20.0, 2000.0, "degrees for radians per second"),)
FASTEST_VEHICLE_MPS, FASTEST_TURN_RADPS = 120.0, 3.5
"""No road vehicle or usual train exceeds 432 km/h, none turns by 200 degrees in a second; the yaw
rates of a vehicle's bus end at 3.92 rad/s (SAE J1939), above which they are marks."""
_NO_VALUE = "what a bus sends where it has no value, such as"
_HEADING = Field(
    *("heading_rad", -6.3, 6.3, "radians in -2π..2π"), hints=_DEGREES, vital=True, turn=TURN_RAD
)
_COMPASS = Field("compass_deg", -180, 360, "degrees in -180..360", vital=True, turn=TURN_DEG)
_TURN = Field(
    *("turn_rad", -6.3, 6.3, "radians in -2π..2π"),
    hints=_DEGREES,
    vital=True,
    marks=3,
    mostly=0.05,
)
_LEVEL = Field(
    *("level_dbm", -200, 0, "dBm in -200..0"),
    hints=(
        (0.0, 4.0, "signal bars; name the column bars"),
        (4.0, 31.0, "ASU of GSM (dBm = 2 ASU - 113), or raw RXLEV (dBm = RXLEV - 110)"),
        (31.0, 63.0, "raw RXLEV (dBm = RXLEV - 110), ASU (LTE: dBm = ASU - 140), or a lost sign"),
        (63.0, 97.0, "a lost sign (70 for -70 dBm), or ASU (LTE: dBm = ASU - 140)"),
        (97.0, 200.0, "a lost sign (70 for -70 dBm)"),
    ),
    vital=True,
)

RECORDED: dict[str, tuple[Field, ...]] = {
    "positions": (
        _TIME,
        _LATITUDE,
        _LONGITUDE,
        Field("altitude_m", -500, 20_000, "metres in -500..20000"),
        Field("accuracy_m", 0, 1e5, "metres >= 0"),
        Field(
            *("speed_mps", 0, 350, "m/s in 0..350"),
            hints=((0.0, np.inf, "a mark of missing values, or exchanged columns"),),
            marks=3,
            mostly=0.1,
            # Forward speeds of an inertial system at rest.
            noise=0.5,
        ),
        Field("course_deg", 0, 360, "degrees in 0..360"),
        _text("provider"),
    ),
    "places": (
        _TIME,
        _EAST,
        _NORTH,
        Field("up_m", -1e5, 1e5, _METRES),
        Field("heading_rad", -6.3, 6.3, "radians"),
    ),
    "truth": (
        _TIME,
        _LATITUDE,
        _LONGITUDE,
        Field("altitude_m", -500, 20_000, "metres in -500..20000"),
    ),
    "true_places": (
        _TIME,
        _EAST,
        _NORTH,
        Field("heading_rad", -6.3, 6.3, "radians"),
    ),
    "radio": (
        _TIME,
        _text("role", required=True),
        _text("technology"),
        Field("mcc", 0, 999, "0..999"),
        Field("mnc", 0, 999, "0..999"),
        Field("lac", 0, 2**24 - 1, "0..16777215"),
        Field("ci", 0, 2**36 - 1, "0..68719476735"),
        _text("cell"),
        Field("arfcn", 0, 3_279_165, "a carrier number"),
        Field("bsic", 0, 1007, "0..1007"),
        _LEVEL,
        Field("timing_advance", 0, 3846, "steps in 0..3846"),
        Field("censored", -1, 1, "-1, 0 or 1"),
        Field("level_step_db", 0, 60, "dB in 0..60"),
    ),
    "motion": (
        _TIME,
        Field("step_m", -1e6, 1e6, _METRES, vital=True),
        _HEADING,
        _TURN,
        _COMPASS,
    ),
    "odometry": (
        _TIME,
        Field(
            *("speed_mps", -FASTEST_VEHICLE_MPS, FASTEST_VEHICLE_MPS, "m/s in -120..120"),
            hints=((FASTEST_VEHICLE_MPS, np.inf, f"{_NO_VALUE} 655.35 km/h, or another unit"),),
            vital=True,
            marks=3,
        ),
        Field(
            *("yaw_rate_radps", -FASTEST_TURN_RADPS, FASTEST_TURN_RADPS, "rad/s in -3.5..3.5"),
            hints=(
                (FASTEST_TURN_RADPS, np.inf, f"degrees for radians, or {_NO_VALUE} 327.67 deg/s"),
            ),
            vital=True,
            marks=3,
            mostly=0.1,
        ),
        Field("speed_sd_mps", 0, 100, "m/s >= 0"),
        Field("yaw_rate_sd_radps", 0, 10, "rad/s >= 0"),
        _HEADING,
        _COMPASS,
    ),
    "poses": (
        _TIME,
        Field("x_m", -1e8, 1e8, _METRES, required=True),
        Field("y_m", -1e8, 1e8, _METRES, required=True),
        Field("z_m", -1e8, 1e8, _METRES, required=True),
        *(Field(f"q{axis}", -1.01, 1.01, "-1..1", required=True) for axis in "xyzw"),
    ),
    "satellites": (
        _TIME,
        _text("satellite", required=True),
        _text("signal"),
        Field("pseudorange_m", 1.5e7, 6e7, "metres in 1.5e7..6e7", required=True),
        Field("sigma_m", 1e-3, 1e5, "metres in 0.001..100000"),
        Field("rate_mps", -2e4, 2e4, "m/s"),
        Field("cn0_dbhz", 0, 100, "dB-Hz in 0..100"),
        *(Field(f"{axis}_m", -6e7, 6e7, _METRES) for axis in ("x", "y", "z")),
    ),
    "accelerometer": (_TIME, *_axes("mps2", 2000, "m/s² in -2000..2000")),
    "linear_acceleration": (_TIME, *_axes("mps2", 2000, "m/s² in -2000..2000")),
    "gravity": (_TIME, *_axes("mps2", 20, "m/s² in -20..20")),
    "gyroscope": (_TIME, *_axes("radps", 200, "rad/s in -200..200")),
    "magnetometer": (_TIME, *_axes("ut", 10_000, "µT in -10000..10000")),
    "orientation": (
        _TIME,
        *(Field(f"q{axis}", -1.01, 1.01, "-1..1", required=True) for axis in "xyzw"),
    ),
    "barometer": (
        _TIME,
        Field(
            *("pressure_hpa", 300, 1100, "hPa in 300..1100"),
            required=True,
            hints=((30_000.0, 110_000.0, "pascal for hPa"),),
        ),
    ),
    "steps": (_TIME, Field("count", 0, 1e9, "steps >= 0", required=True)),
    "compass": (
        _TIME,
        Field(
            *("magnetic_deg", -180, 360, "degrees in -180..360"),
            required=True,
            hints=((360.0, np.inf, "a step counter: the columns of steps and it are exchanged"),),
            vital=True,
            turn=TURN_DEG,
        ),
    ),
    "turns": (
        _TIME,
        _TURN,
        Field("yaw_rate_radps", -20, 20, "rad/s in -20..20", hints=_RATES, vital=True),
    ),
    "ephemerides": (
        _TIME,
        _text("satellite", required=True),
        *(
            Field(name, required=True)
            for name in (
                *("toc_s", "af0", "af1", "af2", "crs", "delta_n", "m0", "cuc", "eccentricity"),
                *("cus", "sqrt_a", "toe_s", "cic", "omega0", "cis", "i0", "crc", "omega"),
                *("omega_dot", "idot", "tgd"),
            )
        ),
        Field("health"),
    ),
    "ionosphere": tuple(
        Field(f"{name}{i}", required=True) for name in ("alpha", "beta") for i in range(4)
    ),
    "cells": (
        _text("technology"),
        Field("mcc", 0, 999, "0..999", required=True),
        Field("mnc", 0, 999, "0..999", required=True),
        Field("lac", 0, 2**24 - 1, "0..16777215", required=True),
        Field("ci", 0, 2**36 - 1, "0..68719476735", required=True),
        _LATITUDE,
        _LONGITUDE,
        Field("range_m", 0, 1e6, "metres >= 0"),
        Field("samples", 0, 1e12, ">= 0"),
    ),
}
"""The columns of each table of a recording; ``cells`` and ``ionosphere`` have no times."""
