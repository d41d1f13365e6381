"""Plain CSV: columns by their usual names, or by a map from fields to columns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.radio.identities import BARS_DBM, levels_of_bars, technology
from mapfilter.tracks.readers.columns import (
    Columns,
    header_columns,
    header_names,
    likely_separator,
    only,
)
from mapfilter.tracks.readers.csv_fields import FIELDS, check_fields, meant
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.identities import (
    add_radio,
    available,
    parse_identities,
)
from mapfilter.tracks.readers.recording import Clock, Reading
from mapfilter.tracks.readers.text import Text

_UNIX_S = 1e8

_KMH = 1 / 3.6
_NEAR_S = 1.0
_SPEEDS = ("speed_mps", "speed_kmh")
_CONTENT = (
    *(("lat_deg", "lon_deg"), ("east_m", "north_m"), ("step_m",), ("level_dbm",), ("bars",)),
    *(("acc_x",), ("gyr_x",), ("mag_x",), ("pressure_hpa",), ("wheel_speed_mps",)),
    *(("wheel_speed_kmh",), ("steps",)),
    *((speed, rate) for speed in _SPEEDS for rate in ("yaw_rate_radps", "yaw_rate_degps")),
)
_VITAL = (
    *("step_m", "heading_rad", "turn_rad", "turn_deg", "compass_deg", "steps", "level_dbm", "bars"),
    *("yaw_rate_radps", "yaw_rate_degps", "wheel_speed_mps", "wheel_speed_kmh"),
)
"""Fields that must hold numbers where a column has them."""
_TIMES = "seconds, Unix time, or ISO 8601 such as 2026-05-01T10:00:00+02:00"


@dataclass(frozen=True)
class _Mapped:
    """Columns by field."""

    rows: Columns
    own: Mapping[str, str]

    def names(self, field: str) -> tuple[str, ...]:
        return (self.own[field].lower(),) if field in self.own else FIELDS[field]

    def has(self, *fields: str) -> bool:
        return all(self.rows.find(*self.names(field)) is not None for field in fields)

    def number(self, field: str) -> Floats:
        return self.rows.number(*self.names(field))

    def radians(self, name: str, per: str = "") -> Floats:
        """Return a field that may be in degrees as radians."""
        if self.has(f"{name}_deg{per}"):
            return np.radians(self.number(f"{name}_deg{per}"))
        return self.number(f"{name}_rad{per}")

    def whole(self, field: str) -> Floats:
        return available(*self.rows.whole(*self.names(field)))

    def texts(self, field: str) -> np.ndarray:
        return self.rows.texts(*self.names(field))


def _matches(text: Text) -> bool:
    names = set(header_names(text.first_line, likely_separator(text.first_line)))

    def has(field: str) -> bool:
        return bool(names & set(FIELDS[field]))

    return has("time") and any(all(map(has, fields)) for fields in _CONTENT)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "CSV"
    rows = header_columns(text.data, reading, text.line)
    own = _own_columns(rows, reading, options)
    mapped = _Mapped(rows, own)
    reading.named = tuple(own)
    reading.tallies.columns |= {
        field: column for field in _VITAL if (column := rows.find(*mapped.names(field))) is not None
    }
    time_s = _times(mapped, reading, options)
    if mapped.has("lat_deg", "lon_deg"):
        speed = mapped.number("speed_mps")
        if mapped.has("speed_kmh"):
            speed = _KMH * mapped.number("speed_kmh")
        names = ("lat_deg", "lon_deg", "altitude_m", "accuracy_m", "course_deg")
        columns = {name: mapped.number(name) for name in names}
        there = np.isfinite(columns["lat_deg"]) | np.isfinite(columns["lon_deg"])
        columns |= {"time_s": time_s, "speed_mps": speed}
        _add(reading, "positions", columns, rows, there)
    if mapped.has("east_m", "north_m"):
        columns = {name: mapped.number(name) for name in ("east_m", "north_m", "heading_rad")}
        _add(reading, "places", {"time_s": time_s, **columns}, rows, np.isfinite(columns["east_m"]))
    elif mapped.has("step_m"):
        moved = ("step_m", "heading_rad", "turn_rad", "compass_deg")
        columns = {name: mapped.number(name) for name in moved}
        columns["turn_rad"] = mapped.radians("turn")
        there = np.isfinite(columns["step_m"])
        _add(reading, "motion", {"time_s": time_s, **columns}, rows, there)
    _add_odometry(mapped, reading, time_s)
    _add_sensors(mapped, reading, time_s)
    _add_cells(mapped, reading, time_s)
    taken = {name for field in FIELDS for name in mapped.names(field)}
    found = [field for field in FIELDS if mapped.has(field)]
    reading.fields = tuple(found)
    unread = (name for name in rows.names if name and name not in taken)
    reading.unread = tuple(
        f"{name} ({near}?)" if (near := meant(name, found)) else name for name in unread
    )
    if reading.unread:
        reading.note(f"columns not used: {listed(reading.unread)}; see --column")


def _add(
    reading: Reading,
    table: str,
    columns: Mapping[str, np.ndarray],
    rows: Columns,
    there: np.ndarray,
) -> None:
    """Add the rows of a table that hold something of it."""
    if there.any():
        reading.add(table, *only(columns, rows.line, there))


def _own_columns(rows: Columns, reading: Reading, options: ReadOptions) -> dict[str, str]:
    """Return the part of a column map that is of this file.

    Raises InputError with every fault of it, and where times are missing.
    """
    faults, own = Faults(), dict(options.columns)
    present = f"{', '.join(rows.names)[:300]}"
    check_fields(own, faults)
    for field, column in options.columns.items():
        if field not in FIELDS:
            continue
        if column.lower() not in rows.names:
            if options.shared:
                del own[field]
                continue
            faults.add(f"{reading.path} header", f"a column {column} for {field}", present)
        elif rows.names.count(column.lower()) > 1:
            faults.add(f"{reading.path} header", f"one column {column}", "several")
    if "time" not in own and rows.find(*FIELDS["time"]) is None:
        hint = "--column time=COLUMN"
        faults.add(f"{reading.path} header", "a column of times", present, hint)
    faults.raise_if_any(InputError)
    return own


def _times(mapped: _Mapped, reading: Reading, options: ReadOptions) -> Floats:
    """Return UTC seconds, or seconds from an unknown start where they are small numbers."""
    number = mapped.number("time") if len(mapped.rows) else np.zeros(0)
    known = number[np.isfinite(number)]
    if known.size >= 0.5 * len(number) and known.size and abs(float(np.median(known))) < _UNIX_S:
        reading.clock = Clock("monotonic")
        return number
    reading.notes[:] = [note for note in reading.notes if not note.endswith("taken as missing")]
    time_s, zoned = mapped.rows.times(*mapped.names("time"), zone=options.zone)
    reading.clock = Clock("utc") if zoned else Clock("local", options.zone)
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


def _add_odometry(mapped: _Mapped, reading: Reading, time_s: Floats) -> None:
    wheels = mapped.has("wheel_speed_mps") or mapped.has("wheel_speed_kmh")
    turned = mapped.has("yaw_rate_radps") or mapped.has("yaw_rate_degps")
    if not wheels:
        if not turned or not any(map(mapped.has, _SPEEDS)):
            return
        # Beside positions a speed is that of their receiver.
        if mapped.has("lat_deg", "lon_deg") or mapped.has("east_m", "north_m"):
            # Beside counted steps the yaw rate is the walker's.
            if not mapped.has("steps"):
                reading.note(
                    "speed and yaw rate not used beside positions; name the column wheel_speed_mps"
                )
            return
    name = "wheel_speed" if wheels else "speed"
    speed = mapped.number(f"{name}_mps")
    if mapped.has(f"{name}_kmh"):
        speed = _KMH * mapped.number(f"{name}_kmh")
    yaw = _at_speeds(reading, time_s, speed, mapped.radians("yaw_rate", "ps"))
    columns = {"time_s": time_s, "speed_mps": speed, "yaw_rate_radps": yaw}
    _add(reading, "odometry", columns, mapped.rows, np.isfinite(speed))


def _at_speeds(reading: Reading, time_s: Floats, speed: Floats, yaw: Floats) -> Floats:
    """Return yaw rates of the rows with speeds: a bus sends each in rows of its own.

    They are taken from the rows with a yaw rate before and after, at most a second away.
    """
    wanted = np.isfinite(speed) & ~np.isfinite(yaw) & np.isfinite(time_s)
    known = np.isfinite(yaw) & np.isfinite(time_s)
    if not wanted.any() or not known.any():
        return yaw
    order = np.argsort(time_s[known], kind="stable")
    at_s, rates = time_s[known][order], yaw[known][order]
    after = np.searchsorted(at_s, time_s[wanted])
    near_s = np.minimum(
        np.abs(at_s[np.minimum(after, at_s.size - 1)] - time_s[wanted]),
        np.abs(at_s[np.maximum(after - 1, 0)] - time_s[wanted]),
    )
    found = np.where(near_s <= _NEAR_S, np.interp(time_s[wanted], at_s, rates), np.nan)
    joined = yaw.copy()
    joined[wanted] = found
    if count := int(np.isfinite(found).sum()):
        reading.note(f"{number_of(count, 'yaw rate')} taken from rows beside those with speeds")
    return joined


def _add_sensors(mapped: _Mapped, reading: Reading, time_s: Floats) -> None:
    sensors = (("acc", "accelerometer", "mps2"), ("gyr", "gyroscope", "radps"))
    for short, sensor, unit in (*sensors, ("mag", "magnetometer", "ut")):
        if mapped.has(*(f"{short}_{axis}" for axis in "xyz")):
            columns = {f"{axis}_{unit}": mapped.number(f"{short}_{axis}") for axis in "xyz"}
            there = np.isfinite(columns[f"x_{unit}"])
            _add(reading, sensor, {"time_s": time_s, **columns}, mapped.rows, there)
    for field, table, column in (
        ("pressure_hpa", "barometer", "pressure_hpa"),
        ("steps", "steps", "count"),
    ):
        if mapped.has(field):
            value = mapped.number(field)
            columns = {"time_s": time_s, column: value}
            _add(reading, table, columns, mapped.rows, np.isfinite(value))
    if mapped.has("steps") and not mapped.has("step_m"):
        _add_courses(mapped, reading, time_s)


def _add_courses(mapped: _Mapped, reading: Reading, time_s: Floats) -> None:
    """Add what gives counted steps a direction: a compass, turns, or a rate of turning."""
    magnetic = mapped.number("compass_deg")
    columns = {"time_s": time_s, "magnetic_deg": magnetic}
    _add(reading, "compass", columns, mapped.rows, np.isfinite(magnetic))
    turn = mapped.radians("turn")
    rate = mapped.radians("yaw_rate", "ps")
    # A row with steps alone has an unknown turn; one without either is none of motion.
    turned = np.isfinite(turn) | np.isfinite(rate)
    there = turned | (np.isfinite(mapped.number("steps")) & turned.any())
    columns = {"time_s": time_s, "turn_rad": turn, "yaw_rate_radps": rate}
    _add(reading, "turns", columns, mapped.rows, there)


def _add_cells(mapped: _Mapped, reading: Reading, time_s: Floats) -> None:
    if not any(map(mapped.has, ("level_dbm", "bars", "ci", "cell"))):
        return
    identity = {name: mapped.whole(name) for name in ("mcc", "mnc", "lac", "ci")}
    if mapped.has("cgi"):
        given = parse_identities(mapped.texts("cgi"))
        identity = {
            name: np.where(np.isnan(values), given[name], values)
            for name, values in identity.items()
        }
    columns = {
        **identity,
        "time_s": time_s,
        **{name: mapped.number(name) for name in ("level_dbm", "level_step_db")},
        **{name: mapped.whole(name) for name in ("arfcn", "bsic", "timing_advance")},
    }
    if mapped.has("technology"):
        columns["technology"] = mapped.rows.mapped(technology, *mapped.names("technology"))
    if mapped.has("bars"):
        _add_bars(mapped, columns)
    cell = mapped.texts("cell")
    identified = (cell != "") | ~np.isnan(identity["ci"])
    there = identified | ~np.isnan(columns["level_dbm"])
    if mapped.has("cell"):
        columns["cell"] = cell
    serving = mapped.rows.flags(*mapped.names("role"), true=("serving",))
    neighbour = mapped.rows.flags(*mapped.names("role"), true=("neighbour", "neighbor"))
    serving |= identified & ~neighbour
    columns["role"] = np.array(["neighbour", "serving"], dtype=object)[serving.astype(np.int64)]
    add_radio(reading, *only(columns, mapped.rows.line, there))


def _add_bars(mapped: _Mapped, columns: dict[str, np.ndarray]) -> None:
    """Give rows without a level that of their bars, as in LTE where the technology is unknown."""
    bars = mapped.number("bars")
    families = columns.get("technology", np.full(len(bars), None, dtype=object))
    families = np.array([one if one in BARS_DBM else "LTE" for one in families], dtype=object)
    names = ("level_dbm", "level_step_db", "censored")
    found = {name: columns.get(name, np.zeros(len(bars))).copy() for name in names}
    without = np.isnan(columns["level_dbm"])
    for family in BARS_DBM:
        of = without & (families == family)
        for name, values in zip(names, levels_of_bars(bars[of], family), strict=True):
            found[name][of] = values
    columns |= found


FORMAT = Format(
    "csv",
    "a plain CSV",
    "any program; columns by their usual names, or ``--column FIELD=COLUMN``",
    "positions, places, motion, wheel speed and yaw rate, cells, inertial sensors, pressure",
    _matches,
    _read,
    by_rows=True,
)
