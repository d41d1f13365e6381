"""From ways, squares, buildings and land use to the route lattice, tile by tile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from shapely import STRtree

from mapfilter._parallel import Progress
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.roads.buildings import burn
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.ways import Buildings, Geometries, Squares, Ways

HALF_WIDTH_M = 6.0
SQUARE_CLASS = "square"
LANDUSE_CLASS = "land use"


@dataclass(frozen=True, slots=True, eq=False)
class WayIndex:
    """Straight segments of ways in a search tree, for exact distances.

    Examples
    --------
    >>> line = np.array([shapely.LineString([(0, 0), (10, 0), (10, 10)])])
    >>> ways = Ways("EPSG:32629", np.array([7]), np.array([0], np.int16), ("path",), line,
    ...             np.array([False]), np.array([0], np.int8))
    >>> WayIndex.of(ways).nearest(np.array([4.0]), np.array([3.0]), 6.0)
    (array([0]), array([3.]))
    """

    ways: Ways
    tree: STRtree
    way: NDArray[np.int64]

    @classmethod
    def of(cls, ways: Ways) -> WayIndex:
        """Index the segments of ways."""
        corner, origin = shapely.get_coordinates(ways.geometry, return_index=True)
        joined = (origin[1:] == origin[:-1]) & np.any(corner[1:] != corner[:-1], axis=1)
        ends = np.stack([corner[:-1][joined], corner[1:][joined]], axis=1)
        return cls(ways, STRtree(shapely.linestrings(ends)), origin[:-1][joined])

    def nearest(
        self, east_m: NDArray[np.float64], north_m: NDArray[np.float64], reach_m: float = np.inf
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the nearest way of each position and its distance.

        Returns
        -------
        way : numpy.ndarray of int64, shape (N,)
            Index into ``ways``, -1 when none is within ``reach_m``; of equally near ways the one
            with the smallest id.
        distance_m : numpy.ndarray of float64, shape (N,)
            Infinite where ``way`` is -1.
        """
        way = np.full(east_m.size, -1, dtype=np.int64)
        distance = np.full(east_m.size, np.inf)
        if not (self.way.size and east_m.size):
            return way, distance
        (which, segment), found_m = self.tree.query_nearest(
            shapely.points(east_m, north_m),
            max_distance=None if np.isinf(reach_m) else reach_m,
            return_distance=True,
        )
        candidate = self.way[segment]
        order = np.lexsort((candidate, self.ways.way_id[candidate], which))
        which, candidate, found_m = which[order], candidate[order], found_m[order]
        first = np.flatnonzero(np.diff(which, prepend=-1))
        way[which[first]], distance[which[first]] = candidate[first], found_m[first]
        return way, distance


@dataclass(frozen=True, slots=True, eq=False)
class AreaIndex:
    """Polygons in a search tree, to burn those of a tile."""

    geometry: Geometries
    tree: STRtree

    @classmethod
    def of(cls, geometry: Geometries) -> AreaIndex:
        """Index polygons."""
        return cls(geometry, STRtree(geometry))

    def mask(self, window: Lattice) -> NDArray[np.bool_]:
        """Return which pixel centres of a window lie in a polygon, shape (rows, cols)."""
        near = np.sort(self.tree.query(shapely.box(*window.bounds_m)))
        return burn(((shape, 1) for shape in self.geometry[near]), window, "uint8").astype(bool)


def route_lattice(
    ways: Ways,
    squares: Squares | None,
    buildings: Buildings | None,
    lattice: Lattice,
    half_width_m: float = HALF_WIDTH_M,
    *,
    tile_px: int = 512,
    progress: Progress | None = None,
) -> RouteLattice:
    """Return the lattice points near a way or in a square, outside buildings.

    Parameters
    ----------
    ways, squares, buildings
        Of the lattice's area, in its CRS.
    lattice : Lattice
        Normally that of the radio rasters.
    half_width_m : float
        A point belongs to a way at most this far from its centre line.
    tile_px : int
        Side of the tiles that the work is done by; it bounds the memory, not the result.
    progress : callable, optional
        Called with tiles done and tiles in all.

    Raises
    ------
    InputError
        The CRS differ, ``half_width_m`` is not > 0, or no point is left.
    """
    faults = Faults()
    for name, layer in (("ways", ways), ("squares", squares), ("buildings", buildings)):
        if layer is not None and not same_crs(layer.crs, lattice.crs):
            faults.add(f"{name}, crs", lattice.crs, layer.crs, "layers of different CRS")
    if not (np.isfinite(half_width_m) and half_width_m > 0):
        faults.add("half_width_m", "metres > 0", half_width_m)
    faults.raise_if_any(InputError)
    index = WayIndex.of(ways)
    open_areas = AreaIndex.of(squares.geometry) if squares else None
    built = AreaIndex.of(buildings.footprints) if buildings else None
    tiles = lattice.tiles(tile_px)
    parts = []
    for done, (row, col, rows, cols) in enumerate(tiles, start=1):
        window = lattice.window(row, col, rows, cols)
        tile = rasterise_tile(window, index, open_areas, built, half_width_m)
        parts.append((row, col, tile))
        if progress is not None:
            progress(done, len(tiles))
    routes = _joined(lattice, parts)
    if not len(routes):
        raise fail(
            InputError,
            "route lattice",
            "a point near a way or in a square",
            "none",
            "roads and rasters of different areas",
        )
    return routes


def rasterise_tile(
    window: Lattice,
    ways: WayIndex,
    squares: AreaIndex | None,
    buildings: AreaIndex | None,
    half_width_m: float,
) -> RouteLattice:
    """Return the route lattice of one window; the same points as on the whole lattice."""
    on_square = _mask(squares, window)
    near = _pixels_near(ways, window, half_width_m)
    candidate = (near | on_square) & ~_mask(buildings, window)
    row, col = np.nonzero(candidate)
    east, north = window.east_north(row, col)
    way, distance = ways.nearest(east, north, half_width_m)
    kept = (way >= 0) | on_square[row, col]
    pixels, nearest = (row[kept], col[kept]), (way[kept], distance[kept])
    return _described(window, on_square, pixels, ways, nearest, SQUARE_CLASS)


def route_lattice_from_landuse(
    mask: NDArray[np.bool_],
    lattice: Lattice,
    ways: Ways | None = None,
    half_width_m: float = HALF_WIDTH_M,
) -> RouteLattice:
    """Return the lattice points in walkable classes of land use, the paper's second database.

    Parameters
    ----------
    mask : numpy.ndarray of bool, shape (lattice.rows, lattice.cols)
        Where one can be, as :func:`mapfilter.roads.landuse.read_landuse` returns it.
    lattice : Lattice
    ways : Ways, optional
        Name the way of points within ``half_width_m`` of one, and give all points their distance;
        they add no point.
    half_width_m : float

    Raises
    ------
    InputError
        The mask has another shape or is empty.
    """
    if mask.shape != (lattice.rows, lattice.cols):
        shape = f"{(lattice.rows, lattice.cols)}"
        raise fail(InputError, "land-use mask", f"shape {shape}", mask.shape)
    if not mask.any():
        raise fail(InputError, "land use", "a walkable point", "none", "no class is walkable")
    index = WayIndex.of(_no_ways(lattice.crs) if ways is None else ways)
    row, col = np.nonzero(mask)
    east, north = lattice.east_north(row, col)
    nearest = index.nearest(east, north, half_width_m)
    return _described(lattice, mask, (row, col), index, nearest, LANDUSE_CLASS)


def _described(
    lattice: Lattice,
    on_square: NDArray[np.bool_],
    pixels: tuple[NDArray[np.int64], NDArray[np.int64]],
    ways: WayIndex,
    nearest: tuple[NDArray[np.int64], NDArray[np.float64]],
    other_class: str,
) -> RouteLattice:
    (row, col), (way, distance_m) = pixels, nearest
    alone = way < 0
    east, north = lattice.east_north(row[alone], col[alone])
    distance_m[alone] = ways.nearest(east, north)[1]
    names = (*ways.ways.class_names, other_class)
    way_id = np.zeros(row.size, dtype=np.int64)
    way_id[~alone] = ways.ways.way_id[way[~alone]]
    way_class = np.full(row.size, len(names) - 1, dtype=np.int16)
    way_class[~alone] = ways.ways.way_class[way[~alone]]
    return RouteLattice(
        lattice,
        row.astype(np.int32),
        col.astype(np.int32),
        way_id,
        way_class,
        names,
        distance_m.astype(np.float32),
        on_square[row, col],
    )


def _pixels_near(ways: WayIndex, window: Lattice, reach_m: float) -> NDArray[np.bool_]:
    """Return all pixels whose centre may be within reach of a segment, and some more."""
    pad = int(np.ceil(reach_m / window.resolution_m + 0.5)) + 1
    side_m = pad * window.resolution_m
    wide = Lattice(
        window.crs,
        window.west_m - side_m,
        window.north_m + side_m,
        window.resolution_m,
        window.rows + 2 * pad,
        window.cols + 2 * pad,
    )
    segments = np.sort(ways.tree.query(shapely.box(*wide.bounds_m)))
    near = np.unique(ways.way[segments])
    shapes = ((line, 1) for line in ways.ways.geometry[near])
    touched = burn(shapes, wide, "uint8", all_touched=True).astype(bool)
    square = np.ones((2 * pad + 1, 2 * pad + 1), dtype=bool)
    grown = binary_dilation(touched, square)
    return np.asarray(grown[pad:-pad, pad:-pad], dtype=np.bool_)


def _mask(areas: AreaIndex | None, window: Lattice) -> NDArray[np.bool_]:
    if areas is None:
        return np.zeros((window.rows, window.cols), dtype=np.bool_)
    return areas.mask(window)


def _joined(lattice: Lattice, parts: list[tuple[int, int, RouteLattice]]) -> RouteLattice:
    row = np.concatenate([tile.row + np.int32(row) for row, _, tile in parts])
    col = np.concatenate([tile.col + np.int32(col) for _, col, tile in parts])
    tiles = [tile for _, _, tile in parts]
    order = np.lexsort((col, row))
    return RouteLattice(
        lattice,
        row[order],
        col[order],
        np.concatenate([tile.way_id for tile in tiles])[order],
        np.concatenate([tile.way_class for tile in tiles])[order],
        tiles[0].class_names,
        np.concatenate([tile.distance_to_way_m for tile in tiles])[order],
        np.concatenate([tile.on_square for tile in tiles])[order],
    )


def _no_ways(crs: str) -> Ways:
    none = np.empty(0, dtype=np.int64)
    lines = np.empty(0, dtype=object)
    return Ways(crs, none, none.astype(np.int16), (), lines, none == 1, none.astype(np.int8))
