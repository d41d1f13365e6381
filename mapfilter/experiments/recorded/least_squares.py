"""Positions by least squares, each from the pseudoranges of one moment: a baseline."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.geodesy import project

_LEAST = 4
_ITERATIONS = 10
_A_M, _E2 = 6378137.0, 6.69437999014e-3
"""WGS 84: half axis, and square of the eccentricity."""


def least_squares_positions(rows: pd.DataFrame, crs: str) -> tuple[Floats, Floats, Floats]:
    """Return time, east and north of the moments with four pseudoranges or more.

    Parameters
    ----------
    rows : DataFrame
        A log's table ``pseudoranges``, corrected for clocks of satellites and atmosphere.
    """
    times, places = [], []
    for time_s, own in rows.groupby("time_s"):
        if len(own) >= _LEAST:
            sat = own[["x_m", "y_m", "z_m"]].to_numpy(dtype=np.float64)
            place = _solved(sat, own["pseudorange_m"].to_numpy(dtype=np.float64))
            if np.isfinite(place).all():
                times.append(time_s)
                places.append(place)
    found = np.array(places, dtype=np.float64).reshape(-1, 3)
    lon, lat = _degrees(found)
    east, north = project(crs, lon, lat)
    return np.array(times, dtype=np.float64), np.asarray(east), np.asarray(north)


def _solved(sat: Floats, ranges_m: Floats) -> Floats:
    state = np.zeros(4)
    for _ in range(_ITERATIONS):
        apart = state[:3] - sat
        away = np.linalg.norm(apart, axis=1)
        design = np.column_stack([apart / away[:, None], np.ones(len(sat))])
        change, *_ = np.linalg.lstsq(design, ranges_m - away - state[3], rcond=None)
        state += change
        if np.linalg.norm(change[:3]) < 1e-3:
            return state[:3]
    return np.full(3, np.nan)


def _degrees(places: Floats) -> tuple[Floats, Floats]:
    """Return longitude and latitude of earth-centred places."""
    x, y, z = places.T
    lon, p = np.arctan2(y, x), np.hypot(x, y)
    lat = np.arctan2(z, p * (1 - _E2))
    for _ in range(5):
        n = _A_M / np.sqrt(1 - _E2 * np.sin(lat) ** 2)
        lat = np.arctan2(z + _E2 * n * np.sin(lat), p)
    return np.degrees(lon), np.degrees(lat)
