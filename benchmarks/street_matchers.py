"""Denver beside a public matcher: python benchmarks/street_matchers.py DATA.

DATA holds the folder mapmatch-denver. The matcher is that of W. Meert and M. Verbeke,
leuvenmapmatching (``pip install leuvenmapmatching``), with the deviation of our hidden Markov
model; ``evaluate denver`` has the shares of the filter and of that model.
"""

import sys
from pathlib import Path

import numpy as np
import shapely
from leuvenmapmatching.map.inmem import InMemMap
from leuvenmapmatching.matcher.distance import DistanceMatcher

from mapfilter.experiments.recorded import denver
from mapfilter.experiments.recorded.street_graph import SIGMA_M, StreetGraph, match_points

_MOST_M = 100.0
_LEAST_PROBABILITY = 1e-8
"""A trace that begins 38 m beside its street is not matched with the 0.001 of its examples."""


def straight_pieces(graph: StreetGraph) -> tuple[InMemMap, dict[tuple[int, int], int]]:
    """Return the streets as straight pieces, as the matcher has them, and the street of each."""
    pieces = InMemMap("streets", use_latlon=False, use_rtree=False)
    number: dict[tuple[object, ...], int] = {}
    street: dict[tuple[int, int], int] = {}

    def node(key: tuple[object, ...], east_m: float, north_m: float) -> int:
        if key not in number:
            number[key] = len(number)
            pieces.add_node(number[key], (north_m, east_m))
        return number[key]

    for line, of, source, target in zip(
        graph.line, graph.street.tolist(), graph.source, graph.target, strict=True
    ):
        at = shapely.get_coordinates(line)
        before = node(("junction", int(source)), *at[0])
        for k, (east_m, north_m) in enumerate(at[1:], start=1):
            last = k == len(at) - 1
            key = ("junction", int(target)) if last else (of, round(east_m, 1), round(north_m, 1))
            here = node(key, east_m, north_m)
            if here != before:
                pieces.add_edge(before, here)
                street[before, here] = of
            before = here
    return pieces, street


def public_streets(graph: StreetGraph, places: np.ndarray) -> np.ndarray:
    """Return the street of each position by the public matcher, 0 where it has none."""
    pieces, street = straight_pieces(graph)
    matcher = DistanceMatcher(
        pieces,
        max_dist=_MOST_M,
        max_dist_init=_MOST_M,
        obs_noise=SIGMA_M,
        obs_noise_ne=2 * SIGMA_M,
        min_prob_norm=_LEAST_PROBABILITY,
        non_emitting_states=True,
        max_lattice_width=10,
    )
    matcher.match([(north_m, east_m) for east_m, north_m in places])
    found = np.zeros(len(places), dtype=np.int64)
    for state in matcher.lattice_best:
        if state.obs_ne == 0:
            found[state.obs] = street.get((state.edge_m.l1, state.edge_m.l2), 0)
    return found


if __name__ == "__main__":
    folder = Path(sys.argv[1]) / denver.BENCHMARK.folder
    graph = denver._graph(folder)
    for part, _, _ in denver.units(folder):
        places = denver.clipped(denver.read_trace(folder / f"{part}.csv", graph.crs), graph)
        edge = match_points(graph, places)
        hmm = np.where(edge >= 0, graph.street[edge], 0)
        public = public_streets(graph, places)
        shares = [denver.judged_streets(graph, places, s)[1].mean() for s in (public, hmm)]
        print(
            f"{part}: {len(places)} points, right: public matcher {shares[0]:.3f}, "
            f"hmm {shares[1]:.3f}; on the same street {np.mean(public == hmm):.3f}"
        )
