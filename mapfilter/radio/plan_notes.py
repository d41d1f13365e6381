"""Notes on a plan: fields that hold usual values, and powers that phones do not report."""

from __future__ import annotations

from collections import Counter

from mapfilter._words import number_of
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.reported_power import MOST_SUBCARRIER_DBM

_SUBCARRIERS = ("LTE", "NR")
"""Technologies whose phones report the power of one subcarrier."""


def assumed_notes(plan: CellPlan) -> tuple[str, ...]:
    """Return a note on the cells whose fields hold usual values; none where all are known."""
    counts = Counter(name for cell in plan.cells for name in cell.assumes)
    if not counts:
        return ()
    named = ", ".join(f"{name} of {count}" for name, count in sorted(counts.items()))
    return (f"usual values for what the plan lacks, so levels err by more: {named} cells",)


def carrier_notes(plan: CellPlan) -> tuple[str, ...]:
    """Return a note on the cells whose power is that of a whole carrier; none without any."""
    carriers = [
        cell
        for cell in plan.cells
        if cell.technology in _SUBCARRIERS and cell.eirp_dbm > MOST_SUBCARRIER_DBM
    ]
    if not carriers:
        return ()
    return (
        f"eirp_dbm of {number_of(len(carriers), 'cell')} is that of a carrier: more than "
        f"{MOST_SUBCARRIER_DBM:g} dBm. Phones report one subcarrier of LTE and NR, "
        "28 to 35 dB less, and predicted levels are too high by that",
    )
