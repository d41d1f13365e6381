"""Cells so far from an area that none of them is received there."""

from __future__ import annotations

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice, outside_m
from mapfilter.radio.cells import CellPlan

_FARTHEST_M = 50_000.0
"""No cell is received from farther away."""
_NAMED = 3


def check_cells_near(plan: CellPlan, lattice: Lattice, where: str) -> None:
    """Check that no cell lies more than 50 km outside an area.

    Parameters
    ----------
    plan : CellPlan
        In the CRS of the lattice.
    where : str
        What messages call the plan.

    Raises
    ------
    InputError
        Some do; one fault for all of them.
    """
    east_m = np.array([cell.east_m for cell in plan.cells])
    north_m = np.array([cell.north_m for cell in plan.cells])
    away_m = outside_m(east_m, north_m, lattice)
    far = np.flatnonzero(away_m > _FARTHEST_M)
    if not far.size:
        return
    named = ", ".join(plan.ids[index] for index in far[:_NAMED])
    more = f" and {far.size - _NAMED} more" if far.size > _NAMED else ""
    got = f"{far.size} of {len(plan)} up to {away_m.max() / 1000:.0f} km off ({named}{more})"
    swapped = outside_m(north_m[far], east_m[far], lattice).min() <= _FARTHEST_M
    hint = "east and north swapped" if swapped else "a CRS of another zone, or swapped coordinates"
    expected = f"cells within {_FARTHEST_M / 1000:.0f} km of the area"
    raise fail(InputError, where, expected, got, hint)
