"""The layers of a network: among the cells of one of them the strongest serves.

A phone compares levels within a carrier. Between carriers and technologies it goes by priorities
and thresholds that no plan states (3GPP TS 36.304, 5.2.4.5), so a carrier at 2600 MHz may serve
where one at 800 MHz is 20 dB stronger; and of other carriers it measures few neighbours, or none.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable

import numpy as np

from mapfilter._types import Ints
from mapfilter.radio.cells import Cell, CellPlan

SHARED_CARRIER = frozenset({"UMTS", "LTE", "NR"})
"""Technologies in which cells send on one carrier, of which a network has several."""


def layer_of(cell: Cell) -> Hashable:
    """Return what the cells of a layer have in common.

    In UMTS, LTE and NR that is the carrier: its number, or where that is unknown the frequency and
    the operator. In GSM, where each cell has a carrier of its own, it is the operator. Cells of
    unknown technology are one layer.
    """
    technology = cell.technology
    if technology in SHARED_CARRIER and cell.arfcn is not None:
        return technology, cell.arfcn
    if technology in SHARED_CARRIER:
        return technology, cell.mcc, cell.mnc, cell.frequency_mhz
    return technology if technology is None else (technology, cell.mcc, cell.mnc)


def layer_numbers(cells: Iterable[Cell]) -> Ints:
    """Return the number of each cell's layer, shape (C,), from 0 in the order of their first cells.

    Examples
    --------
    >>> where = {"site": "S", "east_m": 0.0, "north_m": 0.0, "height_m": 30.0, "azimuth_deg": None}
    >>> low, high = (
    ...     Cell(id=name, eirp_dbm=30.0, frequency_mhz=mhz, technology="LTE", arfcn=arfcn, **where)
    ...     for name, mhz, arfcn in (("L08", 806.0, 6300), ("L26", 2650.0, 3050))
    ... )
    >>> layer_numbers([low, high, low]).tolist()
    [0, 1, 0]
    """
    numbers: dict[Hashable, int] = {}
    return np.array([numbers.setdefault(layer_of(cell), len(numbers)) for cell in cells], np.int64)


def layers_of(plan: CellPlan, cell_ids: Iterable[str]) -> tuple[int, ...]:
    """Return the number of the layer of each of some cells of a plan.

    Cells that the plan lacks are of a layer together.
    """
    known = {cell.id: cell for cell in plan.cells}
    numbers: dict[Hashable, int] = {}
    keys = (layer_of(known[name]) if name in known else "unknown" for name in cell_ids)
    return tuple(numbers.setdefault(key, len(numbers)) for key in keys)
