"""Measurements of one cell, thinned to one level per small square and session."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.radio.measurements import Measurements


@dataclass(frozen=True, eq=False)
class Points:
    """Mean level and position of a cell's readings in each square and session.

    Who stands still does not learn more than who walks on, so readings of one session in one
    square count once.

    Parameters
    ----------
    cell_id : str
    east_m, north_m, level_dbm : numpy.ndarray, shape (N,)
    session : numpy.ndarray of int, shape (N,)
    heard_at : numpy.ndarray, shape (M, 2)
        East and north of every reading behind them.
    """

    cell_id: str
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    session: Ints
    heard_at: Floats

    def __len__(self) -> int:
        return len(self.level_dbm)

    @property
    def places(self) -> Floats:
        """Positions, shape (N, 2)."""
        return np.column_stack([self.east_m, self.north_m])

    def thinned(self, most: int) -> Points:
        """Return at most so many of the points, evenly taken."""
        if len(self) <= most:
            return self
        return self.some(np.linspace(0, len(self) - 1, most).astype(np.int64))

    def some(self, kept: Ints | Bools) -> Points:
        """Return some of the points."""
        return Points(
            self.cell_id,
            self.east_m[kept],
            self.north_m[kept],
            self.level_dbm[kept],
            self.session[kept],
            self.heard_at,
        )


def points_by_cell(measurements: Measurements, square_m: float, most: int) -> dict[str, Points]:
    """Return the points of each cell that was heard.

    Parameters
    ----------
    measurements : Measurements
    square_m : float
        Side of the squares; doubled for a cell until it has at most ``most`` points.
    most : int
    """
    order = np.argsort(measurements.cell, kind="stable")
    edges = np.searchsorted(measurements.cell[order], np.arange(len(measurements.cell_ids) + 1))
    found = {}
    for i, cell_id in enumerate(measurements.cell_ids):
        own = order[edges[i] : edges[i + 1]]
        if not own.size:
            continue
        east_m, north_m = measurements.east_m[own], measurements.north_m[own]
        level_dbm, session = measurements.level_dbm[own], measurements.session[own]
        side_m = square_m
        while True:
            keys = np.column_stack(
                [session, np.floor(north_m / side_m), np.floor(east_m / side_m)]
            ).astype(np.int64)
            squares, which = np.unique(keys, axis=0, return_inverse=True)
            if len(squares) <= most:
                break
            side_m *= 2
        count = np.bincount(which)
        heard_at = np.column_stack([east_m, north_m])
        found[cell_id] = Points(
            cell_id,
            np.bincount(which, east_m) / count,
            np.bincount(which, north_m) / count,
            np.bincount(which, level_dbm) / count,
            squares[:, 0],
            heard_at,
        )
    return found
