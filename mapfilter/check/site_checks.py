"""Checks that each raster is strong about its site, in its direction, and as its EIRP allows.

A level is explained by a constant, the logarithm of the distance from the place, and two harmonics
of the direction, which draw any lobe: no azimuth has to be right. The share of the levels' variance
that is explained compares places over the same pixels, those that differ also with the plan's
antenna there, as a narrow beam below the horizon is strongest away from its mast.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats32
from mapfilter.check.findings import Findings
from mapfilter.check.lobes import Lobe, azimuth_mistakes, find_lobe
from mapfilter.check.place_fits import fits_with_antenna, in_squares, place_fits, places_to_try
from mapfilter.check.raster_kinds import above_free_space_db, falls_with_distance
from mapfilter.check.samples import RasterSample, thinned
from mapfilter.errors import listed
from mapfilter.radio.cells import Cell, CellPlan

_FAR_PX, _FAR_M = 10.0, 150.0
_SITES = 16
_CLEARLY_BETTER = 0.1
_BETTER = 0.05
_MILDLY_BETTER = 0.02
_FITS = 0.65


class _Fit(NamedTuple):
    """Fit of a raster to its site, to the sites near the best place, and to that place."""

    own: float
    by_site: Mapping[str, float]
    best: float
    away_m: float
    far: bool

    def gain(self, site: str) -> float:
        return self.by_site.get(site, 0.0) - self.own


def check_peaks(
    seen: Sequence[RasterSample], plan: CellPlan, where: str, findings: Findings
) -> frozenset[str]:
    """Find rasters that another place than their site explains better.

    Labels of rasters count as exchanged between sites only where rasters went both ways; else it
    is the site that is wrong. Returned are all cells of the sites concerned: where a site is wrong
    its azimuths cannot be judged.
    """
    fits = _fits(seen, plan)
    site_of = {cell_id: plan[cell_id].site for cell_id in fits}
    moved = _exchanged(fits, site_of)
    if moved:
        pairs = ", ".join(f"{cell_id} about {site}" for cell_id, site in list(moved.items())[:8])
        evidence = f"These rasters are strong about the site of another cell: {pairs}."
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
        places_to_try_m = places_to_try(sample)
        tried = place_fits(squares, places_to_try_m)
        best, (east_m, north_m) = float(tried.max()), places_to_try_m[tried.argmax()]
        off_m = np.hypot(*(places_m - (east_m, north_m)).T)
        about = [names[index] for index in np.argsort(off_m, kind="stable")[:_SITES]]
        away_m = float(np.hypot(east_m - cell.east_m, north_m - cell.north_m))
        tried_m = np.array([(cell.east_m, cell.north_m), *(site_at[site] for site in about)])
        own, *others = place_fits(squares, tried_m).tolist()
        by_site = dict(zip(about, others, strict=True)) | {cell.site: own}
        far = away_m >= max(_FAR_M, _FAR_PX * sample.lattice.resolution_m)
        if far and best - own > _BETTER:
            with_antenna = fits_with_antenna(squares, sample.lattice.crs, cell, places_to_try_m)
            far = max(best, *with_antenna[1:]) - max(own, with_antenna[0]) > _BETTER
        found[cell.id] = _Fit(own, by_site, best, away_m, far)
    return found


def _exchanged(fits: Mapping[str, _Fit], site_of: Mapping[str, str]) -> dict[str, str]:
    """Return the site that each exchanged raster belongs to."""
    from scipy.optimize import linear_sum_assignment

    sites = set(site_of.values())
    moved: dict[str, str] = {}
    # Where two sites exchanged some labels, rasters that prove less by themselves came along.
    for least in (_BETTER, _MILDLY_BETTER):
        ids = [
            cell_id
            for cell_id, fit in fits.items()
            if site_of[cell_id] in sites and any(fit.gain(site) > least for site in sites)
        ]
        gain = np.array([[fits[a].gain(site_of[b]) for b in ids] for a in ids])
        taken = linear_sum_assignment(-gain.reshape(len(ids), len(ids)))
        pairs = [
            (ids[row], site_of[ids[col]], gain[row, col]) for row, col in zip(*taken, strict=True)
        ]
        moved = {i: site for i, site, db in pairs if site != site_of[i] and db > _MILDLY_BETTER}
        # Labels are exchanged where rasters went both ways between sites.
        while True:
            left, reached = {site_of[i] for i in moved}, set(moved.values())
            kept = {i: site for i, site in moved.items() if site in left and site_of[i] in reached}
            if len(kept) == len(moved):
                break
            moved = kept
        sites = set(moved.values())
    return moved


def _off(
    fits: Mapping[str, _Fit], site_of: Mapping[str, str], moved: Mapping[str, str]
) -> list[str]:
    """Return the rasters, not exchanged, that a place far from their site explains better."""
    better = {
        cell_id: fit.best - fit.own
        for cell_id, fit in fits.items()
        if cell_id not in moved and fit.far and fit.best > _FITS and fit.best - fit.own > _BETTER
    }
    # Two rasters of a site are as good as one that is clear.
    count = Counter(site_of[cell_id] for cell_id in better)
    sites = {
        site_of[cell_id]
        for cell_id, gain in better.items()
        if gain > _CLEARLY_BETTER or count[site_of[cell_id]] > 1
    }
    return [cell_id for cell_id in better if site_of[cell_id] in sites]


_TURNED_BETTER, _TURNED_FITS = 0.25, 0.4
_TURNED_SLIGHTLY, _LOBES_BETTER = 0.1, 0.3
_ABOVE_DB, _ONE_ABOVE_DB = 10.0, 18.0
_SMALL_EIRP_DBM, _MAST_M = 25.0, 10.0

_TURNS: tuple[tuple[str, Callable[[Floats32], Floats32]], ...] = (
    ("rows and columns exchanged", lambda v: v.T),
    ("rows from south to north", lambda v: v[::-1]),
    ("columns from east to west", lambda v: v[:, ::-1]),
    ("rows and columns both reversed", lambda v: v[::-1, ::-1]),
    ("a quarter turn", lambda v: v.T[::-1]),
    ("a quarter turn the other way", lambda v: v.T[:, ::-1]),
)
"""Turns that exporters may have made, each with what undoes it."""


def check_against_sites(
    samples: Sequence[RasterSample],
    plan: CellPlan,
    outside: frozenset[str],
    where: str,
    findings: Findings,
) -> list[RasterSample]:
    """Check that each raster is strong about its own site, and in its own direction.

    Cells in ``outside`` have their site off the rasters and are skipped; the plan is in the CRS of
    the rasters. Returned are the samples that are strong about their own site.
    """
    seen = [s for s in samples if s.cell_id in plan and s.cell_id not in outside]
    if not seen or _check_turned(seen, plan, where, findings):
        return []
    off = check_peaks(seen, plan, where, findings)
    in_place = [s for s in seen if s.cell_id not in off]
    lobes = _lobes(in_place, plan)
    held = {sample.cell_id for sample in in_place}
    cells = [cell for cell in plan.cells if cell.id in held]
    for mistake in azimuth_mistakes(cells, lobes):
        evidence = f"Azimuths and lobes of the rasters differ by {mistake.offset_deg:.0f}° (median)"
        if mistake.mistake == "azimuth-off-lobe":
            evidence += f": {mistake.reading}."
        else:
            how = "if" if mistake.mistake == "sector-labels-swapped" else "if azimuths are"
            evidence += f"; by {mistake.offset_read_deg:.0f}° {how} {mistake.reading}."
        findings.add(mistake.mistake, f"{where}, cells {listed(mistake.cells)}", evidence)
    return in_place


def check_power(
    samples: Sequence[RasterSample], plan: CellPlan, where: str, findings: Findings
) -> None:
    """Check that levels are possible with the EIRP of the plan, and the EIRP with a mast."""
    cells = [
        cell
        for cell in plan.cells
        if cell.azimuth_deg is not None and not cell.indoor and cell.height_m >= _MAST_M
    ]
    cells = [cell for cell in cells if "eirp_dbm" not in cell.assumes]
    small = [cell for cell in cells if 0 < cell.eirp_dbm <= _SMALL_EIRP_DBM]
    above_db = {
        s.cell_id: above_free_space_db(s, plan[s.cell_id])
        for s in samples
        if s.cell_id in plan
        and not plan[s.cell_id].indoor
        and "eirp_dbm" not in plan[s.cell_id].assumes
    }
    # One cell may have reflections and shadowing on its side, but not most of them.
    most = bool(above_db) and float(np.median(list(above_db.values()))) > _ABOVE_DB
    watts = {cell.id for cell in small}
    too_high = {
        i: db
        for i, db in above_db.items()
        if db > (_ABOVE_DB if most or i in watts else _ONE_ABOVE_DB)
    }
    if too_high:
        ids = list(too_high)
        evidence = (
            f"Levels into the main lobe are up to {max(too_high.values()):.0f} dB above those of "
            f"free space with the plan's EIRP (median of a ring about the site)."
        )
        if watts & set(ids):
            cell = next(cell for cell in small if cell.id in too_high)
            evidence += f" {_as_watts(cell)}"
            findings.add("eirp-watts", f"{where}, cells {listed(ids)}", evidence)
        else:
            findings.add("levels-above-eirp", f"{where}, cells {listed(ids)}", evidence, "warning")
    elif small and 2 * len(small) > len(cells):
        evidence = f"That is little for a sector on a mast. {_as_watts(small[0])}"
        ids = [cell.id for cell in small]
        findings.add("eirp-watts", f"{where}, cells {listed(ids)}", evidence, "warning")


def _check_turned(
    seen: Sequence[RasterSample], plan: CellPlan, where: str, findings: Findings
) -> bool:
    """Find rasters that fit their sites much better when they are turned."""
    seen = [thinned(sample) for sample in seen]
    given = _mean_fall(seen, plan)
    best: tuple[float, str] | None = None
    for words, turn in _TURNS:
        turned = []
        for sample in seen:
            values = turn(sample.values)
            lattice = replace(sample.lattice, rows=values.shape[0], cols=values.shape[1])
            turned.append(replace(sample, values=values, lattice=lattice))
        fit = _mean_fall(turned, plan)
        if fit < _TURNED_FITS or fit - given < _TURNED_SLIGHTLY or (best and fit < best[0]):
            continue
        if (
            fit - given > _TURNED_BETTER
            or _mean_score(turned, plan) - _mean_score(seen, plan) > _LOBES_BETTER
        ):
            best = fit, words
    if best is None:
        return False
    evidence = (
        f"Levels and nearness to the sites correlate by {given:.2f} (mean of {len(seen)} "
        f"cells), and by {best[0]:.2f} if the file holds {best[1]}."
    )
    findings.add("axes-swapped", where, evidence)
    return True


def _mean_fall(samples: Sequence[RasterSample], plan: CellPlan) -> float:
    pairs = ((sample, plan[sample.cell_id]) for sample in samples)
    return float(np.mean([falls_with_distance(s, c.east_m, c.north_m) for s, c in pairs]))


def _mean_score(samples: Sequence[RasterSample], plan: CellPlan) -> float:
    """Return how well the plan's azimuths explain the rasters, on average."""
    lobes = _lobes(samples, plan)
    scores = [lobe.score(plan[cell_id].azimuth_deg or 0.0) for cell_id, lobe in lobes.items()]
    return float(np.mean(scores)) if scores else 0.0


def _lobes(samples: Sequence[RasterSample], plan: CellPlan) -> dict[str, Lobe]:
    found = {}
    for sample in samples:
        cell = plan[sample.cell_id]
        if cell.azimuth_deg is None or cell.indoor:
            continue
        lobe = find_lobe(sample, cell.east_m, cell.north_m, cell.beamwidth_deg)
        if lobe is not None:
            found[cell.id] = lobe
    return found


def _as_watts(cell: Cell) -> str:
    dbm = 10 * np.log10(1000 * cell.eirp_dbm)
    return f"{cell.id} has {cell.eirp_dbm:g}, which as watts would be {dbm:.0f} dBm."
