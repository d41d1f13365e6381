"""What becomes of the blocks of a made city: squares, parks, dead ends and passages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, Polygon

from mapfilter._types import Bools, Ints
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
