"""Where in a large area a search begins: in the tiles that its first evidence is likeliest in.

Weighing every point of a thousand square kilometres takes minutes, and nearly all of them are far
from any cell of the report. Tiles are compared with the report by the range of each cell's levels
in them, which bounds the likelihood of all their points, and with fixes, distances and satellites
by their likelihood at some places of each tile; the best tiles are searched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, log

import numpy as np

from mapfilter._types import Bools, Floats, Floats32, Ints
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.sources.evidence import PlacedTerm, RadioReading, Term

_MOST_POINTS = 1_000_000
"""Most points of the area that are weighed where no cell of the report is known."""
_PER_AXIS = 4
"""Places of a tile along each axis at which terms other than levels are compared with it."""
_NEAR_NATS = 4.5
"""Log-likelihood at three standard deviations: tiles as near to a fix are searched."""
_PEAK_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class SearchedTiles:
    """The tiles of a search.

    Parameters
    ----------
    points : ndarray of float32, shape (2, P)
        East and north in the local frame of their points, in row-major order.
    boxes_m : ndarray, shape (T, 4)
        West, south, east and north of each.
    """

    points: Floats32
    boxes_m: Floats

    def anywhere(self, drawn: Floats) -> Floats32:
        """Return places anywhere in the tiles by numbers from 0 to 1, (N, 2): shape (2, N)."""
        west, south, east, north = self.boxes_m.T
        ends = np.cumsum((east - west) * (north - south))
        along = drawn[:, 0] * ends[-1]
        tile = np.minimum(np.searchsorted(ends, along, side="right"), len(ends) - 1)
        # What is left of the number that chose the tile is as random as the number.
        first = np.concatenate([[0.0], ends])[tile]
        share = (along - first) / (ends[tile] - first)
        places = [
            west[tile] + share * (east - west)[tile],
            south[tile] + drawn[:, 1] * (north - south)[tile],
        ]
        return np.asarray(places, dtype=np.float32)

    def around(
        self, size_m: tuple[float, float], beyond_m: float, count: int, rng: np.random.Generator
    ) -> Floats32:
        """Draw places beyond an area beside those of the tiles at its edge: shape (2, N).

        N is 0 where no tile lies at the edge.
        """
        west, south, east, north = self.boxes_m.T
        width_m, height_m = size_m
        belts = [
            (np.zeros(west.size) - beyond_m, south, np.zeros(west.size), north, west <= 0),
            (east, south, east + beyond_m, north, east >= width_m),
            (west, np.zeros(west.size) - beyond_m, east, np.zeros(west.size), south <= 0),
            (west, north, east, north + beyond_m, north >= height_m),
        ]
        boxes = np.concatenate([np.stack(belt[:4], axis=1)[belt[4]] for belt in belts])
        if not len(boxes):
            return np.empty((2, 0), dtype=np.float32)
        return SearchedTiles(self.points, boxes).anywhere(rng.random((count, 2)))


def searched_tiles(
    area: TiledArea, reading: RadioReading | None, errors: LevelErrors
) -> SearchedTiles | None:
    """Return where to search by first evidence; None for everywhere.

    Tiles in which less than half of the report's cells are received are left out, but for those
    within three standard deviations of a fix. Other threads look up between two cells, or tiles.

    Parameters
    ----------
    reading : RadioReading or None
        Report, and the terms of fixes, timing and satellites. Without a known cell and a fix the
        search is everywhere.
    errors : LevelErrors
        Deviations (dB) that levels are compared with, and the probability of a fault.

    Returns
    -------
    SearchedTiles or None
        At most ``area.search_tiles`` tiles; None also where the area has no more than these.

    Raises
    ------
    StoreError
        A part is damaged, or the database was replaced since it was opened.
    """
    if area.count <= area.search_tiles or reading is None:
        return None
    numbers = _best_tiles(area, reading, errors)
    if not numbers.size:
        return None
    found = [_points_of(area, number) for number in numbers.tolist()]
    row, col = (np.concatenate(axis) for axis in zip(*found, strict=True))
    return SearchedTiles(places_of(area, row, col), _boxes_m(area, numbers))


def points_everywhere(area: TiledArea) -> Floats32:
    """Return points of the whole area, (2, P), or an even part of them where there are many."""
    if area.count <= area.search_tiles:
        found = [_points_of(area, number) for number in range(area.count)]
        row, col = (np.concatenate(axis) for axis in zip(*found, strict=True))
    else:
        point = area.tiles.every_point()
        point = point[:: -(-point.size // _MOST_POINTS)]
        row, col = point // area.lattice.cols, point % area.lattice.cols
    return places_of(area, row, col)


def places_of(area: TiledArea, row: Ints, col: Ints) -> Floats32:
    """Return east and north of pixels in the local frame, in row-major order, shape (2, P)."""
    order = np.lexsort((col, row))
    row, col = row[order], col[order]
    step = area.lattice.resolution_m
    places = np.stack([(col + 0.5) * step, (area.lattice.rows - row - 0.5) * step])
    return np.asarray(places, dtype=np.float32)


def _points_of(area: TiledArea, number: int) -> tuple[Ints, Ints]:
    with area.tiles.lock:
        tile = area.tiles.tile(number)
    return tile.row, tile.col


_ReportedCells = list[tuple[Sequence[int], float]]
"""The cells that each row of a report may be of, and its level, NaN for none."""


def _reported_cells(reading: RadioReading) -> _ReportedCells:
    found: _ReportedCells = []
    if reading.levels is not None:
        levels = zip(reading.levels.cell.tolist(), reading.levels.level_dbm.tolist(), strict=True)
        found += [([cell], level) for cell, level in levels]
    if reading.serving >= 0 and all(reading.serving not in cells for cells, _ in found):
        found.append(([reading.serving], float("nan")))
    several = [one for one in reading.bounds if one.censored == 0]
    return found + [(one.cells.tolist(), one.level_dbm) for one in several]


def _best_tiles(area: TiledArea, reading: RadioReading, errors: LevelErrors) -> Ints:
    """Return the tiles with points that evidence is most probable in, along the lattice."""
    tiles, reported = area.tiles, _reported_cells(reading)
    sd_db = float(np.hypot(errors.total_db, errors.device_db))
    fault = log(max(errors.fault_probability, 1e-6))
    score = np.zeros((tiles.rows, tiles.cols))
    received = np.zeros((tiles.rows, tiles.cols), dtype=np.int64)
    strongest = np.full((tiles.rows, tiles.cols), -np.inf)
    for cells, level_dbm in reported:
        best = np.full(score.shape, fault)
        there = np.zeros(score.shape, dtype=np.bool_)
        for cell in cells:
            with tiles.lock:
                row, col, least_dbm, most_dbm = tiles.range_of(cell)
            part = np.s_[row : row + most_dbm.shape[0], col : col + most_dbm.shape[1]]
            known = np.isfinite(most_dbm)
            there[part] |= known
            strongest[part] = np.fmax(strongest[part], most_dbm)
            beside = np.zeros(most_dbm.shape)
            if isfinite(level_dbm):
                beside = np.maximum(np.maximum(level_dbm - most_dbm, least_dbm - level_dbm), 0.0)
            nats = np.where(known, -0.5 * (beside / sd_db) ** 2, fault)
            best[part] = np.maximum(best[part], nats)
        score += best
        received += there
    gain, near = _gains_of_terms(area, reading.terms)
    if not reported and near.sum() > area.search_tiles:
        return np.empty(0, dtype=np.int64)
    fits = ((2 * received >= len(reported)) & (received > 0)).ravel() | near
    number = np.flatnonzero(fits)
    # A fix that leaves few tiles has all of them searched, whatever cells are received there.
    after = ~near if 2 * near.sum() <= area.search_tiles else np.zeros_like(near)
    total = score.ravel() + gain
    order = np.lexsort((-strongest.ravel()[number], -total[number], after[number]))
    return np.sort(number[order[: area.search_tiles]])


def _gains_of_terms(area: TiledArea, terms: Sequence[Term]) -> tuple[Floats, Bools]:
    """Return the largest log-likelihood of terms in each tile, and which are near a fix, (T,).

    It is that at places spread evenly over each tile, and at the place in it that is nearest to
    the likeliest of all.
    """
    gain, near = np.zeros(area.count), np.zeros(area.count, dtype=np.bool_)
    if not terms:
        return gain, near
    west, south, east, north = _boxes_m(area, np.arange(area.count)).T[:, :, None]
    share = (np.arange(_PER_AXIS) + 0.5) / _PER_AXIS
    x, y = (one.ravel() for one in np.meshgrid(share, share))
    x_m, y_m = west + x * (east - west), south + y * (north - south)
    spacing_m = area.tiles.side * area.lattice.resolution_m / _PER_AXIS
    for term in terms:
        if isinstance(term, PlacedTerm):
            at = term.place_m
        else:
            at = _peak_m(term, x_m.ravel(), y_m.ravel(), spacing_m)
        every_x = np.concatenate([x_m, np.clip(at[0], west, east)], axis=1)
        every_y = np.concatenate([y_m, np.clip(at[1], south, north)], axis=1)
        found = _at_places(term, every_x.ravel(), every_y.ravel())
        most = found.reshape(every_x.shape).max(axis=1)
        gain += most
        if isinstance(term, PlacedTerm):
            near |= most > -_NEAR_NATS
    return gain, near


def _peak_m(term: Term, x_m: Floats, y_m: Floats, spacing_m: float) -> tuple[float, float]:
    """Return about where a term is largest: the best of some places, then of closer ones there."""
    for _ in range(_PEAK_ROUNDS):
        best = int(np.argmax(_at_places(term, x_m, y_m)))
        at = float(x_m[best]), float(y_m[best])
        around = spacing_m * np.linspace(-1.0, 1.0, 9)
        x, y = np.meshgrid(around, around)
        x_m, y_m, spacing_m = at[0] + x.ravel(), at[1] + y.ravel(), spacing_m / 4
    return at


def _at_places(term: Term, x_m: Floats, y_m: Floats) -> Floats:
    """Return a term's log-likelihood at places in the local frame, (N,)."""
    state = np.zeros((STATES, x_m.size), dtype=np.float32)
    state[EAST], state[NORTH] = x_m, y_m
    return np.broadcast_to(term.log_likelihood(state), x_m.shape)


def _boxes_m(area: TiledArea, number: Ints) -> Floats:
    """Return west, south, east and north of tiles in the local frame, (T, 4)."""
    lattice, side = area.lattice, area.tiles.side
    top, left = side * (number // area.tiles.cols), side * (number % area.tiles.cols)
    bottom, right = np.minimum(top + side, lattice.rows), np.minimum(left + side, lattice.cols)
    edges = np.stack([left, lattice.rows - bottom, right, lattice.rows - top], axis=1)
    return np.asarray(edges * lattice.resolution_m)
