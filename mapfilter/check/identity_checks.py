"""Checks that reports can tell the cells of a plan apart: by identity, by carrier and code."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapfilter.check.findings import Findings
from mapfilter.errors import listed
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import UNIQUE_IN_NETWORK, parse_cgi

_SITES_ABOUT = 6
_NEAR_M, _ROUNDED_M = 10_000.0, 2.0


def check_identities(plan: CellPlan, where: str, findings: Findings) -> None:
    """Find cells with one identity, and cells near each other on one carrier with one code.

    Near are the six nearest sites, up to 10 km away: a phone may receive both. Farther away codes
    are used again in any network.
    """
    stated: dict[bool, list[str]] = {}
    held: dict[bool, list[str]] = {}
    for (ci, *network, technology), cells in _by_identity(plan).items():
        if len(cells) > 1:
            shown = "-".join(str(part) for part in (*network, ci) if part is not None)
            # Without network and area other cells of the world have the same number, too.
            needed = network[:2] if technology in UNIQUE_IN_NETWORK else network
            is_whole = None not in needed
            stated.setdefault(is_whole, []).append(f"{listed(cells, 3)} have {shown}")
            held.setdefault(is_whole, []).extend(cells)
    for is_whole, sentences in stated.items():
        evidence = f"Reports by identity cannot tell these cells apart: {listed(sentences, 4)}."
        named = f"{where}, cells {listed(held[is_whole])}"
        findings.add("identity-repeated", named, evidence, "error" if is_whole else "warning")
    _check_codes(plan, where, findings)


def _by_identity(plan: CellPlan) -> dict[tuple[int | str | None, ...], list[str]]:
    """Return the cells of each identity: ci, mcc, mnc, area as far as it counts, technology."""
    found: dict[tuple[int | str | None, ...], list[str]] = {}
    for cell in plan.cells:
        mcc, mnc, lac, ci = cell.mcc, cell.mnc, cell.lac, cell.ci
        if ci is None and (parts := parse_cgi(cell.id)) is not None:
            mcc, mnc, lac, ci = parts
        if ci is not None:
            counts = cell.technology not in UNIQUE_IN_NETWORK or mnc is None
            key = ci, mcc, mnc, lac if counts else None, cell.technology
            found.setdefault(key, []).append(cell.id)
    return found


def _check_codes(plan: CellPlan, where: str, findings: Findings) -> None:
    groups = [group for ids in plan.ids_by_carrier.values() for group in _alike(plan, ids)]
    if not groups:
        return
    reach_m = _reach_m(plan)
    pairs: dict[frozenset[str], tuple[float, str]] = {}
    for cells in groups:
        for one, (other, away_m) in zip(cells, _nearest(cells), strict=True):
            if away_m <= max(reach_m[one.id], reach_m[other.id]) + _ROUNDED_M:
                said = f"{one.id} and {other.id} ({one.arfcn}, {one.bsic}) are {away_m:.0f} m apart"
                pairs.setdefault(frozenset((one.id, other.id)), (away_m, said))
    if not pairs:
        return
    sentences = [text for _, text in sorted(pairs.values())]
    concerned = frozenset().union(*pairs)
    ids = [cell_id for cell_id in plan.ids if cell_id in concerned]
    evidence = f"A phone that receives both cannot tell which it is: {listed(sentences, 4)}."
    findings.add("code-reused-nearby", f"{where}, cells {listed(ids)}", evidence, "warning")


def _alike(plan: CellPlan, ids: Sequence[str]) -> list[list[Cell]]:
    """Return cells of one carrier and code by technology, or together where one states none."""
    by_technology: dict[str | None, list[Cell]] = {}
    for cell_id in ids:
        cell = plan[cell_id]
        by_technology.setdefault(cell.technology, []).append(cell)
    groups = list(by_technology.values())
    if None in by_technology:
        groups = [[plan[cell_id] for cell_id in ids]]
    return [group for group in groups if len(group) > 1]


def _nearest(cells: Sequence[Cell]) -> list[tuple[Cell, float]]:
    """Return the nearest other one of each of two cells or more, and its distance."""
    from scipy.spatial import cKDTree

    places_m = np.array([(cell.east_m, cell.north_m) for cell in cells])
    away_m, found = cKDTree(places_m).query(places_m, k=2)
    # Of cells at one place either may be found first.
    second = (found[:, 0] == np.arange(len(cells))).astype(np.int64)
    rows = zip(found.tolist(), away_m.tolist(), second.tolist(), strict=True)
    return [(cells[index[at]], far_m[at]) for index, far_m, at in rows]


def _reach_m(plan: CellPlan) -> dict[str, float]:
    """Return the distance of each cell to the sixth nearest other site, at most 10 km.

    Cells at one place, to the metre, are of one site, whatever it is called.
    """
    from scipy.spatial import cKDTree

    cells_m = np.round([(cell.east_m, cell.north_m) for cell in plan.cells])
    places_m, of_cell = np.unique(cells_m, axis=0, return_inverse=True)
    count = min(_SITES_ABOUT + 1, len(places_m))
    far_m, _ = cKDTree(places_m).query(places_m, k=[count])
    reach_m = np.minimum(far_m[:, 0], _NEAR_M)[of_cell.ravel()]
    return dict(zip(plan.ids, reach_m.tolist(), strict=True))
