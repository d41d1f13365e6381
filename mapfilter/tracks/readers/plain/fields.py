"""Fields of a plain CSV, and the names of columns by which they are known."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping, Sequence
from difflib import SequenceMatcher, get_close_matches
from itertools import permutations

from mapfilter._header_units import parted_unit
from mapfilter.errors import Faults

_ALIKE, _ALIKE_SHORT = 0.8, 0.85
_ALIKE_WORDS = 0.65
"""The same of each of several words: vehicle_type is no vehicle_speed."""
_SHORT = 4
"""Names of so many letters resemble others that differ in one; shorter ones by chance only."""
_UNITS = ("_rad", "_deg", "_radps", "_degps", "_kmh", "_mps", "_km", "_m")
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
        *("ts", "time_stamp", "epoch", "unix_timestamp", "tst", "isotst"),
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
            for name in (f"{word}_{axis}", f"{word}{axis}", f"{word}_{axis}_{unit}")
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
    field: tuple(dict.fromkeys([*names, *(name.replace("_", " ") for name in names)]))
    for field, names in _NAMES.items()
}
"""Fields that a column map may name, and the names of columns that are known without one."""


def usual_fields(names: Collection[str]) -> dict[str, str]:
    """Return the columns that have usual names of fields, by field."""
    found = ((field, next((n for n in some if n in names), "")) for field, some in FIELDS.items())
    return {field: name for field, name in found if name}


MOTION_FIELDS = (
    *("step_m", "steps", "compass_deg", "heading_rad", "turn_rad", "turn_deg", "yaw_rate_radps"),
    *("yaw_rate_degps", "wheel_speed_mps", "wheel_speed_kmh", "odometer_m", "odometer_km"),
)
"""Fields of which motion is made; step_m, steps, a wheel speed or an odometer among them."""


def meant(column: str, taken: Collection[str] = ()) -> str:
    """Return the field that a column's name resembles, in the same unit; "" for none.

    A misspelling keeps the first letter, adds no word, and leaves the axis of a sensor.

    Parameters
    ----------
    column : str
        In lower case.
    taken : collection of str
        Fields that other columns hold.

    Examples
    --------
    >>> [meant(name) for name in ("stepcount", "compas", "compass_rad", "operator")]
    ['steps', 'compass_deg', '', '']
    """
    names = {name: field for field, some in FIELDS.items() if field not in taken for name in some}
    likeness = {name: _likeness(column, name, field) for name, field in names.items()}
    near = max(likeness, key=likeness.__getitem__, default="")
    return names[near] if near and likeness[near] else ""


def _likeness(column: str, name: str, field: str) -> float:
    """Return how alike a column's name and one of a field are; 0 for not enough."""
    text, own = parted_unit(column)[0], parted_unit(name)[0]
    if any(column.endswith(unit) != name.endswith(unit) for unit in _UNITS if unit in column):
        return 0.0
    if text[:1] != own[0] or len(_words(text)) > len(_words(name)):
        return 0.0
    if is_of_axis(field) and text[-1] != field[-1]:
        return 0.0
    words, others = _words(text), _words(own)
    if len(words) == len(others) and any(map(_differ, words, others)):
        return 0.0
    found = [0.0]
    for one in (own, "".join(_words(name))):
        ratio = SequenceMatcher(None, text, one).ratio()
        least = _ALIKE_SHORT if len(one) == _SHORT else _ALIKE
        found += [ratio] if len(one) >= _SHORT and ratio >= least else []
    return max(found)


def _differ(word: str, other: str) -> bool:
    """Return whether two words are no misspelling of one another."""
    return SequenceMatcher(None, word, other).ratio() < _ALIKE_WORDS


def is_of_axis(field: str) -> bool:
    """Return whether a field is of one axis of a sensor."""
    return field.endswith(("_x", "_y", "_z"))


def _words(name: str) -> list[str]:
    return name.replace("_", " ").split()


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
