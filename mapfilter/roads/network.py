"""The street network, on which journeys are routed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from mapfilter._types import Bools, Floats, Ints, Ints32
from mapfilter.errors import InputError, fail
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.ways import Ways

SAMPLE_M = 2.5


@dataclass(frozen=True, eq=False)
class StreetNetwork:
    """Straight street segments between nodes; the largest connected part of the ways.

    Parameters
    ----------
    crs : str
        Projected CRS, in metres.
    east_m, north_m : numpy.ndarray, shape (N,)
        The nodes.
    node_a, node_b : numpy.ndarray of int32, shape (E,)
        Ends of each edge; the way is drawn from a to b.
    way_id, way_class, class_names
        Of the way that each edge belongs to, as in :class:`mapfilter.roads.ways.Ways`.
    oneway : numpy.ndarray of int8, shape (E,)
        1 when only a to b is allowed, -1 when only b to a, 0 when both.
    """

    crs: str
    east_m: Floats
    north_m: Floats
    node_a: Ints32
    node_b: Ints32
    length_m: Floats
    way_id: Ints
    way_class: NDArray[np.int16]
    class_names: tuple[str, ...]
    oneway: NDArray[np.int8]

    @cached_property
    def adjacency(self) -> Any:
        """Lengths between neighbouring nodes (m), ``scipy.sparse.csr_array``, shape (N, N).

        Entry (i, j) exists where i to j is allowed; of parallel edges the shortest counts.
        """
        from scipy.sparse import csr_array

        forth, back = self.oneway >= 0, self.oneway <= 0
        start = np.concatenate([self.node_a[forth], self.node_b[back]])
        end = np.concatenate([self.node_b[forth], self.node_a[back]])
        length = np.concatenate([self.length_m[forth], self.length_m[back]])
        order = np.lexsort((length, end, start))
        start, end, length = start[order], end[order], length[order]
        # A sparse array would add up parallel edges.
        first = np.ones(start.size, dtype=bool)
        first[1:] = (np.diff(start) != 0) | (np.diff(end) != 0)
        size = self.east_m.size
        return csr_array((length[first], (start[first], end[first])), shape=(size, size))


def street_network(ways: Ways, allowed: RouteLattice | None = None) -> StreetNetwork:
    """Return the network of ways, joined where they share a vertex.

    Parameters
    ----------
    ways : Ways
        What may be used; one-way streets only in their direction.
    allowed : RouteLattice, optional
        Leave out edges that leave these points: an edge stays when each of its samples, at most
        2.5 m apart, has a point among the four lattice points around it. So no route leads
        through a building, and alleys narrower than a pixel stay.

    Returns
    -------
    StreetNetwork
        The largest part in which every node is reached from every other.

    Raises
    ------
    InputError
        No edge is left.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    corner, origin = shapely.get_coordinates(ways.geometry, return_index=True)
    # Shared vertices are equal up to the rounding of the projection.
    _, node = np.unique(np.round(corner, 3), axis=0, return_inverse=True)
    node = node.ravel()
    joined = (origin[1:] == origin[:-1]) & (node[1:] != node[:-1])
    a, b = node[:-1][joined], node[1:][joined]
    way = origin[:-1][joined]
    position = np.zeros((int(node.max(initial=-1)) + 1, 2))
    position[node[::-1]] = corner[::-1]
    if allowed is not None:
        inside = _stays_on(allowed, position[a], position[b])
        a, b, way = a[inside], b[inside], way[inside]
    one = ways.oneway[way]
    start = np.concatenate([a[one >= 0], b[one <= 0]])
    end = np.concatenate([b[one >= 0], a[one <= 0]])
    size = len(position)
    graph = csr_array((np.ones(start.size), (start, end)), shape=(size, size))
    _, part = connected_components(graph, directed=True, connection="strong")
    if a.size == 0 or not np.any(part[a] == part[b]):
        hint = "roads not in the area"
        raise fail(InputError, "street network", "streets that join", "none", hint)
    weight = np.bincount(part[a][part[a] == part[b]], minlength=part.max() + 1)
    kept = (part[a] == weight.argmax()) & (part[b] == weight.argmax())
    a, b, way = a[kept], b[kept], way[kept]
    used, ends = np.unique(np.concatenate([a, b]), return_inverse=True)
    position = position[used]
    a, b = ends[: a.size].astype(np.int32), ends[a.size :].astype(np.int32)
    return StreetNetwork(
        ways.crs,
        position[:, 0].copy(),
        position[:, 1].copy(),
        a,
        b,
        np.hypot(*(position[b] - position[a]).T),
        ways.way_id[way],
        ways.way_class[way],
        ways.class_names,
        ways.oneway[way],
    )


def _stays_on(allowed: RouteLattice, start: Floats, end: Floats) -> Bools:
    """Return which straight edges keep to the pixels of a route lattice, shape (E,)."""
    steps = np.ceil(np.hypot(*(end - start).T) / SAMPLE_M).astype(np.int64) + 1
    edge = np.repeat(np.arange(len(start)), steps)
    rank = np.arange(edge.size) - np.repeat(np.cumsum(steps) - steps, steps)
    share = (rank / (steps[edge] - 1))[:, None]
    place = start[edge] + share * (end[edge] - start[edge])
    lattice = allowed.lattice
    around = np.pad(allowed.mask(), 1)
    # True where one of the points (r-1, c-1), (r-1, c), (r, c-1), (r, c) is allowed.
    corner = around[:-1, :-1] | around[:-1, 1:] | around[1:, :-1] | around[1:, 1:]
    half_m = lattice.resolution_m / 2
    row, col = lattice.row_col(place[:, 0] + half_m, place[:, 1] - half_m)
    good = (row >= 0) & (row <= lattice.rows) & (col >= 0) & (col <= lattice.cols)
    good[good] = corner[row[good], col[good]]
    return np.asarray(np.bincount(edge, weights=~good, minlength=len(start)) == 0, dtype=np.bool_)
