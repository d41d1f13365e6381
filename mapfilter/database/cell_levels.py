"""Levels of a database by cell and by window, for readers of areas too large to hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats, Floats32, Ints, Ints32
from mapfilter.database.checked import Part
from mapfilter.database.floor import DECIMALS
from mapfilter.database.parquet import Window, WindowReader, opened, part_ranges, read_columns
from mapfilter.database.points import way_columns
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import StoreError, fail
from mapfilter.lattice import Lattice

_POINT_COLUMNS = (
    "row",
    "col",
    "way_id",
    "way_class",
    "on_square",
    "distance_to_way_m",
    "best_level_dbm",
    "margin_db",
)
_FIRST_MARGIN_PX = 32
_MAX_PIXELS = 1 << 31
"""Pixels of a lattice whose numbers fit in signed 32 bits."""


class CellLevels(NamedTuple):
    """Levels of one cell.

    ``point`` (N,) are numbers of points in ascending order, ``level_dbm`` (N,) their levels.
    """

    point: Ints32
    level_dbm: Floats32

    @property
    def nbytes(self) -> int:
        """Bytes of both arrays."""
        return self.point.nbytes + self.level_dbm.nbytes


def received_cells(database: RadioRouteDatabase) -> tuple[str, ...]:
    """Return the cells with a level somewhere, in the plan's order."""
    parts = database.level_parts
    return tuple(
        cell for cell in database.cell_ids if any(part.rows for part in parts.get(cell, ()))
    )


class PartExtents(NamedTuple):
    """Where the points of M parts lie, and their strongest level.

    ``part`` (M) are those with rows, cell by cell, and ``band`` (M,) the cells; ``box`` (M, 4) the
    first and last row, and the first and last column; ``most_dbm`` (M,) the largest level.
    """

    part: tuple[Part, ...]
    band: Ints
    box: Ints
    most_dbm: Floats


def part_extents(database: RadioRouteDatabase, cell_ids: tuple[str, ...]) -> PartExtents:
    """Return the extents of the parts of some cells; only the parts' footers are read.

    Raises
    ------
    StoreError
        A part is damaged, or the database was replaced since it was opened.
    """
    parts, bands, boxes, most_dbm = [], [], [], []
    for band, cell_id in enumerate(cell_ids):
        for part in database.level_parts[cell_id]:
            if part.rows:
                with opened(part) as file:
                    found = part_ranges(file.footer, ("row", "col", "level_dbm"))
                parts.append(part)
                bands.append(band)
                boxes.append((*found[0], *found[1]))
                most_dbm.append(found[2][1])
    box = np.array(boxes, dtype=np.int64)
    return PartExtents(tuple(parts), np.array(bands), box, np.array(most_dbm))


def read_levels(part: Part, lattice: Lattice) -> CellLevels:
    """Read the levels of a part, all of one cell.

    Raises
    ------
    StoreError
        The part is damaged, the database was replaced since it was opened, or its lattice has more
        pixels than 32 bits count.
    """
    if lattice.rows * lattice.cols > _MAX_PIXELS:
        expected, got = f"at most {_MAX_PIXELS} pixels", f"{lattice.rows} x {lattice.cols}"
        raise fail(StoreError, f"{part}, lattice", expected, got, "cut the area into several")
    table = read_columns(part, ("point", "level_dbm"))
    point = table["point"].to_numpy()
    if point.size and not 0 <= point.min() <= point.max() < lattice.rows * lattice.cols:
        expected = "points on the database's lattice"
        raise fail(StoreError, str(part), expected, "others", "parts mixed up")
    point = point.astype(np.int32)
    order = np.argsort(point)
    level_dbm = table["level_dbm"].to_numpy().astype(np.float32)
    return CellLevels(point[order], level_dbm[order])


@dataclass(frozen=True, slots=True, eq=False)
class NearestPoints:
    """The nearest point of the database to each pixel of a window, and what is known there.

    Parameters
    ----------
    window : tuple of int
        Row, column, rows and columns on the database's lattice.
    near : ndarray of int32, shape (rows, cols)
        Index of each pixel's nearest point among the P that are the nearest of any.
    point : ndarray of int64, shape (P,)
        Their numbers, in ascending order.
    way_id : ndarray of int64, shape (P,)
    best_dbm, second_dbm : ndarray of float32, shape (P,)
        Strongest and second strongest level; NaN where there is none.
    edge_m : ndarray of float32, shape (rows, cols)
        Distance to the edge of the nearest way, 0 on it.
    """

    window: Window
    near: Ints32
    point: Ints
    way_id: Ints
    best_dbm: Floats32
    second_dbm: Floats32
    edge_m: Floats32

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        arrays = (
            *(self.near, self.point, self.way_id),
            *(self.best_dbm, self.second_dbm, self.edge_m),
        )
        return sum(one.nbytes for one in arrays)


class PointReader:
    """Reads the points of a database by windows."""

    def __init__(self, database: RadioRouteDatabase) -> None:
        self._lattice = database.lattice
        self._reader = WindowReader([database.points_part], _POINT_COLUMNS, database.lattice)

    def nearest(self, window: Window) -> NearestPoints:
        """Return the nearest points of a window, those of the whole database.

        Points around the window are read as far as they may be the nearest of a pixel in it.

        Raises
        ------
        StoreError
            The database has no points, or a part is damaged or was replaced.
        """
        from scipy.ndimage import distance_transform_edt

        top, left, rows, cols = window
        margin, lattice = _FIRST_MARGIN_PX, self._lattice
        while True:
            outer = _grown(window, margin, lattice)
            points = self._reader.read(outer)
            if points and points["row"].size:
                order = np.lexsort((points["col"], points["row"]))
                row, col = (points[name][order] for name in ("row", "col"))
                number = np.full(outer[2:], -1, dtype=np.int32)
                number[row - outer[0], col - outer[1]] = np.arange(row.size)
                away_px, at = distance_transform_edt(number < 0, return_indices=True)
                inner = np.s_[
                    top - outer[0] : top - outer[0] + rows, left - outer[1] : left - outer[1] + cols
                ]
                if np.all(away_px[inner] < _seen_px(window, outer, lattice)):
                    break
                # All that may be nearer lies within.
                margin = int(away_px[inner].max())
            elif outer == (0, 0, lattice.rows, lattice.cols):
                where, expected = "whole lattice", "points of the database"
                raise fail(StoreError, where, expected, "none", "a database without ways")
            else:
                margin *= 4
        nearest = number[at[0][inner], at[1][inner]]
        used, near = np.unique(nearest, return_inverse=True)
        half_width_m, on_way_m = way_columns(points)
        half_width_m, on_way_m = half_width_m[order], on_way_m[order]
        away_m = away_px[inner] * lattice.resolution_m + on_way_m.astype(np.float64)[nearest]
        best_dbm = points["best_level_dbm"][order][used]
        margin_db = points["margin_db"][order][used].astype(np.float64)
        second_dbm = np.round(best_dbm.astype(np.float64) - margin_db, DECIMALS)
        return NearestPoints(
            window,
            near.reshape(rows, cols).astype(np.int32),
            row[used].astype(np.int64) * lattice.cols + col[used],
            points["way_id"][order][used],
            best_dbm.astype(np.float32),
            second_dbm.astype(np.float32),
            np.maximum(away_m.astype(np.float32) - half_width_m[nearest], 0),
        )


def _grown(window: Window, margin: int, lattice: Lattice) -> Window:
    top, left = max(window[0] - margin, 0), max(window[1] - margin, 0)
    bottom = min(window[0] + window[2] + margin, lattice.rows)
    right = min(window[1] + window[3] + margin, lattice.cols)
    return top, left, bottom - top, right - left


def _seen_px(window: Window, outer: Window, lattice: Lattice) -> Ints:
    """Return how far from each pixel of a window the nearest pixel beyond another one lies."""
    far = lattice.rows + lattice.cols
    (top, left, rows, cols), (low, west, high, wide) = window, outer
    row, col = np.arange(top, top + rows), np.arange(left, left + cols)
    above = row - low + 1 if low > 0 else np.full(rows, far)
    below = low + high - row if low + high < lattice.rows else np.full(rows, far)
    before = col - west + 1 if west > 0 else np.full(cols, far)
    behind = west + wide - col if west + wide < lattice.cols else np.full(cols, far)
    seen: Ints = np.minimum(np.minimum(above, below)[:, None], np.minimum(before, behind)[None, :])
    return seen
