"""Measured levels by cell, as means over squares: what a survey is fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.survey.measurements import Measurements


@dataclass(frozen=True, eq=False)
class Points:
    """Mean level and position of a cell's readings in each square and session, shape (N,) each.

    Readings of one session in one square count once, however long it stood still there.
    ``measured_at``, shape (M, 2), is east and north of every reading.
    """

    cell_id: str
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    session: Ints
    measured_at: Floats

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
        columns = self.east_m[kept], self.north_m[kept], self.level_dbm[kept], self.session[kept]
        return Points(self.cell_id, *columns, self.measured_at)


def points_by_cell(measurements: Measurements, square_m: float, most: int) -> dict[str, Points]:
    """Return the points of each cell that was received.

    The side of the squares is doubled for a cell until it has at most ``most`` points.
    """
    order = np.argsort(measurements.cell, kind="stable")
    edges = np.searchsorted(measurements.cell[order], np.arange(len(measurements.cell_ids) + 1))
    found = {}
    for i, cell_id in enumerate(measurements.cell_ids):
        own = order[edges[i] : edges[i + 1]]
        if not own.size:
            continue
        columns = measurements.east_m, measurements.north_m, measurements.level_dbm
        east_m, north_m, level_dbm = (column[own] for column in columns)
        side_m = square_m
        while True:
            keys = [
                measurements.session[own],
                np.floor(north_m / side_m),
                np.floor(east_m / side_m),
            ]
            table = np.column_stack(keys).astype(np.int64)
            squares, which = np.unique(table, axis=0, return_inverse=True)
            if len(squares) <= most:
                break
            side_m *= 2
        count = np.bincount(which)
        found[cell_id] = Points(
            cell_id,
            np.bincount(which, east_m) / count,
            np.bincount(which, north_m) / count,
            np.bincount(which, level_dbm) / count,
            squares[:, 0],
            np.column_stack([east_m, north_m]),
        )
    return found
