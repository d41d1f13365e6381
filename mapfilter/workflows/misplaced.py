"""Positions that lie elsewhere than a database: which mistake would put them into its area."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pyproj.exceptions import ProjError

from mapfilter._types import Floats
from mapfilter.geodesy import Lattice, project, unproject
from mapfilter.workflows.on_lattice import outside_m

AWAY_M = 5000.0
"""Positions all of which lie farther outside of an area are those of another one."""
_ELSEWHERE = "log of another area or zone"
_MOST_TRIED = 200


def is_near(east_m: Floats, north_m: Floats, lattice: Lattice) -> bool:
    """Return whether any of some positions lies in a lattice, or not far outside."""
    known = np.isfinite(east_m) & np.isfinite(north_m)
    if not known.any():
        return False
    return float(outside_m(east_m[known], north_m[known], lattice).min()) <= AWAY_M


def misplaced_by(east_m: Floats, north_m: Floats, lattice: Lattice) -> str:
    """Return the likely mistake of positions that lie outside of a lattice.

    Each of the usual mistakes is undone; the first one that brings them into the area is named.

    Parameters
    ----------
    east_m, north_m : (N,) array
        In the CRS of the lattice.
    """
    step = max(1, len(east_m) // _MOST_TRIED)
    east_m, north_m = east_m[::step], north_m[::step]
    for mistake, east, north in _undone(lattice.crs, east_m, north_m):
        if is_near(east, north, lattice):
            return mistake
    return _ELSEWHERE


def _undone(crs: str, east_m: Floats, north_m: Floats) -> Iterator[tuple[str, Floats, Floats]]:
    yield "east and north swapped", north_m, east_m
    for unit, scale in (("degrees", 1.0), ("degrees times 1e7", 1e7), ("degrees times 1e6", 1e6)):
        first, second = east_m / scale, north_m / scale
        given = f"{unit} given for metres"
        yield given, *_in_crs(crs, first, second)
        yield f"{given}, latitude as east", *_in_crs(crs, second, first)
    lon_deg, lat_deg = unproject(crs, east_m, north_m)
    yield "latitude and longitude swapped", *_in_crs(crs, lat_deg, lon_deg)
    for names, lon, lat in (
        ("longitude", -lon_deg, lat_deg),
        ("latitude", lon_deg, -lat_deg),
        ("latitude and longitude", -lon_deg, -lat_deg),
    ):
        yield f"a lost sign of {names}", *_in_crs(crs, lon, lat)
    swapped = "latitude and longitude swapped, with a lost sign"
    for east, north in ((1, -1), (-1, 1), (-1, -1)):
        yield swapped, *_in_crs(crs, east * lat_deg, north * lon_deg)


def _in_crs(crs: str, lon_deg: Floats, lat_deg: Floats) -> tuple[Floats, Floats]:
    """Return degrees in a CRS; NaN for what are none."""
    with np.errstate(invalid="ignore"):
        good = (np.abs(lon_deg) <= 180) & (np.abs(lat_deg) <= 90)
    lon_deg, lat_deg = np.where(good, lon_deg, np.nan), np.where(good, lat_deg, np.nan)
    try:
        east_m, north_m = project(crs, lon_deg, lat_deg)
    except ProjError:
        return np.full(len(lon_deg), np.nan), np.full(len(lon_deg), np.nan)
    return east_m, north_m
