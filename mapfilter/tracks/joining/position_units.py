"""What turns degrees and radii of positions into metres and standard deviations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats

METRES_PER_DEGREE = 111_195.0
"""Of a great circle of the mean earth: for differences, not for places."""

RADIUS_68 = 1.515
"""Radius of 68 % of a two-dimensional normal distribution, in standard deviations."""

UERE_M = 4.0
"""Radius of 68 % of the errors of a receiver's positions, for a dilution of precision (HDOP) of 1.
"""


def near_deg(lon_deg: ArrayLike, about_deg: float) -> Floats:
    """Return longitudes as those within 180 degrees of another one: -179.9 beside 179.9 is 180.1.

    Examples
    --------
    >>> near_deg([179.9, -179.9, 0.0], 179.9).round(4).tolist()
    [179.9, 180.1, 0.0]
    """
    lon = np.asarray(lon_deg, dtype=np.float64)
    return np.asarray(lon - 360.0 * np.round((lon - about_deg) / 360.0))


def continuous_deg(lon_deg: ArrayLike) -> Floats:
    """Return longitudes of one track that go on across 180 degrees, from the first known one."""
    lon = np.asarray(lon_deg, dtype=np.float64)
    known = lon[np.isfinite(lon)]
    return near_deg(lon, float(known[0])) if known.size else lon


def metres_about_middle(lon_deg: ArrayLike, lat_deg: ArrayLike) -> tuple[Floats, Floats]:
    """Return degrees of one track as metres east and north, on a plane that touches the earth.

    It touches in the middle latitude of the track: those of two tracks are no positions in common.
    Longitudes may lie on both sides of 180 degrees.

    Examples
    --------
    >>> east_m, north_m = metres_about_middle([179.9, -179.9], [60.0, 60.0])
    >>> east_m.round().tolist(), north_m.tolist()
    ([-5560.0, 5560.0], [0.0, 0.0])
    """
    lon, lat = (np.asarray(degrees, dtype=np.float64) for degrees in (lon_deg, lat_deg))
    known = np.isfinite(lon) & np.isfinite(lat)
    if not known.any():
        return np.full(lon.shape, np.nan), np.full(lat.shape, np.nan)
    lon = continuous_deg(lon)
    middle_lon, middle_lat = float(np.median(lon[known])), float(np.median(lat[known]))
    wide = np.cos(np.radians(middle_lat))
    return METRES_PER_DEGREE * wide * (lon - middle_lon), METRES_PER_DEGREE * (lat - middle_lat)
