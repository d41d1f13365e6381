"""Routes along the streets: successive shortest paths to places some hundred metres away."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import InputError, fail

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from mapfilter.roads.network import StreetNetwork

_STARTS = 50


@dataclass(frozen=True, eq=False)
class Route:
    """A path along the streets.

    Parameters
    ----------
    east_m, north_m : ndarray, shape (V,)
        Its corners, at least two.
    way_id : ndarray of int64, shape (V - 1,)
        The way of each segment.
    way_class : ndarray of int16, shape (V - 1,)
        The class of each segment, an index into ``class_names``.
    """

    east_m: Floats
    north_m: Floats
    way_id: Ints
    way_class: NDArray[np.int16]
    class_names: tuple[str, ...]

    @cached_property
    def corner_m(self) -> Floats:
        """Distance along the route of each corner, shape (V,)."""
        return np.concatenate([[0.0], np.cumsum(_lengths(self.east_m, self.north_m))])

    @property
    def length_m(self) -> float:
        """Length of the whole route."""
        return float(self.corner_m[-1])

    def at(self, distance_m: ArrayLike) -> tuple[Floats, Floats, Ints]:
        """Return east (m), north (m) and way at distances along the route, clipped to its ends."""
        distance = np.asarray(distance_m, dtype=np.float64)
        segment = np.searchsorted(self.corner_m, distance, side="right") - 1
        segment = np.clip(segment, 0, len(self.way_id) - 1)
        return (
            np.interp(distance, self.corner_m, self.east_m),
            np.interp(distance, self.corner_m, self.north_m),
            self.way_id[segment],
        )


def route(
    network: StreetNetwork,
    length_m: float,
    rng: np.random.Generator,
    *,
    leg_m: tuple[float, float] = (300.0, 1200.0),
) -> Route:
    """Draw a route of an exact length along a network.

    It starts at the end of a random edge (long edges more often), and goes by shortest paths to
    one random node after another that lies ``leg_m`` away as the crow flies, or, when there is no
    such node, to the farthest that can be reached. Goals do not lie in dead ends, and it does not
    turn back on the spot, unless there is nowhere else to go. One-way streets are kept.

    Parameters
    ----------
    leg_m : tuple of float
        Least and largest distance of the next goal.

    Raises
    ------
    InputError
        The network has no edges, or one cannot go that far on it from any of many starts.
    """
    if not network.node_a.size:
        raise fail(InputError, "street network", "at least one street", "none", "wrong box")
    share = network.length_m / network.length_m.sum()
    through = _through(network)
    for _ in range(_STARTS):
        edge = int(rng.choice(share.size, p=share))
        start = int((network.node_a if rng.random() < 0.5 else network.node_b)[edge])
        nodes = _wander(network, through, start, length_m, leg_m, rng)
        if nodes is not None:
            return _cut(network, nodes, length_m)
    got = "only dead ends of one-way streets"
    raise fail(InputError, "street network", f"streets to go {length_m:g} m along", got)


def _wander(
    network: StreetNetwork,
    through: Bools,
    start: int,
    length_m: float,
    leg_m: tuple[float, float],
    rng: np.random.Generator,
) -> list[int] | None:
    """Return nodes of a path of at least the length, or None where one gets stuck."""
    nodes, gone_m = [start], 0.0
    while gone_m < length_m:
        came_from = nodes[-2] if len(nodes) > 1 else -1
        leg = _leg(network, through, nodes[-1], came_from, leg_m, rng)
        if leg is None:
            return None
        path = [nodes[-1], *leg]
        gone_m += float(_lengths(network.east_m[path], network.north_m[path]).sum())
        nodes += leg
    return nodes


def _leg(
    network: StreetNetwork,
    through: Bools,
    here: int,
    came_from: int,
    leg_m: tuple[float, float],
    rng: np.random.Generator,
) -> list[int] | None:
    """Return the nodes after ``here`` on a shortest path to a random goal."""
    from scipy.sparse.csgraph import dijkstra

    away_m = np.hypot(
        network.east_m - network.east_m[here], network.north_m - network.north_m[here]
    )
    in_reach = (away_m >= leg_m[0]) & (away_m <= leg_m[1])
    onward, anyway = _without_edge(network.adjacency, here, came_from), network.adjacency
    anywhere = np.ones_like(in_reach)
    for graph, wanted in (
        (onward, in_reach & through),
        (onward, in_reach),
        (anyway, in_reach),
        (onward, anywhere),
        (anyway, anywhere),
    ):
        length, before = dijkstra(graph, indices=here, return_predecessors=True)
        goals = np.flatnonzero(np.isfinite(length) & (length > 0) & wanted)
        if goals.size:
            at_random = wanted is not anywhere
            nodes = [int(rng.choice(goals) if at_random else goals[np.argmax(length[goals])])]
            while (node := int(before[nodes[-1]])) != here:
                nodes.append(node)
            return nodes[::-1]
    return None


def _through(network: StreetNetwork) -> Bools:
    """Return which nodes are left when dead ends are taken off again and again."""
    left = np.ones(network.east_m.size, dtype=bool)
    ends = np.unique(np.sort(np.stack([network.node_a, network.node_b], axis=1), axis=1), axis=0)
    ends = ends[ends[:, 0] != ends[:, 1]]
    while True:
        ends = ends[left[ends].all(axis=1)]
        dead = left & (np.bincount(ends.ravel(), minlength=left.size) < 2)
        if not dead.any():
            return left
        left &= ~dead


def _without_edge(graph: csr_array, start: int, end: int) -> csr_array:
    if end < 0:
        return graph
    from scipy.sparse import csr_array

    lengths = graph.data.copy()
    first, last = graph.indptr[start], graph.indptr[start + 1]
    lengths[first:last][graph.indices[first:last] == end] = np.inf
    return csr_array((lengths, graph.indices, graph.indptr), shape=graph.shape)


def _cut(network: StreetNetwork, nodes: list[int], length_m: float) -> Route:
    """Turn nodes into a route and end it at the length."""
    east, north = network.east_m[nodes], network.north_m[nodes]
    # The shortest edge between each two successive nodes.
    size, at = network.east_m.size, np.asarray(nodes, dtype=np.int64)
    low = np.minimum(network.node_a, network.node_b).astype(np.int64)
    key = low * size + np.maximum(network.node_a, network.node_b)
    order = np.lexsort((network.length_m, key))
    wanted = np.minimum(at[:-1], at[1:]) * size + np.maximum(at[:-1], at[1:])
    edge = order[np.searchsorted(key[order], wanted)]
    along = np.concatenate([[0.0], np.cumsum(_lengths(east, north))])
    corners = int(np.searchsorted(along, length_m, side="left"))
    return Route(
        np.append(east[:corners], np.interp(length_m, along, east)),
        np.append(north[:corners], np.interp(length_m, along, north)),
        network.way_id[edge[:corners]],
        network.way_class[edge[:corners]],
        network.class_names,
    )


def _lengths(east_m: Floats, north_m: Floats) -> Floats:
    return np.hypot(np.diff(east_m), np.diff(north_m))
