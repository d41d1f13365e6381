"""The layers of a network: among the cells of one of them the strongest serves.

A phone compares levels within a carrier. Between carriers and technologies it goes by priorities
and thresholds that no plan states (3GPP TS 36.304, 5.2.4.5), so a carrier at 2600 MHz may serve
where one at 800 MHz is 20 dB stronger; and of other carriers it measures few neighbours, or none.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable, Sequence

import numpy as np

from mapfilter._types import Ints
from mapfilter.radio.cells import Cell, CellPlan

SHARED_CARRIER = frozenset({"UMTS", "LTE", "NR"})
"""Technologies in which cells send on one carrier, of which a network has several."""

_Network = tuple[int | None, int | None]


def layer_numbers(cells: Sequence[Cell]) -> Ints:
    """Return the number of each cell's layer, shape (C,), from 0 in the order of their first cells.

    In UMTS, LTE and NR a layer is a carrier: its number, or where that is unknown the frequency and
    the network. In GSM, where each cell has a carrier of its own, it is a network (MCC and MNC).
    Cells of unknown technology are one layer. A cell without a network is of the only one of its
    technology, and one without a carrier of the only one of its network at its frequency, if there
    is one; so all cells of a plan belong together here.

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
    networks: dict[Hashable, set[_Network]] = defaultdict(set)
    for cell in cells:
        if cell.mcc is not None and cell.mnc is not None:
            networks[cell.technology].add((cell.mcc, cell.mnc))
    bands = [
        (cell.technology, *_network(cell, networks[cell.technology]), cell.frequency_mhz)
        for cell in cells
    ]
    carriers: dict[Hashable, set[int]] = defaultdict(set)
    for cell, band in zip(cells, bands, strict=True):
        if cell.arfcn is not None:
            carriers[band].add(cell.arfcn)
    numbers: dict[Hashable, int] = {}
    keys = (_key(cell.arfcn, band, carriers[band]) for cell, band in zip(cells, bands, strict=True))
    return np.array([numbers.setdefault(key, len(numbers)) for key in keys], dtype=np.int64)


def _network(cell: Cell, known: set[_Network]) -> _Network:
    """Return a cell's network, or the only one that is known where what it states agrees."""
    if len(known) == 1:
        ((mcc, mnc),) = known
        if cell.mcc in (None, mcc) and cell.mnc in (None, mnc):
            return mcc, mnc
    return cell.mcc, cell.mnc


def _key(
    arfcn: int | None, band: tuple[str | None, int | None, int | None, float], known: set[int]
) -> tuple[Hashable, ...]:
    """Return what the cells of a layer have in common; ``known`` are the carriers in its band."""
    technology, mcc, mnc, _ = band
    if technology is None:
        return (None,)
    if technology not in SHARED_CARRIER:
        return technology, mcc, mnc
    if arfcn is None and len(known) == 1:
        (arfcn,) = known
    return band if arfcn is None else (technology, arfcn)


def layers_of(plan: CellPlan, cell_ids: Iterable[str]) -> tuple[int, ...]:
    """Return the number of the layer of each of some cells of a plan, from 0 as they come.

    Cells that the plan lacks are of a layer together.
    """
    layers = layer_numbers(plan.cells).tolist()
    layer_of = {cell.id: layer for cell, layer in zip(plan.cells, layers, strict=True)}
    numbers: dict[int, int] = {}
    return tuple(numbers.setdefault(layer_of.get(name, -1), len(numbers)) for name in cell_ids)
