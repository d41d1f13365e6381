"""Positions that lie elsewhere than an area: how far, and which mistake would put them into it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from pyproj.exceptions import ProjError

from mapfilter._types import Floats
from mapfilter.errors import Faults
from mapfilter.geodesy import project, same_grid, short_crs, unproject, utm_crs
from mapfilter.lattice import Lattice, outside_m

AWAY_M = 5000.0
"""Positions all of which lie farther outside of an area are those of another one."""
FAR_M = 2000.0
"""Positions of one journey that lie farther apart are wrong: of degrees, of clocks, or spoofed."""
FAR_APART = "km from those of the same times"
"""Words by which notes on such positions are known."""
UNDONE = {
    "latitude and longitude swapped": ("lat_deg", "lon_deg", 1, 1),
    "a lost sign of longitude": ("lon_deg", "lat_deg", -1, 1),
    "a lost sign of latitude": ("lon_deg", "lat_deg", 1, -1),
    "latitude and longitude swapped, with a lost sign": ("lat_deg", "lon_deg", -1, -1),
}
"""Columns and signs of the true longitude and latitude, by the mistake."""

OTHERWISE = "log of another area or zone"
"""The likely mistake where no other one explains positions."""
_MOST_TRIED = 200
_TIMES = 10.0
"""Undoing a mistake brings positions so many times nearer, or it explains nothing."""


def nearest_m(east_m: Floats, north_m: Floats, lattice: Lattice) -> float:
    """Return how far outside a lattice the nearest of some positions lies; infinite for none."""
    known = np.isfinite(east_m) & np.isfinite(north_m)
    return float(outside_m(east_m[known], north_m[known], lattice).min(initial=np.inf))


def is_near(east_m: Floats, north_m: Floats, lattice: Lattice) -> bool:
    """Return whether any of some positions lies in a lattice, or not far outside."""
    return nearest_m(east_m, north_m, lattice) <= AWAY_M


def check_near(
    where: str,
    east_m: Floats,
    north_m: Floats,
    lattice: Lattice,
    faults: Faults,
    otherwise: str = OTHERWISE,
) -> None:
    """Note positions of which none lies near a database's area, with the likely mistake.

    Parameters
    ----------
    east_m, north_m : (N,) array
        In the CRS of the lattice; none are no fault.
    otherwise : str
        The mistake to name where none of the usual ones explains them.
    """
    if not east_m.size or is_near(east_m, north_m, lattice):
        return
    box = lattice.bounds_m
    found = east_m.min(), north_m.min(), east_m.max(), north_m.max()
    expected = f"positions near the database's {_box(*box)}"
    mistake = misplaced_by(east_m, north_m, lattice) or otherwise
    faults.add(where, expected, _box(*found), mistake)


def _box(west_m: float, south_m: float, east_m: float, north_m: float) -> str:
    return f"{west_m:.0f}..{east_m:.0f} m east, {south_m:.0f}..{north_m:.0f} m north"


def misplaced_by(east_m: Floats, north_m: Floats, lattice: Lattice) -> str:
    """Return the likely mistake of positions that lie outside of a lattice; "" for none of them.

    Each of the usual mistakes is undone; the first one that brings them into the area is named.
    One that brings them little nearer is none: beside the meridian of Greenwich or the equator the
    place with the other sign is close to the true one.

    Parameters
    ----------
    east_m, north_m : (N,) array
        In the CRS of the lattice.
    """
    return _explained(east_m, north_m, lattice, _undone)


def degrees_for_metres(east_m: Floats, north_m: Floats, lattice: Lattice) -> str:
    """Return which degrees of a lattice's area were given for metres; "" if they are none."""
    return _explained(east_m, north_m, lattice, _from_degrees)


_Undoing = Callable[[str, Floats, Floats], Iterator[tuple[str, Floats, Floats]]]


def _explained(east_m: Floats, north_m: Floats, lattice: Lattice, undoing: _Undoing) -> str:
    step = max(1, len(east_m) // _MOST_TRIED)
    east_m, north_m = east_m[::step], north_m[::step]
    away_m = nearest_m(east_m, north_m, lattice)
    for mistake, east, north in undoing(lattice.crs, east_m, north_m):
        if nearest_m(east, north, lattice) <= min(AWAY_M, away_m / _TIMES):
            return mistake
    return ""


def _undone(crs: str, east_m: Floats, north_m: Floats) -> Iterator[tuple[str, Floats, Floats]]:
    yield "east and north swapped", north_m, east_m
    yield from _from_degrees(crs, east_m, north_m)
    lon_deg, lat_deg = unproject(crs, east_m, north_m)
    yield from _of_another_zone(crs, lon_deg, lat_deg)
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


def _of_another_zone(
    crs: str, lon_deg: Floats, lat_deg: Floats
) -> Iterator[tuple[str, Floats, Floats]]:
    """Yield metres of positions in the UTM zone of their place, taken for those of a CRS.

    Metres of a log that states another zone than theirs lie in that zone.
    """
    known = np.isfinite(lon_deg) & np.isfinite(lat_deg)
    if not known.any():
        return
    zone = utm_crs(float(np.median(lon_deg[known])), float(np.median(lat_deg[known])))
    if not same_grid(zone, crs):
        mistake = f"a wrong CRS: {zone} is stated for metres of {short_crs(crs)}"
        yield mistake, *_in_crs(zone, lon_deg, lat_deg)


def _from_degrees(
    crs: str, east_m: Floats, north_m: Floats
) -> Iterator[tuple[str, Floats, Floats]]:
    for unit, scale in (("degrees", 1.0), ("degrees times 1e7", 1e7), ("degrees times 1e6", 1e6)):
        first, second = east_m / scale, north_m / scale
        given = f"{unit} given for metres"
        yield given, *_in_crs(crs, first, second)
        yield f"{given}, latitude as east", *_in_crs(crs, second, first)


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
