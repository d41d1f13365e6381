"""Indexed ways, and which of them reach the pixels of any window; distances are exact."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numba import njit
from numpy.typing import NDArray
from shapely import STRtree

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.ways import Geometries, Ways

HALF_WIDTH_M = 6.0


@dataclass(frozen=True, slots=True, eq=False)
class WayIndex:
    """Straight segments of ways, in the order of way ids, each with the half width of its way.

    Examples
    --------
    >>> line = np.array([shapely.LineString([(0, 0), (10, 0), (10, 10)])])
    >>> ways = Ways("EPSG:32629", np.array([7]), np.array([0], np.int16), ("path",), line,
    ...             np.array([False]), np.array([0], np.int8))
    >>> index = WayIndex.of(ways, 6.0)
    >>> index.nearest(np.array([4.0]), np.array([3.0]))
    (array([0]), array([3.]))
    >>> way, distance_m = index.reaching(Lattice("EPSG:32629", 0.0, 10.0, 5.0, 2, 2))
    >>> way.tolist(), distance_m.tolist()
    ([[-1, 0], [0, 0]], [[inf, 2.5], [2.5, 2.5]])
    """

    ways: Ways
    tree: STRtree
    way: Ints
    ends_m: Floats
    half_width_m: Floats

    @classmethod
    def of(
        cls,
        ways: Ways,
        half_width_m: float = HALF_WIDTH_M,
        by_class_m: Mapping[str, float] | None = None,
    ) -> WayIndex:
        """Index the segments of ways; half widths as for a route lattice.

        Raises
        ------
        InputError
            A half width is not > 0 (of a class, not >= 0).
        """
        faults, by_class_m = Faults(), by_class_m or {}
        note_half_widths(faults, half_width_m, by_class_m)
        faults.raise_if_any(InputError)
        by_code = np.array([by_class_m.get(name, half_width_m) for name in ways.class_names])
        if by_code.size and not by_code.all():
            ways = ways.select(by_code[ways.way_class] > 0)
        return cls._of_lines(ways, ways.geometry, np.arange(len(ways)), by_code)

    @classmethod
    def _of_lines(cls, ways: Ways, lines: Geometries, way: Ints, by_code: Floats) -> WayIndex:
        """Index the segments of lines that are parts of the ways with the given indices."""
        corner, origin = shapely.get_coordinates(lines, return_index=True)
        joined = (origin[1:] == origin[:-1]) & np.any(corner[1:] != corner[:-1], axis=1)
        ends_m = np.stack([corner[:-1][joined], corner[1:][joined]], axis=1)
        of_way = way[origin[:-1][joined]]
        # The first of equally near segments is kept: that of the smallest way id.
        order = np.lexsort((of_way, ways.way_id[of_way]))
        ends_m, of_way = ends_m[order], of_way[order]
        half_width_m = by_code[ways.way_class[of_way]] if of_way.size else np.empty(0)
        return cls(ways, STRtree(shapely.linestrings(ends_m)), of_way, ends_m, half_width_m)

    def __reduce__(self) -> tuple[Callable[..., WayIndex], tuple[Any, ...]]:
        # Shapes one by one take as long to send as a tile's other work.
        ways = self.ways
        columns = ways.crs, ways.way_id, ways.way_class, ways.class_names
        marks = ways.covered, ways.oneway
        lines = shapely.to_wkb(ways.geometry)
        return _unpacked_index, (columns, lines, marks, self.way, self.ends_m, self.half_width_m)

    def segments_near(self, window: Lattice, least_m: float = 0.0) -> Ints:
        """Return the segments that reach a window, or are at most ``least_m`` away from it."""
        west, south, east, north = window.bounds_m
        reach_m = max(float(self.half_width_m.max(initial=0.0)), least_m)
        box = shapely.box(west - reach_m, south - reach_m, east + reach_m, north + reach_m)
        return np.sort(self.tree.query(box))

    def inside(self, areas: Geometries) -> WayIndex:
        """Return the index of the parts of the ways that lie in polygons."""
        segments = shapely.linestrings(self.ends_m)
        area, segment = STRtree(segments).query(areas, predicate="intersects")
        parts, pair = shapely.get_parts(
            shapely.intersection(segments[segment], areas[area]), return_index=True
        )
        line = (shapely.get_type_id(parts) == 1) & (shapely.length(parts) > 0)
        by_code = np.zeros(max(len(self.ways.class_names), 1))
        by_code[self.ways.way_class[self.way]] = self.half_width_m
        return self._of_lines(self.ways, parts[line], self.way[segment[pair[line]]], by_code)

    def reaching(self, window: Lattice) -> tuple[Ints, Floats]:
        """Return, of each pixel of a window, the nearest way that it belongs to, and its distance.

        Ways are indices into ``ways``, -1 where none reaches the pixel's centre: there the distance
        is infinite. Of equally near ways it is the one with the smallest id.
        """
        size = (window.rows, window.cols)
        segment, distance_m = np.full(size, -1, dtype=np.int64), np.full(size, np.inf)
        if self.way.size:
            near = self.segments_near(window)
            _burn(
                self.ends_m[near],
                self.half_width_m[near],
                (window.west_m, window.north_m, window.resolution_m),
                segment,
                distance_m,
            )
            found = segment >= 0
            segment[found] = self.way[near[segment[found]]]
        return segment, distance_m

    def nearest(self, east_m: Floats, north_m: Floats) -> tuple[Ints, Floats]:
        """Return the nearest way of each position, however far, as :meth:`reaching` does."""
        way = np.full(east_m.size, -1, dtype=np.int64)
        distance = np.full(east_m.size, np.inf)
        if self.way.size and east_m.size:
            (which, segment), found_m = self.tree.query_nearest(
                shapely.points(east_m, north_m), return_distance=True
            )
            order = np.lexsort((segment, which))
            which, segment, found_m = which[order], segment[order], found_m[order]
            first = np.flatnonzero(np.diff(which, prepend=-1))
            way[which[first]], distance[which[first]] = self.way[segment[first]], found_m[first]
        return way, distance


def note_half_widths(faults: Faults, half_width_m: float, by_class_m: Mapping[str, float]) -> None:
    """Note half widths that are not > 0, and those of classes that are not >= 0."""
    faults.check_positive("", "metres", half_width_m=half_width_m)
    for name, width_m in by_class_m.items():
        if not (np.isfinite(width_m) and width_m >= 0):
            faults.add(f"half_width_by_class_m, {name}", "metres >= 0", width_m)


def _unpacked_index(
    columns: tuple[str, Ints, NDArray[np.int16], tuple[str, ...]],
    lines: NDArray[np.object_],
    marks: tuple[Bools, NDArray[np.int8]],
    way: Ints,
    ends_m: Floats,
    half_width_m: Floats,
) -> WayIndex:
    ways = Ways(*columns, shapely.from_wkb(lines), *marks)
    return WayIndex(ways, STRtree(shapely.linestrings(ends_m)), way, ends_m, half_width_m)


def load_kernel() -> None:
    """Load the kernel of :meth:`WayIndex.reaching`, which takes as long as a tile's other work."""
    segment, distance_m = np.empty((0, 0), dtype=np.int64), np.empty((0, 0))
    _burn(np.empty((0, 2, 2)), np.empty(0), (0.0, 0.0, 1.0), segment, distance_m)


@njit(cache=True)
def _burn(
    ends_m: Floats,
    half_width_m: Floats,
    place: tuple[float, float, float],
    segment: Ints,
    distance_m: Floats,
) -> None:  # pragma: no cover
    """Write the nearest of the segments that reach a pixel centre, and its distance."""
    west_m, north_m, resolution_m = place
    rows, cols = segment.shape
    for k in range(len(ends_m)):
        ax, ay = ends_m[k, 0]
        bx, by = ends_m[k, 1]
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        if square == 0.0:
            continue
        # Rounded outwards; the distance decides.
        reach = half_width_m[k] + 1e-6 * resolution_m
        top = np.ceil((north_m - max(ay, by) - reach) / resolution_m - 0.5)
        bottom = np.floor((north_m - min(ay, by) + reach) / resolution_m - 0.5)
        for row in range(
            int(min(max(top, 0.0), rows)), int(max(min(bottom, rows - 1.0), -1.0)) + 1
        ):
            y = north_m - (row + 0.5) * resolution_m
            low, high = 0.0, 1.0
            if dy != 0.0:
                # The part of the segment that is within reach of this row.
                low, high = (y - reach - ay) / dy, (y + reach - ay) / dy
                if low > high:
                    low, high = high, low
                low, high = min(max(low, 0.0), 1.0), min(max(high, 0.0), 1.0)
            x_low, x_high = ax + low * dx, ax + high * dx
            left = np.ceil((min(x_low, x_high) - reach - west_m) / resolution_m - 0.5)
            right = np.floor((max(x_low, x_high) + reach - west_m) / resolution_m - 0.5)
            for col in range(
                int(min(max(left, 0.0), cols)), int(max(min(right, cols - 1.0), -1.0)) + 1
            ):
                x = west_m + (col + 0.5) * resolution_m
                along = min(max(((x - ax) * dx + (y - ay) * dy) / square, 0.0), 1.0)
                distance = np.hypot(x - ax - along * dx, y - ay - along * dy)
                if distance <= half_width_m[k] and distance < distance_m[row, col]:
                    distance_m[row, col] = distance
                    segment[row, col] = k
