"""Whether the rasters of two bands are exchanged: the higher one loses more."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from mapfilter.check.findings import Findings
from mapfilter.check.level_law import LEAST_IN_RING, LEAST_RINGS, is_macro, lobe
from mapfilter.check.plan_gain import gain_by_plan_db
from mapfilter.check.samples import RasterSample, thinned
from mapfilter.errors import listed
from mapfilter.radio.cells import Cell, CellPlan

_LOW_TO_HIGH, _SAME_WAY_DEG = 1.4, 10.0
_LEAST_PAIRS, _MOST_PAIRS = 3, 0.9
_BETTER_SHARE, _BEYOND_DB = 0.5, 8.0


def check_bands(
    samples: Sequence[RasterSample],
    plan: CellPlan,
    quantity: str,
    where: str,
    findings: Findings,
) -> None:
    """Check that of a sector's two bands the higher one loses more.

    Free space alone costs 20 dB per tenfold frequency, Okumura and Hata's cities 26 to 34. Compared
    are levels less their EIRP and the antenna's gain, over the same pixels of cells of one site,
    direction and technology. Samples are as in :func:`check_factor`.
    """
    held = {s.cell_id: s for s in samples if s.cell_id in plan and is_macro(plan[s.cell_id])}
    by_site: dict[str, list[Cell]] = {}
    for cell in plan.cells:
        if cell.id in held and (quantity == "loss" or "eirp_dbm" not in cell.assumes):
            by_site.setdefault(cell.site, []).append(cell)
    more, expected, names = list[float](), list[float](), list[str]()
    for cells in by_site.values():
        for one, other in combinations(cells, 2):
            low, high = sorted((one, other), key=lambda cell: cell.frequency_mhz)
            free_db = 20 * np.log10(high.frequency_mhz / low.frequency_mhz)
            if high.frequency_mhz < _LOW_TO_HIGH * low.frequency_mhz or not _alike(low, high):
                continue
            more_db = _more_db(held[low.id], low, held[high.id], high, losses=quantity == "loss")
            if more_db is not None:
                more.append(more_db)
                expected.append(free_db)
                names.append(f"{low.id} and {high.id}")
    if len(more) < _LEAST_PAIRS:
        return
    middle_db, usual_db = float(np.median(more)), float(np.median(expected))
    exchanged = np.array(more) < 0
    if exchanged.mean() < _MOST_PAIRS or not (
        -usual_db - _BEYOND_DB < middle_db < -_BETTER_SHARE * usual_db
    ):
        return
    ids = [name for name, wrong in zip(names, exchanged, strict=True) if wrong]
    evidence = (
        f"In {int(exchanged.sum())} of {len(more)} pairs the cell of the higher band loses less, "
        f"by {-middle_db:.0f} dB (median); in free space it loses {usual_db:.0f} dB more."
    )
    findings.add("band-labels-swapped", f"{where}, cells {listed(ids, 3)}", evidence, "warning")


def _alike(one: Cell, other: Cell) -> bool:
    if one.technology != other.technology or (one.azimuth_deg is None) != (
        other.azimuth_deg is None
    ):
        return False
    turned_deg = ((one.azimuth_deg or 0.0) - (other.azimuth_deg or 0.0) + 180.0) % 360.0 - 180.0
    return abs(turned_deg) <= _SAME_WAY_DEG


def _more_db(
    low_sample: RasterSample,
    low: Cell,
    high_sample: RasterSample,
    high: Cell,
    *,
    losses: bool,
) -> float | None:
    """Return by how much more the high band loses than the low one; the median in the lobe."""
    if low_sample.lattice != high_sample.lattice:
        return None
    low_sample, high_sample = thinned(low_sample), thinned(high_sample)
    used = lobe(low_sample, low)[1] & ~np.isnan(high_sample.values)
    if used.sum() < LEAST_RINGS * LEAST_IN_RING:
        return None
    east_m, north_m = low_sample.positions_m()
    lost = []
    for sample, cell in ((low_sample, low), (high_sample, high)):
        gain_db = gain_by_plan_db(cell, sample.lattice.crs, east_m[used], north_m[used])
        power_db = (0.0 if losses else cell.eirp_dbm) + (0.0 if gain_db is None else gain_db)
        lost.append(power_db - sample.values[used])
    return float(np.median(lost[1] - lost[0]))
