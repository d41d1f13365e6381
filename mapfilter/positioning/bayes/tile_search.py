"""Where in a large area a search begins: in the tiles that its first report speaks for.

Weighing every point of a thousand square kilometres takes minutes, and nearly all of them are far
from any cell of the report. Tiles are compared with the report by the range of each cell's levels
in them, which bounds the likelihood of all their points; the best tiles are searched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, log

import numpy as np

from mapfilter._types import Floats, Floats32, Ints
from mapfilter.models.level_errors import LevelErrors
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.tiled_area import TiledArea

_MOST_POINTS = 1_000_000
"""Most points of the area that are weighed where no cell of the report is known."""


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
    """Return where to search by a first report; None for everywhere.

    Tiles in which less than half of the report's cells are received are left out.
    """
    heard = _heard(reading)
    if area.count <= area.search_tiles:
        return None
    with area.tiles.lock:
        numbers = _best_tiles(area, heard, errors) if heard else np.empty(0, dtype=np.int64)
        if not numbers.size:
            return None
        found = [_points_of(area, number) for number in numbers.tolist()]
    row, col = (np.concatenate(axis) for axis in zip(*found, strict=True))
    boxes_m = np.array([_box_m(area, number) for number in numbers.tolist()])
    return SearchedTiles(places_of(area, row, col), boxes_m)


def points_everywhere(area: TiledArea) -> Floats32:
    """Return points of the whole area, (2, P), or an even part of them where there are many."""
    if area.count <= area.search_tiles:
        with area.tiles.lock:
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
    tile = area.tiles.tile(number)
    return tile.row, tile.col


_Heard = list[tuple[Sequence[int], float]]
"""The cells that each row of a report may be of, and its level, NaN for none."""


def _heard(reading: RadioReading | None) -> _Heard:
    if reading is None:
        return []
    heard: _Heard = []
    if reading.levels is not None:
        levels = zip(reading.levels.cell.tolist(), reading.levels.level_dbm.tolist(), strict=True)
        heard += [([cell], level) for cell, level in levels]
    if reading.serving >= 0 and all(reading.serving not in cells for cells, _ in heard):
        heard.append(([reading.serving], float("nan")))
    several = [one for one in reading.bounds if one.censored == 0]
    return heard + [(one.cells.tolist(), one.level_dbm) for one in several]


def _best_tiles(area: TiledArea, heard: _Heard, errors: LevelErrors) -> Ints:
    """Return the tiles with points that a report is most probable in, along the lattice."""
    tiles = area.tiles
    sd_db = float(np.hypot(errors.total_db, errors.device_db))
    fault = log(max(errors.fault_probability, 1e-6))
    score = np.zeros((tiles.rows, tiles.cols))
    received = np.zeros((tiles.rows, tiles.cols), dtype=np.int64)
    strongest = np.full((tiles.rows, tiles.cols), -np.inf)
    for cells, level_dbm in heard:
        best = np.full(score.shape, fault)
        there = np.zeros(score.shape, dtype=np.bool_)
        for cell in cells:
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
    fits = 2 * received >= len(heard)
    fits &= received > 0
    number = np.flatnonzero(fits)
    order = np.lexsort((-strongest.ravel()[number], -score.ravel()[number]))
    return np.sort(number[order[: area.search_tiles]])


def _box_m(area: TiledArea, number: int) -> tuple[float, float, float, float]:
    """Return west, south, east and north of a tile in the local frame."""
    lattice, side = area.lattice, area.tiles.side
    top, left = side * (number // area.tiles.cols), side * (number % area.tiles.cols)
    bottom, right = min(top + side, lattice.rows), min(left + side, lattice.cols)
    step = lattice.resolution_m
    return left * step, (lattice.rows - bottom) * step, right * step, (lattice.rows - top) * step
