"""Whether rasters hold what they should: levels or losses of the cells of the plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import rasterio
from rasterio.errors import RasterioError

from mapfilter.check.findings import Findings, listed
from mapfilter.check.lobes import falls_with_distance
from mapfilter.check.plausibility import (
    Kind,
    RasterSample,
    kind_of,
    nodata_taken_as_level,
    sample_raster,
)
from mapfilter.errors import InputError
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.rxlev_rasters import RxLevRasters

_MISREAD: dict[tuple[str, Kind], str] = {
    ("level", "loss"): "loss-as-level",
    ("level", "rxlev"): "rxlev-as-level",
    ("loss", "level"): "level-as-loss",
    ("loss", "rxlev"): "rxlev-as-loss",
    ("level", "unclear"): "values-implausible",
    ("loss", "unclear"): "values-implausible",
}
_FALLS = 0.3


def is_surveyed(rasters: RxLevRasters) -> bool:
    """Tell whether rasters were made of measurements, not predicted."""
    if not rasters.path.is_file():
        return False
    try:
        with rasterio.open(rasters.path) as source:
            return str(source.tags().get("MODEL", "")).startswith("survey")
    except RasterioError:
        return False


def check_ids(rasters: RxLevRasters, plan: CellPlan, where: str, findings: Findings) -> None:
    """See that rasters and plan hold the same cells."""
    held = set(rasters.cell_ids)
    missing = [cell_id for cell_id in plan.ids if cell_id not in held]
    unknown = [cell_id for cell_id in rasters.cell_ids if cell_id not in plan]
    if missing:
        evidence = f"{len(missing)} of {len(plan)} cells have no raster: {listed(missing)}."
        findings.add("cell-without-raster", f"{where} and {rasters.path}", evidence)
    if unknown:
        evidence = f"{len(unknown)} of {len(held)} rasters have no cell: {listed(unknown)}."
        findings.add("raster-without-cell", f"{rasters.path} and {where}", evidence)


def sampled(rasters: RxLevRasters, plan: CellPlan | None, findings: Findings) -> list[RasterSample]:
    """Read a sample of each raster, and see that its numbers are what they are said to be.

    Returns
    -------
    list of RasterSample
        Levels, or losses with a minus sign, without what stands for no data; those of rasters
        without anything to look at are left out.
    """
    kinds: dict[Kind, list[RasterSample]] = {}
    nodata: list[tuple[str, float, float]] = []
    constant, empty = [], []
    for cell_id in rasters.cell_ids:
        cell = plan[cell_id] if plan is not None and cell_id in plan else None
        try:
            sample = sample_raster(rasters, cell_id, cell)
        except InputError as error:
            findings.add_faults(error, "rasters-invalid")
            continue
        if (taken := nodata_taken_as_level(sample.values)) is not None:
            nodata.append((cell_id, *taken))
            kept = np.where(sample.values == np.float32(taken[0]), np.nan, sample.values)
            sample = replace(sample, values=kept.astype(np.float32))
            if not sample.known.size:
                continue
        kind = kind_of(sample.values)
        if not sample.known.size:
            empty.append(cell_id)
        elif np.ptp(sample.known) == 0:
            constant.append(f"{cell_id} {sample.known[0]:g}")
        else:
            kinds.setdefault(kind, []).append(sample)
    where = str(rasters.path)
    if nodata:
        worst = max(nodata, key=lambda one: one[2])
        ids = listed([one[0] for one in nodata])
        evidence = f"{worst[1]:g} stands in up to {worst[2]:.1%} of the pixels, as a number."
        findings.add("nodata-as-level", f"{where}, cells {ids}", evidence)
    if empty:
        findings.add(
            "raster-empty", f"{where}, cells {listed(empty)}", "No pixel has data.", "warning"
        )
    if constant:
        evidence = f"One number in all pixels: {listed(constant)}."
        findings.add("raster-constant", where, evidence)
    useful: list[RasterSample] = []
    for kind, samples in kinds.items():
        _check_identical(samples, where, findings)
        falls = kind == "loss" and _falls_away(samples, plan)
        _check_kind(rasters, kind, samples, findings, falls=falls)
        negative = kind == "loss" and not falls
        useful += [replace(s, values=-s.values) for s in samples] if negative else samples
    return useful


def _check_kind(
    rasters: RxLevRasters,
    kind: Kind,
    samples: Sequence[RasterSample],
    findings: Findings,
    *,
    falls: bool,
) -> None:
    code = "field-strength" if falls else _MISREAD.get((rasters.quantity, kind))
    if code is None:
        return
    numbers = np.concatenate([sample.known for sample in samples])
    low, middle, high = np.percentile(numbers, [1, 50, 99])
    evidence = (
        f"Declared {rasters.quantity}; {len(samples)} of {len(rasters.cell_ids)} rasters hold "
        f"{low:.5g}..{high:.5g}, median {middle:.5g}"
    )
    evidence += ", which become less away from the sites." if falls else "."
    ids = listed([sample.cell_id for sample in samples])
    findings.add(code, f"{rasters.path}, cells {ids}", evidence)


def _falls_away(samples: Sequence[RasterSample], plan: CellPlan | None) -> bool:
    """Tell whether numbers above 0 fall with the distance, as no path loss does."""
    if plan is None:
        return False
    known = [(s, plan[s.cell_id]) for s in samples if s.cell_id in plan]
    falls = [falls_with_distance(s, cell.east_m, cell.north_m) for s, cell in known]
    return bool(falls) and float(np.median(falls)) > _FALLS


def _check_identical(samples: Sequence[RasterSample], where: str, findings: Findings) -> None:
    by_sum: dict[str, list[str]] = {}
    for sample in samples:
        by_sum.setdefault(f"{sample.checksum} {sample.lattice!r}", []).append(sample.cell_id)
    for ids in by_sum.values():
        if len(ids) > 1:
            evidence = f"The same numbers in all pixels of {len(ids)} rasters."
            findings.add("identical-rasters", f"{where}, cells {listed(ids)}", evidence)
