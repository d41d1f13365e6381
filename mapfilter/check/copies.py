"""Checks that no raster is a copy of another cell's."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

import numpy as np

from mapfilter.check.findings import Findings
from mapfilter.check.plan_gain import gain_by_plan_db
from mapfilter.check.samples import RasterSample
from mapfilter.errors import listed
from mapfilter.lattice import Lattice
from mapfilter.propagation.surroundings import pixels_m
from mapfilter.radio.cells import Cell, CellPlan

_SAME_PLACE_M = 1.0
_SAME_DB = 0.5
"""Rasters in whole dB hide so much, and a copy that is no more off does no harm."""

_pattern = attrgetter(
    "antenna",
    "azimuth_deg",
    "downtilt_deg",
    "mechanical_downtilt_deg",
    "beamwidth_deg",
    "max_attenuation_db",
    "vertical_beamwidth_deg",
    "side_lobe_db",
)


def check_copies(
    samples: Sequence[RasterSample],
    plan: CellPlan | None,
    quantity: str,
    where: str,
    findings: Findings,
) -> None:
    """Find rasters that are equal though the plan's cells are not.

    By the plan, levels are equal of carriers of one sector in one band, and of sectors of one site
    that are both received at the largest attenuation of their antennas all over the area. The plan
    is in the CRS of the rasters.
    """
    by_sum: dict[tuple[str, Lattice], list[str]] = {}
    for sample in samples:
        by_sum.setdefault((sample.checksum, sample.lattice), []).append(sample.cell_id)
    for (_, lattice), same in by_sum.items():
        if len(same) < 2 or (plan is not None and _are_alike(same, plan, lattice, quantity)):
            continue
        evidence = f"The same numbers in all pixels of {len(same)} rasters."
        findings.add("identical-rasters", f"{where}, cells {listed(same)}", evidence)


def _are_alike(ids: Sequence[str], plan: CellPlan, lattice: Lattice, quantity: str) -> bool:
    if not all(cell_id in plan for cell_id in ids):
        return False
    first, *others = (plan[cell_id] for cell_id in ids)
    return all(_difference_db(first, other, lattice, quantity) <= _SAME_DB for other in others)


def _difference_db(one: Cell, other: Cell, lattice: Lattice, quantity: str) -> float:
    """Return by how much rasters of two cells differ at most by the plan.

    Infinity for other places, heights and surroundings, and where patterns are not known.
    """
    apart_m = np.hypot(one.east_m - other.east_m, one.north_m - other.north_m)
    if max(apart_m, abs(one.height_m - other.height_m)) > _SAME_PLACE_M:
        return np.inf
    if one.indoor != other.indoor:
        return np.inf
    steady_db = 20 * np.log10(other.frequency_mhz / one.frequency_mhz)
    if quantity == "level":
        steady_db += one.eirp_dbm - other.eirp_dbm
    if one.indoor:
        steady_db += other.penetration_loss_db - one.penetration_loss_db
    if _pattern(one) == _pattern(other):
        return float(abs(steady_db))
    place_m = lattice.crs, *pixels_m(lattice)
    one_db, other_db = gain_by_plan_db(one, *place_m), gain_by_plan_db(other, *place_m)
    if one_db is None or other_db is None:
        return np.inf
    return float(np.abs(steady_db + one_db - other_db).max())
