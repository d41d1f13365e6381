"""Shortcuts over ground without mapped ways: squares, parks, courtyards, car parks.

Maps lack many of the ways that pedestrians use, and people cross open ground where it is shorter or
pleasanter. Pieces of an itinerary are replaced by paths of least cost over the open ground, on
which a metre on a way costs four times a metre off the ways, until the wanted share is reached.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from mapfilter._types import Bools, Floats, Ints
from mapfilter.lattice import Lattice
from mapfilter.simulation.worlds.itinerary import STEP_M, Itinerary, resampled
from mapfilter.simulation.worlds.open_ground import OpenGround
from mapfilter.simulation.worlds.street_lines import OFF_MARGIN_M, StreetLines

_ATTEMPTS = 120
_SHORTEST_M, _LONGEST_M = 80.0, 320.0
_AROUND_M = 60.0
_ON_WAY = 4.0
_LEAST_OFF_M = 25.0
_LARGEST_DETOUR = 2.0
_SMOOTHED = 2.0
_NEIGHBOURS = ((0, 1, 1.0), (1, 0, 1.0), (1, 1, 2.0**0.5), (1, -1, 2.0**0.5))


def with_shortcuts(
    planned: Itinerary,
    share: float,
    length_m: float,
    streets: StreetLines,
    ground: OpenGround,
    rng: np.random.Generator,
) -> Itinerary:
    """Return an itinerary of which about a share lies off the ways, cut to a length.

    Parameters
    ----------
    share : float
        0..1, of ``length_m``; less is reached where there is no open ground.
    length_m : float
        Of the journey.
    """
    path = planned
    for _ in range(_ATTEMPTS):
        path = path.cut(1.3 * length_m)
        shown = path.cut(length_m)
        missing_m = share * length_m - off_ways_m(shown, streets)
        if missing_m < 0.5 * _LEAST_OFF_M:
            break
        reach_m = float(np.clip(2 * missing_m, _SHORTEST_M, _LONGEST_M))
        piece = int(rng.uniform(_SHORTEST_M, reach_m + 1.0) / STEP_M)
        last = shown.east_m.size - piece - 1
        if last < 1:
            break
        begin = int(rng.integers(last))
        end = begin + piece
        # Nothing is cut short twice.
        if (path.half_width_m[begin : end + 1] == 0).any():
            continue
        found = _over_ground(path, begin, end, streets, ground)
        if found is not None and off_ways_m(found, streets) <= missing_m + _LEAST_OFF_M:
            path = _spliced(path, begin, end, found)
    return path.cut(length_m)


def off_ways_m(path: Itinerary, streets: StreetLines) -> float:
    """Return how many metres of a path are off the ways."""
    return STEP_M * float(streets.off_ways(path.east_m, path.north_m).sum())


def _over_ground(
    path: Itinerary, begin: int, end: int, streets: StreetLines, ground: OpenGround
) -> Itinerary | None:
    """Return the path over open ground between two places, where it is worth to go there."""
    ends = [(path.east_m[i], path.north_m[i]) for i in (begin, end)]
    window = _window(ground.lattice, ends)
    if window is None:
        return None
    lattice = ground.lattice.window(*window)
    row, col, rows, cols = window
    free = ground.open[row : row + rows, col : col + cols]
    pixel_row, pixel_col = np.indices(free.shape)
    east, north = lattice.east_north(pixel_row.ravel(), pixel_col.ravel())
    clear_m = streets.clearance_m(east, north, 10.0).reshape(free.shape)
    cost = np.where(clear_m > OFF_MARGIN_M, 1.0, _ON_WAY)
    cells = _cheapest(free, cost, [lattice.row_col(*place) for place in ends])
    if cells is None:
        return None
    line_east, line_north = lattice.east_north(*cells)
    line_east = np.concatenate([[ends[0][0]], line_east[1:-1], [ends[1][0]]])
    line_north = np.concatenate([[ends[0][1]], line_north[1:-1], [ends[1][1]]])
    smooth = [
        gaussian_filter1d(axis, _SMOOTHED, mode="nearest") for axis in (line_east, line_north)
    ]
    for axis, raw in zip(smooth, (line_east, line_north), strict=True):
        axis[[0, -1]] = raw[[0, -1]]
    found = resampled(smooth[0], smooth[1], np.zeros(len(line_east) - 1))
    planned_m = STEP_M * (end - begin)
    too_long = found.walked_m[-1] > _LARGEST_DETOUR * planned_m
    worth = off_ways_m(found, streets) >= _LEAST_OFF_M
    return None if too_long or not worth else found


def _window(lattice: Lattice, ends: list[tuple[float, float]]) -> tuple[int, int, int, int] | None:
    rows, cols = zip(*(lattice.row_col(*place) for place in ends), strict=True)
    if not all(bool(lattice.contains(r, c)) for r, c in zip(rows, cols, strict=True)):
        return None
    around = int(_AROUND_M / lattice.resolution_m)
    top, left = max(min(rows) - around, 0), max(min(cols) - around, 0)
    bottom, right = (
        min(max(rows) + around, lattice.rows - 1),
        min(max(cols) + around, lattice.cols - 1),
    )
    return int(top), int(left), int(bottom - top + 1), int(right - left + 1)


def _cheapest(free: Bools, cost: Floats, ends: list[tuple[int, int]]) -> tuple[Ints, Ints] | None:
    """Return rows and columns of the cheapest path over free pixels; None without one."""
    open_ = free.copy()
    for row, col in ends:
        open_[row, col] = True
    number = np.arange(free.size).reshape(free.shape)
    pairs, weights = [], []
    for down, right, length in _NEIGHBOURS:
        here, there = _shifted(down, right)
        both = open_[here] & open_[there]
        pairs.append(np.stack([number[here][both], number[there][both]]))
        weights.append(0.5 * length * (cost[here] + cost[there])[both])
    first, second = np.concatenate(pairs, axis=1)
    graph = coo_array((np.concatenate(weights), (first, second)), shape=(free.size,) * 2).tocsr()
    start, goal = (int(number[place]) for place in ends)
    _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    if start == goal or before[goal] < 0:
        return None
    path = [goal]
    while path[-1] != start:
        path.append(int(before[path[-1]]))
    rows, cols = np.divmod(np.array(path[::-1], dtype=np.int64), free.shape[1])
    return rows, cols


def _shifted(down: int, right: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return the slices of all pixels that have a neighbour there, and of these neighbours."""
    rows = (slice(None, -down or None), slice(down, None))
    if right >= 0:
        cols = (slice(None, -right or None), slice(right, None))
    else:
        cols = (slice(-right, None), slice(None, right))
    return (rows[0], cols[0]), (rows[1], cols[1])


def _spliced(path: Itinerary, begin: int, end: int, found: Itinerary) -> Itinerary:
    def joined(name: str) -> Floats:
        own = getattr(path, name)
        return np.concatenate([own[:begin], getattr(found, name), own[end + 1 :]])

    return Itinerary(joined("east_m"), joined("north_m"), joined("half_width_m"))
