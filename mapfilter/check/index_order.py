"""Indexes of rasters in which each name stands one row off its cell.

A raster is compared with what a cell would give: levels that fall by 35 dB per tenfold distance
from its site, less the attenuation of a sector beside its azimuth. The correlation of both is the
fit. Carriers of a sector fit each other's rasters alike and prove nothing; neighbouring sectors and
sites do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mapfilter.check.findings import Findings
from mapfilter.check.place_fits import MeanLevels, in_squares
from mapfilter.check.samples import RasterSample
from mapfilter.errors import listed
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.cells import Cell, CellPlan

_SLOPE_DB, _FRONT_TO_BACK_DB = 35.0, 20.0
_APART, _LEAST_ROWS, _LEAST_BETWEEN_SITES = 0.1, 4, 2
_MOST, _LEAST_FIT = 0.9, 0.5


def plan_by_index(
    samples: Sequence[RasterSample],
    order: Sequence[str],
    plan: CellPlan,
    index: Path,
    findings: Findings,
) -> CellPlan:
    """Report an index that is shifted by one row; return the plan by which rasters are judged.

    That is the given one, or one in which each cell id stands for the cell whose raster bears it,
    if nearly all rasters that differ fit the cell of the row above, or of the row below, better
    than their own, also from site to site. A raster beyond the end of the index has no cell there.

    Parameters
    ----------
    samples : sequence of RasterSample
        Levels, or losses with a minus sign.
    order : sequence of str
        Ids in the order of the index.
    """
    squares = {s.cell_id: found for s in samples if (found := in_squares(s)) is not None}
    for step, side in ((1, "above"), (-1, "below")):
        ids = [cell_id for cell_id in order if cell_id in plan]
        # Past the end it is the other end, as where the names were rotated.
        cell_of = {ids[at]: ids[(at - step) % len(ids)] for at in range(len(ids))}
        last = ids[0 if step == 1 else -1] if ids else ""
        fits = {
            cell_id: (_fit(squares[cell_id], plan[cell_id]), _fit(squares[cell_id], plan[other]))
            for cell_id, other in cell_of.items()
            if cell_id in squares
        }
        proving = {i: fit for i, fit in fits.items() if i != last and abs(fit[1] - fit[0]) > _APART}
        if not _explains(proving, cell_of, plan):
            continue
        if last in fits and fits[last][1] - fits[last][0] <= _APART:
            del cell_of[last]
        own, meant = np.mean(list(proving.values()), axis=0)
        some = listed([f"that of {i} is of {cell_of[i]}" for i in proving], 3)
        evidence = (
            f"The names of the rasters are shifted by one row: levels and those about the cell's "
            f"site and azimuth correlate by {own:.2f} (mean of the {len(proving)} rasters that "
            f"tell), and by {meant:.2f} if each raster is of the cell one row {side} ({some})."
        )
        way = "up" if step == 1 else "down"
        findings.add("index-shifted", str(index), evidence, remedy=_REMEDY.format(way=way))
        return CellPlan(plan.crs, tuple(replace(plan[b], id=a) for a, b in cell_of.items()))
    return plan


_REMEDY = "Move FILE_NAME and the columns after it in the index {way} by one row."


def _explains(
    proving: Mapping[str, tuple[float, float]], cell_of: Mapping[str, str], plan: CellPlan
) -> bool:
    between = [i for i in proving if plan[i].site != plan[cell_of[i]].site]
    if len(proving) < _LEAST_ROWS or len(between) < _LEAST_BETWEEN_SITES:
        return False
    better = {i: meant > own for i, (own, meant) in proving.items()}
    shares = np.mean([*better.values()]), np.mean([better[i] for i in between])
    return bool(min(shares) >= _MOST and np.mean([*proving.values()], axis=0)[1] >= _LEAST_FIT)


def _fit(squares: MeanLevels, cell: Cell) -> float:
    """Return the correlation of levels with those of a cell, the convergence of grids left out."""
    east_m, north_m = squares.east_m - cell.east_m, squares.north_m - cell.north_m
    distance_m = np.maximum(np.hypot(east_m, north_m), squares.side_m / 2)
    level_db = -_SLOPE_DB * np.log10(distance_m)
    if cell.azimuth_deg is not None:
        off_rad = np.arctan2(east_m, north_m) - np.radians(cell.azimuth_deg)
        beamwidth_rad = np.radians(cell.beamwidth_deg)
        level_db = level_db + sector_gain_db(off_rad, beamwidth_rad, _FRONT_TO_BACK_DB)
    if np.ptp(level_db) == 0:
        return 0.0
    return float(np.corrcoef(level_db, squares.level_db)[0, 1])
