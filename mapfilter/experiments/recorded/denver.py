"""Traces of cars in Denver, matched to a street graph, beside a hidden Markov model of our own.

The data have neither times nor a list of the streets that were driven. So a point counts as matched
rightly where the street runs within 25 m of it, and is the same street as that of the point before,
or one that begins where that ends. Points come one a second. Neighbouring points are right or
wrong together, so the share of them has no interval.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd
import shapely

from mapfilter._inputs import read_input
from mapfilter._types import Bools, Floats, Ints
from mapfilter.database.sources import LayerRoutes
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded.benchmark import Benchmark, Journey, Judged, Task
from mapfilter.experiments.recorded.ground import roads_alone
from mapfilter.experiments.recorded.locating import OpenMap, locate_log
from mapfilter.experiments.recorded.rows import Found
from mapfilter.experiments.recorded.street_graph import StreetGraph, match_points, read_graph
from mapfilter.geodesy import project, utm_crs
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.propagation.shadowing import named_rng
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.widths import half_width_of
from mapfilter.tracks.deadreckoning import steps_between
from mapfilter.tracks.log import TrackLog, make_log

RIGHT_M, JOINED_M, ON_GRAPH_M = 25.0, 1.0, 50.0
LEAST_POINTS = 20
_GRAPH, _TRACES = "*graph*.graphml.gz", "*trace*.csv"
_RESOLUTION_M, _MARGIN_M = 4.0, 50.0
_CLASS = "residential"
_LARGEST_BYTES = 100_000_000
_MAP = "streets"


def units(folder: Path) -> list[tuple[str, str, int]]:
    """Return the traces."""
    return [(file.stem, "trace", 1) for file in sorted(folder.glob(_TRACES))]


def prepare(folder: Path, work: Path) -> None:
    """Build a database of the graph's streets."""
    graph = _graph(folder)
    west, south, east, north = shapely.total_bounds(graph.line)
    bounds = (west - _MARGIN_M, south - _MARGIN_M, east + _MARGIN_M, north + _MARGIN_M)
    lattice = Lattice.covering(graph.crs, bounds, _RESOLUTION_M)
    source = RouteSource.of(graph.ways(), None, None, half_width_of(_CLASS))
    roads_alone(LayerRoutes(source, lattice), work / _MAP)


def read(task: Task) -> tuple[StreetGraph, OpenMap]:
    """Read the graph, and open the map of its streets."""
    return _graph(task.data), OpenMap.open(task.work / _MAP)


def judge(task: Task, shared: tuple[StreetGraph, OpenMap]) -> Judged:
    """Match the part of a trace that lies on the graph by both methods."""
    graph, over = shared
    places = clipped(read_trace(task.data / f"{task.part}.csv", graph.crs), graph)
    if len(places) < LEAST_POINTS:
        expected = f"{LEAST_POINTS} points or more on the graph"
        raise fail(InputError, str(task.data / task.part), expected, len(places))
    edge = match_points(graph, places)
    hmm = np.where(edge >= 0, graph.street[edge], 0)
    rng = named_rng(task.seed, "denver", task.part)
    options = BayesFilter(vehicle=True)
    located = locate_log(trace_log(places, graph.crs), over, rng, options)
    at = np.searchsorted(located.estimate.time_s, np.arange(len(places), dtype=np.float64))
    ours = located.estimate.way_id[np.minimum(at, len(located.estimate) - 1)]
    found = []
    apart_hmm, _ = judged_streets(graph, places, hmm)
    for method, street in (("bayes", ours), ("hmm", hmm)):
        apart_m, right = judged_streets(graph, places, street)
        same = float(np.mean(street == hmm))
        found += [
            Found(
                task.part,
                method,
                "trace",
                bool(right[i]),
                None,
                None,
                apart_m[i : i + 1],
                np.empty(0, dtype=np.bool_),
                apart_hmm[i : i + 1][np.isfinite(apart_hmm[i : i + 1])],
                note=f"{100 * same:.0f} % of the points on the street of the other method",
                dependent=True,
            )
            for i in range(len(places))
        ]
    # There is no other truth than the trace itself; for the picture.
    known = Truth(np.arange(len(places), dtype=np.float64), places[:, 0], places[:, 1])
    return Judged(tuple(found), {"bayes": Journey(located.estimate, known, over.path)})


def read_trace(file: Path, crs: str) -> Floats:
    """Read the places of a trace, shape (N, 2); the same place again and again once."""
    lon, lat = _degrees(file)
    places = np.column_stack(project(crs, lon, lat))
    moved = np.append(True, np.any(np.diff(places, axis=0) != 0, axis=1))
    return np.asarray(places[moved & np.isfinite(places).all(axis=1)])


def clipped(places: Floats, graph: StreetGraph) -> Floats:
    """Return the longest stretch of places that follow each other within 50 m of a street."""
    tree = shapely.STRtree(graph.line)
    near, _ = tree.query(shapely.points(places), "dwithin", ON_GRAPH_M)
    inside = np.zeros(len(places), dtype=np.bool_)
    inside[near] = True
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
    spans = edges.reshape(-1, 2)
    if not len(spans):
        return places[:0]
    first, end = spans[np.argmax(spans[:, 1] - spans[:, 0])]
    return places[first:end]


def trace_log(places: Floats, crs: str) -> TrackLog:
    """Return a trace as fixes, a second apart, with the steps between them as motion."""
    time_s = np.arange(len(places), dtype=np.float64)
    step, heading = steps_between(places[:, 0], places[:, 1])
    motion = pd.DataFrame(
        {
            "time_s": time_s,
            "step_m": np.append(0.0, step),
            "heading_rad": np.append(heading[:1], heading),
        }
    )
    gnss = pd.DataFrame({"time_s": time_s, "east_m": places[:, 0], "north_m": places[:, 1]})
    return make_log(crs, motion=motion, gnss=gnss)


def judged_streets(graph: StreetGraph, places: Floats, street: Ints) -> tuple[Floats, Bools]:
    """Return how far each point is from its street, and whether that counts as right."""
    first = {int(number): i for i, number in reversed(list(enumerate(graph.street)))}
    lines = [graph.line[first[int(s)]] if int(s) in first else None for s in street]
    apart = np.array(
        [
            shapely.distance(line, shapely.Point(place)) if line is not None else np.inf
            for line, place in zip(lines, places, strict=True)
        ]
    )
    follows = np.ones(len(lines), dtype=np.bool_)
    for i in range(1, len(lines)):
        a, b = lines[i - 1], lines[i]
        follows[i] = a is not None and b is not None and shapely.distance(a, b) <= JOINED_M
    return apart, (apart <= RIGHT_M) & follows


def _graph(folder: Path) -> StreetGraph:
    files = sorted(folder.glob(_GRAPH))[:1]
    if not files:
        raise fail(InputError, str(folder), _GRAPH, "none")
    lon, lat = _degrees(sorted(folder.glob(_TRACES))[0])
    return read_graph(files[0], utm_crs(float(lon[0]), float(lat[0])))


def _degrees(file: Path) -> tuple[Floats, Floats]:
    """Return longitude and latitude of a trace's rows."""
    try:
        table = pd.read_csv(io.BytesIO(read_input(file, _LARGEST_BYTES, "a trace")))
        found = table["longitude"].to_numpy(float), table["latitude"].to_numpy(float)
    except (KeyError, ValueError) as error:
        expected = "a CSV of latitude and longitude"
        raise fail(InputError, str(file), expected, repr(error)) from error
    if not len(table):
        raise fail(InputError, str(file), "rows", "none")
    return found


BENCHMARK = Benchmark("denver", "mapmatch-denver", (_GRAPH, _TRACES), units, judge, prepare, read)
