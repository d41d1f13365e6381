"""One tile of a build: the levels of all cells at the tile's points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.rasters import RxLevRasters
from mapfilter.roads.lattice import RouteLattice

Floats32 = NDArray[np.float32]

_CELLS_AT_A_TIME = 128
_ALIGNED_PX = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Tile:
    """A window of the rasters and the points in it; all that a worker needs.

    Parameters
    ----------
    rasters : RxLevRasters
    plan : CellPlan
    window : (row, col, rows, cols)
    row, col : numpy.ndarray, shape (N,)
        The points, counted from the window's corner.
    floor_dbm : float
    """

    rasters: RxLevRasters
    plan: CellPlan
    window: tuple[int, int, int, int]
    row: NDArray[np.int64]
    col: NDArray[np.int64]
    floor_dbm: float


@dataclass(frozen=True, slots=True, eq=False)
class TileLevels:
    """What is heard at a tile's points.

    Parameters
    ----------
    best : numpy.ndarray of int32, shape (N,)
        The strongest cell, the first in the plan's order of equals; -1 when none is above the
        floor.
    best_level_dbm, margin_db : numpy.ndarray of float32, shape (N,)
        Its level, and how far above the second strongest it is.
    cell, which : numpy.ndarray of int32, shape (L,)
        Each level's cell, and its point as an index into the tile's points; sorted by both.
    level_dbm, below_best_db : numpy.ndarray of float32, shape (L,)
        Rounded to 0.01 dB.
    """

    best: NDArray[np.int32]
    best_level_dbm: Floats32
    margin_db: Floats32
    cell: NDArray[np.int32]
    which: NDArray[np.int32]
    level_dbm: Floats32
    below_best_db: Floats32


def read_tile(tile: Tile) -> TileLevels:
    """Read a tile's window, a few cells at a time, and keep the levels above the floor.

    Raises
    ------
    InputError
        The rasters are cut off.
    """
    ids = tile.plan.ids
    level = np.empty((len(ids), tile.row.size), dtype=np.float64)
    for first in range(0, len(ids), _CELLS_AT_A_TIME):
        some = ids[first : first + _CELLS_AT_A_TIME]
        window_dbm = tile.rasters.read_levels_dbm(tile.plan, tile.window, some)
        level[first : first + len(some)] = window_dbm[:, tile.row, tile.col]
    level = np.round(level, 2)
    strength = np.where(np.isnan(level), -np.inf, level)
    best = strength.argmax(axis=0)
    best_dbm = strength.max(axis=0)
    second_dbm = np.full_like(best_dbm, -np.inf)
    if len(ids) > 1:
        second_dbm = np.partition(strength, -2, axis=0)[-2]
    with np.errstate(invalid="ignore"):
        margin = np.where(np.isfinite(second_dbm), best_dbm - second_dbm, np.nan)
    cell, which = np.nonzero(strength >= tile.floor_dbm)
    kept_dbm = strength[cell, which]
    return TileLevels(
        np.where(best_dbm >= tile.floor_dbm, best, -1).astype(np.int32),
        best_dbm.astype(np.float32),
        np.round(margin, 2).astype(np.float32),
        cell.astype(np.int32),
        which.astype(np.int32),
        kept_dbm.astype(np.float32),
        np.round(best_dbm[which] - kept_dbm, 2).astype(np.float32),
    )


def pixel_offset(rasters: RxLevRasters, routes: RouteLattice) -> tuple[int, int]:
    """Return the rows and columns from the rasters' corner to the route lattice's corner.

    Raises
    ------
    InputError
        CRS, resolution or pixel edges differ, or the two do not overlap.
    """
    raster, lattice = rasters.lattice, routes.lattice
    where, faults = f"{rasters.path} and roads", Faults()
    hint = "make the route lattice on the rasters' lattice"
    if not same_crs(raster.crs, lattice.crs):
        faults.add(where, f"one CRS ({raster.crs})", lattice.crs, "files of different zones")
    elif abs(raster.resolution_m - lattice.resolution_m) > 1e-6 * raster.resolution_m:
        got = f"{raster.resolution_m:g} m and {lattice.resolution_m:g} m"
        faults.add(where, "one resolution", got, hint)
    faults.raise_if_any(InputError)
    down = (raster.north_m - lattice.north_m) / raster.resolution_m
    right = (lattice.west_m - raster.west_m) / raster.resolution_m
    row, col = round(down), round(right)
    if max(abs(down - row), abs(right - col)) > _ALIGNED_PX:
        got = f"shifted by {right - col:+.3f} and {down - row:+.3f} pixels"
        faults.add(where, "pixels that align", got, f"half-pixel convention; {hint}")
    elif not _overlap(raster, lattice, row, col):
        got = f"rasters {_box(raster)}, roads {_box(lattice)}"
        faults.add(where, "areas that overlap", got, "files of different areas")
    faults.raise_if_any(InputError)
    return row, col


def _overlap(raster: Lattice, lattice: Lattice, row: int, col: int) -> bool:
    return -lattice.rows < row < raster.rows and -lattice.cols < col < raster.cols


def _box(lattice: Lattice) -> str:
    west, south, east, north = lattice.bounds_m
    return f"{west:.0f}..{east:.0f} E {south:.0f}..{north:.0f} N"
