"""Sites and rasters in ED50 and WGS 84, one taken for the other: 100 to 220 m apart in Europe.

Within some hundred metres of a site levels show where it stands: they are explained by a constant
and the logarithm of the distance, beside the gain of the plan's antenna.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapfilter._types import Floats
from mapfilter.check.findings import Findings
from mapfilter.check.plan_gain import gain_by_plan_db
from mapfilter.check.samples import RasterSample
from mapfilter.geodesy import project, same_crs, unproject, utm_zone, utm_zone_crs
from mapfilter.radio.cells import Cell, CellPlan

_ED50_DEG = (-16.1, 25.71, 48.61, 84.73)
_ZONES = range(28, 39)
_REACH_M, _LEAST_PX, _WIDEST_PX_M = 700.0, 60, 60.0
_LEAST_SITES, _MOST = 5, 0.8
_BETTER, _ERRORS = 0.03, 4.0
_OTHERS = ((0.5, 0.0), (1.5, 0.0), (0.0, 1.0), (0.0, -1.0))
"""Other shifts, along and across the one that is tried; it has to explain more than these."""


def ed50_shifts_m(crs: str, east_m: float, north_m: float) -> dict[str, tuple[float, float]]:
    """Return by how much coordinates of ED50 that were taken for WGS 84 move when mended.

    For degrees, and in a UTM zone of WGS 84 for metres of that zone of ED50; empty outside Europe.

    Returns
    -------
    dict of str to (float, float)
        East and north in metres by the name of the coordinates.

    Examples
    --------
    >>> shifts = ed50_shifts_m("EPSG:32632", 512_000.0, 5_512_000.0)
    >>> {name: (round(east), round(north)) for name, (east, north) in shifts.items()}
    {'degrees': (-82, -91), 'UTM metres': (-83, -201)}
    """
    lon, lat = (float(one) for one in unproject(crs, east_m, north_m))
    west, south, east, north = _ED50_DEG
    if not (west <= lon <= east and south <= lat <= north):
        return {}
    meant = {"degrees": unproject("EPSG:4230", lon, lat)}
    zone = utm_zone(lon, lat)
    if zone in _ZONES and same_crs(crs, utm_zone_crs(zone, lat)):
        meant["UTM metres"] = unproject(f"EPSG:230{zone}", east_m, north_m)
    found = {}
    for name, (true_lon, true_lat) in meant.items():
        true_east_m, true_north_m = project(crs, true_lon, true_lat)
        found[name] = (float(true_east_m) - east_m, float(true_north_m) - north_m)
    return found


def plan_by_datum(
    samples: Sequence[RasterSample],
    plan: CellPlan,
    outside: frozenset[str],
    where: str,
    findings: Findings,
) -> CellPlan:
    """Report sites that fit their rasters after a change of datum; return a plan moved by it.

    Parameters
    ----------
    samples : sequence of RasterSample
        Levels, or losses with a minus sign.
    plan : CellPlan
        In the CRS of the rasters; returned as it is where nothing is found.
    outside : frozenset of str
        Cells whose site is off the rasters, which are passed over.
    """
    seen = [s for s in samples if s.cell_id in plan and s.cell_id not in outside]
    seen = [s for s in seen if s.lattice.resolution_m <= _WIDEST_PX_M]
    sites = {plan[s.cell_id].site for s in seen}
    if len(sites) < _LEAST_SITES:
        return plan
    middle = np.mean([(plan[s.cell_id].east_m, plan[s.cell_id].north_m) for s in seen], axis=0)
    shifts = ed50_shifts_m(plan.crs, *middle.tolist())
    tried = [
        (name, sign, sign * np.array(shift_m))
        for name, shift_m in shifts.items()
        for sign in (1, -1)
    ]
    others = [_turned(shift_m, *by) for *_, shift_m in tried for by in _OTHERS]
    moves_m = np.array([(0.0, 0.0), *(shift_m for *_, shift_m in tried), *others])
    gains = _gains(seen, plan, moves_m)
    if not tried or len(gains) < _LEAST_SITES:
        return plan
    mean = gains.mean(axis=0)
    best = 1 + int(np.argmax(mean[1 : 1 + len(tried)]))
    beside = 1 + len(tried) + len(_OTHERS) * (best - 1)
    error = gains[:, best].std(ddof=1) / np.sqrt(len(gains))
    if (
        mean[best] < max(_BETTER, _ERRORS * error, *mean[beside : beside + len(_OTHERS)])
        or (gains[:, best] > 0).mean() < _MOST
    ):
        return plan
    name, sign, (east_m, north_m) = tried[best - 1]
    whose = ("the sites", "the rasters") if sign > 0 else ("the rasters", "the sites")
    evidence = (
        f"Levels within {_REACH_M:g} m of the sites are explained better at "
        f"{int((gains[:, best] > 0).sum())} of {len(gains)} sites if these stand "
        f"{_words(east_m, north_m)}, the shift of {name} of ED50 that are taken for WGS 84: likely "
        f"{whose[0]} are in ED50, and {whose[1]} in WGS 84."
    )
    findings.add("datum-shifted", where, evidence, "warning")
    moved = (
        replace(cell, east_m=cell.east_m + east_m, north_m=cell.north_m + north_m)
        for cell in plan.cells
    )
    return replace(plan, cells=tuple(moved))


def _turned(shift_m: Floats, along: float, across: float) -> Floats:
    east_m, north_m = shift_m
    return along * shift_m + across * np.array([-north_m, east_m])


def _gains(seen: Sequence[RasterSample], plan: CellPlan, moves_m: Floats) -> Floats:
    """Return by how much moves of each site explain more of its levels, (sites, moves)."""
    by_site: dict[str, list[Floats]] = {}
    for sample in seen:
        cell = plan[sample.cell_id]
        explained = _explained(sample, cell, moves_m)
        if explained is not None:
            by_site.setdefault(cell.site, []).append(explained - explained[0])
    return np.array([np.mean(one, axis=0) for one in by_site.values()])


def _explained(sample: RasterSample, cell: Cell, moves_m: Floats) -> Floats | None:
    """Return the share of the variance about a site that is explained if it is moved, (moves,)."""
    lattice = sample.lattice
    reach = int(_REACH_M / lattice.resolution_m) + 1
    row, col = lattice.row_col(cell.east_m, cell.north_m)
    top, left = max(row - reach, 0), max(col - reach, 0)
    values = sample.values[top : max(row + reach + 1, 0), left : max(col + reach + 1, 0)]
    rows, cols = np.nonzero(~np.isnan(values))
    east_m, north_m = lattice.east_north(rows + top, cols + left)
    near = np.hypot(east_m - cell.east_m, north_m - cell.north_m) < _REACH_M
    east_m, north_m = east_m[near], north_m[near]
    level_db = values[rows[near], cols[near]].astype(np.float64)
    if level_db.size < _LEAST_PX or np.ptp(level_db) == 0:
        return None
    explained = []
    for right_m, up_m in moves_m.tolist():
        there = replace(cell, east_m=cell.east_m + right_m, north_m=cell.north_m + up_m)
        gain_db = gain_by_plan_db(there, lattice.crs, east_m, north_m)
        if gain_db is None:
            return None
        away_m = np.hypot(east_m - there.east_m, north_m - there.north_m)
        far = np.log10(np.maximum(away_m, lattice.resolution_m / 2))
        rest_db = level_db - gain_db
        far, rest_db = far - far.mean(), rest_db - rest_db.mean()
        slope_db = (far @ rest_db) / (far @ far)
        left_db2 = np.mean((rest_db - slope_db * far) ** 2)
        explained.append(1 - left_db2 / level_db.var())
    return np.array(explained)


def _words(east_m: float, north_m: float) -> str:
    return (
        f"{abs(east_m):.0f} m {'east' if east_m > 0 else 'west'} and "
        f"{abs(north_m):.0f} m {'north' if north_m > 0 else 'south'}"
    )
