"""Predicted levels at every pixel of an area, spread from the points of a database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapfilter._types import Bools, Floats32, Ints
from mapfilter.lattice import Lattice


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RadioField:
    """Predicted levels at every pixel of an area.

    Off the points each pixel has the values of its nearest point of the area.

    Parameters
    ----------
    lattice : Lattice
        The area's part of the database's lattice.
    cell_ids : tuple of str
        The cells with a level in the area, in the plan's order.
    level_dbm : numpy.ndarray of float32, shape (rows, cols, cells)
        NaN below the database's floor.
    distance_to_way_m : numpy.ndarray of float32, shape (rows, cols)
        Distance to the nearest way's centre line, 0 in squares; off the points, that of the
        nearest point plus the distance to it.
    half_width_m : numpy.ndarray of float32, shape (rows, cols)
        Half the usual width of the nearest way by its class; 0 where it belongs to none.
    way_id : numpy.ndarray of int64, shape (rows, cols)
        0 where the (nearest) point belongs to no way.
    on_way : numpy.ndarray of bool, shape (rows, cols)
        The pixel is a point of the database.
    """

    lattice: Lattice
    cell_ids: tuple[str, ...]
    level_dbm: Floats32
    distance_to_way_m: Floats32
    half_width_m: Floats32
    way_id: Ints
    on_way: Bools

    def __repr__(self) -> str:
        points = int(self.on_way.sum())
        return f"RadioField({len(self.cell_ids)} cells, {points} points; {self.lattice})"


def fill_field(
    window: Lattice,
    pixels: tuple[NDArray[Any], NDArray[Any]],
    way_id: Ints,
    distance_m: Floats32,
    half_width_m: Floats32,
    received: Sequence[tuple[str, NDArray[Any], NDArray[Any], Floats32]],
) -> RadioField:
    """Spread points over a window and fill the gaps from the nearest point.

    ``pixels`` are rows and columns of the points in the window, at least one. ``received`` are the
    cell id, row, col and level_dbm of the points at which each cell is received, all among these.
    """
    # Here, as it takes long to import, and a database may be opened for its figures alone.
    from scipy.ndimage import distance_transform_edt

    size = (window.rows, window.cols)
    on_way = np.zeros(size, dtype=np.bool_)
    on_way[pixels] = True
    away_px, (row, col) = distance_transform_edt(~on_way, return_indices=True)
    point_at = np.zeros(size, dtype=np.int64)
    point_at[pixels] = np.arange(way_id.size)
    level_of = np.full((way_id.size, len(received)), np.nan, dtype=np.float32)
    for i, (_, cell_row, cell_col, level_dbm) in enumerate(received):
        level_of[point_at[cell_row, cell_col], i] = level_dbm
    nearest = point_at[row, col]
    return RadioField(
        window,
        tuple(cell_id for cell_id, *_ in received),
        level_of[nearest],
        (away_px * window.resolution_m + distance_m[nearest]).astype(np.float32),
        half_width_m[nearest],
        way_id[nearest],
        on_way,
    )
