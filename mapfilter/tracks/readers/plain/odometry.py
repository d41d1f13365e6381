"""Speeds and yaw rates of a vehicle in a plain CSV."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd

from mapfilter._constants import KMH_MPS
from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.tracks.readers.plain.fields import column_option
from mapfilter.tracks.readers.plain.mapped import Mapped, add_rows
from mapfilter.tracks.readers.plain.steps import are_counted
from mapfilter.tracks.readers.recorded.odometer_counts import counted_way
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.tables import FASTEST_TURN_RADPS

_NEAR_S, _COARSE_M, _COURSE_MPS = 1.0, 0.5, 1.0
_SPEEDS = ("speed_mps", "speed_kmh")
_WHEELS, _ODOMETERS = ("wheel_speed_mps", "wheel_speed_kmh"), ("odometer_m", "odometer_km")
_STEPS = ("steps", "step_m")
_OF_PHONES = (*_STEPS, "level_dbm", "bars", "cell", "ci", "cgi", "acc_x")
_TURNS, _RATES = ("turn_rad", "turn_deg"), ("yaw_rate_radps", "yaw_rate_degps")
_FEWEST_ALONE, _ALONE_SHARE = 10, 0.1


def has_odometry(mapped: Mapped) -> bool:
    """Return whether a file has the speed of a vehicle.

    It is that of the wheels, or by their odometer; else any speed, where there are no positions
    whose receiver measured it, no steps, and without a yaw rate nothing of a phone.
    """
    if any(map(mapped.has, (*_WHEELS, *_ODOMETERS))):
        return True
    if not any(map(mapped.has, _SPEEDS)) or _is_placed(mapped) or any(map(mapped.has, _STEPS)):
        return False
    return _is_turned(mapped) or not any(map(mapped.has, _OF_PHONES))


def has_unused_odometry(mapped: Mapped) -> bool:
    """Return whether a speed and a yaw rate are not used: there are positions beside them.

    Beside counted steps the yaw rate is the walker's.
    """
    speeds = any(map(mapped.has, _SPEEDS)) and not has_odometry(mapped)
    return speeds and _is_placed(mapped) and _is_turned(mapped) and not mapped.has("steps")


def turns_alone(mapped: Mapped) -> bool:
    """Return whether a file has the yaw rate of a vehicle whose speeds another file has."""
    others = (*_OF_PHONES, *_SPEEDS)
    beside = has_odometry(mapped) or _is_placed(mapped) or any(map(mapped.has, others))
    return _is_turned(mapped) and not beside


def heading_of_wheels(mapped: Mapped) -> str:
    """Return the field of the headings of a vehicle without a yaw rate; "" for none.

    Beside positions a heading may be the course of their receiver, which ends with them, and beside
    steps it is a walker's. A course that is alone with a speed goes on as that does.
    """
    if not has_odometry(mapped) or any(map(mapped.holds, _RATES)) or _is_placed(mapped):
        return ""
    if any(map(mapped.has, _STEPS)):
        return ""
    return _first_held(mapped, ("heading_rad", "compass_deg", "course_deg"))


def has_turns_of_wheels(mapped: Mapped) -> bool:
    """Return whether a vehicle with neither a yaw rate nor headings has turns from row to row."""
    if not has_odometry(mapped) or any(map(mapped.holds, _RATES)):
        return False
    heading = heading_of_wheels(mapped)
    directed = bool(heading) and mapped.holds(heading)
    return not directed and any(map(mapped.has, _TURNS))


def has_rates_of_steps(mapped: Mapped) -> bool:
    """Return whether steps of known lengths have a yaw rate, and no other direction."""
    if not mapped.has("step_m") or are_counted(mapped) or not _is_turned(mapped):
        return False
    return not any(map(mapped.holds, ("heading_rad", "compass_deg", *_TURNS)))


def add_turns(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    """Add the turns of a vehicle or of steps that are in neither of their own tables."""
    if has_turns_of_wheels(mapped):
        column, values = "turn_rad", mapped.radians("turn")
    elif has_rates_of_steps(mapped):
        column, values = "yaw_rate_radps", mapped.radians("yaw_rate", "ps")
    else:
        return
    columns = {"time_s": time_s, column: values}
    add_rows(reading, "turns", columns, mapped.rows, np.isfinite(values))


def add_odometry(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    """Add the rows with a vehicle's speed or yaw rate, and yaw rates of rows beside them."""
    if not has_odometry(mapped):
        if turns_alone(mapped):
            rates = mapped.radians("yaw_rate", "ps")
            there = np.isfinite(rates) & (np.abs(rates) <= FASTEST_TURN_RADPS)
            columns = {"time_s": time_s, "yaw_rate_radps": rates}
            add_rows(reading, "odometry", columns, mapped.rows, there)
        if _is_placed(mapped) and any(map(mapped.has, _SPEEDS)):
            _note_speeds(mapped, reading)
        return
    _note_units(mapped, reading)
    rates = mapped.radians("yaw_rate", "ps")
    rows = pd.DataFrame({"time_s": time_s, "yaw_rate_radps": rates, "line": mapped.rows.line})
    heading = heading_of_wheels(mapped)
    if heading:
        reading.note(f"{mapped.rows.find(*mapped.names(heading))}: headings of the vehicle")
        rows = rows.assign(heading=mapped.number(heading))
    odometer = _odometer(mapped, reading)
    if not odometer:
        _add_driven(reading, rows, heading, _speeds(mapped, reading), float("nan"))
        return
    # A part of a large file does not show how an odometer grows at its ends.
    unit = mapped.unit(odometer)
    factor = 1.0 if unit is None else unit.factor
    unit_m = (1000.0 if odometer == "odometer_km" else 1.0) * factor
    column = mapped.rows.find(*mapped.names(odometer)) or ""
    ending = partial(_add_counted, reading, heading, column, unit_m)
    reading.keep(rows.assign(count=mapped.number(odometer) / factor), ending)


def _add_counted(
    reading: Reading, heading: str, column: str, unit_m: float, rows: pd.DataFrame
) -> None:
    """Add all rows of a file with the count of an odometer."""
    way = counted_way(rows["time_s"].to_numpy(), rows["count"].to_numpy(), unit_m)
    text = f"{column}: an odometer, speeds are those by which it grows"
    if way.least_m > _COARSE_M:
        text += f", in counts of {way.least_m:.3g} m"
    for count, what in ((way.wraps, "wraps around"), (way.resets, "begins anew or jumps")):
        if count:
            text += f"; it {what} {number_of(count, 'time')}"
    reading.note(text)
    _add_driven(reading, rows, heading, way.speed_mps, way.speed_sd_mps)


def _add_driven(
    reading: Reading, rows: pd.DataFrame, heading: str, speed: Floats, speed_sd_mps: float
) -> None:
    """Add rows with a speed, a yaw rate or a heading of the vehicle.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, yaw_rate_radps, line and, where ``heading`` is a field, heading.
    """
    time_s = rows["time_s"].to_numpy()
    yaw = _at_speeds(reading, time_s, speed, rows["yaw_rate_radps"].to_numpy())
    columns = {"time_s": time_s, "speed_mps": speed, "yaw_rate_radps": yaw}
    columns["speed_sd_mps"] = np.full(len(speed), speed_sd_mps)
    there = np.isfinite(speed)
    if not there.any():
        return
    there |= np.isfinite(yaw) & (np.abs(yaw) <= FASTEST_TURN_RADPS)
    if heading:
        given = rows["heading"].to_numpy()
        if heading == "course_deg":
            # Of a receiver that stands the course is noise.
            moving_mps = np.abs(_between_rows(time_s, speed))
            given = np.where(moving_mps >= _COURSE_MPS, given, np.nan)
        columns["heading_rad" if heading == "heading_rad" else "compass_deg"] = given
        there |= np.isfinite(given)
    kept = {name: values[there] for name, values in columns.items()}
    reading.add("odometry", kept, rows["line"].to_numpy()[there])


def _between_rows(time_s: Floats, speed: Floats) -> Floats:
    """Return speeds with those between the rows that have one; NaN where there is none at all."""
    known = np.flatnonzero(np.isfinite(speed) & np.isfinite(time_s))
    if not known.size:
        return speed
    known = known[np.argsort(time_s[known], kind="stable")]
    return np.where(np.isfinite(speed), speed, np.interp(time_s, time_s[known], speed[known]))


def _odometer(mapped: Mapped, reading: Reading) -> str:
    """Return the field of an odometer that gives the speeds; "" where the wheels do, or none."""
    odometer = _first_held(mapped, _ODOMETERS)
    if not (odometer and any(map(mapped.holds, _WHEELS))):
        return odometer
    column = mapped.rows.find(*mapped.names(odometer))
    reading.ignore(f"{column}: not used beside the speeds of the wheels")
    return ""


def _speeds(mapped: Mapped, reading: Reading) -> Floats:
    """Return speeds of the wheels, else any."""
    # Beside positions a speed is the receiver's, and beside steps a walker's.
    by_wheels = any(map(mapped.holds, _WHEELS)) or (
        any(map(mapped.has, _WHEELS)) and (_is_placed(mapped) or any(map(mapped.has, _STEPS)))
    )
    if not by_wheels:
        reading.note("speed: taken for a vehicle's, as there are no positions beside it")
    return speeds_of(mapped, "wheel_speed" if by_wheels else "speed")


def speeds_of(mapped: Mapped, name: str) -> Floats:
    """Return a speed in m/s, of a field for m/s or one for km/h; NaN where missing."""
    if mapped.prefers(f"{name}_kmh", f"{name}_mps"):
        return KMH_MPS * mapped.number(f"{name}_kmh")
    return mapped.number(f"{name}_mps")


def _first_held(mapped: Mapped, fields: Sequence[str]) -> str:
    """Return the first of some fields with numbers, else the first with a column; "" for none."""
    there = [field for field in fields if mapped.has(field)]
    return next(filter(mapped.holds, there), there[0] if there else "")


def _is_placed(mapped: Mapped) -> bool:
    return mapped.has("lat_deg", "lon_deg") or mapped.has("east_m", "north_m")


def _is_turned(mapped: Mapped) -> bool:
    return any(map(mapped.has, _RATES))


def _note_units(mapped: Mapped, reading: Reading) -> None:
    """Note columns with usual names that state no unit, and what they are taken for."""
    for field, units, other in (
        ("wheel_speed_mps", "m/s; for km/h", "wheel_speed_kmh"),
        ("yaw_rate_radps", "rad/s; for deg/s", "yaw_rate_degps"),
    ):
        column = mapped.rows.find(*mapped.names(field))
        if column is not None and field not in mapped.own and mapped.unit(field) is None:
            option = column_option(other, column)
            reading.note(f"{column}: no unit in its name, taken for {units} {option}")


def _note_speeds(mapped: Mapped, reading: Reading) -> None:
    """Note speeds taken for those of a receiver that a vehicle may have measured."""
    field = next(filter(mapped.has, reversed(_SPEEDS)))
    column = mapped.rows.find(*mapped.names(field))
    option = f"where wheels measured it: {column_option(f'wheel_{field}', column or '')}"
    if has_unused_odometry(mapped):
        reading.note(f"speed and yaw rate not used beside positions; {option}")
        return
    speed = mapped.number(field)
    place = mapped.number("lat_deg" if mapped.has("lat_deg") else "east_m")
    measured, alone = np.isfinite(speed), np.isfinite(speed) & ~np.isfinite(place)
    if (count := int(alone.sum())) >= max(_FEWEST_ALONE, _ALONE_SHARE * measured.sum()):
        why = f"without a position in the row, not used; {option}"
        reading.count(
            lambda n, of: f"{column}: {n} of {number_of(of, 'speed')} {why}",
            *(count, int(measured.sum())),
            ignored=True,
        )


def _at_speeds(reading: Reading, time_s: Floats, speed: Floats, yaw: Floats) -> Floats:
    """Return yaw rates of the rows with speeds: a bus sends each in rows of its own.

    They are taken from the rows with a yaw rate before and after, at most a second away. Rates that
    no vehicle turns by are of no use for that.
    """
    wanted = np.isfinite(speed) & ~np.isfinite(yaw) & np.isfinite(time_s)
    possible = np.abs(yaw) <= FASTEST_TURN_RADPS
    known = possible & np.isfinite(time_s)
    alone = np.isfinite(yaw) & ~possible & ~np.isfinite(speed)
    if count := int(alone.sum()):
        beyond = f"beyond {FASTEST_TURN_RADPS:g} rad/s in rows without speeds"
        reading.count(lambda n: f"{number_of(n, 'yaw rate')} {beyond}", count, ignored=True)
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
        beside = "taken from rows beside those with speeds"
        reading.count(lambda n: f"{number_of(n, 'yaw rate')} {beside}", count)
    return joined
