"""Checks that reports can tell the cells of a plan apart: by identity, by carrier and code."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from mapfilter.check.findings import Findings
from mapfilter.errors import listed
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import parse_cgi

_UNIQUE_IN_NETWORK = ("LTE", "NR")
"""Technologies whose cell identity is unique in a network, whatever the tracking area."""
_SITES_ABOUT = 6
_NEAR_M = 10_000.0


def check_identities(plan: CellPlan, where: str, findings: Findings) -> None:
    """Find cells with one identity, and cells near each other on one carrier with one code.

    Near are the six nearest sites, up to 10 km away: a phone may receive both. Farther away codes
    are used again in any network.
    """
    stated: dict[bool, list[str]] = {}
    held: dict[bool, list[str]] = {}
    for (ci, *others), cells in _by_identity(plan).items():
        if len(cells) > 1:
            # Without network and area other cells of the world have the same number, too.
            whole = None not in others[:2] and (others[2] is not None or others[3] is not None)
            shown = "-".join(str(part) for part in (*others[:3], ci) if part is not None)
            stated.setdefault(whole, []).append(f"{listed(cells, 3)} have {shown}")
            held.setdefault(whole, []).extend(cells)
    for whole, sentences in stated.items():
        evidence = f"Reports by identity cannot tell these cells apart: {listed(sentences, 4)}."
        named = f"{where}, cells {listed(held[whole])}"
        findings.add("identity-repeated", named, evidence, "error" if whole else "warning")
    _check_codes(plan, where, findings)


def _by_identity(plan: CellPlan) -> dict[tuple[int | str | None, ...], list[str]]:
    """Return the cells of each identity: ci, mcc, mnc, area and technology as far as they count."""
    found: dict[tuple[int | str | None, ...], list[str]] = {}
    for cell in plan.cells:
        mcc, mnc, lac, ci = cell.mcc, cell.mnc, cell.lac, cell.ci
        if ci is None and (parts := parse_cgi(cell.id)) is not None:
            mcc, mnc, lac, ci = parts
        if ci is None:
            continue
        unique = cell.technology in _UNIQUE_IN_NETWORK and mnc is not None
        key = ci, mcc, mnc, None if unique else lac, cell.technology if unique else None
        found.setdefault(key, []).append(cell.id)
    return found


def _check_codes(plan: CellPlan, where: str, findings: Findings) -> None:
    reused = [ids for ids in plan.ids_by_carrier.values() if len(ids) > 1]
    if not reused:
        return
    reach_m = _reach_m(plan)
    pairs = [
        (one, other, away_m)
        for ids in reused
        for one, other in combinations([plan[cell_id] for cell_id in ids], 2)
        if _same_technology(one, other)
        and (away_m := float(np.hypot(one.east_m - other.east_m, one.north_m - other.north_m)))
        <= max(reach_m[one.site], reach_m[other.site])
    ]
    if not pairs:
        return
    said = [
        f"{one.id} and {other.id} ({one.arfcn}, {one.bsic}) are {away_m:.0f} m apart"
        for one, other, away_m in sorted(pairs, key=lambda pair: pair[2])
    ]
    evidence = f"A phone that receives both cannot tell which it is: {listed(said, 4)}."
    ids = dict.fromkeys(cell.id for pair in pairs for cell in pair[:2])
    findings.add("code-reused-nearby", f"{where}, cells {listed(list(ids))}", evidence, "warning")


def _reach_m(plan: CellPlan) -> dict[str, float]:
    """Return the distance of each site to the sixth nearest other one, at most 10 km."""
    site_at = {cell.site: (cell.east_m, cell.north_m) for cell in reversed(plan.cells)}
    places_m = np.array(list(site_at.values()))
    count = min(_SITES_ABOUT + 1, len(places_m))
    far_m, _ = cKDTree(places_m).query(places_m, k=[count])
    return dict(zip(site_at, np.minimum(far_m[:, 0], _NEAR_M).tolist(), strict=True))


def _same_technology(one: Cell, other: Cell) -> bool:
    return None in (one.technology, other.technology) or one.technology == other.technology
