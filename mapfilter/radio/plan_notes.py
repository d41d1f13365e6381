"""Notes on a plan: usual values, powers that phones do not report, and layers."""

from __future__ import annotations

from collections import Counter

from mapfilter._words import number_of
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.layers import SHARED_CARRIER, layer_numbers
from mapfilter.radio.reported_power import MOST_SUBCARRIER_DBM

_SUBCARRIERS = ("LTE", "NR")
"""Technologies whose phones report the power of one subcarrier."""


_SAME_BAND, _SOME = 1.15, 3
"""Frequencies within this factor are of one band; with fewer cells each may have a carrier."""


def layer_notes(plan: CellPlan) -> tuple[str, ...]:
    """Return notes on the layers of a network; none where all cells are of one, in one band."""
    notes: list[str] = []
    layers = layer_numbers(plan.cells).tolist()
    counts, own = Counter(layers), dict(zip(plan.ids, layers, strict=True))
    if len(counts) > 1:
        notes.append(
            f"{len(counts)} layers (carriers of UMTS, LTE and NR, networks of GSM): a serving cell "
            "is compared with cells of its own layer, also where those of others are stronger"
        )
    for technology in sorted(SHARED_CARRIER):
        cells = [cell for cell in plan.cells if cell.technology == technology]
        if len(cells) >= _SOME and max(counts[own[cell.id]] for cell in cells) == 1:
            notes.append(
                f"each of {len(cells)} cells of {technology} has a carrier (arfcn, or else "
                "frequency_mhz) of its own, so a serving cell is compared with none: cells of one "
                "carrier have the same number"
            )
    unknown = sorted(cell.frequency_mhz for cell in plan.cells if cell.technology is None)
    if unknown and unknown[-1] > _SAME_BAND * unknown[0]:
        notes.append(
            f"technology of {number_of(len(unknown), 'cell')} is unknown, at {unknown[0]:g} to "
            f"{unknown[-1]:g} MHz: the strongest of them is expected to serve. Where bands have "
            "priorities, as in LTE, state technology (and earfcn)"
        )
    return tuple(notes)


def assumed_notes(plan: CellPlan) -> tuple[str, ...]:
    """Return a note on the cells whose fields hold usual values; none where all are known."""
    counts = Counter(name for cell in plan.cells for name in cell.assumes)
    if not counts:
        return ()
    named = ", ".join(f"{name} of {count}" for name, count in sorted(counts.items()))
    return (f"usual values for what the plan lacks, so levels err by more: {named} cells",)


def of_carriers(plan: CellPlan) -> list[Cell]:
    """Return the cells of LTE and NR whose power is that of a whole carrier."""
    return [
        cell
        for cell in plan.cells
        if cell.technology in _SUBCARRIERS and cell.eirp_dbm > MOST_SUBCARRIER_DBM
    ]


def carrier_notes(plan: CellPlan) -> tuple[str, ...]:
    """Return a note on the cells whose power is that of a whole carrier; none without any."""
    carriers = of_carriers(plan)
    if not carriers:
        return ()
    return (
        f"eirp_dbm of {number_of(len(carriers), 'cell')} is that of a carrier: more than "
        f"{MOST_SUBCARRIER_DBM:g} dBm. Phones report one subcarrier of LTE and NR, "
        "28 to 35 dB less, and predicted levels are too high by that",
    )
