"""The exact nearest point of one cell's set, for one position or for many at once.

Points are pixel centres of a lattice, so no tree is needed: the set is kept by rows, and the search
goes outwards row by row and ends when no nearer row is possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from mapfilter._types import Floats, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.lattice import Lattice


@dataclass(frozen=True, slots=True, eq=False)
class CellPointIndex:
    """Exact search for the nearest point; made by :meth:`of_points`.

    Of several points at the same distance the *last* in row-major order wins. A stable ascending
    sort by the weight 1/distance leaves that one last, which is the one that Khalaf-Allah (2007,
    Table 2, lines 13-16) takes.

    Parameters
    ----------
    east_m, north_m : numpy.ndarray, shape (N,)
        The points, centres of the lattice's pixels in row-major order.
    row_start : numpy.ndarray of int64, shape (row_span + 1,)
        Where each row's points begin, counted from ``first_row``, the northernmost with a point.
    col : numpy.ndarray of int64, shape (N,)
        The points' columns, ascending within each row.

    Examples
    --------
    >>> lattice = Lattice("EPSG:32629", 0.0, 20.0, 5.0, 4, 4)
    >>> index = CellPointIndex.of_points(lattice, [0, 0, 3], [0, 2, 1])
    >>> which, distance_m = index.nearest([2.5, 7.5, 7.5], [17.5, 17.5, 2.5])
    >>> which.tolist(), distance_m.tolist()
    ([0, 1, 2], [0.0, 5.0, 0.0])
    """

    lattice: Lattice
    east_m: Floats
    north_m: Floats
    row_start: Ints
    col: Ints
    first_row: int

    @classmethod
    def of_points(cls, lattice: Lattice, row: ArrayLike, col: ArrayLike) -> CellPointIndex:
        """Index lattice points given as rows and columns in strictly ascending row-major order.

        Raises
        ------
        InputError
            The lengths differ, a point is off the lattice, or they are not in row-major order.
        """
        rows, cols = np.asarray(row, dtype=np.int64), np.asarray(col, dtype=np.int64)
        if rows.ndim != 1 or rows.shape != cols.shape:
            got = f"{rows.shape} and {cols.shape}"
            raise fail(InputError, "points", "as many rows as columns", got)
        faults = Faults()
        if not np.all(lattice.contains(rows, cols)):
            faults.add("points", "rows and columns on the lattice", "some off the lattice")
        if np.any(np.diff(rows * lattice.cols + cols) <= 0):
            faults.add("points", "strictly ascending row-major order", "another order")
        faults.raise_if_any(InputError)
        east, north = lattice.east_north(rows, cols)
        first, last = (int(rows[0]), int(rows[-1])) if rows.size else (0, -1)
        start = np.searchsorted(rows, np.arange(first, last + 2)).astype(np.int64)
        return cls(lattice, east, north, start, cols, first)

    def __len__(self) -> int:
        return self.col.size

    def nearest(
        self, east_m: ArrayLike, north_m: ArrayLike, max_distance_m: float = np.inf
    ) -> tuple[Ints, Floats]:
        """Return the nearest point of each position, on the lattice or off it, and its distance.

        Points are row-major ranks; -1, at infinite distance, where there is none within
        ``max_distance_m`` or the position is not finite. Both results have the shape (M,).
        """
        return _nearest(
            np.atleast_1d(np.asarray(east_m, dtype=np.float64)),
            np.atleast_1d(np.asarray(north_m, dtype=np.float64)),
            float(max_distance_m),
            self.lattice.west_m,
            self.lattice.north_m,
            self.lattice.resolution_m,
            self.row_start,
            self.col,
            self.first_row,
        )


@njit(cache=True)
def _nearest_in_row(
    east: float, col: Ints, low: int, high: int, west: float, resolution: float
) -> tuple[int, float]:  # pragma: no cover
    """Return the nearest of ``col[low:high]`` (not empty) and its distance along the row."""
    target = (east - west) / resolution - 0.5
    begin, end = low, high
    while low < high:
        middle = (low + high) // 2
        if col[middle] <= target:
            low = middle + 1
        else:
            high = middle
    # The answer is one of the two neighbours of the position; the right one wins a tie.
    right = np.inf
    if low < end:
        right = abs(east - (west + (col[low] + 0.5) * resolution))
    if low > begin:
        left = abs(east - (west + (col[low - 1] + 0.5) * resolution))
        if left < right:
            return low - 1, left
    return low, right


@njit(cache=True)
def _nearest(
    east_m: Floats,
    north_m: Floats,
    max_distance_m: float,
    west: float,
    north_edge: float,
    resolution: float,
    row_start: Ints,
    col: Ints,
    first_row: int,
) -> tuple[Ints, Floats]:  # pragma: no cover
    count = east_m.size
    span = row_start.size - 1
    index = np.full(count, -1, dtype=np.int64)
    distance = np.full(count, np.inf)
    for i in range(count):
        east, north = east_m[i], north_m[i]
        if not (np.isfinite(east) and np.isfinite(north)):
            continue
        # Clipped as a float: a position far off the lattice would overflow an integer.
        offset = (north_edge - north) / resolution - 0.5 - first_row
        below = int(min(max(np.ceil(offset), 0.0), float(span)))
        best, best_square = -1, max_distance_m * max_distance_m
        for away in range(span):
            reached = False
            for row in (below + away, below - 1 - away):
                if not 0 <= row < span:
                    continue
                dy = north - (north_edge - (first_row + row + 0.5) * resolution)
                if dy * dy > best_square:
                    continue
                reached = True
                low, high = row_start[row], row_start[row + 1]
                if low < high:
                    which, dx = _nearest_in_row(east, col, low, high, west, resolution)
                    square = dx * dx + dy * dy
                    if square < best_square or (square == best_square and which > best):
                        best, best_square = which, square
            if not reached:
                # Every row farther out is farther still.
                break
        if best >= 0:
            index[i], distance[i] = best, np.sqrt(best_square)
    return index, distance
