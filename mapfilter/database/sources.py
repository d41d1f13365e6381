"""Points of a build: a route lattice, or the layers that it is made of, tile by tile."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import STRtree

from mapfilter._types import Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.lattice import Lattice
from mapfilter.roads.index import WayIndex
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.route_points import RouteSource, areas_near

_ALIGNED_PX = 1e-3

RoutePart = RouteLattice | Callable[[], RouteLattice]
"""The points of one tile, or a function that makes them in another process."""


@dataclass(frozen=True, slots=True, eq=False)
class LatticeRoutes:
    """A route lattice, cut by tile."""

    points: RouteLattice

    @property
    def lattice(self) -> Lattice:
        """Lattice of the points."""
        return self.points.lattice

    def holds(self, window: Lattice) -> bool:
        """Return whether there is a point in a window."""
        return bool(self._inside(window).size)

    def part(self, window: Lattice) -> RouteLattice:
        """Return the points within a window."""
        inside = self._inside(window)
        whole, (top, left) = self.points, pixels_between(self.lattice, window)
        return RouteLattice(
            window,
            whole.row[inside] - np.int32(top),
            whole.col[inside] - np.int32(left),
            whole.way_id[inside],
            whole.way_class[inside],
            whole.class_names,
            whole.distance_to_way_m[inside],
            whole.on_square[inside],
            whole.attribution,
        )

    def weight(self, window: Lattice) -> float:
        """Return how many points lie within a window."""
        return float(self._inside(window).size)

    def digest(self) -> str:
        """Return a checksum of the points."""
        whole = self.points
        columns = (whole.row, whole.col, whole.way_id, whole.way_class, whole.distance_to_way_m)
        return _digest(repr(whole.lattice), repr(whole.class_names), *columns, whole.on_square)

    def _inside(self, window: Lattice) -> Ints:
        # The points are in row-major order: only the rows of the window are looked at.
        top, left = pixels_between(self.lattice, window)
        first, last = np.searchsorted(self.points.row, [top, top + window.rows])
        col = self.points.col[first:last]
        inside: Ints = np.flatnonzero((col >= left) & (col < left + window.cols))
        return inside + int(first)


@dataclass(frozen=True, slots=True, eq=False)
class LayerRoutes:
    """Ways, squares, buildings and water of an area; no point is laid before its tile's turn."""

    layers: RouteSource
    lattice: Lattice

    def holds(self, window: Lattice) -> bool:
        """Return whether a way or a square is near a window."""
        squares = self.layers.squares
        on_square = squares is not None and areas_near(squares, window).size > 0
        return on_square or self.layers.ways.segments_near(window).size > 0

    def part(self, window: Lattice) -> Callable[[], RouteLattice]:
        """Return what lays the points of a window: the same as of the whole layers."""
        layers = self.layers
        squares, buildings, water = (
            STRtree(areas_near(areas, window)) if areas is not None else None
            for areas in (layers.squares, layers.buildings, layers.water)
        )
        squares = squares if squares is not None and len(squares) else None
        near = RouteSource(
            layers.crs,
            _ways_near(layers.ways, window, far=squares is not None),
            squares,
            buildings,
            water,
            _ways_near(layers.bridges, window, far=False) if layers.bridges else None,
        )
        return partial(near.tile, window)

    def weight(self, window: Lattice) -> float:
        """Return the area of the ways' half widths and of the squares in a window."""
        ways, box = self.layers.ways, shapely.box(*window.bounds_m)
        near = ways.tree.query(box)
        inside = shapely.intersection(ways.tree.geometries[near], box)
        area = float((shapely.length(inside) * 2 * ways.half_width_m[near]).sum())
        if self.layers.squares is not None:
            valid = shapely.make_valid(areas_near(self.layers.squares, window))
            area += float(shapely.area(shapely.intersection(valid, box)).sum())
        return area

    def digest(self) -> str:
        """Return a checksum of the layers."""
        layers, ways = self.layers, self.layers.ways
        areas = [
            shapely.to_wkb(area.geometries).tolist() if area is not None else None
            for area in (layers.squares, layers.buildings, layers.water)
        ]
        parts: tuple[NDArray[Any], ...]
        parts = (ways.ends_m, ways.half_width_m, ways.ways.way_id[ways.way])
        names = (repr(self.lattice), repr(ways.ways.class_names), repr(areas))
        over = layers.bridges
        # Ways over water stay as points, which the water itself does not tell.
        parts += (over.ends_m, over.half_width_m, over.ways.way_id[over.way]) if over else ()
        return _digest(*names, *parts, ways.ways.way_class[ways.way])


Routes = LatticeRoutes | LayerRoutes
"""The points of an area, tile by tile."""


def cut_by_tile(routes: RouteLattice | Routes) -> Routes:
    """Return routes whose points are taken tile by tile; a route lattice is cut."""
    return LatticeRoutes(routes) if isinstance(routes, RouteLattice) else routes


def check_aligned(raster: Lattice, lattice: Lattice, where: str) -> None:
    """Check that a route lattice lies on the pixels of the rasters, and overlaps them."""
    faults = Faults()
    note_misaligned(
        raster, lattice, where, "make the route lattice on the rasters' lattice", faults
    )
    faults.raise_if_any(InputError)
    if overlap(raster, lattice, (0, 0, raster.rows, raster.cols)) is None:
        got = f"rasters {_box(raster)}, roads {_box(lattice)}"
        raise fail(InputError, where, "areas that overlap", got, "files of different areas")


def note_misaligned(a: Lattice, b: Lattice, where: str, hint: str, faults: Faults) -> None:
    """Note where two lattices differ in CRS or resolution, or are shifted by parts of a pixel."""
    down, right = (a.north_m - b.north_m) / a.resolution_m, (b.west_m - a.west_m) / a.resolution_m
    off_px = right - round(right), down - round(down)
    if not same_crs(a.crs, b.crs):
        faults.add(
            where, f"one CRS ({shown_crs(a.crs)})", shown_crs(b.crs), "files of different zones"
        )
    elif abs(a.resolution_m - b.resolution_m) > 1e-6 * a.resolution_m:
        got = f"{a.resolution_m:g} m and {b.resolution_m:g} m"
        faults.add(where, "one resolution", got, hint)
    elif max(abs(off_px[0]), abs(off_px[1])) > _ALIGNED_PX:
        got = f"shifted by {off_px[0]:+.3f} and {off_px[1]:+.3f} pixels"
        faults.add(where, "pixels that align", got, f"half-pixel convention; {hint}")


def pixels_between(lattice: Lattice, other: Lattice) -> tuple[int, int]:
    """Return the rows and columns from a lattice's corner to that of another aligned with it."""
    down = (lattice.north_m - other.north_m) / lattice.resolution_m
    right = (other.west_m - lattice.west_m) / lattice.resolution_m
    return round(down), round(right)


def overlap(
    lattice: Lattice, other: Lattice, window: tuple[int, int, int, int]
) -> tuple[int, int, int, int] | None:
    """Return the part of a window of ``lattice`` that ``other``, aligned with it, covers."""
    row, col, rows, cols = window
    top, left = pixels_between(lattice, other)
    first_row, first_col = max(row, top), max(col, left)
    last_row, last_col = min(row + rows, top + other.rows), min(col + cols, left + other.cols)
    if last_row <= first_row or last_col <= first_col:
        return None
    return first_row, first_col, last_row - first_row, last_col - first_col


def _ways_near(index: WayIndex, window: Lattice, *, far: bool) -> WayIndex:
    """Return the segments that reach a window; ``far``: and the nearest of each point in it."""
    west, south, east, north = window.bounds_m
    least_m = 0.0
    if far:
        # No point's nearest way is farther than the centre's is from the centre, and the way there.
        centre = np.array([(west + east) / 2]), np.array([(south + north) / 2])
        nearest_m = float(index.nearest(*centre)[1][0])
        if math.isfinite(nearest_m):
            least_m = nearest_m + math.hypot(east - west, north - south)
    near = index.segments_near(window, least_m)
    used, way = np.unique(index.way[near], return_inverse=True)
    taken = np.zeros(len(index.ways), dtype=np.bool_)
    taken[used] = True
    ends_m = index.ends_m[near]
    tree = STRtree(shapely.linestrings(ends_m))
    return WayIndex(index.ways.select(taken), tree, way, ends_m, index.half_width_m[near])


def _digest(*parts: str | NDArray[np.generic]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part.encode() if isinstance(part, str) else np.ascontiguousarray(part).data)
    return digest.hexdigest()


def _box(lattice: Lattice) -> str:
    west, south, east, north = lattice.bounds_m
    return f"{west:.0f}..{east:.0f} E {south:.0f}..{north:.0f} N"
