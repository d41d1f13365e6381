"""Whether each raster is strong about its own site, or rather about that of another cell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plausibility import RasterSample
from mapfilter.radio.sitefit import best_place, in_squares, place_fit
from mapfilter.workflows.findings import Findings, listed

_FAR_PX, _FAR_M = 10.0, 150.0
_SITES = 16
_CLEARLY_BETTER = 0.1
_BETTER = 0.05
_MILDLY_BETTER = 0.02
_FITS = 0.65


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """How well sites and the best place explain one raster."""

    own: float
    # Of the cell's own site and of those about the best place.
    by_site: Mapping[str, float]
    best: float
    away_m: float
    far: bool

    @property
    def explained(self) -> bool:
        """Whether a place far from the site is where the antenna may well stand."""
        return self.far and self.best > _FITS

    def gain(self, site: str) -> float:
        return self.by_site.get(site, 0.0) - self.own


def check_peaks(
    seen: Sequence[RasterSample], plan: CellPlan, where: str, findings: Findings
) -> frozenset[str]:
    """Find rasters that another place than their site explains better.

    Labels of rasters count as exchanged between sites only where rasters went both ways; else it
    is the site that is wrong.

    Parameters
    ----------
    seen : sequence of RasterSample
        Levels of cells of the plan.
    plan : CellPlan
    where : str
        The rasters.
    findings : Findings

    Returns
    -------
    frozenset of str
        All cells of the sites concerned: where a site is wrong its azimuths cannot be judged.
    """
    fits = _fits(seen, plan)
    site_of = {cell_id: plan[cell_id].site for cell_id in fits}
    moved = _exchanged(fits, site_of)
    if moved:
        told = ", ".join(f"{cell_id} about {site}" for cell_id, site in list(moved.items())[:8])
        evidence = f"These rasters are strong about the site of another cell: {told}."
        findings.add("site-labels-swapped", f"{where}, cells {listed(list(moved))}", evidence)
    off = _off(fits, site_of, moved)
    if off:
        worst = fits[max(off, key=lambda cell_id: fits[cell_id].best - fits[cell_id].own)]
        evidence = (
            f"Distance and direction from the site explain the levels with a correlation of "
            f"{worst.own:.2f}, and from a place {worst.away_m:.0f} m away with {worst.best:.2f}."
        )
        findings.add("site-off-peak", f"{where}, cells {listed(off)}", evidence)
    sites = {site_of[cell_id] for cell_id in (*moved, *off)}
    return frozenset(cell.id for cell in plan.cells if cell.site in sites)


def _fits(seen: Sequence[RasterSample], plan: CellPlan) -> dict[str, _Fit]:
    site_at = {cell.site: (cell.east_m, cell.north_m) for cell in reversed(plan.cells)}
    names, places_m = list(site_at), np.array(list(site_at.values()))
    found = {}
    for sample in seen:
        squares = in_squares(sample)
        if squares is None:
            continue
        cell = plan[sample.cell_id]
        best, (east_m, north_m) = best_place(squares, sample)
        off_m = np.hypot(*(places_m - (east_m, north_m)).T)
        about = [names[index] for index in np.argsort(off_m, kind="stable")[:_SITES]]
        away_m = float(np.hypot(east_m - cell.east_m, north_m - cell.north_m))
        own = place_fit(squares, cell.east_m, cell.north_m)
        found[cell.id] = _Fit(
            own,
            {site: place_fit(squares, *site_at[site]) for site in about} | {cell.site: own},
            best,
            away_m,
            away_m >= max(_FAR_M, _FAR_PX * sample.lattice.resolution_m),
        )
    return found


def _exchanged(fits: Mapping[str, _Fit], site_of: Mapping[str, str]) -> dict[str, str]:
    """Return the site that each exchanged raster belongs to."""
    sites = set(site_of.values())
    moved = _both_ways(_reassigned(_drawn(fits, site_of, sites, _BETTER), fits, site_of), site_of)
    # Where two sites exchanged some labels, rasters that prove less by themselves came along.
    along = _drawn(fits, site_of, set(moved.values()), _MILDLY_BETTER)
    return _both_ways(_reassigned(along, fits, site_of), site_of)


def _drawn(
    fits: Mapping[str, _Fit], site_of: Mapping[str, str], sites: Set[str], least: float
) -> list[str]:
    """Return the rasters of sites that another of those sites explains better."""
    return [
        cell_id
        for cell_id, fit in fits.items()
        if site_of[cell_id] in sites and any(fit.gain(site) > least for site in sites)
    ]


def _reassigned(
    ids: Sequence[str], fits: Mapping[str, _Fit], site_of: Mapping[str, str]
) -> dict[str, str]:
    """Return the sites that rasters go to when labels are exchanged among them for the best."""
    if not ids:
        return {}
    gain = np.array([[fits[a].gain(site_of[b]) for b in ids] for a in ids])
    rows, cols = linear_sum_assignment(-gain)
    return {
        ids[row]: site_of[ids[col]]
        for row, col in zip(rows, cols, strict=True)
        if site_of[ids[row]] != site_of[ids[col]] and gain[row, col] > _MILDLY_BETTER
    }


def _both_ways(moved: Mapping[str, str], site_of: Mapping[str, str]) -> dict[str, str]:
    """Return the rasters that went to sites from which others came, and the other way round."""
    kept = dict(moved)
    while True:
        left, reached = {site_of[cell_id] for cell_id in kept}, set(kept.values())
        inner = {i: site for i, site in kept.items() if site in left and site_of[i] in reached}
        if len(inner) == len(kept):
            return inner
        kept = inner


def _off(
    fits: Mapping[str, _Fit], site_of: Mapping[str, str], moved: Mapping[str, str]
) -> list[str]:
    """Return the rasters, not exchanged, that a place far from their site explains better."""
    better = {
        cell_id: fit.best - fit.own
        for cell_id, fit in fits.items()
        if cell_id not in moved and fit.explained and fit.best - fit.own > _BETTER
    }
    # Two rasters of a site are as good as one that is clear.
    count = Counter(site_of[cell_id] for cell_id in better)
    sites = {
        site_of[cell_id]
        for cell_id, gain in better.items()
        if gain > _CLEARLY_BETTER or count[site_of[cell_id]] > 1
    }
    return [cell_id for cell_id in better if site_of[cell_id] in sites]
