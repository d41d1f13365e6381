"""Ways, squares, buildings and water of an area, in metres; cutting them at its edge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import short_crs

Bounds = tuple[float, float, float, float]
"""West, south, east, north in metres."""

Geometries = NDArray[np.object_]
_LINE, _RING, _POLYGON = 1, 2, 3
_FARTHEST_M = 1e8
"""Larger than the coordinates of any map; much larger ones overflow in products."""


class _Layer:
    """Shows the number of features and the CRS."""

    __slots__ = ()
    crs: str
    geometry: Geometries

    def __len__(self) -> int:
        return int(self.geometry.size)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} in {short_crs(self.crs)})"

    def _faults(self, kind: str, *columns: NDArray[Any]) -> Faults:
        """Return faults of a layer whose columns differ in length, or geometries in kind."""
        what, faults = type(self).__name__.lower(), Faults()
        if any(column.shape != (len(self),) for column in columns):
            lengths = ", ".join(str(column.shape) for column in columns)
            faults.add(what, f"columns of length {len(self)}", lengths)
        if np.any(shapely.get_type_id(self.geometry) != shapely.GeometryType[kind.upper()].value):
            faults.add(f"{what}, geometry", f"only {kind}s", "another kind")
        elif not np.all(np.isfinite(shapely.get_coordinates(self.geometry))):
            faults.add(f"{what}, geometry", "finite coordinates", "NaN or infinity")
        return faults


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Ways(_Layer):
    """The ways that a profile may use.

    A way that leaves the area and comes back is several rows with the same ``way_id``.

    Parameters
    ----------
    crs : str
        Projected CRS, in metres.
    way_id : numpy.ndarray of int64, shape (N,)
        The map's own numbers, > 0.
    way_class : numpy.ndarray of int16, shape (N,)
        Index into ``class_names``.
    class_names : tuple of str
        Kinds of way, such as ``("footway", "residential")``.
    geometry : numpy.ndarray of shapely.LineString, shape (N,)
        Drawn from the way's first node to its last.
    covered : numpy.ndarray of bool, shape (N,)
        The way runs through a tunnel or a building.
    oneway : numpy.ndarray of int8, shape (N,)
        1 when only the drawn direction is allowed, -1 when only the other, 0 when both.
    """

    crs: str
    way_id: Ints
    way_class: NDArray[np.int16]
    class_names: tuple[str, ...]
    geometry: Geometries
    covered: Bools
    oneway: NDArray[np.int8]

    def __post_init__(self) -> None:
        columns = self.way_id, self.way_class, self.covered, self.oneway
        faults = self._faults("LineString", *columns)
        if np.any((self.way_class < 0) | (self.way_class >= len(self.class_names))):
            faults.add("ways, way_class", f"0..{len(self.class_names) - 1}", "another code")
        if np.any(self.way_id <= 0):
            faults.add("ways, way_id", "numbers > 0", int(self.way_id.min()))
        faults.raise_if_any(InputError)

    @classmethod
    def open(
        cls, crs: str, way_id: Ints, classes: NDArray[np.object_], geometry: Geometries
    ) -> Ways:
        """Return ways that are neither covered nor one-way; classes are given in words."""
        names, codes = np.unique(classes.astype(str), return_inverse=True)
        flag = np.zeros(way_id.size, dtype=np.int8)
        words = tuple(str(name) for name in names)
        return cls(crs, way_id, codes.astype(np.int16), words, geometry, flag.astype(bool), flag)

    @classmethod
    def none(cls, crs: str) -> Ways:
        """Return no ways."""
        nothing = np.empty(0, dtype=object)
        return cls.open(crs, np.empty(0, dtype=np.int64), nothing, nothing)

    def select(self, which: Any, geometry: Geometries | None = None) -> Ways:
        """Return the ways chosen by a mask or by indices, with other lines where given."""
        return Ways(
            self.crs,
            self.way_id[which],
            self.way_class[which],
            self.class_names,
            self.geometry[which] if geometry is None else geometry,
            self.covered[which],
            self.oneway[which],
        )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Squares(_Layer):
    """Areas that are walked in any direction.

    Parameters
    ----------
    area_id : numpy.ndarray of int64, shape (N,)
        The map's own numbers; those of multipolygon relations are negative.
    geometry : numpy.ndarray of shapely.Polygon, shape (N,)
        The areas; holes (fountains, lawns) are not part of them.
    """

    crs: str
    area_id: Ints
    geometry: Geometries

    def __post_init__(self) -> None:
        self._faults("Polygon", self.area_id).raise_if_any(InputError)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Buildings(_Layer):
    """Building footprints and heights.

    Parameters
    ----------
    footprints : numpy.ndarray of shapely.Polygon, shape (N,)
        Their ground plans.
    height_m : numpy.ndarray of float64, shape (N,)
        Height of the roof above the ground.
    from_height, from_levels, from_default : int
        How many heights came from a height, from a number of storeys, and from the default.
    """

    crs: str
    footprints: Geometries
    height_m: Floats
    from_height: int
    from_levels: int
    from_default: int

    def __post_init__(self) -> None:
        faults = self._faults("Polygon", self.height_m)
        if not np.all(np.isfinite(self.height_m) & (self.height_m > 0)):
            faults.add("buildings, height_m", "metres > 0", "another height")
        faults.raise_if_any(InputError)

    @property
    def geometry(self) -> Geometries:  # type: ignore[override]
        """The footprints."""
        return self.footprints

    @property
    def height_sources(self) -> str:
        """One sentence on the sources of the heights."""
        return (
            f"{number_of(len(self), 'building')}: height from the map for {self.from_height}, "
            f"from storeys for {self.from_levels}, the default for {self.from_default}"
        )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Water(_Layer):
    """Water, which is crossed on bridges only.

    Its polygons are rivers, lakes and seas; holes (islands) are not part of them.
    """

    crs: str
    geometry: Geometries

    def __post_init__(self) -> None:
        self._faults("Polygon").raise_if_any(InputError)


def on_earth(geometry: Geometries) -> Bools:
    """Return which geometries, in metres, have only coordinates that can be places."""
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

    With ``cut`` they end at the edge of the box; else they are kept whole.
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
    return ways.select(origin, lines)
