"""The points of route lattices, laid from the layers of an area: whole, or any tile of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import STRtree

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import burn
from mapfilter.roads.index import HALF_WIDTH_M, WayIndex, note_half_widths
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.ways import Buildings, Geometries, Squares, Water, Ways

TILE_PX = 512
SQUARE_CLASS = "square"
LANDUSE_CLASS = "land use"


def areas_near(areas: STRtree, window: Lattice) -> Geometries:
    """Return the polygons about a window, in their order."""
    near = np.sort(areas.query(shapely.box(*window.bounds_m)))
    return np.asarray(areas.geometries[near])


@dataclass(frozen=True, slots=True, eq=False)
class RouteSource:
    """Indexed layers of a route lattice, for any of its tiles; it can be sent to other processes.

    ``bridges`` are the parts of the ways that lie in the water, which stay.
    """

    crs: str
    ways: WayIndex
    squares: STRtree | None
    buildings: STRtree | None
    water: STRtree | None
    bridges: WayIndex | None

    @classmethod
    def of(
        cls,
        ways: Ways,
        squares: Squares | None = None,
        buildings: Buildings | None = None,
        half_width_m: float = HALF_WIDTH_M,
        *,
        half_width_by_class_m: Mapping[str, float] | None = None,
        water: Water | None = None,
        crs: str | None = None,
    ) -> RouteSource:
        """Index the layers of an area; parameters and errors as of :func:`route_lattice`.

        ``crs`` is that of the lattice; by default that of the ways.
        """
        faults, crs = Faults(), crs or ways.crs
        layers = {"ways": ways, "squares": squares, "buildings": buildings, "water": water}
        for name, layer in layers.items():
            if layer is not None and not same_crs(layer.crs, crs):
                got = shown_crs(layer.crs)
                faults.add(f"{name}, crs", shown_crs(crs), got, "layers of different CRS")
        note_half_widths(faults, half_width_m, half_width_by_class_m or {})
        faults.raise_if_any(InputError)
        index = WayIndex.of(ways, half_width_m, half_width_by_class_m)
        return cls(
            crs,
            index,
            STRtree(squares.geometry) if squares else None,
            STRtree(buildings.footprints) if buildings else None,
            STRtree(water.geometry) if water else None,
            index.inside(water.geometry) if water else None,
        )

    def __reduce__(self) -> tuple[Callable[..., RouteSource], tuple[Any, ...]]:
        areas = self.squares, self.buildings, self.water
        packed = [None if tree is None else shapely.to_wkb(tree.geometries) for tree in areas]
        return _unpacked_source, (self.crs, self.ways, packed, self.bridges)

    def tile(self, window: Lattice) -> RouteLattice:
        """Return the route lattice of a window; the same points as on the whole lattice."""
        on_square = inside_areas(self.squares, window)
        way, distance_m = self.ways.reaching(window)
        allowed = ((way >= 0) | on_square) & ~inside_areas(self.buildings, window)
        if self.water is not None and self.bridges is not None:
            wet = inside_areas(self.water, window)
            if np.any(wet & allowed):
                allowed &= ~wet | (self.bridges.reaching(window)[0] >= 0)
        return described(allowed, window, on_square, self.ways, (way, distance_m), SQUARE_CLASS)

    def over(self, lattice: Lattice, tile_px: int = TILE_PX) -> RouteLattice:
        """Return the route lattice of a whole area, made tile by tile; at least one point."""
        tiles = [
            (row, col, self.tile(lattice.window(row, col, rows, cols)))
            for row, col, rows, cols in lattice.tiles(tile_px)
        ]
        rows = np.concatenate([tile.row + np.int32(top) for top, _, tile in tiles])
        cols = np.concatenate([tile.col + np.int32(left) for _, left, tile in tiles])
        order = np.lexsort((cols, rows))

        def joined(column: str) -> Any:
            return np.concatenate([getattr(tile, column) for _, _, tile in tiles])[order]

        if not order.size:
            expected = "a point near a way or in a square"
            hint = "roads and rasters of different areas"
            raise fail(InputError, "route lattice", expected, "none", hint)
        return RouteLattice(
            lattice,
            rows[order],
            cols[order],
            joined("way_id"),
            joined("way_class"),
            tiles[0][2].class_names,
            joined("distance_to_way_m"),
            joined("on_square"),
        )


def _unpacked_source(
    crs: str, ways: WayIndex, packed: list[NDArray[np.object_] | None], bridges: WayIndex | None
) -> RouteSource:
    squares, buildings, water = (
        None if areas is None else STRtree(shapely.from_wkb(areas)) for areas in packed
    )
    return RouteSource(crs, ways, squares, buildings, water, bridges)


def described(
    allowed: Bools,
    window: Lattice,
    on_square: Bools,
    ways: WayIndex,
    nearest: tuple[Ints, Floats],
    other_class: str,
) -> RouteLattice:
    """Return the allowed pixels with their ways, or the distance of the nearest that is."""
    row, col = np.nonzero(allowed)
    way, distance_m = nearest[0][row, col], nearest[1][row, col]
    alone = way < 0
    distance_m[alone] = ways.nearest(*window.east_north(row[alone], col[alone]))[1]
    names = (*ways.ways.class_names, other_class)
    way_id = np.zeros(row.size, dtype=np.int64)
    way_id[~alone] = ways.ways.way_id[way[~alone]]
    way_class = np.full(row.size, len(names) - 1, dtype=np.int16)
    way_class[~alone] = ways.ways.way_class[way[~alone]]
    return RouteLattice(
        window,
        row.astype(np.int32),
        col.astype(np.int32),
        way_id,
        way_class,
        names,
        distance_m.astype(np.float32),
        on_square[row, col],
    )


def inside_areas(areas: STRtree | None, window: Lattice) -> Bools:
    """Return which pixel centres of a window lie in a polygon, shape (rows, cols)."""
    near = np.empty(0) if areas is None else areas_near(areas, window)
    return burn(((shape, 1) for shape in near), window, "uint8").astype(bool)


def route_lattice(
    ways: Ways,
    squares: Squares | None,
    buildings: Buildings | None,
    lattice: Lattice,
    half_width_m: float = HALF_WIDTH_M,
    *,
    half_width_by_class_m: Mapping[str, float] | None = None,
    water: Water | None = None,
    tile_px: int = TILE_PX,
) -> RouteLattice:
    """Return the lattice points near a way or in a square, outside buildings and water.

    Parameters
    ----------
    ways, squares, buildings
        Of the lattice's area, in its CRS. Ways just outside count for points inside; of several
        near a point it belongs to the nearest.
    lattice, half_width_m, half_width_by_class_m
        As for :func:`mapfilter.roads.routes.read_routes`.
    water : Water, optional
        Cut out except on ways that cross it and within their half width: where a way runs through
        water there is a bridge, a pier or a ford.
    tile_px : int
        Side of the tiles that are processed at a time; it bounds the memory, not the result.

    Raises
    ------
    InputError
        The CRS differ, a half width is no length, or no point is left.
    """
    source = RouteSource.of(
        ways,
        squares,
        buildings,
        half_width_m,
        half_width_by_class_m=half_width_by_class_m,
        water=water,
        crs=lattice.crs,
    )
    return source.over(lattice, tile_px)


def route_lattice_from_landuse(
    mask: Bools,
    lattice: Lattice,
    ways: Ways | None = None,
    half_width_m: float = HALF_WIDTH_M,
    *,
    half_width_by_class_m: Mapping[str, float] | None = None,
) -> RouteLattice:
    """Return the lattice points in walkable classes of land use, the paper's second database.

    Parameters
    ----------
    mask : numpy.ndarray of bool, shape (lattice.rows, lattice.cols)
        Accessible points, such as ``LandUse.walkable``.
    lattice : Lattice
        Of the mask.
    ways : Ways, optional
        Name the way of points within its half width, and give all points their distance; they
        add no point.
    half_width_m, half_width_by_class_m
        As for :func:`route_lattice`.

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
    ways = Ways.none(lattice.crs) if ways is None else ways
    index = WayIndex.of(ways, half_width_m, half_width_by_class_m)
    return described(mask, lattice, mask, index, index.reaching(lattice), LANDUSE_CLASS)
