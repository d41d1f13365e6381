"""EIRP of a whole carrier, where phones report the level of one subcarrier."""

from __future__ import annotations

from mapfilter.check.findings import Findings
from mapfilter.errors import listed
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_notes import of_carriers
from mapfilter.radio.reported_power import MOST_SUBCARRIER_DBM


def check_carrier_power(plan: CellPlan, where: str, findings: Findings) -> None:
    """Check the EIRP of LTE and NR cells whose levels are predicted, or made of losses."""
    cells = of_carriers(plan)
    if cells:
        most_dbm = max(cell.eirp_dbm for cell in cells)
        evidence = (
            f"EIRP of up to {most_dbm:g} dBm for {len(cells)} of {len(plan)} cells, more than the "
            f"{MOST_SUBCARRIER_DBM:g} dBm of a subcarrier of LTE or NR."
        )
        named = f"{where}, cells {listed([cell.id for cell in cells])}"
        findings.add("eirp-of-carrier", named, evidence, "warning")
