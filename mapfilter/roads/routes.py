"""From ways, squares, buildings, water and land use to the route lattice, tile by tile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import STRtree

from mapfilter._parallel import Progress
from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.roads.buildings import burn
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.near import HALF_WIDTH_M, WayIndex, note_half_widths
from mapfilter.roads.ways import Buildings, Geometries, Squares, Water, Ways

SQUARE_CLASS = "square"
LANDUSE_CLASS = "land use"
TILE_PX = 512


@dataclass(frozen=True, slots=True, eq=False)
class AreaIndex:
    """Polygons in a search tree, to burn those of a tile."""

    geometry: Geometries
    tree: STRtree

    @classmethod
    def of(cls, geometry: Geometries) -> AreaIndex:
        """Index polygons."""
        return cls(geometry, STRtree(geometry))

    def mask(self, window: Lattice) -> Bools:
        """Return which pixel centres of a window lie in a polygon, shape (rows, cols)."""
        near = np.sort(self.tree.query(shapely.box(*window.bounds_m)))
        return burn(((shape, 1) for shape in self.geometry[near]), window, "uint8").astype(bool)


@dataclass(frozen=True, slots=True, eq=False)
class RouteSource:
    """What any tile of a route lattice is made from; it can be sent to other processes.

    Parameters
    ----------
    crs : str
        Projected CRS of everything, in metres.
    ways : WayIndex
    squares, buildings, water : AreaIndex or None
    bridges : WayIndex or None
        The parts of the ways that lie in the water: water cuts nothing off these.
    """

    crs: str
    ways: WayIndex
    squares: AreaIndex | None
    buildings: AreaIndex | None
    water: AreaIndex | None
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
    ) -> RouteSource:
        """Index the layers of an area; the parameters are those of :func:`route_lattice`.

        Raises
        ------
        InputError
            The CRS differ, or a half width is no length.
        """
        faults = Faults()
        layers = {"squares": squares, "buildings": buildings, "water": water}
        _note_crs(faults, ways.crs, layers)
        faults.raise_if_any(InputError)
        index = WayIndex.of(ways, half_width_m, half_width_by_class_m or {})
        return cls(
            ways.crs,
            index,
            AreaIndex.of(squares.geometry) if squares else None,
            AreaIndex.of(buildings.footprints) if buildings else None,
            AreaIndex.of(water.geometry) if water else None,
            index.inside(water.geometry) if water else None,
        )

    def tile(self, window: Lattice) -> RouteLattice:
        """Return the route lattice of a window; the same points as on the whole lattice."""
        on_square = _mask(self.squares, window)
        way, distance_m = self.ways.reaching(window)
        allowed = ((way >= 0) | on_square) & ~_mask(self.buildings, window)
        if self.water is not None and self.bridges is not None:
            wet = self.water.mask(window)
            if np.any(wet & allowed):
                allowed &= ~wet | (self.bridges.reaching(window)[0] >= 0)
        return _described(allowed, window, on_square, self.ways, (way, distance_m), SQUARE_CLASS)

    def over(
        self, lattice: Lattice, tile_px: int = TILE_PX, progress: Progress | None = None
    ) -> RouteLattice:
        """Return the route lattice of a whole area, made tile by tile.

        Raises
        ------
        InputError
            No point is left.
        """
        tiles = lattice.tiles(tile_px)
        parts = []
        for done, (row, col, rows, cols) in enumerate(tiles, start=1):
            parts.append((row, col, self.tile(lattice.window(row, col, rows, cols))))
            if progress is not None:
                progress(done, len(tiles))
        routes = _joined(lattice, parts)
        if not len(routes):
            expected = "a point near a way or in a square"
            hint = "roads and rasters of different areas"
            raise fail(InputError, "route lattice", expected, "none", hint)
        return routes


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
    progress: Progress | None = None,
) -> RouteLattice:
    """Return the lattice points near a way or in a square, outside buildings and water.

    Parameters
    ----------
    ways, squares, buildings
        Of the lattice's area, in its CRS. Ways just outside count for points inside.
    lattice : Lattice
        Normally that of the radio rasters.
    half_width_m : float
        A point belongs to a way at most this far from its centre line; to the nearest of several.
    half_width_by_class_m : mapping of str to float, optional
        The same for some classes of way; 0 leaves the class out.
    water : Water, optional
        Where nobody walks, save on the ways that cross it and within their half width: where a
        way runs through water there is a bridge, a pier or a ford.
    tile_px : int
        Side of the tiles that the work is done by; it bounds the memory, not the result.
    progress : callable, optional
        Called with tiles done and tiles in all.

    Raises
    ------
    InputError
        The CRS differ, a half width is no length, or no point is left.
    """
    faults = Faults()
    layers = {"ways": ways, "squares": squares, "buildings": buildings, "water": water}
    _note_crs(faults, lattice.crs, layers)
    note_half_widths(faults, half_width_m, half_width_by_class_m or {})
    faults.raise_if_any(InputError)
    source = RouteSource.of(
        ways,
        squares,
        buildings,
        half_width_m,
        half_width_by_class_m=half_width_by_class_m,
        water=water,
    )
    return source.over(lattice, tile_px, progress)


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
        Where one can be, as :class:`mapfilter.roads.landuse.LandUse` tells it.
    lattice : Lattice
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
    index = WayIndex.of(
        Ways.none(lattice.crs) if ways is None else ways, half_width_m, half_width_by_class_m or {}
    )
    return landuse_tile(mask, lattice, index)


def landuse_tile(mask: Bools, window: Lattice, ways: WayIndex) -> RouteLattice:
    """Return the route lattice of a window of land use; there may be no point in it."""
    return _described(mask, window, mask, ways, ways.reaching(window), LANDUSE_CLASS)


def _described(
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


def _note_crs(
    faults: Faults, crs: str, layers: Mapping[str, Ways | Squares | Buildings | Water | None]
) -> None:
    for name, layer in layers.items():
        if layer is not None and not same_crs(layer.crs, crs):
            faults.add(f"{name}, crs", crs, layer.crs, "layers of different CRS")


def _mask(areas: AreaIndex | None, window: Lattice) -> Bools:
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
