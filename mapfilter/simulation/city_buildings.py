"""What becomes of the blocks of a made city: squares, parks, dead ends and passages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, Polygon

from mapfilter._types import Bools, Floats, Ints
from mapfilter.roads.ways import Geometries
from mapfilter.simulation.city_streets import GRID, INNER, OLD_TOWN, PARK, VILLAS

_SQUARE_M2 = (900.0, 7000.0)
_SQUARE_SHARE = 0.05
_PARK_SHARE = 0.03
_PARK_M2 = 5000.0
# How often a block of each style has a dead end, and a passage for walkers.
_DEAD_ENDS = {OLD_TOWN: 0.25, INNER: 0.6, GRID: 0.6, VILLAS: 0.8}
_PASSAGES = {OLD_TOWN: 0.1, INNER: 0.12, GRID: 0.15, VILLAS: 0.15}
_LEAST_DEPTH_M = 35.0


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Blocks, and what they are.

    Parameters
    ----------
    outline : numpy.ndarray of shapely.Polygon, shape (N,)
        Up to the middle of the streets.
    style : numpy.ndarray of int64, shape (N,)
        Of the quarter, or PARK.
    is_square : numpy.ndarray of bool, shape (N,)
    """

    outline: Geometries
    style: Ints
    is_square: Bools


def used_blocks(
    blocks: Geometries, outlines: Geometries, styles: Ints, rng: np.random.Generator
) -> Blocks:
    """Give each block the style of its quarter; some become squares or parks.

    The block of the old town that is nearest to its middle is always a square.
    """
    middle = shapely.point_on_surface(blocks)
    block, quarter = STRtree(outlines).query(middle, predicate="intersects")
    style = np.full(len(blocks), INNER)
    style[block] = styles[quarter]
    area_m2 = shapely.area(blocks)
    chance = rng.random(len(blocks))
    fits = (area_m2 >= _SQUARE_M2[0]) & (area_m2 <= _SQUARE_M2[1])
    is_square = fits & (chance < _SQUARE_SHARE) & np.isin(style, (OLD_TOWN, INNER, GRID))
    in_town = np.flatnonzero(fits & (style == OLD_TOWN))
    if in_town.size:
        away_m = shapely.distance(middle[in_town], shapely.Point(0.0, 0.0))
        is_square[in_town[np.argmin(away_m)]] = True
    is_park = ~is_square & (area_m2 > _PARK_M2) & (chance > 1 - _PARK_SHARE) & (style != OLD_TOWN)
    return Blocks(blocks, np.where(is_park, PARK, style), is_square)


def inner_ways(blocks: Blocks, rng: np.random.Generator) -> list[tuple[LineString, str]]:
    """Return dead ends, passages and paths within blocks; each begins on a street."""
    found: list[tuple[LineString, str]] = []
    for outline, style, is_square in zip(
        blocks.outline, blocks.style, blocks.is_square, strict=True
    ):
        draw = rng.random(3)
        if is_square:
            continue
        if style == PARK:
            found += [(line, "path") for line in _star(outline, rng)]
            continue
        chord = _chord(outline, rng)
        if chord is None or chord.length < _LEAST_DEPTH_M:
            continue
        if draw[0] < _PASSAGES[int(style)]:
            found.append((chord, "footway"))
        elif draw[1] < _DEAD_ENDS[int(style)]:
            ends = chord.coords[0], chord.interpolate(0.3 + 0.3 * draw[2], normalized=True)
            found.append((LineString(ends), "service" if style != VILLAS else "residential"))
    return found


def _chord(outline: Polygon, rng: np.random.Generator) -> LineString | None:
    """Return a line from the middle part of a long side straight to the other side."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    sides = np.diff(corners[:3], axis=0)
    across = int(np.argmin(np.hypot(sides[:, 0], sides[:, 1])))
    start = corners[0] + sides[1 - across] * rng.uniform(0.35, 0.65)
    if across == 0:
        ends = np.array([start, start + sides[0]])
    else:
        start = corners[0] + sides[0] * rng.uniform(0.35, 0.65)
        ends = np.array([start, start + sides[1]])
    if rng.random() < 0.5:
        ends = ends[::-1]
    middle = ends.mean(axis=0)
    reach = LineString(middle + 1.2 * (ends - middle)).intersection(outline)
    return reach if reach.geom_type == "LineString" else None


def _star(outline: Polygon, rng: np.random.Generator) -> list[LineString]:
    """Return paths from the edge of a park to a place within."""
    place = outline.point_on_surface()
    edge = outline.exterior
    arms = int(rng.integers(3, 6))
    starts = (np.arange(arms) + rng.uniform(0.1, 0.9, arms)) / arms
    lines = [LineString([edge.interpolate(s, normalized=True), place]) for s in starts]
    # Only what stays within a park is a path of it.
    return [line for line in lines if outline.buffer(0.1).covers(line)]


STOREY_M = 3.2
_ROOF_M = 1.5
_LEAST_HOUSE_M2 = 30.0
_LEAST_COURT_M2 = 60.0
_CORNER_RAD = np.radians(25.0)


@dataclass(frozen=True, slots=True)
class Manner:
    """How a block is built up.

    Parameters
    ----------
    depth_m, front_m : float
        Of a house.
    apart_m : float
        From each house to the border of its plot.
    garden_m : float
        Between street and plots.
    storeys : tuple of float
        Least and most of a block's mean.
    """

    depth_m: float
    front_m: float
    apart_m: float
    garden_m: float
    storeys: tuple[float, float]


_MANNERS = {
    OLD_TOWN: Manner(10.0, 9.0, 0.0, 0.0, (3.0, 5.0)),
    INNER: Manner(12.5, 17.0, 0.0, 0.0, (4.0, 6.5)),
    GRID: Manner(13.0, 20.0, 0.0, 0.0, (4.0, 7.0)),
    VILLAS: Manner(13.0, 18.0, 2.5, 3.5, (1.6, 3.2)),
}
_SLABS = Manner(20.0, 45.0, 4.0, 2.0, (7.0, 13.0))
_SLAB_SHARE = 0.1


def houses(blocks: Geometries, style: Ints, rng: np.random.Generator) -> tuple[Geometries, Floats]:
    """Build on blocks.

    Parameters
    ----------
    blocks : numpy.ndarray of shapely geometries, shape (N,)
        What streets leave of each.
    style : numpy.ndarray of int64, shape (N,)
        In what style; parks stay free.

    Returns
    -------
    footprints : numpy.ndarray of shapely.Polygon, shape (M,)
    height_m : numpy.ndarray, shape (M,)
    """
    built: list[Polygon] = []
    heights: list[Floats] = []
    for block, kind in zip(blocks, style, strict=True):
        if kind == PARK:
            continue
        is_slabs = kind in (GRID, VILLAS) and rng.random() < _SLAB_SHARE
        manner = _SLABS if is_slabs else _MANNERS[int(kind)]
        mean = rng.uniform(*manner.storeys)
        for part in shapely.get_parts(shapely.buffer(block, -manner.garden_m, join_style="mitre")):
            found = _about(part, manner, rng)
            storeys = np.maximum(np.round(mean + rng.normal(0, 0.7, len(found))), 1)
            built += found
            heights.append(np.round(STOREY_M * storeys + _ROOF_M, 1))
    footprints = np.empty(len(built), dtype=object)
    footprints[:] = built
    return footprints, np.concatenate([np.empty(0), *heights])


def _about(plot: Polygon, manner: Manner, rng: np.random.Generator) -> list[Polygon]:
    """Return the houses along the edge of a plot, which leave a court in its middle."""
    if plot.area < _LEAST_HOUSE_M2:
        return []
    plot = Polygon(plot.exterior).simplify(0.3)
    court = shapely.buffer(plot, -manner.depth_m, join_style="mitre")
    if court.area < _LEAST_COURT_M2:
        court = shapely.buffer(plot, -0.7 * manner.depth_m, join_style="mitre")
    ring = plot.difference(court)
    walls = _party_walls(plot, manner, rng)
    cut = shapely.union_all([ring.boundary, *walls])
    parts = shapely.get_parts(shapely.polygonize([cut]))
    parts = parts[shapely.contains(ring, shapely.point_on_surface(parts))]
    if manner.apart_m:
        parts = shapely.get_parts(shapely.buffer(parts, -manner.apart_m, join_style="mitre"))
    return [part for part in parts if part.area >= _LEAST_HOUSE_M2]


def _party_walls(plot: Polygon, manner: Manner, rng: np.random.Generator) -> Geometries:
    """Return lines inward from the edge of a plot, clear of its corners."""
    edge = shapely.get_coordinates(shapely.orient_polygons(plot).exterior)
    side = np.diff(edge, axis=0)
    length_m = np.hypot(side[:, 0], side[:, 1])
    side /= length_m[:, None]
    turn = np.abs(
        np.arctan2(_cross(side, np.roll(side, -1, 0)), (side * np.roll(side, -1, 0)).sum(1))
    )
    end_m = np.cumsum(length_m)
    corner_m = np.concatenate([[0.0], end_m])[np.concatenate([[turn[-1]], turn]) > _CORNER_RAD]
    count = max(int(end_m[-1] / manner.front_m), 1)
    place_m = (np.arange(count) + rng.uniform(0.2, 0.8, count)) * end_m[-1] / count
    off_m = np.abs(place_m[:, None] - corner_m[None, :]).min(axis=1, initial=np.inf)
    place_m = place_m[off_m > 0.9 * manner.depth_m]
    on = np.minimum(np.searchsorted(end_m, place_m), len(side) - 1)
    foot = edge[on] + side[on] * (place_m - end_m[on] + length_m[on])[:, None]
    inward = np.column_stack([-side[on, 1], side[on, 0]])
    ends = np.stack([foot - 0.5 * inward, foot + (manner.depth_m + 0.5) * inward], axis=1)
    return np.asarray(shapely.linestrings(ends))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
