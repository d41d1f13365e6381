"""Checks of raster values: quantity, nodata, constants, copies, and the cells of the plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from rasterio.errors import RasterioError

from mapfilter._gdal import open_raster
from mapfilter._types import Floats32
from mapfilter.check.copies import check_copies
from mapfilter.check.findings import Findings
from mapfilter.check.raster_kinds import Kind, below_free_space_db, falls_away, kind_of
from mapfilter.check.samples import RasterSample, sample_raster
from mapfilter.errors import Fault, InputError, listed
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.files import (
    POWERS,
    SIGN_NOT_READ,
    are_bytes_without_sign,
    are_powers,
    as_stored,
    check_plausible,
)
from mapfilter.rasters.raster_set import RxLevRasters, in_other_case, switched_off

_TOO_SMALL_DB = 10.0
_FEW_NUMBERS, _LARGEST_BYTE = 12, 255
"""Different numbers that cells may have, where levels have more; the largest in a byte."""


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
        off = switched_off(unknown, plan)
        evidence += f" {off[:1].upper()}{off[1:]}." if off else ""
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
    groups = _Groups()
    # What is none of a cell may be terrain or clutter: its numbers are not those of levels.
    of_cells = [one for one in rasters.cell_ids if plan is not None and one in plan]
    for cell_id in of_cells or rasters.cell_ids:
        cell = plan[cell_id] if plan is not None and cell_id in plan else None
        try:
            sample = sample_raster(rasters, cell_id, cell)
        except InputError as error:
            findings.add_faults(error, "rasters-invalid")
            continue
        groups.add(sample, rasters, tile_px)
    groups.report(rasters, findings)
    useful: list[RasterSample] = []
    for kind, samples in groups.kinds.items():
        check_copies(samples, plan, rasters.quantity, str(rasters.path), findings)
        falls = _check_kind(kind, samples, rasters, plan, findings)
        if kind == "unclear":
            # Whether more is stronger is not known.
            continue
        # Of what is left without the number for no data, places are not judged.
        whole = [s for s in samples if s.cell_id not in groups.nodata]
        negative = kind == "loss" and not falls
        useful += [replace(s, values=-s.values) for s in whole] if negative else whole
    return useful


@dataclass(frozen=True, slots=True)
class _Groups:
    """Samples by what their numbers are.

    Parameters
    ----------
    kinds : dict of str to list of RasterSample
        Those of a usual range, by what they look like.
    beyond : dict of (str, str) to list of RasterSample
        Those beyond what the quantity can be, by what is expected and its likely cause.
    nodata : dict of str to (float, float)
        By cell a number that means no data, and its share of the pixels.
    constant : list of str
        Cells with one number in all pixels, and that number.
    empty : list of str
        Cells without data.
    """

    kinds: dict[Kind, list[RasterSample]] = field(default_factory=dict)
    beyond: dict[tuple[str, str], list[RasterSample]] = field(default_factory=dict)
    nodata: dict[str, tuple[float, float]] = field(default_factory=dict)
    constant: list[str] = field(default_factory=list)
    empty: list[str] = field(default_factory=list)

    def add(self, sample: RasterSample, rasters: RxLevRasters, tile_px: int) -> None:
        """Put a sample where it belongs, without a number that means no data."""
        cell_id = sample.cell_id
        if sample.nodata is not None:
            self.nodata[cell_id] = sample.nodata
            kept = np.where(sample.values == np.float32(sample.nodata[0]), np.nan, sample.values)
            sample = replace(sample, values=kept.astype(np.float32))
            if not sample.known.size:
                return
        kind = kind_of(sample.values)
        if not sample.known.size:
            self.empty.append(cell_id)
        elif np.ptp(sample.known) == 0:
            self.constant.append(f"{cell_id} {sample.known[0]:g}")
        elif (fault := _beyond(sample, rasters, kind, tile_px)) is not None:
            self.beyond.setdefault((fault.expected, fault.hint), []).append(sample)
        else:
            self.kinds.setdefault(kind, []).append(sample)

    def report(self, rasters: RxLevRasters, findings: Findings) -> None:
        """Report all that are of no usual range."""
        where = str(rasters.path)
        if self.nodata:
            number, most = max(self.nodata.values(), key=lambda one: one[1])
            share = f"{most:.1%}" if most >= 0.01 else f"{100 * most:.2g} %"
            stored = as_stored(number, rasters.factor)
            evidence = f"{stored} stands in up to {share} of the pixels, as a number."
            findings.add("nodata-as-level", f"{where}, cells {listed([*self.nodata])}", evidence)
        if self.empty:
            cells = f"{where}, cells {listed(self.empty)}"
            findings.add("raster-empty", cells, "No pixel has data.", "warning")
        if self.constant:
            evidence = f"One number in all pixels: {listed(self.constant)}."
            findings.add("raster-constant", where, evidence)
        for (expected, hint), samples in self.beyond.items():
            low = min(float(sample.known.min()) for sample in samples)
            high = max(float(sample.known.max()) for sample in samples)
            evidence = (
                f"Expected {expected}; {len(samples)} of {len(rasters.cell_ids)} rasters hold "
                f"{low:.5g}..{high:.5g}"
            )
            evidence += f" ({hint})." if hint else "."
            ids = listed([sample.cell_id for sample in samples])
            findings.add("values-implausible", f"{where}, cells {ids}", evidence)


def _check_kind(
    kind: Kind,
    samples: Sequence[RasterSample],
    rasters: RxLevRasters,
    plan: CellPlan | None,
    findings: Findings,
) -> bool:
    """Report samples that are not what is declared; return whether losses are field strengths."""
    falls = kind == "loss" and falls_away(samples, plan)
    below_db = 0.0 if falls or kind != "loss" else below_free_space_db(samples, plan)
    unsigned = below_db > _TOO_SMALL_DB
    if not (falls or unsigned or kind not in (rasters.quantity, "empty")):
        return falls
    code = "field-strength" if falls else f"{kind}-as-{rasters.quantity}"
    code = "levels-without-sign" if unsigned else code
    # A negative factor turns levels into what looks like losses, and losses into levels.
    no_sign = falls and all(are_bytes_without_sign(s.known, rasters.factor) for s in samples)
    if kind == "unclear" or no_sign or (rasters.factor < 0 and kind in ("level", "loss")):
        code = "values-implausible"
    numbers = np.concatenate([sample.known for sample in samples])
    low, middle, high = np.percentile(numbers, [1, 50, 99])
    evidence = (
        f"Declared {rasters.quantity}; {len(samples)} of {len(rasters.cell_ids)} rasters "
        f"hold {low:.5g}..{high:.5g}, median {middle:.5g}"
    )
    if unsigned:
        evidence += f": as losses {below_db:.0f} dB less than those of free space"
    evidence += ", which become less away from the sites" if falls else ""
    evidence += f" ({cause})." if (cause := _cause(numbers, no_sign, falls, kind)) else "."
    ids = listed([sample.cell_id for sample in samples])
    findings.add(code, f"{rasters.path}, cells {ids}", evidence)
    return falls


def _cause(numbers: Floats32, no_sign: bool, falls: bool, kind: Kind) -> str:
    """Return the likely cause of numbers of another kind, where they tell more than the kind."""
    if no_sign:
        return SIGN_NOT_READ
    if are_powers(numbers):
        return POWERS
    whole = bool((numbers == np.round(numbers)).all())
    if kind == "rxlev" and whole and np.unique(numbers).size <= _FEW_NUMBERS:
        return "if they are numbers of cells, it is a raster of the best server, without levels"
    if falls and whole and numbers.min() >= 0 and numbers.max() <= _LARGEST_BYTE:
        return (
            "or whole numbers with an offset, as RSRP + 140: gdal_translate -a_offset -140 "
            "FROM.tif TO.tif states it, with the offset of the tool"
        )
    return ""


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
