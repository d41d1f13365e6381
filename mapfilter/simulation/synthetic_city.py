"""Synthetic cities of any size: streets, squares, houses and a river, all drawn from a seed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely.affinity import rotate, translate
from shapely.geometry import LineString

from mapfilter._types import Floats
from mapfilter.errors import ConfigError, Faults
from mapfilter.lattice import Lattice
from mapfilter.roads.osm import DRIVING_CLASSES
from mapfilter.roads.ways import (
    Bounds,
    Buildings,
    Geometries,
    Squares,
    Water,
    Ways,
    polygons_inside,
)
from mapfilter.simulation.city_blocks import (
    Pieces,
    blocks_of,
    clear_of_streets,
    connected,
    inner_ways,
    noded,
    uses_of,
    ways_of,
    with_lines,
    without_small_blocks,
    without_stubs,
)
from mapfilter.simulation.city_houses import houses
from mapfilter.simulation.city_streets import PARK, bend, quarters, skeleton, streets

_SIZES_M = (200.0, 50_000.0)
_RIVER_FROM_M = 800.0
_CORNER_EVERY_M = 20.0
_EDGE_M = 60.0
_CHURCH_M = (13.0, 30.0)


@dataclass(frozen=True, slots=True, eq=False)
class SyntheticCity:
    """An invented city within ``bounds_m``: west, south, east, north.

    Parameters
    ----------
    ways : Ways
        All walkable ways; one connected network.
    water : Water
        The river; empty without one.
    parks : numpy.ndarray of shapely.Polygon
        For pictures; their paths are among the ways.
    """

    bounds_m: Bounds
    ways: Ways
    squares: Squares
    buildings: Buildings
    water: Water
    parks: Geometries

    @property
    def driving_ways(self) -> Ways:
        """The ways that are open to cars."""
        names = self.ways.class_names
        drivable = np.array([name in DRIVING_CLASSES for name in names], dtype=np.bool_)
        return self.ways.select(drivable[self.ways.way_class])


def synthetic_city(lattice: Lattice, seed: int, *, river: bool = True) -> SyntheticCity:
    """Return a city with an irregular European street pattern.

    In its middle an old town with crooked alleys about a main square; radial and ring roads; inner
    quarters with perimeter blocks; farther out grids of different directions, villas, parks and
    tall slabs; squares, dead ends, passages; a river that is crossed on a few bridges only.

    Parameters
    ----------
    lattice : Lattice
        The area that it fills, at least 200 m and at most 50 km to each side.
    seed : int
        Not negative. Another area gives another city.
    river : bool
        Without effect on areas less than 800 m wide or high, which have none.

    Returns
    -------
    SyntheticCity
        In the CRS of the lattice.

    Raises
    ------
    ConfigError
        The area is too small or too large, or the seed is negative.

    Examples
    --------
    >>> city = synthetic_city(Lattice("EPSG:32631", 500_000.0, 1000.0, 5.0, 200, 200), seed=1)
    >>> len(city.ways) > 100, len(city.buildings) > 100
    (True, True)
    """
    _check(lattice, seed)
    rng = np.random.default_rng(seed)
    west, south, east, north = lattice.bounds_m
    half_m = np.array([east - west, north - south]) / 2
    off_m = np.round(half_m * rng.uniform(-0.12, 0.12, 2))
    centre_m = np.array([west + east, south + north]) / 2 + off_m
    area = (*(-half_m - off_m), *(half_m - off_m))
    # Bending moves the edge of what is laid out, which is therefore wider than the area.
    box = (*(-half_m - off_m - _EDGE_M), *(half_m - off_m + _EDGE_M))
    plan = skeleton(box, river and 2 * half_m.min() >= _RIVER_FROM_M, rng)
    parts, roads = quarters(plan, box, rng)
    roads = [*plan.roads, *roads, *(line for part in parts for line in streets(part, rng))]
    phases = rng.uniform(0, 2 * np.pi, (2, 3))

    def bent(shapes: Any) -> Any:
        many = shapely.segmentize(shapes, _CORNER_EVERY_M)
        return shapely.transform(many, lambda at: bend(at, plan.old_town_m, phases))

    def placed(shapes: Any) -> Geometries:
        moved = shapely.transform(np.asarray(shapes, object), lambda at: at + centre_m)
        return np.asarray(moved)

    # Cut at junctions before bending, or ends would no longer lie on the streets that they meet.
    pieces = noded(Pieces.of(roads))
    pieces = noded(replace(pieces, geometry=shapely.clip_by_rect(bent(pieces.geometry), *area)))
    pieces = connected(without_stubs(without_small_blocks(pieces), area))
    blocks = blocks_of(pieces, shapely.box(*area).exterior)
    blocks = blocks[~shapely.contains(bent(plan.banks), shapely.point_on_surface(blocks))]
    outlines, styles = zip(*parts, strict=True)
    style, is_square = uses_of(blocks, bent(np.array(outlines)), np.array(styles), rng)
    pieces = connected(with_lines(pieces, Pieces.of(inner_ways(blocks, style, is_square, rng))))
    clear = clear_of_streets(blocks, pieces)
    footprints, height_m = houses(clear[~is_square], style[~is_square], rng)
    churches, tower_m = _churches(clear[is_square], rng)
    ways = ways_of(pieces, lattice.crs, centre_m)
    squares = placed(blocks[is_square])
    built = placed(np.concatenate([footprints, churches]))
    water, _ = polygons_inside(placed([bent(plan.river)]), lattice.bounds_m, cut=True)
    return SyntheticCity(
        lattice.bounds_m,
        ways,
        Squares(lattice.crs, int(ways.way_id.max()) + 1 + np.arange(len(squares)), squares),
        Buildings(lattice.crs, built, np.concatenate([height_m, tower_m]), len(built), 0, 0),
        Water(lattice.crs, water),
        placed(blocks[style == PARK]),
    )


def manhattan(
    lattice: Lattice,
    *,
    block_m: float = 80.0,
    street_m: tuple[float, float] = (22.0, 25.0),
    height_m: float = 26.0,
) -> SyntheticCity:
    """Return straight canyons: square blocks of one height, streets at right angles.

    Such is the city on which ray-traced predictions are often tried.

    Parameters
    ----------
    lattice : Lattice
        The area; the first streets to the east and north run along its western and southern edge.
    block_m, height_m : float
        Side and height of a block, which is one house.
    street_m : tuple of float
        Width of the streets that run east-west, and of those that run north-south.

    Raises
    ------
    ConfigError
        A length is not > 0, or the area is too small or too large.

    Examples
    --------
    >>> city = manhattan(Lattice("EPSG:32631", 500_000.0, 1000.0, 5.0, 200, 200))
    >>> len(city.buildings), city.buildings.footprints[0].area
    (100, 6400.0)
    """
    _check(lattice, 0, block_m, *street_m, height_m)
    west, south, east, north = lattice.bounds_m
    columns = np.arange(west + street_m[1] / 2, east, block_m + street_m[1])
    rows = np.arange(south + street_m[0] / 2, north, block_m + street_m[0])
    lines = [LineString([(at, north), (at, south)]) for at in columns]
    lines += [LineString([(west, at), (east, at)]) for at in rows]
    names = ["secondary"] * len(columns) + ["residential"] * len(rows)
    pieces = noded(Pieces.of(list(zip(lines, names, strict=True))))
    at = np.meshgrid(columns + street_m[1] / 2, rows + street_m[0] / 2)
    corner_m = [axis.ravel() for axis in at]
    blocks = shapely.box(*corner_m, *(axis + block_m for axis in corner_m))
    blocks, _ = polygons_inside(blocks, lattice.bounds_m, cut=True)
    none = np.empty(0, dtype=object)
    return SyntheticCity(
        lattice.bounds_m,
        ways_of(pieces, lattice.crs, np.zeros(2)),
        Squares(lattice.crs, np.empty(0, dtype=np.int64), none),
        Buildings(lattice.crs, blocks, np.full(len(blocks), height_m), len(blocks), 0, 0),
        Water(lattice.crs, none),
        none,
    )


def _churches(squares: Geometries, rng: np.random.Generator) -> tuple[Geometries, Floats]:
    """Return a church, with its tower's height, in each square that has room for one."""
    found, tower_m = [], []
    for square in squares[~shapely.is_empty(squares)]:
        place, turn = square.centroid, rng.uniform(0, 180)
        church = shapely.box(-_CHURCH_M[0], -_CHURCH_M[1] / 3, _CHURCH_M[0], _CHURCH_M[1] / 3)
        church = translate(rotate(church, turn), place.x, place.y)
        if shapely.buffer(square, -6.0).contains(church):
            found.append(church)
            tower_m.append(round(float(rng.uniform(22, 45)), 1))
    return np.array(found, dtype=object), np.array(tower_m)


def _check(lattice: Lattice, seed: int, *lengths_m: float) -> None:
    faults = Faults()
    west, south, east, north = lattice.bounds_m
    size_m = east - west, north - south
    if not (min(size_m) >= _SIZES_M[0] and max(size_m) <= _SIZES_M[1]):
        expected = f"sides of {_SIZES_M[0]:g} to {_SIZES_M[1]:g} m"
        faults.add("synthetic city, size_m", expected, f"{size_m[0]:g} x {size_m[1]:g} m")
    if seed < 0:
        faults.add("synthetic city, seed", "a number >= 0", seed)
    if not all(np.isfinite(length) and length > 0 for length in lengths_m):
        faults.add("synthetic city, lengths", "metres > 0", lengths_m)
    faults.raise_if_any(ConfigError)
