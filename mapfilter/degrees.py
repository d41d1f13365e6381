"""Positions and boxes in degrees: their ranges, and boxes across 180 degrees of longitude."""

from __future__ import annotations

from math import isfinite, isnan

from mapfilter.errors import Faults, InputError

_WIDEST_DEG = 90.0
"""Of an area's box across 180° of longitude; a wider one has exchanged corners."""
ONE_SIDE = "an area on one side of 180° of longitude"
NO_MAPS = "no maps are made across it: make an area of each side"


def degree_fault(lat_deg: float, lon_deg: float) -> tuple[str, str, str] | None:
    """Return (expected, found, likely mistake) where a position is beyond its range, else None."""
    if abs(lat_deg) <= 90 and abs(lon_deg) <= 180:
        return None
    swapped = max(abs(lat_deg), abs(lon_deg)) <= 180
    hint = "longitude and latitude swapped" if swapped else "metres given for degrees"
    if isnan(lat_deg) or isnan(lon_deg):
        hint = ""
    return "degrees in -90..90 and -180..180", f"{lat_deg:g}, {lon_deg:g}", hint


def check_bbox(bbox: tuple[float, float, float, float], where: str = "bbox") -> None:
    """Check a box of west, south, east, north in degrees; raise InputError with its faults."""
    west, south, east, north = bbox
    faults = Faults()
    if not all(isfinite(side) for side in bbox):
        faults.add(where, "four finite numbers", bbox)
    elif (across := _across_180(bbox)) is not None:
        faults.add(where, *across)
    elif max(abs(west), abs(east)) > 180 or max(abs(south), abs(north)) > 180:
        faults.add(where, "degrees: west, south, east, north", bbox, "metres given for degrees")
    elif max(abs(south), abs(north)) > 90:
        faults.add(where, "latitudes in -90..90", bbox, "longitude and latitude swapped")
    elif west >= east or south >= north:
        faults.add(where, "west < east and south < north", bbox, "corners swapped")
    faults.raise_if_any(InputError)


def _across_180(bbox: tuple[float, float, float, float]) -> tuple[str, str, str] | None:
    """Return (expected, found, what to do) for a box across 180° of longitude, else None."""
    west, south, east, north = bbox
    # West of 0..180 and east of -180..0, or one of them counted on.
    turned = -180 <= east < 0 < west <= 180
    beyond = -360 <= west < east <= 360 and (west < -180 or east > 180)
    narrow = max(abs(south), abs(north)) <= 90 and (east - west) % 360 < _WIDEST_DEG
    if not (narrow and (turned or beyond)):
        return None
    left, right = ((side + 180) % 360 - 180 for side in (west, east))
    if left < right:
        numbers = ",".join(f"{side:g}" for side in (left, south, right, north))
        return "longitudes of -180 to 180", f"{bbox}", f"longitudes of 0 to 360; write {numbers}"
    sides = (left, south, 180.0, north), (-180.0, south, right, north)
    two = " and ".join(",".join(f"{side:g}" for side in one) for one in sides)
    return ONE_SIDE, f"{bbox}, across it", f"{NO_MAPS}: {two}"
