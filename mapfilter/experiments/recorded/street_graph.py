"""A street graph of osmnx (GraphML) as edges, and the hidden Markov model of Newson and Krumm.

P. Newson, J. Krumm, "Hidden Markov map matching through noise and sparseness", ACM GIS 2009: the
usual matcher of positions to streets, here as a baseline.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from mapfilter._types import Floats, Ints
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import project
from mapfilter.roads.ways import Ways
from mapfilter.tracks.readers.texts.text import read_text

SIGMA_M, BETA_M = 10.0, 30.0
"""Deviation of positions, and scale of the difference between route and straight line."""
NEAR_M = 60.0
_LARGEST_BYTES = 100_000_000
_SPACE = "{http://graphml.graphdrawing.org/xmlns}"


@dataclass(frozen=True, eq=False)
class StreetGraph:
    """Directed edges of a street graph.

    Parameters
    ----------
    source, target : ndarray of int64, shape (E,)
        Nodes, counted from 0.
    street : ndarray of int64, shape (E,)
        Number of the street piece, from 1; equal for both directions of one.
    line : ndarray of LineString, shape (E,)
        From source to target.
    """

    crs: str
    nodes: int
    source: Ints
    target: Ints
    street: Ints
    line: Any

    def ways(self) -> Ways:
        """Return each street once, as ways numbered like it."""
        _, first = np.unique(self.street, return_index=True)
        kind = np.full(first.size, "residential", dtype=object)
        return Ways.open(self.crs, self.street[first], kind, self.line[first])

    def distances_m(self, most_m: float) -> Floats:
        """Return the lengths of the shortest routes between nodes, infinite beyond a limit."""
        length = shapely.length(self.line)
        order = np.lexsort((length, self.target, self.source))
        pair = np.column_stack([self.source, self.target])[order]
        first = np.append(True, np.any(np.diff(pair, axis=0) != 0, axis=1))
        kept = order[first]
        shape = (self.nodes, self.nodes)
        graph = coo_array((length[kept], (self.source[kept], self.target[kept])), shape=shape)
        return np.asarray(dijkstra(graph.tocsr(), limit=most_m))


def read_graph(file: Path, crs: str) -> StreetGraph:
    """Read a graph of osmnx; InputError where it is none."""
    data = read_text(file, _LARGEST_BYTES).data
    try:
        root = ElementTree.fromstring(data)
        keys = {k.get("id"): (k.get("for"), k.get("attr.name")) for k in root.iter(f"{_SPACE}key")}
        name = {value: key for key, value in keys.items()}
        x, y, geometry = name["node", "x"], name["node", "y"], name["edge", "geometry"]
        nodes = {n.get("id"): _data(n, (x, y)) for n in root.iter(f"{_SPACE}node")}
        edges = [
            (e.get("source"), e.get("target"), _data(e, (geometry,)).get(geometry))
            for e in root.iter(f"{_SPACE}edge")
        ]
        number = {node: i for i, node in enumerate(nodes)}
        places = {n: (float(d[x]), float(d[y])) for n, d in nodes.items()}
        lines = [_line(places[a], places[b], text) for a, b, text in edges if a and b]
        ends = np.array([(number[a], number[b]) for a, b, _ in edges if a and b], dtype=np.int64)
    except (ElementTree.ParseError, KeyError, ValueError, TypeError) as error:
        expected = "a street graph of osmnx (GraphML)"
        raise fail(InputError, str(file), expected, repr(error)) from error
    flat = [np.column_stack(project(crs, part[:, 0], part[:, 1])) for part in lines]
    made = np.array([shapely.LineString(part) for part in flat], dtype=object)
    middle = shapely.get_coordinates(shapely.line_interpolate_point(made, 0.5, normalized=True))
    piece = np.column_stack([np.sort(ends, axis=1), np.round(middle)])
    street = np.unique(piece, axis=0, return_inverse=True)[1].ravel() + 1
    return StreetGraph(crs, len(number), ends[:, 0], ends[:, 1], street.astype(np.int64), made)


def match_points(graph: StreetGraph, places: Floats) -> Ints:
    """Return the edge of each position by the most probable route, shape (N,); -1 without one."""
    tree = shapely.STRtree(graph.line)
    points = shapely.points(places)
    routes = graph.distances_m(_most_m(places))
    length = shapely.length(graph.line)
    best: list[Ints] = []
    back: list[Ints] = []
    scores: list[Floats] = []
    score, before, along_before = np.empty(0), np.empty(0, dtype=np.int64), np.empty(0)
    for i, point in enumerate(points):
        edge = np.sort(tree.query(point, "dwithin", NEAR_M))
        along = shapely.line_locate_point(graph.line[edge], point)
        emit = -0.5 * (shapely.distance(graph.line[edge], point) / SIGMA_M) ** 2
        if before.size and edge.size:
            straight = float(np.hypot(*(places[i] - places[i - 1])))
            ahead = along[None, :] - along_before[:, None]
            same = (before[:, None] == edge[None, :]) & (ahead >= -SIGMA_M)
            rest = (length[before] - along_before)[:, None]
            through = routes[graph.target[before][:, None], graph.source[edge][None, :]]
            route = np.where(same, np.abs(ahead), rest + through + along[None, :])
            total = score[:, None] - np.abs(route - straight) / BETA_M
            total[~np.isfinite(route)] = -np.inf
            came = total.argmax(axis=0)
            score = total.max(axis=0) + emit
        else:
            came, score = np.full(edge.size, -1), emit
        if edge.size and not np.isfinite(score).any():
            came, score = np.full(edge.size, -1), emit
        best.append(edge)
        back.append(came)
        scores.append(score)
        before, along_before = edge, along
        if not edge.size:
            score = np.empty(0)
    return _traced(best, back, scores)


def _traced(best: list[Ints], back: list[Ints], scores: list[Floats]) -> Ints:
    """Return the edges of the most probable paths, from the last position backwards."""
    found = np.full(len(best), -1, dtype=np.int64)
    at = -1
    for i in range(len(best) - 1, -1, -1):
        if not best[i].size:
            at = -1
            continue
        if at < 0:
            # A path ends where no route leads on.
            at = int(scores[i].argmax())
        found[i] = best[i][at]
        at = int(back[i][at])
    return found


def _most_m(places: Floats) -> float:
    steps = np.hypot(*np.diff(places, axis=0).T) if len(places) > 1 else np.zeros(1)
    return float(10 * steps.max() + 500.0)


def _data(element: ElementTree.Element, names: tuple[str | None, ...]) -> dict[str | None, str]:
    found = {d.get("key"): d.text or "" for d in element.iter(f"{_SPACE}data")}
    return {name: found[name] for name in names if name in found}


def _line(a: tuple[float, float], b: tuple[float, float], text: str | None) -> Floats:
    if not text:
        return np.array([a, b], dtype=np.float64)
    return np.asarray(shapely.get_coordinates(shapely.from_wkt(text)), dtype=np.float64)
