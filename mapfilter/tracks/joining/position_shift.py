"""Times at which positions of two recordings agree best."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter.geodesy import unproject
from mapfilter.tracks.joining.position_units import METRES_PER_DEGREE, continuous_deg, near_deg
from mapfilter.tracks.readers.recorded.recording import Recording

_MOST_POINTS = 400
COMMON_SHARE = 0.5
"""Least share of a recording that another one has in common with it."""
_FINE_S = 0.1
_GAP_S = 30.0
"""A silence longer than this, and than so many usual ones, is a gap: places in it are unknown."""
_GAPS = 10.0

TimedPlaces = tuple[Floats, Floats, Floats]
"""Seconds, longitudes that go on across 180 degrees, and latitudes."""


def places_of(recording: Recording) -> TimedPlaces | None:
    """Return times and positions, or None where there are few."""
    for name in ("positions", "truth"):
        if name in recording.tables and len(recording.tables[name]) >= 3:
            rows = recording.tables[name]
            return _degrees(rows["time_s"], rows["lon_deg"], rows["lat_deg"])
    for name in ("places", "true_places"):
        if recording.crs and name in recording.tables and len(recording.tables[name]) >= 3:
            rows = recording.tables[name]
            lon, lat = unproject(recording.crs, rows["east_m"], rows["north_m"])
            return _degrees(rows["time_s"], lon, lat)
    return None


def _degrees(time_s: pd.Series, lon_deg: object, lat_deg: object) -> TimedPlaces:
    time, first = np.unique(time_s.to_numpy(dtype=np.float64), return_index=True)
    lon = np.asarray(lon_deg, dtype=np.float64)[first]
    lat = np.asarray(lat_deg, dtype=np.float64)[first]
    return time, continuous_deg(lon), lat


def median_apart_m(one: TimedPlaces, other: TimedPlaces, shift_s: float, least: float) -> float:
    """Return the median distance of a shifted track; NaN where little of it is in common.

    Moments in a gap of the first track do not count: nobody knows where it was.
    """
    step = max(1, len(other[0]) // _MOST_POINTS)
    time = other[0][::step] + shift_s
    inside = (time >= one[0][0]) & (time <= one[0][-1]) & _known(one[0], time)
    if inside.sum() < 3 or inside.mean() < least:
        return float("nan")
    lon, lat = (degrees[::step][inside] for degrees in other[1:])
    # Of differences, not of places: so scales of two tracks cannot part them.
    east = near_deg(np.interp(time[inside], one[0], one[1]) - lon, 0.0) * np.cos(np.radians(lat))
    north = np.interp(time[inside], one[0], one[2]) - lat
    return METRES_PER_DEGREE * float(np.median(np.hypot(east, north)))


def _known(time_s: Floats, at_s: Floats) -> Bools:
    """Return which moments lie in no gap of a track, such as that of a receiver that is jammed."""
    if len(time_s) < 2:
        return np.isin(at_s, time_s)
    after = np.searchsorted(time_s, at_s).clip(1, len(time_s) - 1)
    silent_s = np.diff(time_s)
    longest_s = max(_GAP_S, _GAPS * float(np.median(silent_s)))
    on_a_row = (time_s[after] == at_s) | (time_s[after - 1] == at_s)
    known: Bools = on_a_row | (silent_s[after - 1] <= longest_s)
    return known


def best_place_shift(one: TimedPlaces, other: TimedPlaces, shifts: Floats) -> tuple[float, float]:
    """Return the shift of the least median distance, and that distance."""
    least = min(COMMON_SHARE, 0.9 * np.ptp(one[0]) / max(np.ptp(other[0]), 1e-9) * COMMON_SHARE)
    apart = np.array([median_apart_m(one, other, shift, least) for shift in shifts])
    if not np.isfinite(apart).any():
        return 0.0, float("inf")
    best, step = float(shifts[np.nanargmin(apart)]), float(shifts[1] - shifts[0])
    fine = best + np.arange(-step, step + _FINE_S, _FINE_S)
    apart = np.array([median_apart_m(one, other, shift, least) for shift in fine])
    if not np.isfinite(apart).any():
        return best, float("inf")
    return float(fine[np.nanargmin(apart)]), float(np.nanmin(apart))
