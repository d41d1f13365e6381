"""Ways and blocks of a synthetic city: streets cut at junctions, and what lies between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import STRtree
from shapely.geometry import LineString, Polygon

from mapfilter._types import Bools, Floats, Ints
from mapfilter.roads.ways import Bounds, Geometries, Ways
from mapfilter.simulation.city_streets import GRID, INNER, OLD_TOWN, PARK, SNAP_M, VILLAS, Roads

_MAIN = ("primary", "secondary", "tertiary")
# Metres from the middle of a street to the houses, by its class.
_CLEAR_M = {
    "primary": 11.0,
    "secondary": 9.0,
    "tertiary": 7.5,
    "residential": 5.2,
    "living_street": 3.2,
    "pedestrian": 4.2,
    "service": 3.5,
    "footway": 2.0,
    "path": 2.0,
}
_CLASSES = tuple(sorted(_CLEAR_M))
_LEAST_BLOCK_M2 = 900.0
_ROUNDS = 4

_SQUARE_M2 = (900.0, 7000.0)
_SQUARE_SHARE = 0.05
_PARK_SHARE = 0.03
_PARK_M2 = 5000.0
# How often a block of each style has a dead end, and a passage for walkers.
_DEAD_ENDS = {OLD_TOWN: 0.25, INNER: 0.6, GRID: 0.6, VILLAS: 0.8}
_PASSAGES = {OLD_TOWN: 0.1, INNER: 0.12, GRID: 0.15, VILLAS: 0.15}
_LEAST_DEPTH_M = 35.0


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Pieces of street: their geometry, the line that each is of, and its class; shape (N,)."""

    geometry: Geometries
    line: Ints
    name: NDArray[np.str_]

    @classmethod
    def of(cls, roads: Roads) -> Pieces:
        """Return whole lines, not yet cut where they cross."""
        names = np.array([name for _, name in roads], str)
        return cls(np.array([line for line, _ in roads], object), np.arange(len(roads)), names)

    def select(self, which: Bools | Ints) -> Pieces:
        """Return some of the pieces."""
        return Pieces(self.geometry[which], self.line[which], self.name[which])

    @property
    def ends(self) -> tuple[Floats, Ints, Ints]:
        """Places where pieces end, and which of them each begins and ends at."""
        ends = [shapely.get_coordinates(shapely.get_point(self.geometry, at)) for at in (0, -1)]
        place, node = np.unique(np.round(np.concatenate(ends), 3), axis=0, return_inverse=True)
        start, end = np.split(node.ravel(), 2)
        return place, start, end


def noded(lines: Pieces) -> Pieces:
    """Cut lines where they cross or meet; what several share goes to the first."""
    parts = shapely.get_parts(shapely.unary_union(lines.geometry, grid_size=SNAP_M))
    middle = shapely.line_interpolate_point(parts, 0.5, normalized=True)
    part, line = STRtree(lines.geometry).query(middle, predicate="dwithin", distance=10 * SNAP_M)
    owner = np.full(len(parts), len(lines.geometry))
    np.minimum.at(owner, part, line)
    own = owner < len(lines.geometry)
    return Pieces(parts[own], lines.line[owner[own]], lines.name[owner[own]])


def with_lines(pieces: Pieces, more: Pieces) -> Pieces:
    """Add lines, each of which begins on a piece or crosses some."""
    number = np.concatenate([pieces.line, more.line + int(pieces.line.max()) + 1])
    geometry = np.concatenate([pieces.geometry, more.geometry])
    return noded(Pieces(geometry, number, np.concatenate([pieces.name, more.name])))


def blocks_of(pieces: Pieces, *edge: LineString) -> Geometries:
    """Return the areas that streets, and the edge of an area, enclose."""
    lines = shapely.union_all([*pieces.geometry, *edge])
    return np.asarray(shapely.get_parts(shapely.polygonize([lines])))


def without_small_blocks(pieces: Pieces) -> Pieces:
    """Leave out the longest minor street about each block that is too small to build on."""
    for _ in range(_ROUNDS):
        blocks = blocks_of(pieces)
        rim = shapely.boundary(blocks[shapely.area(blocks) < _LEAST_BLOCK_M2])
        middle = shapely.line_interpolate_point(pieces.geometry, 0.5, normalized=True)
        block, piece = STRtree(middle).query(rim, predicate="dwithin", distance=10 * SNAP_M)
        minor = ~np.isin(pieces.name[piece], _MAIN)
        block, piece = block[minor], piece[minor]
        if not piece.size:
            break
        order = np.lexsort((piece, -shapely.length(pieces.geometry[piece]), block))
        _, first = np.unique(block[order], return_index=True)
        kept = np.ones(len(pieces.geometry), dtype=np.bool_)
        kept[piece[order][first]] = False
        pieces = pieces.select(kept)
    return pieces


def without_stubs(pieces: Pieces, area: Bounds) -> Pieces:
    """Leave out, round by round, pieces that end blindly inside an area."""
    for _ in range(_ROUNDS):
        at, start, end = pieces.ends
        on_edge = np.isclose(at, area[:2]) | np.isclose(at, area[2:])
        blind = (np.bincount(np.concatenate([start, end])) == 1) & ~on_edge.any(axis=1)
        pieces = pieces.select(~(blind[start] | blind[end]))
    return pieces


def connected(pieces: Pieces) -> Pieces:
    """Return the pieces of the largest network, by length."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    at, start, end = pieces.ends
    graph = csr_array((np.ones(start.size), (start, end)), shape=(len(at), len(at)))
    _, part = connected_components(graph, directed=False)
    weight = np.bincount(part[start], weights=shapely.length(pieces.geometry))
    return pieces.select(part[start] == weight.argmax())


def ways_of(pieces: Pieces, crs: str, shift_m: Floats) -> Ways:
    """Join the pieces of each line to ways, and move them to a place."""
    pieces = pieces.select(np.argsort(pieces.line, kind="stable"))
    number, first, line = np.unique(pieces.line, return_index=True, return_inverse=True)
    whole = shapely.line_merge(shapely.multilinestrings(pieces.geometry, indices=line))
    parts, origin = shapely.get_parts(whole, return_index=True)
    return Ways(
        crs,
        number[origin] + 1,
        np.searchsorted(_CLASSES, pieces.name[first][origin]).astype(np.int16),
        _CLASSES,
        np.asarray(shapely.transform(parts, lambda at: at + shift_m)),
        np.zeros(len(parts), dtype=np.bool_),
        np.zeros(len(parts), dtype=np.int8),
    )


def clear_of_streets(blocks: Geometries, pieces: Pieces) -> Geometries:
    """Return what of each block is left beside the streets about and in it."""
    room = np.array([_CLEAR_M[str(name)] for name in pieces.name])
    paved = shapely.buffer(pieces.geometry, room, cap_style="square", join_style="mitre")
    block, street = STRtree(paved).query(blocks)
    left = blocks.copy()
    for i in np.unique(block):
        near = shapely.union_all(paved[np.sort(street[block == i])])
        left[i] = shapely.difference(blocks[i], near)
    return left


def uses_of(
    blocks: Geometries, outlines: Geometries, styles: Ints, rng: np.random.Generator
) -> tuple[Ints, Bools]:
    """Return the style of each block, that of its quarter or PARK, and which are squares.

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
    return np.where(is_park, PARK, style), is_square


def inner_ways(
    blocks: Geometries, styles: Ints, is_square: Bools, rng: np.random.Generator
) -> Roads:
    """Return dead ends, passages and paths within blocks; each begins on a street."""
    found: Roads = []
    for outline, style, square in zip(blocks, styles.tolist(), is_square, strict=True):
        draw = rng.random(3)
        if square:
            continue
        if style == PARK:
            found += [(line, "path") for line in _star(outline, rng)]
            continue
        chord = _chord(outline, rng)
        if chord.length < _LEAST_DEPTH_M:
            continue
        if draw[0] < _PASSAGES[style]:
            found.append((chord, "footway"))
        elif draw[1] < _DEAD_ENDS[style]:
            ends = chord.coords[0], chord.interpolate(0.3 + 0.3 * draw[2], normalized=True)
            found.append((LineString(ends), "service" if style != VILLAS else "residential"))
    return found


def _chord(outline: Polygon, rng: np.random.Generator) -> LineString:
    """Return a line from the middle part of a long side to the other side; empty where bent."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    sides = np.diff(corners[:3], axis=0)
    across = int(np.argmin(np.hypot(sides[:, 0], sides[:, 1])))
    start = corners[0] + sides[1 - across] * rng.uniform(0.35, 0.65, 1 + across)[-1]
    ends = np.array([start, start + sides[across]])
    if rng.random() < 0.5:
        ends = ends[::-1]
    middle = ends.mean(axis=0)
    reach = LineString(middle + 1.2 * (ends - middle)).intersection(outline)
    return reach if reach.geom_type == "LineString" else LineString()


def _star(outline: Polygon, rng: np.random.Generator) -> list[LineString]:
    """Return paths from the edge of a park to a place within."""
    place = outline.point_on_surface()
    arms = int(rng.integers(3, 6))
    starts = (np.arange(arms) + rng.uniform(0.1, 0.9, arms)) / arms
    edge = [outline.exterior.interpolate(start, normalized=True) for start in starts]
    lines = [LineString([start, place]) for start in edge]
    # Only what stays within a park is a path of it.
    return [line for line in lines if outline.buffer(0.1).covers(line)]
