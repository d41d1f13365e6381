"""Levels at positions: those of rasters, or of an array."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters

Levels = Callable[[Floats, Floats], NDArray[np.floating]]
"""From east and north (m), shape (N,), to levels (dBm), shape (N, cells); NaN: not received."""


def level_sampler(
    rasters: RxLevRasters,
    cell_ids: Sequence[str] | None = None,
    bounds_m: tuple[float, float, float, float] | None = None,
    *,
    plan: CellPlan | None = None,
) -> Levels:
    """Return a function that looks levels up in rasters: the pixel that holds each position.

    Parameters
    ----------
    rasters : RxLevRasters
        Of levels (dBm), or of losses (dB), which need ``plan``.
    cell_ids : sequence of str, optional
        The columns, such as ``plan.ids``; else the rasters' own order.
    bounds_m : tuple of float, optional
        West, south, east, north of the part that is read into memory; else all of it.
    plan : CellPlan, optional
        Gives the EIRP from which losses are taken.

    Returns
    -------
    levels : callable
        From east and north (m), shape (N,), to levels (dBm), shape (N, cells); NaN outside.

    Raises
    ------
    InputError
        The rasters hold losses and there is no plan, a cell is missing, or they do not reach into
        the bounds.
    """
    if plan is None and rasters.quantity != "level":
        raise fail(InputError, str(rasters.path), "levels in dBm, or a cell plan", "losses in dB")
    lattice, window = rasters.lattice, None
    if bounds_m is not None:
        window = _window(lattice, bounds_m, str(rasters.path))
        lattice = lattice.window(*window)
    if plan is None:
        return array_sampler(rasters.read(window, cell_ids), lattice)
    return array_sampler(rasters.read_levels_dbm(plan, window, cell_ids), lattice)


def array_sampler(level_dbm: NDArray[np.floating], lattice: Lattice) -> Levels:
    """Return a function that looks levels up in an array of shape (cells, rows, cols)."""

    def levels(east_m: Floats, north_m: Floats) -> NDArray[np.floating]:
        row, col = lattice.row_col(np.atleast_1d(east_m), np.atleast_1d(north_m))
        inside = lattice.contains(row, col)
        found = level_dbm[:, np.where(inside, row, 0), np.where(inside, col, 0)].T
        return np.where(inside[:, np.newaxis], found, np.nan)

    return levels


def _window(
    lattice: Lattice, bounds_m: tuple[float, float, float, float], where: str
) -> tuple[int, int, int, int]:
    west, south, east, north = bounds_m
    top, left = lattice.row_col(west, north)
    bottom, right = lattice.row_col(east, south)
    top, left = max(top, 0), max(left, 0)
    bottom, right = min(bottom, lattice.rows - 1), min(right, lattice.cols - 1)
    if bottom < top or right < left:
        got = f"rasters over {lattice.bounds_m}"
        raise fail(InputError, where, f"rasters over {bounds_m}", got)
    return top, left, bottom - top + 1, right - left + 1
