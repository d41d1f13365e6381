"""Cells by the ids of a plan: of one reported cell by identity, or by carrier and code."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import SERVING, UNIQUE_IN_NETWORK, parse_cgi

_SHORT_CI = 1 << 16


@dataclass(frozen=True, slots=True)
class ReportedCell:
    """One combination of a cell's id, identity, carrier and code, as reports give it."""

    role: str
    cell: str | None
    technology: str | None
    mcc: int | None
    mnc: int | None
    lac: int | None
    ci: int | None
    arfcn: int | None
    bsic: int | None


class PlanNames:
    """The identities, carriers and codes of a plan, by which reported cells get its ids."""

    def __init__(self, plan: CellPlan) -> None:
        self.plan = plan
        self.by_ci: dict[int, list[Cell]] = {}
        for cell in plan.cells:
            if cell.ci is None and (found := parse_cgi(cell.id)) is not None:
                mcc, mnc, lac, ci = found
                cell = replace(cell, mcc=mcc, mnc=mnc, lac=lac, ci=ci)
            if cell.ci is not None:
                self.by_ci.setdefault(cell.ci, []).append(cell)

    def name(self, reported: ReportedCell) -> str | None:
        """Return the plan's id of a reported cell, or what was reported."""
        if reported.cell is not None and reported.cell in self.plan:
            return reported.cell
        if reported.ci is None and reported.cell is not None:
            reported = _with_identity(reported)
        if reported.ci is not None:
            return self._by_identity(reported) or reported.cell or _shown(reported)
        if reported.cell is not None or reported.arfcn is None or reported.bsic is None:
            return reported.cell
        return self._by_carrier(reported.arfcn, reported.bsic, reported)

    def _by_identity(self, reported: ReportedCell) -> str | None:
        assert reported.ci is not None
        found = [c for c in self.by_ci.get(reported.ci, ()) if _fits(c, reported)]
        if not found and reported.ci >= _SHORT_CI and reported.technology in ("UMTS", None):
            short = self.by_ci.get(reported.ci % _SHORT_CI, ())
            # The short identity is unique in a location area only.
            found = [c for c in short if c.lac is not None and c.lac == reported.lac]
            found = [c for c in found if _fits(c, reported)]
        return found[0].id if len(found) == 1 else None

    def _by_carrier(self, arfcn: int, bsic: int, reported: ReportedCell) -> str | None:
        ids = self.plan.ids_by_carrier.get((arfcn, bsic), ())
        cells = [self.plan[one] for one in ids]
        same = [c.id for c in cells if _same_technology(c.technology, reported.technology)]
        if reported.role == SERVING:
            return same[0] if len(same) == 1 else None
        if len(same) == len(ids):
            return None
        # A filter resolves by carrier and code alone, and would take a cell of another technology.
        unknown = f"{reported.technology} carrier {arfcn}, code {bsic}"
        return same[0] if len(same) == 1 else unknown if not same else None


def _with_identity(reported: ReportedCell) -> ReportedCell:
    """Return a reported cell with the identity that its id states, if any."""
    found = parse_cgi(reported.cell or "")
    if found is None:
        return reported
    mcc, mnc, lac, ci = found
    return replace(reported, mcc=mcc, mnc=mnc, lac=lac, ci=ci)


def _same_technology(one: str | None, other: str | None) -> bool:
    return one is None or other is None or one == other


def _fits(cell: Cell, reported: ReportedCell) -> bool:
    """Return whether no part of an identity that both sides state differs."""
    if not _same_technology(cell.technology, reported.technology):
        return False
    names = ["mcc", "mnc", "lac"]
    by_network = cell.mnc is not None and reported.mnc is not None
    if by_network and (reported.technology or cell.technology) in UNIQUE_IN_NETWORK:
        names.remove("lac")
    pairs = [(getattr(cell, name), getattr(reported, name)) for name in names]
    return all(one is None or other is None or one == other for one, other in pairs)


def _shown(reported: ReportedCell) -> str:
    parts = (reported.mcc, reported.mnc, reported.lac, reported.ci)
    return "-".join(str(part) for part in parts if part is not None)
