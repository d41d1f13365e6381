"""Coordinate reference systems: positions are east/north metres in a projected one.

The angle between true and grid north, by which azimuths and headings differ
(:mod:`mapfilter.angles`), is the grid convergence.
"""

from __future__ import annotations

from functools import lru_cache
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pyproj import CRS, Proj, Transformer
from pyproj.exceptions import CRSError, ProjError

from mapfilter._crs_words import meant_crs
from mapfilter._inputs import named_file, shown
from mapfilter._types import Floats
from mapfilter.degrees import degree_fault
from mapfilter.errors import InputError, fail

_SHORT, _MOST_KEPT = 20, 64
_LEAST_UTM_DEG, _MOST_UTM_DEG = -80.0, 84.0
_SAME_M = 1.0


def grid_convergence_rad(crs: str, lon_deg: float, lat_deg: float) -> float:
    """Return the clockwise angle from true north to grid north of ``crs`` at a place.

    Raises
    ------
    InputError
        The projection has no such place.
    """
    convergence_deg = float(projection(crs).get_factors(lon_deg, lat_deg).meridian_convergence)
    if not np.isfinite(convergence_deg):
        raise fail(InputError, "place", f"a longitude and latitude of {crs}", (lon_deg, lat_deg))
    return float(np.radians(convergence_deg))


def known_crs(spec: Any, where: str = "crs") -> CRS:
    """Return a CRS that names no files, which PROJ would open wherever they are.

    Raises
    ------
    InputError
        It names one, such as a grid with its folder.
    pyproj.exceptions.CRSError, TypeError, ValueError
        It is none.
    """
    found = named_file(spec) if isinstance(spec, str) else ""
    if not found:
        crs = CRS.from_user_input(spec)
        found = named_file(crs.to_wkt())
        if not found:
            return crs
    hint = "leave the file out, or install the grid where PROJ finds it by its name"
    raise fail(InputError, where, "a CRS without files", shown(found), hint)


def horizontal_part(crs: CRS) -> CRS:
    """Return the part of a CRS that counts no heights.

    Examples
    --------
    >>> horizontal_part(CRS("EPSG:25832+7837")).to_epsg()
    25832
    """
    if crs.is_compound:
        return crs.sub_crs_list[0]
    return crs.to_2d() if len(crs.axis_info) == 3 else crs


def projected_crs(spec: Any, where: str = "crs") -> str:
    """Return the canonical text of a projected CRS in metres ("EPSG:32629", else WKT).

    Of a compound CRS it is the horizontal part: heights are not used.

    Raises
    ------
    InputError
        The CRS is missing or unknown, or does not count metres east and north.
    """
    if spec is None or spec == "":
        raise fail(InputError, where, "a projected CRS in metres", "none", "CRS left out on export")
    # To look for its code among all that there are takes up to 6 ms.
    return _kept_text(spec, where) if isinstance(spec, str) else _canonical_text(spec, where)


def _canonical_text(spec: Any, where: str) -> str:
    try:
        crs = horizontal_part(known_crs(spec, where))
    except (CRSError, TypeError, ValueError) as error:
        expected, hint = "a CRS such as EPSG:32629", meant_crs(str(spec))
        raise fail(InputError, where, expected, repr(spec), hint) from error
    if crs.is_geographic:
        hint = "degrees given for metres"
        raise fail(InputError, where, "a projected CRS in metres", crs.name, hint)
    horizontal = crs.axis_info[:2]
    if not crs.is_projected or any(
        axis.unit_name not in ("metre", "meter") or axis.direction == "west" for axis in horizontal
    ):
        axes = ", ".join(f"{axis.unit_name} {axis.direction}" for axis in horizontal) or "no unit"
        hint = _metres_about(crs, axes) if crs.is_projected else ""
        raise fail(InputError, where, "metres east and north", f"{crs.name} ({axes})", hint)
    authority = crs.to_authority(min_confidence=100)
    return f"{authority[0]}:{authority[1]}" if authority else str(crs.to_wkt())


_kept_text = lru_cache(_MOST_KEPT)(_canonical_text)


def _metres_about(crs: CRS, axes: str) -> str:
    """Return what to do with coordinates in other units, or counted to the west or south."""
    area, target = crs.area_of_use, "and the code of a UTM zone"
    if area is not None:
        target = utm_crs((area.west + area.east) / 2, (area.south + area.north) / 2)
    ways = {"foot": "in feet", "kilometre": "in kilometres", "west": "to the west"}
    given = next((way for word, way in ways.items() if word in axes), f"of {axes}")
    return f"coordinates {given}; project them, as by gdalwarp or ogr2ogr -t_srs {target}"


def short_crs(crs: str) -> str:
    """Return a CRS as people call it: its code, or the name in its WKT."""
    return crs if len(crs) <= _SHORT else str(CRS.from_user_input(crs).name)


def shown_crs(crs: str) -> str:
    """Return a CRS as messages show it: its code or name; the beginning of a text without."""
    return shown(crs) if short_crs(crs) == "unknown" else short_crs(crs)


def same_crs(a: str, b: str) -> bool:
    """Return whether two CRS texts mean the same system."""
    return a == b or bool(_horizontal(a).equals(_horizontal(b)))


@lru_cache(maxsize=64)
def same_grid(a: str, b: str) -> bool:
    """Return whether places have the same east and north in two CRS, to a metre.

    So have those of one projection over WGS 84 and over a datum that is fixed to a continent.

    Examples
    --------
    >>> same_grid("EPSG:25832", "EPSG:32632"), same_grid("EPSG:25832", "EPSG:32633")
    (True, False)
    """
    if same_crs(a, b):
        return True
    area = _horizontal(a).area_of_use or _horizontal(b).area_of_use
    if area is None:
        return False
    lon_deg = np.linspace(area.west, area.east, 5)[1:-1]
    lat_deg = np.linspace(area.south, area.north, 5)[1:-1]
    with np.errstate(invalid="ignore"):  # Infinite are those of places that a CRS lacks.
        apart_m = np.subtract(project(a, lon_deg, lat_deg), project(b, lon_deg, lat_deg))
    return bool(np.all(np.abs(apart_m) <= _SAME_M))


def utm_zone(lon_deg: float, lat_deg: float) -> int:
    """Return the UTM zone of a place, 1 to 60, with the exceptions of Norway and Svalbard.

    Examples
    --------
    >>> utm_zone(-8.5, 51.9), utm_zone(5.3, 60.4), utm_zone(15.6, 78.2)
    (29, 32, 33)
    """
    if 56.0 <= lat_deg < 64.0 and 3.0 <= lon_deg < 12.0:
        return 32
    if lat_deg >= 72.0 and 0.0 <= lon_deg < 42.0:
        return 31 + 2 * int((lon_deg + 3.0) // 12.0)
    return int(np.clip((lon_deg + 180.0) // 6.0 + 1, 1, 60))


def utm_zone_crs(zone: int, lat_deg: float) -> str:
    """Return the CRS of a UTM zone (WGS 84) on the hemisphere of a latitude."""
    return f"EPSG:{(32600 if lat_deg >= 0 else 32700) + zone}"


def utm_crs(lon_deg: float, lat_deg: float) -> str:
    """Return the WGS 84 / UTM zone of a place; UPS (east, north) beyond 84° N and 80° S.

    Raises
    ------
    InputError
        These are no degrees, or none in their range.

    Examples
    --------
    >>> utm_crs(-8.6, 41.1), utm_crs(24.9, 60.2), utm_crs(18.4, -33.9), utm_crs(0.0, 89.0)
    ('EPSG:32629', 'EPSG:32635', 'EPSG:32734', 'EPSG:5041')
    """
    given: Any = (lat_deg, lon_deg)
    # Arrays without a dimension are what `unproject` returns for a place.
    if not all(isinstance(one[()] if _is_scalar(one) else one, Real) for one in given):
        got = f"{shown(lat_deg)}, {shown(lon_deg)}"
        raise fail(InputError, "latitude, longitude", "two numbers in degrees", got)
    if wrong := degree_fault(float(lat_deg), float(lon_deg)):
        raise fail(InputError, "latitude, longitude", *wrong)
    if lat_deg > _MOST_UTM_DEG or lat_deg < _LEAST_UTM_DEG:
        return "EPSG:5041" if lat_deg > 0 else "EPSG:5042"
    return utm_zone_crs(utm_zone(lon_deg, lat_deg), lat_deg)


def _is_scalar(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 0


def utm_crs_of(lon_deg: ArrayLike, lat_deg: ArrayLike) -> str:
    """Return the UTM zone, or UPS, of the middle of places, which may lie across 180 degrees.

    Parameters
    ----------
    lon_deg, lat_deg : (N,) array_like
        One place or more, all known.

    Examples
    --------
    >>> utm_crs_of([179.9, -179.9, 179.8], [-17.0, -17.0, -17.0]), utm_crs_of([24.9], [60.2])
    ('EPSG:32760', 'EPSG:32635')
    """
    lon = np.asarray(lon_deg, dtype=np.float64)
    # The same numbers, but where these jump by a whole turn.
    lon = lon - 360.0 * np.round((lon - lon[0]) / 360.0)
    middle_deg = float(np.median(lon))
    middle_deg -= 360.0 * np.round(middle_deg / 360.0)
    return utm_crs(middle_deg, float(np.median(np.asarray(lat_deg))))


def project(crs: str, lon_deg: ArrayLike, lat_deg: ArrayLike) -> tuple[Floats, Floats]:
    """Turn longitudes and latitudes (WGS 84, degrees) into east and north metres."""
    east, north = _from_lonlat(crs).transform(np.asarray(lon_deg), np.asarray(lat_deg))
    return np.asarray(east, dtype=np.float64), np.asarray(north, dtype=np.float64)


def unproject(crs: str, east_m: ArrayLike, north_m: ArrayLike) -> tuple[Floats, Floats]:
    """Turn east and north metres into longitudes and latitudes (WGS 84, degrees)."""
    lon, lat = _from_lonlat(crs).transform(
        np.asarray(east_m), np.asarray(north_m), direction="INVERSE"
    )
    return np.asarray(lon, dtype=np.float64), np.asarray(lat, dtype=np.float64)


@lru_cache(maxsize=16)
def _from_lonlat(crs: str) -> Transformer:
    try:
        return Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    except (CRSError, ProjError) as error:
        raise fail(InputError, "crs", "a CRS such as EPSG:32629", repr(crs)) from error


def _horizontal(crs: str) -> CRS:
    return horizontal_part(CRS.from_user_input(crs))


@lru_cache(maxsize=16)
def projection(crs: str) -> Proj:
    """Return the projection of a CRS, for its factors at a place."""
    return Proj(CRS.from_user_input(crs))
