"""Itineraries: from goal to goal along the streets, not always by the shortest way.

Pedestrians choose among routes by perceived length, of which the measured one explains a part only
(Bovy & Stern 1990, *Route Choice: Wayfinding in Transport Networks*). Here each leg is the shortest
path after every edge's length was multiplied by a log-normal factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from mapfilter._types import Floats, Ints, Ints32
from mapfilter.errors import InputError, fail
from mapfilter.roads.network import StreetNetwork
from mapfilter.simulation.worlds.street_lines import StreetLines

_PERCEPTION_SD = 0.3
_TURNING_BACK = 20.0
_STARTS = 50
_LEAST_LEG_M, _LARGEST_LEG_M = 250.0, 1100.0
STEP_M = 2.0


@dataclass(frozen=True, eq=False)
class Itinerary:
    """A path along the centre lines, sampled every 2 m.

    Parameters
    ----------
    east_m, north_m : (K,) arrays
    half_width_m : (K,) array
        Of the way; 0 off the ways.
    """

    east_m: Floats
    north_m: Floats
    half_width_m: Floats

    @property
    def walked_m(self) -> Floats:
        """Distance along the path, shape (K,)."""
        steps = np.hypot(np.diff(self.east_m), np.diff(self.north_m))
        return np.concatenate([[0.0], np.cumsum(steps)])

    def cut(self, length_m: float) -> Itinerary:
        """Return the beginning of the path up to a length."""
        end = int(np.searchsorted(self.walked_m, length_m)) + 1
        return Itinerary(self.east_m[:end], self.north_m[:end], self.half_width_m[:end])


def itinerary(
    streets: StreetLines,
    length_m: float,
    rng: np.random.Generator,
    *,
    start: int | None = None,
) -> Itinerary:
    """Draw an itinerary of at least a length.

    Parameters
    ----------
    start : int, optional
        Node to begin at; by default one drawn by the length of the streets about it.

    Raises
    ------
    InputError
        There are no streets, or one cannot go that far from any of many starts.
    """
    network = streets.network
    if not network.node_a.size:
        raise fail(InputError, "street network", "at least one street", "none", "wrong box")
    share = network.length_m / network.length_m.sum()
    for _ in range(_STARTS):
        first = int(network.node_a[rng.choice(share.size, p=share)]) if start is None else start
        nodes = _nodes(network, first, length_m, rng)
        if nodes is not None:
            return _sampled(streets, nodes)
    expected = f"streets to walk {length_m:g} m along"
    raise fail(InputError, "street network", expected, "dead ends only")


def _nodes(
    network: StreetNetwork, first: int, length_m: float, rng: np.random.Generator
) -> list[int] | None:
    nodes, gone_m = [first], 0.0
    while gone_m < length_m:
        leg = _leg(network, nodes, rng)
        if leg is None:
            return None
        path = [nodes[-1], *leg]
        steps = np.diff(network.east_m[path]), np.diff(network.north_m[path])
        gone_m += float(np.hypot(*steps).sum())
        nodes += leg
    return nodes


def _leg(network: StreetNetwork, nodes: list[int], rng: np.random.Generator) -> list[int] | None:
    """Return the nodes after the last one on a perceived shortest path to a random goal."""
    here = nodes[-1]
    graph = network.adjacency
    factor = np.exp(_PERCEPTION_SD * rng.standard_normal(graph.data.size))
    perceived = csr_array((graph.data * factor, graph.indices, graph.indptr), shape=graph.shape)
    if len(nodes) > 1:
        own = slice(graph.indptr[here], graph.indptr[here + 1])
        perceived.data[own][graph.indices[own] == nodes[-2]] *= _TURNING_BACK
    cost, before = dijkstra(perceived, indices=here, return_predecessors=True)
    away = np.hypot(network.east_m - network.east_m[here], network.north_m - network.north_m[here])
    reached = np.isfinite(cost) & (cost > 0)
    goals = np.flatnonzero(reached & (away >= _LEAST_LEG_M) & (away <= _LARGEST_LEG_M))
    if not goals.size:
        if not reached.any():
            return None
        goals = np.array([int(np.argmax(np.where(reached, away, -1.0)))])
    return _path(before, here, int(rng.choice(goals)))


def _path(before: Ints32, here: int, goal: int) -> list[int]:
    path = [goal]
    while int(before[path[-1]]) != here:
        path.append(int(before[path[-1]]))
    return path[::-1]


def _sampled(streets: StreetLines, nodes: list[int]) -> Itinerary:
    network = streets.network
    east, north = network.east_m[nodes], network.north_m[nodes]
    width = streets.half_width_m[_edges(network, np.array(nodes, dtype=np.int64))]
    return resampled(east, north, width)


def resampled(east_m: Floats, north_m: Floats, half_width_m: Floats) -> Itinerary:
    """Return a polyline sampled every 2 m; widths are those of its K - 1 segments."""
    steps = np.hypot(np.diff(east_m), np.diff(north_m))
    keep = np.concatenate([[True], steps > 0])
    width = half_width_m[keep[1:]]
    corner = np.concatenate([[0.0], np.cumsum(steps[steps > 0])])
    walked = np.arange(0.0, corner[-1] + 1e-9, STEP_M)
    segment = np.clip(np.searchsorted(corner, walked, side="right") - 1, 0, width.size - 1)
    return Itinerary(
        np.interp(walked, corner, east_m[keep]),
        np.interp(walked, corner, north_m[keep]),
        width[segment],
    )


def _edges(network: StreetNetwork, nodes: Ints) -> Ints:
    """Return the shortest edge between each two successive nodes."""
    ends = np.sort(np.stack([network.node_a, network.node_b], axis=1).astype(np.int64), axis=1)
    key = ends[:, 0] * network.east_m.size + ends[:, 1]
    order = np.lexsort((network.length_m, key))
    wanted = np.minimum(nodes[:-1], nodes[1:]) * network.east_m.size
    wanted += np.maximum(nodes[:-1], nodes[1:])
    return np.asarray(order[np.searchsorted(key[order], wanted)])
