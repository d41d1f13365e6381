"""What is known of the tiles of a large area: their points, the cells that reach them, levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mapfilter._types import Bools, Floats, Floats32, Ints
from mapfilter.database.cell_levels import CellLevels, NearestPoints
from mapfilter.models.tile_kernels import level_ranges


class LevelRange(NamedTuple):
    """Least and largest level of a cell in some tiles, (rows, cols); NaN where it has none.

    ``row`` and ``col`` are those of the first tile.
    """

    row: int
    col: int
    least_dbm: Floats32
    most_dbm: Floats32


@dataclass(frozen=True, slots=True, eq=False)
class Tile:
    """A tile of an area.

    Parameters
    ----------
    points : NearestPoints
        Of a window that reaches beyond the tile by the width of the roughness.
    row, col : ndarray of int64, shape (M,)
        The points of the database that lie in the tile itself.
    box : tuple of int
        First and last row, first and last column of all nearest points.
    """

    points: NearestPoints
    row: Ints
    col: Ints
    box: tuple[int, int, int, int]

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return self.points.nbytes + self.row.nbytes + self.col.nbytes

    @property
    def corner(self) -> tuple[int, int]:
        """Row and column of the first pixel of the arrays."""
        return self.points.window[0], self.points.window[1]


class Reaching(NamedTuple):
    """The cells that may have a level in a tile, ascending, (C,), and a bound of these levels.

    The bound is by the footers of the parts until it is ``exact``. ``part`` (C) are the parts of
    each cell, by their places among the extents.
    """

    band: Ints
    bound_dbm: Floats
    exact: Bools
    part: tuple[Ints, ...]

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(one.nbytes for one in (self.band, self.bound_dbm, self.exact, *self.part))


def level_range(
    parts: Sequence[CellLevels], area_cols: int, side: int, rows: int, cols: int
) -> LevelRange:
    """Return the least and the largest level of a cell in each tile.

    Parameters
    ----------
    parts : sequence of CellLevels
        All of the cell.
    area_cols : int
        Columns of the area's lattice.
    side : int
        Of a tile, pixels.
    rows, cols : int
        Of tiles.
    """
    found = [level_ranges(*part, area_cols, side, cols, rows * cols) for part in parts]
    leasts, mosts = zip(*found, strict=True)
    least = np.fmin.reduce(leasts).reshape(rows, cols)
    most = np.fmax.reduce(mosts).reshape(rows, cols)
    row, col = np.nonzero(np.isfinite(most))
    part = np.s_[row.min() : row.max() + 1, col.min() : col.max() + 1]
    return LevelRange(int(row.min()), int(col.min()), least[part].copy(), most[part].copy())
