"""From lines that cross to ways that share corners, and the blocks between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from shapely import STRtree
from shapely.geometry import LineString

from mapfilter._types import Bools, Floats, Ints
from mapfilter.roads.ways import Bounds, Geometries, Ways
from mapfilter.simulation.city_streets import CLASSES, SNAP_M

CLEAR_M = {
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
"""Metres from the middle of a street to the houses, by its class."""

_MAIN = frozenset(("primary", "secondary", "tertiary"))
_LEAST_BLOCK_M2 = 900.0
_ROUNDS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Straight or bent pieces of street between junctions.

    Parameters
    ----------
    geometry : numpy.ndarray of shapely.LineString, shape (N,)
    line : numpy.ndarray of int64, shape (N,)
        The line that each piece is of.
    name : numpy.ndarray of str, shape (N,)
        Its class.
    """

    geometry: Geometries
    line: Ints
    name: NDArray[np.str_]

    def select(self, which: Bools) -> Pieces:
        """Return some of the pieces."""
        return Pieces(self.geometry[which], self.line[which], self.name[which])


def drawn(lines: list[tuple[LineString, str]]) -> Pieces:
    """Return lines with their classes as they are, not yet cut where they cross."""
    geometry = np.array([line for line, _ in lines], dtype=object)
    return Pieces(geometry, np.arange(len(lines)), np.array([name for _, name in lines], str))


def noded(lines: Pieces) -> Pieces:
    """Cut lines where they cross or meet; what several share goes to the first."""
    parts = shapely.get_parts(shapely.unary_union(lines.geometry, grid_size=SNAP_M))
    middle = shapely.line_interpolate_point(parts, 0.5, normalized=True)
    tree = STRtree(lines.geometry)
    part, line = tree.query(middle, predicate="dwithin", distance=10 * SNAP_M)
    owner = np.full(len(parts), len(lines.geometry))
    np.minimum.at(owner, part, line)
    own = owner < len(lines.geometry)
    return Pieces(parts[own], lines.line[owner[own]], lines.name[owner[own]])


def with_lines(pieces: Pieces, more: Pieces) -> Pieces:
    """Add lines, each of which begins on a piece or crosses some."""
    number = more.line + int(pieces.line.max()) + 1
    return noded(
        Pieces(
            np.concatenate([pieces.geometry, more.geometry]),
            np.concatenate([pieces.line, number]),
            np.concatenate([pieces.name, more.name]),
        )
    )


def blocks_of(pieces: Pieces, edge: LineString | None = None) -> Geometries:
    """Return the areas that streets, and the edge of an area, enclose."""
    lines = [*pieces.geometry] if edge is None else [*pieces.geometry, edge]
    return np.asarray(shapely.get_parts(shapely.polygonize([shapely.union_all(lines)])))


def without_small_blocks(pieces: Pieces) -> Pieces:
    """Leave out the longest minor street about each block that is too small to build on."""
    for _ in range(_ROUNDS):
        blocks = blocks_of(pieces)
        tiny = blocks[shapely.area(blocks) < _LEAST_BLOCK_M2]
        if not tiny.size:
            break
        middle = shapely.line_interpolate_point(pieces.geometry, 0.5, normalized=True)
        rim = shapely.boundary(tiny)
        block, piece = STRtree(middle).query(rim, predicate="dwithin", distance=10 * SNAP_M)
        minor = ~np.isin(pieces.name[piece], list(_MAIN))
        block, piece = block[minor], piece[minor]
        length_m = shapely.length(pieces.geometry[piece])
        order = np.lexsort((piece, -length_m, block))
        _, first = np.unique(block[order], return_index=True)
        kept = np.ones(len(pieces.geometry), dtype=np.bool_)
        kept[piece[order][first]] = False
        if kept.all():
            break
        pieces = pieces.select(kept)
    return pieces


def without_stubs(pieces: Pieces, area: Bounds) -> Pieces:
    """Leave out, round by round, pieces that end blindly inside an area."""
    west, south, east, north = area
    for _ in range(_ROUNDS):
        at, start, end = _ends(pieces)
        degree = np.bincount(np.concatenate([start, end]))
        on_edge = np.isclose(at, (west, south)) | np.isclose(at, (east, north))
        blind = (degree == 1) & ~on_edge.any(axis=1)
        kept = ~(blind[start] | blind[end])
        if kept.all():
            break
        pieces = pieces.select(kept)
    return pieces


def connected(pieces: Pieces) -> Pieces:
    """Return the pieces of the largest network, by length."""
    at, start, end = _ends(pieces)
    graph = csr_array((np.ones(start.size), (start, end)), shape=(len(at), len(at)))
    _, part = connected_components(graph, directed=False)
    weight = np.bincount(part[start], weights=shapely.length(pieces.geometry))
    return pieces.select(part[start] == weight.argmax())


def _ends(pieces: Pieces) -> tuple[Floats, Ints, Ints]:
    """Return the places where pieces end, and which of them each begins and ends at."""
    ends = [shapely.get_coordinates(shapely.get_point(pieces.geometry, at)) for at in (0, -1)]
    place, node = np.unique(np.round(np.concatenate(ends), 3), axis=0, return_inverse=True)
    start, end = np.split(node.ravel(), 2)
    return place, start, end


def ways_of(pieces: Pieces, crs: str, east_m: float, north_m: float) -> Ways:
    """Join the pieces of each line to ways, and move them to a place."""
    geometry: list[object] = []
    line: list[int] = []
    order = np.argsort(pieces.line, kind="stable")
    first = np.flatnonzero(np.diff(pieces.line[order], prepend=-1))
    names: list[str] = []
    for group in np.split(order, first[1:]):
        whole = shapely.line_merge(shapely.multilinestrings(pieces.geometry[group]))
        for part in shapely.get_parts(whole):
            geometry.append(shapely.transform(part, lambda at: at + np.array([east_m, north_m])))
            line.append(int(pieces.line[group[0]]) + 1)
            names.append(str(pieces.name[group[0]]))
    code = np.array([CLASSES.index(name) for name in names], dtype=np.int16)
    lines = np.empty(len(geometry), dtype=object)
    lines[:] = geometry
    return Ways(
        crs,
        np.array(line, dtype=np.int64),
        code,
        CLASSES,
        lines,
        np.zeros(len(line), dtype=np.bool_),
        np.zeros(len(line), dtype=np.int8),
    )


def clear_of_streets(blocks: Geometries, pieces: Pieces) -> Geometries:
    """Return what of each block is left beside the streets about and in it."""
    room = np.array([CLEAR_M[str(name)] for name in pieces.name])
    paved = shapely.buffer(pieces.geometry, room, cap_style="square", join_style="mitre")
    block, street = STRtree(paved).query(blocks)
    left = blocks.copy()
    for i in np.unique(block):
        near = shapely.union_all(paved[np.sort(street[block == i])])
        left[i] = shapely.difference(blocks[i], near)
    return left
