"""Starts of journeys that do not begin on a street: indoors, and outside the area."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.lattice import Lattice
from mapfilter.simulation.worlds.itinerary import Itinerary, resampled
from mapfilter.simulation.worlds.open_ground import OpenGround
from mapfilter.simulation.worlds.sinusoids import gauss_markov
from mapfilter.simulation.worlds.street_lines import StreetLines

_FARTHEST_BUILDING_M = 80.0
_ROOM_M = 2.0
_ROOM_S = 30.0
_LEAVING_MPS = 1.0
_NEAREST_EDGES = 12


def from_indoors(
    east_m: float,
    north_m: float,
    ground: OpenGround,
    indoors_s: float,
    rng: np.random.Generator,
) -> tuple[Floats, Floats, Bools]:
    """Return a time inside the nearest building, and the way from there to a start, every second.

    One moves about a room, some 2 m to each side, and leaves at 1 m/s. Without a building within
    80 m the time is spent at the start itself.

    Returns
    -------
    east_m, north_m : (N,) arrays
    indoors : (N,) array of bool
        Whether the phone is still inside.
    """
    lattice = ground.lattice
    row, col = (int(i) for i in lattice.row_col(east_m, north_m))
    around = int(_FARTHEST_BUILDING_M / lattice.resolution_m)
    top, left = max(row - around, 0), max(col - around, 0)
    rows, cols = np.nonzero(ground.built[top : row + around + 1, left : col + around + 1])
    room = np.array([east_m, north_m])
    if rows.size:
        places = np.stack(lattice.east_north(rows + top, cols + left), axis=1)
        away = np.hypot(*(places - room).T)
        # Some of the nearest pixels, not always the one at the wall.
        nearest = np.argsort(away, kind="stable")[:_NEAREST_EDGES]
        room = places[int(rng.choice(nearest))]
    seconds = np.arange(max(int(indoors_s), 1), dtype=np.float64)
    about = np.stack([gauss_markov(seconds, _ROOM_S, rng) for _ in range(2)], axis=1)
    about = room + _ROOM_M * np.tanh(about)
    way = np.array([east_m, north_m]) - about[-1]
    steps = int(np.ceil(np.hypot(*way) / _LEAVING_MPS))
    leaving = about[-1] + np.multiply.outer(np.arange(1, steps) / max(steps, 1), way)
    path = np.concatenate([about, leaving])
    built = ground.is_built(path[:, 0], path[:, 1])
    indoors = np.arange(len(path)) < seconds.size
    indoors |= built & (np.arange(len(path)) >= seconds.size)
    return path[:, 0], path[:, 1], np.asarray(indoors)


def from_outside(
    streets: StreetLines, lattice: Lattice, outside_m: float, rng: np.random.Generator
) -> tuple[int, Itinerary]:
    """Return a node near the edge of the area, and a straight way to it from outside.

    Parameters
    ----------
    outside_m : float
        How far from the edge the way begins.

    Returns
    -------
    node : int
    prefix : Itinerary
        Off the ways.
    """
    network = streets.network
    west, south, east, north = lattice.bounds_m
    sides = (
        (network.east_m - west, (-1.0, 0.0)),
        (east - network.east_m, (1.0, 0.0)),
        (network.north_m - south, (0.0, -1.0)),
        (north - network.north_m, (0.0, 1.0)),
    )
    edge_m, outward = sides[int(rng.integers(len(sides)))]
    nearest = np.argsort(edge_m, kind="stable")[:_NEAREST_EDGES]
    node = int(rng.choice(nearest))
    far_m = outside_m + max(float(edge_m[node]), 0.0)
    ends = np.array([network.east_m[node], network.north_m[node]])
    begin = ends + far_m * np.array(outward)
    line = np.stack([begin, ends])
    return node, resampled(line[:, 0], line[:, 1], np.zeros(1))
