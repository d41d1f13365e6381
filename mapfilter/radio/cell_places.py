"""Places of a cell plan's rows: in one CRS, where it is used, and moved from those of sites."""

from __future__ import annotations

import math
from pathlib import Path

from mapfilter._constants import FOOT_M
from mapfilter._crs_reach import area_of_use
from mapfilter._words import number_of
from mapfilter.degrees import degree_fault
from mapfilter.errors import Faults
from mapfilter.geodesy import project, unproject
from mapfilter.radio.arrange_cells import Arranged
from mapfilter.radio.cell_layouts import OFFSETS
from mapfilter.radio.cell_rows import Row
from mapfilter.radio.plan_systems import unit_name

ZONE_IN_FRONT = (
    "eastings with the number of a zone in front, as of EPSG:4647 or Gauss-Krüger (EPSG:31467)"
)
_NEAR_DEG, _ZONE_M, _WIDEST_ZONE_FT = 3.0, 1e6, 2.8e6


def place_rows(path: Path, rows: list[Row], crs: str, faults: Faults) -> None:
    """Give every row its east and north in ``crs``, and check that the CRS is used there."""
    some = [row.values for row in rows]
    some = [v for v in some if v.get("lat") is not None and v.get("lon") is not None]
    east_m, north_m = project(crs, [v["lon"] for v in some], [v["lat"] for v in some])
    for values, east, north in zip(some, east_m.tolist(), north_m.tolist(), strict=True):
        values["east_m"], values["north_m"] = east, north
    for row in rows:
        values, names, wrong = row.values, "lat, lon", None
        if "lat" in values:
            if values["lat"] is not None and values["lon"] is not None:
                wrong = _place_fault(values["lat"], values["lon"], crs)
        elif values["east"] is not None and values["north"] is not None:
            names, own = "east, north", values.get("crs", crs)
            values["east_m"], values["north_m"] = values["east"], values["north"]
            if own != crs:
                moved = project(crs, *unproject(own, values["east"], values["north"]))
                values["east_m"], values["north_m"] = map(float, moved)
            wrong = _metre_fault(values["east"], values["north"], own)
        if wrong is not None:
            faults.add(f"{path} row {row.line}, {names}", *wrong)
            row.faulty = True


def move_from_sites(rows: list[Row], table: Arranged) -> tuple[str, ...]:
    """Move cells from the places of their sites by what they lie beside these; return a note."""
    moved, farthest_m = 0, 0.0
    for row in rows:
        east_m, north_m = (row.values.get(name) or 0.0 for name in OFFSETS)
        if not row.faulty and (east_m or north_m):
            row.values["east_m"] += east_m
            row.values["north_m"] += north_m
            moved, farthest_m = moved + 1, max(farthest_m, math.hypot(east_m, north_m))
    if not moved:
        return ()
    names = " and ".join(table.shown.get(name, name) for name in OFFSETS if name in table.header)
    some = number_of(moved, "cell lies", "cells lie")
    return (f"{some} beside the place of the site, by {names}, up to {farthest_m:.3g} m",)


def _metre_fault(east: float, north: float, crs: str) -> tuple[str, str, str] | None:
    unit = unit_name(crs)
    expected = f"{unit} where {crs} is used, or their CRS in cells.crs"
    got = f"{east:.9g}, {north:.9g}"
    if max(abs(east), abs(north)) <= 180 and (_near(crs, east, north) or _near(crs, north, east)):
        return expected, got, f"degrees given for {unit}"
    if _near(crs, *_degrees(crs, east, north)):
        return None
    zone_m = east // _ZONE_M * _ZONE_M if east > _WIDEST_ZONE_FT else 0.0
    likely = {
        "east and north swapped": (north, east),
        ZONE_IN_FRONT: (east - zone_m, north),
    }
    if unit == "metres":
        likely["feet given for metres"] = FOOT_M * east, FOOT_M * north
    elif "feet" in unit:
        likely[f"metres given for {unit}"] = east / FOOT_M, north / FOOT_M
    near = (hint for hint, place in likely.items() if _near(crs, *_degrees(crs, *place)))
    return expected, got, next(near, "another CRS")


def _degrees(crs: str, east: float, north: float) -> tuple[float, float]:
    lon_deg, lat_deg = unproject(crs, east, north)
    return float(lon_deg), float(lat_deg)


def _place_fault(lat: float, lon: float, crs: str) -> tuple[str, str, str] | None:
    wrong = degree_fault(lat, lon)
    if wrong is not None or _near(crs, lon, lat):
        return wrong
    hint = "a cell of another place, or another CRS"
    if abs(lon) <= 90 and _near(crs, lat, lon):
        hint = "longitude and latitude swapped"
    return f"a place where {crs} is used", f"{lat:g}, {lon:g}", hint


def _near(crs: str, lon_deg: float, lat_deg: float) -> bool:
    """Return whether a place lies in, or within a few degrees of, the area a CRS is made for."""
    area = area_of_use(crs)
    if not (math.isfinite(lon_deg) and math.isfinite(lat_deg)):
        return False
    if area is None:
        return True
    middle = area.west + ((area.east - area.west) % 360) / 2
    half = ((area.east - area.west) % 360) / 2 or 180.0
    offset = (lon_deg - middle + 180) % 360 - 180
    south, north = area.south - _NEAR_DEG, area.north + _NEAR_DEG
    return bool(abs(offset) <= half + _NEAR_DEG and south <= lat_deg <= north)
