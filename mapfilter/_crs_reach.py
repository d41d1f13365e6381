"""Places at which the coordinates of a projected CRS mean nothing: far outside of its area."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pyproj import CRS

from mapfilter._types import Bools, Floats
from mapfilter.geodesy import project, projection, utm_crs

_SCALE_TOLERANCE, _NEAR_TOLERANCE = 0.05, 0.002
_ROW, _NO_SQUARE = 1000, 1 << 40
"""Squares of one degree are numbered by 1000 times their western side plus their southern one."""
_UNDONE = {
    "latitude and longitude swapped": ((1, 1),),
    "a lost sign of longitude": ((-1, 1),),
    "a lost sign of latitude": ((1, -1),),
    "latitude and longitude swapped, with a lost sign": ((1, -1), (-1, 1), (-1, -1)),
}
"""Signs of the true longitude and latitude, by the mistake."""
_FARTHEST_DEG = 60.0
"""Beyond, a transverse Mercator projection comes back to lengths that are right."""


@lru_cache(maxsize=16)
def area_of_use(crs: str) -> Any:
    """Return the area that a CRS is made for, west, south, east and north; None if it has none."""
    return CRS.from_user_input(crs).area_of_use


def project_within(
    crs: str, lon_deg: ArrayLike, lat_deg: ArrayLike
) -> tuple[Floats, Floats, Bools]:
    """Turn longitudes and latitudes into east and north metres, and tell which are beyond a CRS.

    Beyond are places without coordinates in it, and those outside of its area where its lengths
    are off by more than 5 %, or that are 60 degrees of longitude away.

    Examples
    --------
    >>> project_within("EPSG:2393", [25.0, 90.0, 207.0], [60.0, 60.0, 60.0])[2].tolist()
    [False, True, True]
    """
    lon, lat = np.atleast_1d(np.asarray(lon_deg, float)), np.atleast_1d(np.asarray(lat_deg, float))
    east_m, north_m = project(crs, lon, lat)
    beyond = ~(np.isfinite(east_m) & np.isfinite(north_m))
    # Of whole degrees, as those of a journey are few.
    square = np.full(lon.shape, _NO_SQUARE, dtype=np.int64)
    known = ~beyond
    square[known] = np.floor(lon[known]) * _ROW + np.floor(lat[known])
    found = np.unique(square[known]).tolist()
    absurd = [one for one in found if _is_absurd(crs, *_corner_deg(one))]
    return east_m, north_m, beyond | np.isin(square, absurd) if absurd else beyond


def ground_m(crs: str, lon_deg: float, lat_deg: float, length_m: float = 100.0) -> float:
    """Return how long a length of a CRS is on the ground, where that differs most.

    Examples
    --------
    >>> [f"{ground_m(crs, 25.0, 60.0):.0f}" for crs in ("EPSG:32635", "EPSG:3857")]
    ['100', '50']
    """
    return length_m / max(_scales(crs, lon_deg, lat_deg), key=lambda scale: abs(scale - 1))


def is_on_the_ground(crs: str, lon_deg: float, lat_deg: float) -> bool:
    """Return whether metres of a CRS are metres on the ground at a place, within 5 %."""
    return _is_true_to_scale(crs, lon_deg, lat_deg, _SCALE_TOLERANCE)


def is_used_at(crs: str, lon_deg: float, lat_deg: float) -> bool:
    """Return whether a place is in the area that a CRS is made for; not where it states none."""
    area = area_of_use(crs)
    if area is None or not (np.isfinite(lon_deg) and np.isfinite(lat_deg)):
        return False
    within = 0 <= (lon_deg - area.west) % 360 <= ((area.east - area.west) % 360 or 360)
    return within and bool(area.south <= lat_deg <= area.north)


def likely_mistake(crs: str, lon_deg: float, lat_deg: float) -> str:
    """Return the likely mistake of a place beyond a CRS: what puts it there, else the zone there.

    Examples
    --------
    >>> likely_mistake("EPSG:32635", 60.2, 25.0), likely_mistake("EPSG:32635", -25.0, 60.2)
    ('latitude and longitude swapped', 'a lost sign of longitude')
    """
    for mistake, signs in _UNDONE.items():
        for east, north in signs:
            lon, lat = (lat_deg, lon_deg) if "swapped" in mistake else (lon_deg, lat_deg)
            if abs(lat) <= 90 and _is_usual(crs, east * lon, north * lat):
                return mistake
    return zone_hint(lon_deg, lat_deg)


def zone_hint(lon_deg: float, lat_deg: float) -> str:
    """Return that a place is one of another region, with the zone that is used there."""
    if not (abs(lat_deg) <= 90 and np.isfinite(lon_deg)):
        return "a position of another place"
    zone = utm_crs((lon_deg + 180) % 360 - 180, lat_deg)
    return f"a wrong position, or a CRS of another region: at that place it is {zone}"


def _is_usual(crs: str, lon_deg: float, lat_deg: float) -> bool:
    """Return whether a place is in the area of a CRS, or, of one without, its lengths are right."""
    if area_of_use(crs) is None:
        return _is_true_to_scale(crs, lon_deg, lat_deg, _NEAR_TOLERANCE)
    return is_used_at(crs, lon_deg, lat_deg)


def _corner_deg(square: int) -> tuple[int, int]:
    west = round(square / _ROW)
    return west, square - west * _ROW


@lru_cache(maxsize=4096)
def _is_absurd(crs: str, west_deg: int, south_deg: int) -> bool:
    """Return whether coordinates in a square of one degree mean nothing."""
    lon, lat, area = west_deg + 0.5, min(south_deg + 0.5, 90.0), area_of_use(crs)
    if area is not None:
        half = ((area.east - area.west) % 360) / 2 or 180.0
        outside = abs((lon - area.west - half + 180) % 360 - 180) - half
        if outside <= 1 and area.south - 1 <= lat <= area.north + 1:
            return False
        if outside > _FARTHEST_DEG:
            return True
    return not _is_true_to_scale(crs, lon, lat, _SCALE_TOLERANCE)


def _is_true_to_scale(crs: str, lon_deg: float, lat_deg: float, tolerance: float) -> bool:
    return all(abs(scale - 1) <= tolerance for scale in _scales(crs, lon_deg, lat_deg))


def _scales(crs: str, lon_deg: float, lat_deg: float) -> tuple[float, float]:
    """Return the scales along the meridian and the parallel."""
    factors = projection(crs).get_factors(lon_deg, lat_deg)
    return float(factors.meridional_scale), float(factors.parallel_scale)
