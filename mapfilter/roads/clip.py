"""Cutting lines and polygons at the edge of an area."""

from __future__ import annotations

import numpy as np
import shapely

from mapfilter._types import Bools, Ints
from mapfilter.roads.ways import Bounds, Geometries, Ways

_LINE, _RING, _POLYGON = 1, 2, 3

_FARTHEST_M = 1e8
"""No map's coordinates are larger, and much larger ones overflow in products."""


def on_earth(geometry: Geometries) -> Bools:
    """Tell which geometries, in metres, have only coordinates that can be places."""
    corner, origin = shapely.get_coordinates(geometry, return_index=True)
    # Written so that NaN is no place.
    is_place = (np.abs(corner) < _FARTHEST_M).all(axis=1)
    good = np.ones(len(geometry), dtype=np.bool_)
    good[origin[~is_place]] = False
    return good


def lines_inside(geometry: Geometries, bounds_m: Bounds) -> tuple[Geometries, Ints]:
    """Return the lines among geometries, cut at a box, and which geometry each comes from.

    Lines keep their direction, and within the box all their vertices.
    """
    lines, origin = shapely.get_parts(geometry, return_index=True)
    chosen = np.isin(shapely.get_type_id(lines), (_LINE, _RING))
    lines, origin = lines[chosen], origin[chosen]
    crossing = ~shapely.covers(shapely.box(*bounds_m), lines)
    # Unlike an intersection, this walks along the line.
    lines[crossing] = shapely.clip_by_rect(lines[crossing], *bounds_m)
    parts, line = shapely.get_parts(lines, return_index=True)
    kept = (shapely.get_type_id(parts) == _LINE) & (shapely.length(parts) > 0)
    return parts[kept], origin[line[kept]].astype(np.int64)


def polygons_inside(
    geometry: Geometries, bounds_m: Bounds, *, cut: bool
) -> tuple[Geometries, Ints]:
    """Return the polygons among geometries that touch a box, and which geometry each comes from.

    What crosses itself is mended first.

    Parameters
    ----------
    geometry : numpy.ndarray of shapely geometries
    bounds_m : tuple of float
        West, south, east, north.
    cut : bool
        Cut them at the edge of the box; else they are kept whole.
    """
    box = shapely.box(*bounds_m)
    flat, origin = shapely.get_parts(geometry, return_index=True)
    chosen = (shapely.get_type_id(flat) == _POLYGON) & shapely.intersects(box, flat)
    whole = shapely.make_valid(flat[chosen])
    parts, index = shapely.get_parts(
        shapely.intersection(whole, box) if cut else whole, return_index=True
    )
    # Touching the edge of the area leaves lines and points behind.
    kept = (shapely.get_type_id(parts) == _POLYGON) & (shapely.area(parts) > 0)
    return parts[kept], origin[chosen][index[kept]].astype(np.int64)


def clip_ways(ways: Ways, bounds_m: Bounds) -> Ways:
    """Return the ways cut at a box; there may be none left."""
    lines, origin = lines_inside(ways.geometry, bounds_m)
    return Ways(
        ways.crs,
        ways.way_id[origin],
        ways.way_class[origin],
        ways.class_names,
        lines,
        ways.covered[origin],
        ways.oneway[origin],
    )
