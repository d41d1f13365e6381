"""Fields of a plain CSV, and the names of columns by which they are known."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches
from itertools import permutations

from mapfilter.errors import Faults
from mapfilter.tracks.readers.plain.foreign_names import FOREIGN

_UNIT_WORDS = {
    "_mps": "m/s",
    "_kmh": "km/h",
    "_radps": "rad/s",
    "_degps": "deg/s",
    "_rad": "radians",
    "_deg": "degrees",
    "_km": "km",
    "step_m": "metres each",
    "steps": "a counter",
    "odometer_m": "m",
}
"""Units of fields by their endings, in words."""
_CODES = tuple("/".join(some) for n in (2, 3) for some in permutations(("pci", "psc", "bsic"), n))
"""Names of a column of codes of several technologies."""
_NAMES: Mapping[str, tuple[str, ...]] = {
    "time": (
        *("time", "time_s", "timestamp", "datetime", "utc", "unix_time", "date_time", "t"),
        *("timestamps", "timestep_time", "time_utc_usec"),
        *("ts", "time_stamp", "epoch", "unix_timestamp", "tst", "isotst", "datetimeiso"),
        *("measured_at", "recorded_at", "tow", "tow_s", "gps_tow", "time_of_week"),
        "yyyy-mo-dd hh-mi-ss_sss",
    ),
    "lat_deg": (
        *("lat_deg", "lat", "latitude", "location latitude :", "latitude n/s"),
        *("gps_latitude", "gps_lat", "gnss_latitude", "gnss_lat"),
    ),
    "lon_deg": (
        *("lon_deg", "lon", "lng", "long", "longitude", "longtitude", "location longitude :"),
        "longitude e/w",
        *("gps_longitude", "gps_lon", "gps_long", "gps_lng", "gnss_longitude", "gnss_lon"),
    ),
    "altitude_m": ("altitude_m", "altitude", "ele", "height_m"),
    "accuracy_m": ("accuracy_m", "accuracy"),
    "hdop": ("hdop",),
    "speed_mps": ("speed_mps",),
    "speed_kmh": ("speed_kmh",),
    "course_deg": ("course_deg", "bearing", "course"),
    "east_m": ("east_m", "easting"),
    "north_m": ("north_m", "northing"),
    "heading_rad": ("heading_rad",),
    "step_m": ("step_m",),
    "turn_rad": ("turn_rad",),
    "compass_deg": ("compass_deg", "heading_deg", "azimuth_deg"),
    "turn_deg": ("turn_deg",),
    "yaw_rate_radps": ("yaw_rate_radps", "yaw_rate", "yaw_rate_rad_s", "yaw rate (rad/s)"),
    "yaw_rate_degps": ("yaw_rate_degps", "yaw_rate_deg_s", "yaw_rate_dps", "yaw rate (deg/s)"),
    "wheel_speed_mps": (
        *("wheel_speed_mps", "wheel_speed", "vehicle_speed_mps"),
        *("wheel speed (m/s)", "vehicle speed (m/s)"),
    ),
    "wheel_speed_kmh": (
        *("wheel_speed_kmh", "vehicle_speed_kmh"),
        *("wheel speed (km/h)", "vehicle speed (km/h)"),
    ),
    "odometer_m": ("odometer_m", "odo_m"),
    "odometer_km": ("odometer_km", "odo_km"),
    "role": ("role", "servingcell", "is_serving", "registered", "isregistered"),
    "technology": ("technology", "radio", "rat", "network_type", "net_type", "tech"),
    "cell": ("cell",),
    "cgi": ("cgi", "ecgi", "ncgi"),
    "mcc": ("mcc", "plmn", "mccmnc", "mcc_mnc", "mcc-mnc", "mcc/mnc"),
    "mnc": ("mnc", "net"),
    "lac": ("lac", "tac", "area", "lac/tac", "tac/lac", "lac_tac", "tac_lac"),
    "ci": ("ci", "cid", "eci", "nci", "cellid", "cell_id"),
    "enodeb": ("enodeb", "enodeb_id", "enodebid", "enb", "enb_id", "enbid"),
    "sector": ("sector", "sector_id", "sectorid", "cell_number", "local_cell_id", "lcid"),
    "arfcn": ("arfcn", "uarfcn", "earfcn", "nrarfcn", "nr_arfcn", "narfcn"),
    "bsic": ("bsic", "psc", "pci", "psc_or_pci", "pci_psc", *_CODES),
    "level_dbm": (
        *("level_dbm", "dbm", "rsrp", "rscp", "rssi", "signal_dbm", "ss_rsrp", "ssrsrp"),
    ),
    "bars": ("bars", "signal_bars"),
    "level_step_db": ("level_step_db",),
    "timing_advance": ("timing_advance", "ta"),
    "pressure_hpa": ("pressure_hpa", "pressure"),
    "steps": ("steps", "step_count"),
    **{
        f"q{axis}": (
            *(f"q{axis}", f"q_{axis}", f"quat_{axis}", f"quaternion_{axis}"),
            *(f"rotation_vector_{axis}", f"orientation_q{axis}"),
        )
        for axis in "xyzw"
    },
    **{
        f"{sensor}_{axis}": tuple(
            name
            for word in (sensor, *others)
            for name in (
                f"{word}_{axis}",
                f"{word}{axis}",
                f"{word}.{axis}",
                f"{word}_{axis}_{unit}",
            )
        )
        for sensor, unit, others in (
            ("acc", "mps2", ("accel", "accelerometer", "acceleration")),
            ("gyr", "radps", ("gyro", "gyroscope", "angular_velocity", "w")),
            ("mag", "ut", ("magnetometer", "magnetic")),
        )
        for axis in "xyz"
    },
}
FIELDS: Mapping[str, tuple[str, ...]] = {
    field: tuple(
        dict.fromkeys(
            [*names, *(name.replace("_", " ") for name in names), *FOREIGN.get(field, ())]
        )
    )
    for field, names in _NAMES.items()
}
"""Fields that a column map may name, and the names of columns that are known without one."""


def usual_fields(names: Collection[str]) -> dict[str, str]:
    """Return the columns that have usual names of fields, by field."""
    known = frozenset(names)
    found = ((field, next((n for n in some if n in known), "")) for field, some in FIELDS.items())
    return {field: name for field, name in found if name}


MOTION_FIELDS = (
    *("step_m", "steps", "compass_deg", "heading_rad", "turn_rad", "turn_deg", "yaw_rate_radps"),
    *("yaw_rate_degps", "wheel_speed_mps", "wheel_speed_kmh", "odometer_m", "odometer_km"),
)
"""Fields of which motion is made; step_m, steps, a wheel speed or an odometer among them."""


def is_of_axis(field: str) -> bool:
    """Return whether a field is of one axis of a sensor."""
    return field.endswith(("_x", "_y", "_z"))


def column_option(field: str, column: str) -> str:
    """Return the option that names the column of a field, as a shell takes it.

    Examples
    --------
    >>> column_option("time", "Zeit"), column_option("speed_mps", "v [m/s]")
    ('--column time=Zeit', "--column 'speed_mps=v [m/s]'")
    """
    return f"--column {shlex.quote(f'{field}={column}')}"


def column_options(fields: Sequence[str], column: str) -> str:
    """Return the options that name the column of one of some fields, with the unit of each.

    Examples
    --------
    >>> column_options(["speed_mps", "speed_kmh"], "v")
    '--column speed_mps=v for m/s, or --column speed_kmh=v for km/h'
    >>> column_options(["steps"], "count")
    '--column steps=count'
    """
    options = [column_option(field, column) for field in fields]
    return options[0] if len(options) == 1 else by_unit(fields, options)


def by_unit(fields: Sequence[str], texts: Sequence[str]) -> str:
    """Join texts on fields of one quantity with the unit of each."""
    units = [next((u for end, u in _UNIT_WORDS.items() if f.endswith(end)), f) for f in fields]
    return ", or ".join(f"{text} for {unit}" for text, unit in zip(texts, units, strict=True))


def check_fields(columns: Mapping[str, str], faults: Faults) -> None:
    """Note each field of a column map that does not exist, with the most similar one."""
    for field in columns:
        if field not in FIELDS:
            near = get_close_matches(field, FIELDS, 3)
            # The list of all would hide the likely ones.
            expected = f"a field such as {', '.join(near or FIELDS)}"
            faults.add(f"--column {field}", expected, field, near[0] if near else "")
