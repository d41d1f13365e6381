"""Radio maps for bounds: where a phone can be, levels received there, and their errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.ndimage import distance_transform_edt

from mapfilter._types import Bools, Floats32, Ints
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.options import Below1, Options, Positive
from mapfilter.radio.layers import layers_of

MOST_RECEIVED = 7
"""Cells in a report: the serving one and six neighbours."""
MOST_LEVELS = 1_000_000_000

_TOLERANCE_PX = 1.0


@dataclass(frozen=True, slots=True)
class ErrorModel(Options):
    """How far predicted levels are from those received: normal, correlated along the way.

    The error of a cell has the autocorrelation exp(-d / correlation_m) (Gudmundson 1991,
    "Correlation model for shadow fading in mobile radio systems"); cells of one site share a part
    of it.

    Parameters
    ----------
    deviation_db : float
        Standard deviation, > 0.
    correlation_m : float
        > 0.
    site_share : float
        Share of the variance that is common to a site's cells, at least 0 and below 1.
    """

    deviation_db: Positive = 7.0
    correlation_m: Positive = 50.0
    site_share: Below1 = 0.5

    def looks(self, length_m: float) -> float:
        """Return how many independent looks a path is worth: 1 + length / (2 · correlation).

        So many independent ones give the mean level along a path as well as a continuous record
        of it does: the variance of the best linear estimate of the mean of a process with this
        correlation is 2 / (2 + length / correlation) of that of one look (Grenander 1950).

        Examples
        --------
        >>> ErrorModel(7.0, 50.0).looks(100.0)
        2.0
        """
        return 1.0 + length_m / (2.0 * self.correlation_m)


@dataclass(frozen=True, slots=True, eq=False)
class RadioMap:
    """A database in memory, over all pixels of its lattice.

    Parameters
    ----------
    cell_ids : tuple of str
        Those that are received, C of them.
    site, layer : numpy.ndarray of int64, shape (C,)
        Number of the site of each cell, and of its layer (:func:`mapfilter.radio.layers.layers_of`)
        from 0.
    level_dbm : numpy.ndarray of float32, shape (rows, cols, C)
        Off the points, those of the nearest; ``floor_dbm`` where a cell is not received, and more
        where it is.
    floor_dbm, margin_db : float
        Of the database.
    on_way : numpy.ndarray of bool, shape (rows, cols)
        The points.
    near_way : numpy.ndarray of bool, shape (rows, cols)
        The points, and pixels beside them.
    row, col : numpy.ndarray of int64, shape (N,)
        The points, row by row.
    way_id : numpy.ndarray of int64, shape (N,)
        0 for points of no way.
    server : numpy.ndarray of int64, shape (N,)
        The strongest cell of each point, of all layers.
    """

    lattice: Lattice
    cell_ids: tuple[str, ...]
    site: Ints
    layer: Ints
    level_dbm: Floats32
    floor_dbm: float
    margin_db: float
    on_way: Bools
    near_way: Bools
    row: Ints
    col: Ints
    way_id: Ints
    server: Ints

    def __len__(self) -> int:
        return int(self.row.size)

    def points_by_cell(self) -> tuple[Ints, Ints]:
        """Return the points at which each cell can serve.

        A point belongs to the strongest cell of each layer and to its cells at most the margin
        weaker.

        Returns
        -------
        first : numpy.ndarray of int64, shape (C + 1,)
            Those of cell c are ``point[first[c]:first[c + 1]]``.
        point : numpy.ndarray of int64
            Indices of points, cell by cell.
        """
        level = self.level_dbm[self.row, self.col]
        best = best_of_layers_dbm(level, self.layer)[:, self.layer]
        received = (level >= best - np.float32(self.margin_db)) & (level > self.floor_dbm)
        cell, point = np.nonzero(received.T)
        first = np.searchsorted(cell, np.arange(len(self.cell_ids) + 1))
        return first.astype(np.int64), point.astype(np.int64)


def best_of_layers_dbm(level_dbm: Floats32, layer: Ints) -> Floats32:
    """Return the strongest level of each layer, shape (…, layers), of levels (…, cells)."""
    count = int(layer.max(initial=-1)) + 1
    return np.stack([level_dbm[..., layer == k].max(axis=-1) for k in range(count)], axis=-1)


def radio_map(database: RadioRouteDatabase) -> RadioMap:
    """Read a database into memory.

    Raises
    ------
    InputError
        It has no cells, or its lattice times its cells is beyond 1e9 levels.
    """
    if not database.cell_ids:
        hint = "a database of roads alone"
        raise fail(InputError, str(database.path), "cells", "none", hint)
    lattice = database.lattice
    size = lattice.rows * lattice.cols * len(database.cell_ids)
    if size > MOST_LEVELS:
        got = f"{size:.1e}: {lattice.rows} x {lattice.cols} pixels, {len(database.cell_ids)} cells"
        hint = "a smaller area: build a database of a part"
        raise fail(InputError, str(database.path), f"at most {MOST_LEVELS:.0e} levels", got, hint)
    field = database.field()
    # A database holds levels from the floor on, which kernels compare in double precision.
    floor_dbm = np.float32(database.floor_dbm)
    least_dbm = np.nextafter(floor_dbm, np.float32(np.inf))
    level = np.where(np.isnan(field.level_dbm), floor_dbm, np.maximum(field.level_dbm, least_dbm))
    row, col = np.nonzero(field.on_way)
    away_px = distance_transform_edt(~field.on_way)
    sites = [database.plan[cell_id].site for cell_id in field.cell_ids]
    return RadioMap(
        lattice,
        field.cell_ids,
        np.unique(sites, return_inverse=True)[1].astype(np.int64),
        np.array(layers_of(database.plan, field.cell_ids), dtype=np.int64),
        level,
        float(floor_dbm),
        database.margin_db,
        field.on_way,
        away_px <= _TOLERANCE_PX,
        row.astype(np.int64),
        col.astype(np.int64),
        field.way_id[row, col],
        np.argmax(level[row, col], axis=1).astype(np.int64),
    )


@njit(cache=True)
def received_cells(level_dbm, floor_dbm, site, layer, share, found, part):  # type: ignore[no-untyped-def]
    """Write the strongest cells above the floor into ``found``, those of a site side by side.

    They are of the layer of the strongest cell, as a phone measures few cells of others. ``part``
    gets, at the last cell of each site, what :func:`distance_squared` needs, and 0 at the others.
    Returns how many cells are received.
    """
    count, serving = 0, layer[np.argmax(level_dbm)]
    for cell in range(level_dbm.size):
        level = level_dbm[cell]
        if level <= floor_dbm or layer[cell] != serving:
            continue
        place = count
        while place > 0 and level_dbm[found[place - 1]] < level:
            place -= 1
        if place >= found.size:
            continue
        count = min(count + 1, found.size)
        for other in range(count - 1, place, -1):
            found[other] = found[other - 1]
        found[place] = cell
    for i in range(1, count):
        cell, place = found[i], i
        while place > 0 and site[found[place - 1]] > site[cell]:
            found[place] = found[place - 1]
            place -= 1
        found[place] = cell
    of_site = 0
    for i in range(count):
        of_site += 1
        part[i] = 0.0
        if i == count - 1 or site[found[i + 1]] != site[found[i]]:
            part[i] = share / (1.0 - share + of_site * share)
            of_site = 0
    return count


@njit(inline="always")
def distance_squared(off_db, part, count):  # type: ignore[no-untyped-def]
    """Return x' S⁻¹ x for offsets of received cells, in units of (1 - share) · variance.

    Within a site S is, in units of the variance, (1 - share) I + share 1 1', whose inverse is known
    in closed form (Sherman and Morrison 1950).
    """
    total, of_site = 0.0, 0.0
    for i in range(count):
        total += off_db[i] * off_db[i]
        of_site += off_db[i]
        if part[i] > 0.0:
            total -= part[i] * of_site * of_site
            of_site = 0.0
    return total
