"""The gain of a cell's antenna at places, as far as the plan states it."""

from __future__ import annotations

from typing import Final

from mapfilter._types import Floats
from mapfilter.propagation.surroundings import antenna_gain_db
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import Cell

PHONE_M: Final = 1.5
"""Usual height of a phone above ground."""


def gain_by_plan_db(cell: Cell, crs: str, east_m: Floats, north_m: Floats) -> Floats | None:
    """Return the gain against the boresight in dB, 0 or less; None for a pattern file.

    Places and cell are in one CRS. Of an omnidirectional antenna the shape is ().
    """
    if cell.antenna not in ANTENNAS:
        return None
    return antenna_gain_db(cell, crs, east_m, north_m, PHONE_M, {})
