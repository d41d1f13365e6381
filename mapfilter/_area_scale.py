"""Areas in metres: those of the ground, on one side of 180° of longitude."""

from __future__ import annotations

from typing import Any

import numpy as np

from mapfilter.degrees import NO_MAPS, ONE_SIDE
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import known_crs, unproject

SWAPPED = "east and north exchanged: systems may name north first, files hold east"
_EARTH_RADIUS_M = 6_371_000.0
_SHORT_M = 100.0
_SCALE_TOLERANCE = 0.03
_INCLINED = 0.06
"""How far meridians are inclined to the grid, at most, as a tangent."""


def check_scale(crs: str, bounds_m: tuple[float, float, float, float], where: str) -> None:
    """Check that metres of a CRS are metres on the ground in the middle of an area.

    Raises
    ------
    InputError
        They differ by more than 3 %: the CRS is made for another region or is Web Mercator.
    """
    west, south, east, north = bounds_m
    # An area that ends at 180° has corners beyond it, as meridians are inclined to the grid.
    half = max((east - west) / 2 - _INCLINED * max(east - west, north - south), _SHORT_M / 2)
    middle_m = np.array([[(west + east) / 2], [(south + north) / 2]])
    ends_m = middle_m + np.array([[0.0, _SHORT_M, -half, half], [0.0, 0.0, 0.0, 0.0]])
    lon_rad, lat_rad = np.radians(unproject(crs, *ends_m))
    expected = "a CRS whose metres are metres on the ground in this area"
    if not (np.isfinite(lon_rad).all() and np.isfinite(lat_rad).all()):
        got = f"{crs}, in which it has no place"
        raise fail(InputError, where, expected, got, _likely(crs, bounds_m))
    if np.ptp(lon_rad) > np.pi:
        got = f"{crs}, {west:.0f}..{east:.0f} m east, across it"
        raise fail(InputError, where, ONE_SIDE, got, f"{NO_MAPS}, and cut rasters there")
    along_rad = np.hypot((lon_rad[1] - lon_rad[0]) * np.cos(lat_rad[0]), lat_rad[1] - lat_rad[0])
    ground_m = float(along_rad * _EARTH_RADIUS_M)
    if not abs(ground_m / _SHORT_M - 1) <= _SCALE_TOLERANCE:
        got = f"{crs}, of which {_SHORT_M:g} m are {ground_m:.0f} m"
        raise fail(InputError, where, expected, got, _likely(crs, bounds_m))


def _likely(crs: str, bounds_m: tuple[float, float, float, float]) -> str:
    """Return the likely mistake: exchanged axes, where the CRS is used at the exchanged place."""
    west, south, east, north = bounds_m
    area = known_crs(crs).area_of_use
    middle = (west + east) / 2, (south + north) / 2
    if area is not None and not _is_used(crs, area, *middle) and _is_used(crs, area, *middle[::-1]):
        return SWAPPED
    return "a CRS of another region, or Web Mercator"


def _is_used(crs: str, area: Any, east_m: float, north_m: float) -> bool:
    lon_deg, lat_deg = (float(one[0]) for one in unproject(crs, [east_m], [north_m]))
    return bool(area.west <= lon_deg <= area.east and area.south <= lat_deg <= area.north)
