"""Speeds and yaw rates of a vehicle in a plain CSV."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.tracks.readers.csv_mapped import Mapped, add_rows
from mapfilter.tracks.readers.recording import Reading
from mapfilter.tracks.readers.tables import FASTEST_TURN_RADPS

_KMH = 1 / 3.6
_NEAR_S = 1.0
_SPEEDS = ("speed_mps", "speed_kmh")


def add_odometry(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    """Add the rows with a vehicle's speed or yaw rate, and yaw rates of rows beside them."""
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
    if not np.isfinite(speed).any():
        return
    turns = np.isfinite(yaw) & (np.isfinite(speed) | (np.abs(yaw) <= FASTEST_TURN_RADPS))
    add_rows(reading, "odometry", columns, mapped.rows, np.isfinite(speed) | turns)


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
        some = number_of(count, "yaw rate")
        reading.ignore(f"{some} beyond {FASTEST_TURN_RADPS:g} rad/s in rows without speeds")
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
