"""Cells of a log by the ids of a plan: identities, and carriers with codes, by technology."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import IDENTITY
from mapfilter.radio.plan_names import PlanNames, ReportedCell
from mapfilter.tracks.joining.neighbour_codes import (
    CODED,
    CodedRow,
    has_codes_without_carrier,
    neighbours_by_code,
)
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING

_KEYS = ("technology", *IDENTITY, "arfcn", "bsic")


def name_by_plan(log: TrackLog, plan: CellPlan) -> TrackLog:
    """Return a log whose reported cells have the ids of a plan, where the plan has them.

    A cell whose id the plan does not know is looked up by its identity: the columns ``mcc``,
    ``mnc``, ``lac`` and ``ci``, or an id that is a CGI, ECGI or NCGI. Parts that either side does
    not state are not compared, and a single cell must fit; the tracking area does not count in LTE
    and NR, and the RNC is dropped in UMTS where the plan has 16-bit identities. A serving cell
    without any identity is looked up by carrier and code. Neighbours without an identity are left
    to the filter, unless the plan has their carrier and code in several technologies; in UMTS, LTE
    and NR they get a carrier, or a cell, where their code tells it
    (:mod:`mapfilter.tracks.joining.neighbour_codes`).

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
