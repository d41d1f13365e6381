"""Levels of all cells over an area, in memory, also off the ways."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import distance_transform_edt

from mapfilter._types import Bools, Floats32, Ints
from mapfilter.geodesy import Lattice


@dataclass(frozen=True, slots=True, eq=False)
class RadioField:
    """What would be heard at every pixel of an area.

    Off the points each pixel holds what its nearest point of the area holds.

    Parameters
    ----------
    lattice : Lattice
        The area's part of the database's lattice.
    cell_ids : tuple of str
        The cells heard in the area, in the plan's order.
    level_dbm : numpy.ndarray of float32, shape (rows, cols, cells)
        NaN below the database's floor.
    distance_to_way_m : numpy.ndarray of float32, shape (rows, cols)
        How far it is to where one can be: 0 in squares, else to the nearest way's centre line;
        off the points the distance to the nearest point and what that point has itself.
    way_id : numpy.ndarray of int64, shape (rows, cols)
        0 where the (nearest) point belongs to no way.
    on_way : numpy.ndarray of bool, shape (rows, cols)
        The pixel is a point of the database.
    """

    lattice: Lattice
    cell_ids: tuple[str, ...]
    level_dbm: Floats32
    distance_to_way_m: Floats32
    way_id: Ints
    on_way: Bools

    def levels_at(self, east_m: ArrayLike, north_m: ArrayLike) -> Floats32:
        """Return the levels at positions, shape (N, cells); NaN below the floor or off the area.

        Parameters
        ----------
        east_m, north_m : array_like, shape (N,)
            Finite positions; each takes the levels of the pixel that holds it.
        """
        row, col = self.lattice.row_col(np.atleast_1d(east_m), np.atleast_1d(north_m))
        inside = self.lattice.contains(row, col)
        levels = np.full((row.size, len(self.cell_ids)), np.nan, dtype=np.float32)
        levels[inside] = self.level_dbm[row[inside], col[inside]]
        return levels


def fill_field(
    window: Lattice,
    pixels: tuple[NDArray[Any], NDArray[Any]],
    way_id: Ints,
    distance_m: Floats32,
    heard: Sequence[tuple[str, NDArray[Any], NDArray[Any], Floats32]],
) -> RadioField:
    """Spread points over a window and fill the gaps from the nearest point.

    Parameters
    ----------
    window : Lattice
    pixels : tuple of numpy.ndarray, shape (N,) each
        Rows and columns of the points in the window, at least one.
    way_id, distance_m : numpy.ndarray, shape (N,)
        Each point's way, and how far its centre line is.
    heard : sequence of (cell id, row, col, level_dbm)
        The points at which each cell is heard; they are among ``pixels``.
    """
    size = (window.rows, window.cols)
    on_way = np.zeros(size, dtype=np.bool_)
    on_way[pixels] = True
    away_px, (row, col) = distance_transform_edt(~on_way, return_indices=True)
    ways, distance = np.zeros(size, dtype=np.int64), np.zeros(size)
    ways[pixels], distance[pixels] = way_id, distance_m
    level = np.empty((*size, len(heard)), dtype=np.float32)
    for i, (_, cell_row, cell_col, level_dbm) in enumerate(heard):
        layer = np.full(size, np.nan, dtype=np.float32)
        layer[cell_row, cell_col] = level_dbm
        level[..., i] = layer[row, col]
    return RadioField(
        window,
        tuple(cell_id for cell_id, *_ in heard),
        level,
        (away_px * window.resolution_m + distance[row, col]).astype(np.float32),
        ways[row, col],
        on_way,
    )
