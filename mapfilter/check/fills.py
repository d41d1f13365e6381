"""Numbers that fill large parts of rasters: no data written as a level, or levels cut off."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapfilter._types import Floats32
from mapfilter.check.findings import Findings, Severity
from mapfilter.check.samples import RasterSample
from mapfilter.errors import listed
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.files import as_stored

_LEAST_SHARE = 0.1
_TIMES_THE_NEXT = 5.0
_LEAST_PX = 400
_MOST_LOOKED_AT = 40_000
_LEAST_RASTERS = 0.3
_WEAK_DBM = -100.0


def filling_number(values: Floats32) -> tuple[float, float] | None:
    """Return the number that fills a large part of a raster, and its share; None without one.

    Levels differ from pixel to pixel: even in whole dB neighbouring numbers are about as frequent.

    Examples
    --------
    >>> levels = -100 + 10 * np.sin(np.arange(1000, dtype=np.float32))
    >>> filling_number(levels), filling_number(np.round(levels))
    (None, None)
    >>> filling_number(np.where(levels < -105, np.float32(-60), levels))
    (-60.0, 0.332)
    """
    known = values[~np.isnan(values)]
    if known.size < _LEAST_PX:
        return None
    known = known[:: -(-known.size // _MOST_LOOKED_AT)]
    numbers, counts = np.unique(known, return_counts=True)
    at = int(counts.argmax())
    share = float(counts[at] / known.size)
    next_count = np.delete(counts, at).max(initial=0)
    if numbers.size < 2 or share < _LEAST_SHARE or counts[at] < _TIMES_THE_NEXT * next_count:
        return None
    return float(numbers[at]), share


def check_fills(
    samples: Sequence[RasterSample],
    plan: CellPlan,
    factor: float,
    quantity: str,
    floor_dbm: float,
    where: str,
    findings: Findings,
) -> list[RasterSample]:
    """Find one number that fills a large part of many rasters, and return samples without it.

    It most likely means no data, or levels were cut off there. Below the floor of the database it
    does no harm, which is noted; it is a warning where levels end at it and it is weak, else an
    error.

    Parameters
    ----------
    samples : sequence of RasterSample
        Levels in dBm, or losses with a minus sign.
    factor : float
        By which stored numbers were multiplied.
    floor_dbm : float
        Of the database that is to be built.
    """
    filled = {s.cell_id: f for s in samples if (f := filling_number(s.values)) is not None}
    if not filled:
        return list(samples)
    number, count = Counter(number for number, _ in filled.values()).most_common(1)[0]
    if count < _LEAST_RASTERS * len(samples):
        return list(samples)
    having = [s for s in samples if s.cell_id in filled and filled[s.cell_id][0] == number]
    share = max(filled[s.cell_id][1] for s in having)
    eirps = [plan[s.cell_id].eirp_dbm for s in having if s.cell_id in plan]
    power_dbm = float(np.median(eirps)) if quantity == "loss" and eirps else 0.0
    level_dbm = number + power_dbm
    weakest = all(float(s.known.min()) >= number for s in having)
    severity: Severity = "error"
    if level_dbm < floor_dbm:
        severity = "note"
    elif weakest and level_dbm <= _WEAK_DBM:
        severity = "warning"
    sign = -1.0 if quantity == "loss" else 1.0
    stored = as_stored(sign * number, factor)
    unit = "dB" if quantity == "loss" else "dBm"
    evidence = (
        f"{sign * number:g} {unit} fills up to {share:.0%} of the pixels of {len(having)} of "
        f"{len(samples)} rasters; all other numbers are rare"
    )
    evidence += f". {_MEANING[severity]}"
    remedy = f"Set rasters.nodata = {stored}, the stored number, if it means no data"
    remedy += ", or export levels without a lower limit." if weakest else "."
    ids = listed([s.cell_id for s in having])
    findings.add("nodata-as-level", f"{where}, cells {ids}", evidence, severity, remedy)
    return [_without(s, number) for s in samples]


_MEANING: dict[Severity, str] = {
    "error": "A phone would be expected to receive the cell there.",
    "warning": "Levels seem to be cut off there, above the floor of the database.",
    "note": "It is below the floor of the database, so that the cell is not received there.",
}


def _without(sample: RasterSample, number: float) -> RasterSample:
    kept = np.where(sample.values == np.float32(number), np.float32(np.nan), sample.values)
    return replace(sample, values=kept.astype(np.float32))
