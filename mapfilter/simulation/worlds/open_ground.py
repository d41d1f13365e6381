"""Ground on which one can walk although no way is mapped: all but buildings and water."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.lattice import Lattice


@dataclass(frozen=True, eq=False)
class OpenGround:
    """Where neither a building nor water is.

    Parameters
    ----------
    lattice : Lattice
    open : (rows, cols) array of bool
        Squares, parks, courtyards, car parks, streets, bridges.
    built : (rows, cols) array of bool
        Buildings.
    """

    lattice: Lattice
    open: Bools
    built: Bools

    def is_open(self, east_m: Floats, north_m: Floats) -> Bools:
        """Return which positions are open; none outside the lattice."""
        return self._look_up(self.open, east_m, north_m)

    def is_built(self, east_m: Floats, north_m: Floats) -> Bools:
        """Return which positions are inside a building; none outside the lattice."""
        return self._look_up(self.built, east_m, north_m)

    def _look_up(self, mask: Bools, east_m: Floats, north_m: Floats) -> Bools:
        row, col = self.lattice.row_col(east_m, north_m)
        there = self.lattice.contains(row, col)
        return np.asarray(mask[np.where(there, row, 0), np.where(there, col, 0)] & there)
