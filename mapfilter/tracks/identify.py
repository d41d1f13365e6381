"""Cells of a log by the ids of a plan: identities, and carriers with codes, by technology."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import IDENTITY, UNIQUE_IN_NETWORK, parse_cgi
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.neighbour_codes import (
    CODED,
    CodedRow,
    has_codes_without_carrier,
    neighbours_by_code,
)
from mapfilter.tracks.schema import SERVING

_KEYS = ("technology", *IDENTITY, "arfcn", "bsic")
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


def name_by_plan(log: TrackLog, plan: CellPlan) -> TrackLog:
    """Return a log whose reported cells have the ids of a plan, where the plan has them.

    A cell whose id the plan does not know is looked up by its identity: the columns ``mcc``,
    ``mnc``, ``lac`` and ``ci``, or an id that is a CGI, ECGI or NCGI. Parts that either side does
    not state are not compared, and a single cell must fit; the tracking area does not count in LTE
    and NR, and the RNC is dropped in UMTS where the plan has 16-bit identities. A serving cell
    without any identity is looked up by carrier and code. Neighbours without an identity are left
    to the filter, unless the plan has their carrier and code in several technologies; in UMTS, LTE
    and NR they get a carrier, or a cell, where their code tells it
    (:mod:`mapfilter.tracks.neighbour_codes`).

    Returns
    -------
    TrackLog
        The same object where nothing changes; what was named is in its notes.
    """
    radio = log.radio
    cells = radio["cell"]
    if radio.empty or bool(cells.isin(plan.ids).all()):
        return log
    columns = [_values(radio, name) for name in ("role", "cell", *_KEYS)]
    number_of_key: dict[tuple[Any, ...], int] = {}
    numbers = [
        number_of_key.setdefault(values, len(number_of_key))
        for values in zip(*columns, strict=True)
    ]
    table = PlanNames(plan)
    named: list[str | None] = []
    found = _Counts()
    for values, count in zip(number_of_key, np.bincount(numbers).tolist(), strict=True):
        reported = ReportedCell(*map(_plain, values))
        named.append(table.name(reported))
        found.add(reported, named[-1], plan, count)
    if any(found.named.values()) or found.hidden:
        # Without the dtype pandas 3 makes these strings, and None becomes NaN.
        new = pd.Series([named[i] for i in numbers], index=radio.index, dtype=object)
        log = replace(log, radio=radio.assign(cell=new), notes=(*log.notes, *found.notes()))
    return _by_codes(log, plan)


def _by_codes(log: TrackLog, plan: CellPlan) -> TrackLog:
    """Return a log whose neighbours of a code have the carriers and cells that it tells."""
    radio = log.radio
    bare = radio["arfcn"].isna() & radio["bsic"].notna() & (radio["role"] != SERVING)
    if not bare.any() and not has_codes_without_carrier(plan):
        return log
    columns = [_values(radio, name) for name in CODED]
    rows = [CodedRow(*values) for values in zip(radio["time_s"], *columns, strict=True)]
    found = neighbours_by_code(rows, plan)
    changes = list(zip(rows, found, strict=True))
    carried = sum(row.arfcn is None and carrier is not None for row, (carrier, _) in changes)
    named = sum(row.cell is None and cell is not None for row, (_, cell) in changes)
    notes: list[str] = []
    if carried:
        radio = radio.assign(arfcn=pd.array([carrier for carrier, _ in found], dtype="Int64"))
        taken = number_of(carried, "neighbour has", "neighbours have")
        notes.append(f"radio: {taken} no carrier, taken to be on the serving cell's")
    if named:
        cells = pd.Series([cell for _, cell in found], index=radio.index, dtype=object)
        radio = radio.assign(cell=cells)
        taken = number_of(named, "neighbour")
        notes.append(f"radio: {taken} named by code alone, as the plan lacks carriers")
    return replace(log, radio=radio, notes=(*log.notes, *notes)) if notes else log


def _values(table: pd.DataFrame, name: str) -> list[Any]:
    """Return the values of a column, None where there are none."""
    if name not in table:
        return [None] * len(table)
    values: list[Any] = table[name].to_numpy(dtype=object, na_value=None).tolist()
    return values


def _plain(value: Any) -> Any:
    return int(value) if isinstance(value, int | float | np.number) else value


class _Counts:
    """Rows that got an id, and rows of cells that the plan does not have."""

    def __init__(self) -> None:
        self.named: dict[str, int] = {}
        self.lost: dict[str, int] = {}
        self.hidden = False

    def add(self, reported: ReportedCell, name: str | None, plan: CellPlan, rows: int) -> None:
        if name is not None and name in plan and name != reported.cell:
            self.named[name] = self.named.get(name, 0) + rows
        elif name is not None and name not in plan:
            self.lost[name] = self.lost.get(name, 0) + rows
            self.hidden |= name != reported.cell

    def notes(self) -> Iterable[str]:
        if self.named:
            rows, cells = sum(self.named.values()), len(self.named)
            held = f"{number_of(rows, 'row')} of {number_of(cells, 'cell')}"
            yield f"radio: {held} named by the plan's identities"
        if self.lost:
            often = sorted(self.lost, key=lambda name: (-self.lost[name], name))
            rows, some = sum(self.lost.values()), listed(often)
            lost = f"{number_of(rows, 'row')} of {number_of(len(self.lost), 'cell')}"
            yield f"radio: {lost} that the plan lacks ({some})"


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
