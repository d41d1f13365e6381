"""Checks of raster values: quantity, nodata, constants, copies, and the cells of the plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from rasterio.errors import RasterioError

from mapfilter._gdal import open_raster
from mapfilter._types import Floats32
from mapfilter.check.copies import check_copies
from mapfilter.check.findings import Findings
from mapfilter.check.plan_gain import PHONE_M
from mapfilter.check.samples import RasterSample, sample_raster
from mapfilter.errors import Fault, InputError, listed
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.files import as_stored, check_plausible
from mapfilter.rasters.raster_set import RxLevRasters, in_other_case

Kind = Literal["level", "loss", "rxlev", "empty", "unclear"]

_HIGHEST_RXLEV = 63
_LEAST_LOSS_DB = 20.0
_NO_LEVEL_BELOW = -300.0
_MOST_SHARE = 0.5
_NEAREST_RING_M = 64.0
_LEAST_IN_RING = 50


def kind_of(values: Floats32) -> Kind:
    """Return what numbers most likely are; NaN is ignored.

    Levels (dBm) are mostly below 0, path losses (dB) mostly above 20, and raw RXLEV are whole
    numbers in 0..63 (3GPP TS 45.008, 8.1.4).

    Examples
    --------
    >>> kind_of(np.float32([-60.5, -101.2])), kind_of(np.float32([88.1, 120.4]))
    ('level', 'loss')
    >>> kind_of(np.float32([0, 17, 63])), kind_of(np.float32([np.nan]))
    ('rxlev', 'empty')
    """
    known = values[np.isfinite(values)]
    known = known[(known >= _NO_LEVEL_BELOW) & (known <= -_NO_LEVEL_BELOW)]
    if not known.size:
        return "empty"
    if (known < 0).mean() > _MOST_SHARE:
        return "level"
    whole = bool((known == np.round(known)).all())
    if whole and known.min() >= 0 and known.max() <= _HIGHEST_RXLEV:
        return "rxlev"
    return "loss" if np.median(known) > _LEAST_LOSS_DB else "unclear"


def falls_with_distance(sample: RasterSample, east_m: float, north_m: float) -> float:
    """Return the correlation of levels with minus the logarithm of the distance from a place.

    1 is a raster that falls off evenly around it; 0 where nothing is known.
    """
    east, north = sample.positions_m()
    known = ~np.isnan(sample.values)
    value = sample.values[known].astype(np.float64)
    least_m = sample.lattice.resolution_m
    far = -np.log10(np.maximum(np.hypot(east - east_m, north - north_m)[known], least_m))
    if value.size < 2 or np.ptp(value) == 0 or np.ptp(far) == 0:
        return 0.0
    return float(np.corrcoef(value, far)[0, 1])


def above_free_space_db(sample: RasterSample, cell: Cell) -> float:
    """Return by how much levels in the main lobe exceed those of free space.

    Levels of ``EIRP - 32.44 - 20 log10(d / km) - 20 log10(f / MHz)`` (Friis 1946; ITU-R P.525) are
    exceeded here and there by reflections and shadowing, but by the median of a whole ring about
    the site only where the EIRP is another. Rings are octaves of the distance from 64 m on, as
    obstacles cost the less the nearer they are; the one that exceeds most counts. Minus infinity
    where too few pixels are to be seen.
    """
    ground_m, azimuth_deg = sample.seen_from(cell.east_m, cell.north_m)
    used = ~np.isnan(sample.values) & (ground_m >= _NEAREST_RING_M)
    if cell.azimuth_deg is not None:
        off_deg = (azimuth_deg - cell.azimuth_deg + 180.0) % 360.0 - 180.0
        used &= np.abs(off_deg) <= cell.beamwidth_deg / 2
    ground_m = ground_m[used]
    distance_km = np.hypot(ground_m, cell.height_m - PHONE_M) / 1000
    loss_db = 32.44 + 20 * np.log10(distance_km) + 20 * np.log10(cell.frequency_mhz)
    above_db = sample.values[used] - cell.eirp_dbm + loss_db
    ring = np.log2(ground_m).astype(np.int64)
    rings = (above_db[ring == number] for number in np.unique(ring))
    medians_db = [float(np.median(some)) for some in rings if some.size >= _LEAST_IN_RING]
    return max(medians_db, default=-np.inf)


_FALLS = 0.3
_TOO_SMALL_DB = 10.0


def is_surveyed(rasters: RxLevRasters) -> bool:
    """Return whether rasters were made of measurements, not predicted."""
    if not rasters.path.is_file():
        return False
    try:
        with open_raster(rasters.path) as source:
            return str(source.tags().get("MODEL", "")).startswith("survey")
    except (RasterioError, InputError):
        return False


def check_ids(rasters: RxLevRasters, plan: CellPlan, where: str, findings: Findings) -> None:
    """Check that rasters and plan hold the same cells."""
    held = set(rasters.cell_ids)
    missing = [cell_id for cell_id in plan.ids if cell_id not in held]
    unknown = [cell_id for cell_id in rasters.cell_ids if cell_id not in plan]
    cased = in_other_case(unknown, missing)
    if missing:
        evidence = f"{len(missing)} of {len(plan)} cells have no raster: {listed(missing)}."
        evidence += f" {cased[:1].upper()}{cased[1:]}." if cased else ""
        findings.add("cell-without-raster", f"{where} and {rasters.path}", evidence)
    if unknown:
        evidence = f"{len(unknown)} of {len(held)} rasters have no cell: {listed(unknown)}."
        findings.add("raster-without-cell", f"{rasters.path} and {where}", evidence)


def sampled(
    rasters: RxLevRasters, plan: CellPlan | None, tile_px: int, findings: Findings
) -> list[RasterSample]:
    """Read a sample of each raster, and check that its numbers are of the declared kind.

    Parameters
    ----------
    tile_px : int
        Side of the tiles that a build looks at one by one.

    Returns
    -------
    list of RasterSample
        Levels, or losses with a minus sign; those of rasters without anything to look at, beyond
        what the quantity can be, or with a number that means no data, are left out.
    """
    kinds: dict[Kind, list[RasterSample]] = {}
    beyond: dict[tuple[str, str], list[RasterSample]] = {}
    nodata: list[tuple[str, float, float]] = []
    constant, empty = [], []
    for cell_id in rasters.cell_ids:
        cell = plan[cell_id] if plan is not None and cell_id in plan else None
        try:
            sample = sample_raster(rasters, cell_id, cell)
        except InputError as error:
            findings.add_faults(error, "rasters-invalid")
            continue
        if sample.nodata is not None:
            nodata.append((cell_id, *sample.nodata))
            kept = np.where(sample.values == np.float32(sample.nodata[0]), np.nan, sample.values)
            sample = replace(sample, values=kept.astype(np.float32))
            if not sample.known.size:
                continue
        kind = kind_of(sample.values)
        if not sample.known.size:
            empty.append(cell_id)
        elif np.ptp(sample.known) == 0:
            constant.append(f"{cell_id} {sample.known[0]:g}")
        elif (fault := _beyond(sample, rasters, kind, tile_px)) is not None:
            beyond.setdefault((fault.expected, fault.hint), []).append(sample)
        else:
            kinds.setdefault(kind, []).append(sample)
    where = str(rasters.path)
    if nodata:
        worst = max(nodata, key=lambda one: one[2])
        ids = listed([one[0] for one in nodata])
        share = f"{worst[2]:.1%}" if worst[2] >= 0.01 else f"{100 * worst[2]:.2g} %"
        number = as_stored(worst[1], rasters.factor)
        evidence = f"{number} stands in up to {share} of the pixels, as a number."
        findings.add("nodata-as-level", f"{where}, cells {ids}", evidence)
    if empty:
        cells = f"{where}, cells {listed(empty)}"
        findings.add("raster-empty", cells, "No pixel has data.", "warning")
    if constant:
        evidence = f"One number in all pixels: {listed(constant)}."
        findings.add("raster-constant", where, evidence)
    for (expected, hint), samples in beyond.items():
        low = min(float(sample.known.min()) for sample in samples)
        high = max(float(sample.known.max()) for sample in samples)
        evidence = (
            f"Expected {expected}; {len(samples)} of {len(rasters.cell_ids)} rasters hold "
            f"{low:.5g}..{high:.5g}"
        )
        evidence += f" ({hint})." if hint else "."
        ids = listed([sample.cell_id for sample in samples])
        findings.add("values-implausible", f"{where}, cells {ids}", evidence)
    useful: list[RasterSample] = []
    marked = {one[0] for one in nodata}
    for kind, samples in kinds.items():
        check_copies(samples, plan, rasters.quantity, where, findings)
        falls = kind == "loss" and _falls_away(samples, plan)
        below_db = 0.0 if falls or kind != "loss" else _below_free_space_db(samples, plan)
        unsigned = below_db > _TOO_SMALL_DB
        if falls or unsigned or kind not in (rasters.quantity, "empty"):
            code = "field-strength" if falls else f"{kind}-as-{rasters.quantity}"
            code = "levels-without-sign" if unsigned else code
            # A negative factor turns levels into what looks like losses, and losses into levels.
            if kind == "unclear" or (rasters.factor < 0 and kind in ("level", "loss")):
                code = "values-implausible"
            numbers = np.concatenate([sample.known for sample in samples])
            low, middle, high = np.percentile(numbers, [1, 50, 99])
            evidence = (
                f"Declared {rasters.quantity}; {len(samples)} of {len(rasters.cell_ids)} rasters "
                f"hold {low:.5g}..{high:.5g}, median {middle:.5g}"
            )
            if unsigned:
                evidence += f": as losses {below_db:.0f} dB less than those of free space"
            evidence += ", which become less away from the sites." if falls else "."
            ids = listed([sample.cell_id for sample in samples])
            findings.add(code, f"{where}, cells {ids}", evidence)
        if kind == "unclear":
            # Whether more is stronger is not known.
            continue
        negative = kind == "loss" and not falls
        # Of what is left without the number for no data, places are not judged.
        whole = [s for s in samples if s.cell_id not in marked]
        useful += [replace(s, values=-s.values) for s in whole] if negative else whole
    return useful


def strongest(samples: Sequence[RasterSample], plan: CellPlan, quantity: str) -> dict[str, float]:
    """Return the strongest level of each cell of the plan, in dBm; losses are taken from EIRPs."""
    return {
        s.cell_id: float(s.known.max()) + (plan[s.cell_id].eirp_dbm if quantity == "loss" else 0.0)
        for s in samples
        if s.cell_id in plan
    }


def _beyond(sample: RasterSample, rasters: RxLevRasters, kind: Kind, tile_px: int) -> Fault | None:
    """Return the fault of numbers that the declared quantity cannot have, and a build refuses.

    None where they are of another quantity, which is told as such.
    """
    if kind not in (rasters.quantity, "empty"):
        return None
    side = max(round(tile_px * rasters.lattice.resolution_m / sample.lattice.resolution_m), 1)
    rows, cols = (range(0, length, side) for length in sample.values.shape)
    tiles = (sample.values[top : top + side, left : left + side] for top in rows for left in cols)
    try:
        for values in (sample.values, *tiles):
            check_plausible(values, rasters.quantity, rasters.path, rasters.factor)
    except InputError as error:
        return error.faults[0]
    return None


def _below_free_space_db(samples: Sequence[RasterSample], plan: CellPlan | None) -> float:
    """Return by how much numbers, if they are losses, are less than those of free space.

    That of the middle one of the cells; no obstacle makes a loss less. Minus infinity where it is
    not known.
    """
    known = [(s, plan[s.cell_id]) for s in samples if plan is not None and s.cell_id in plan]
    below_db = [
        above_free_space_db(replace(s, values=-s.values), replace(cell, eirp_dbm=0.0))
        for s, cell in known
        if not cell.indoor
    ]
    return float(np.median(below_db)) if below_db else -np.inf


def _falls_away(samples: Sequence[RasterSample], plan: CellPlan | None) -> bool:
    """Return whether numbers above 0 fall with the distance, as no path loss does."""
    if plan is None:
        return False
    known = [(s, plan[s.cell_id]) for s in samples if s.cell_id in plan]
    falls = [falls_with_distance(s, cell.east_m, cell.north_m) for s, cell in known]
    return bool(falls) and float(np.median(falls)) > _FALLS
