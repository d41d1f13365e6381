"""What one report says of each cell: its level, or the bound below which it was.

A cell that is missing is weaker than what a report could hold: the weakest level in a full report,
else the receiver's sensitivity. It is not missing where a nameless neighbour may be it. A report of
the serving cell alone says nothing of other cells, unless most reports of its journey have
neighbours, and none says anything of a layer (:mod:`mapfilter.radio.layers`) of which the phone
measures nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.database.field import RadioField
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.layers import layer_numbers
from mapfilter.tracks.schema import SERVING

_APART_DB = 15.0
_AT_SENSITIVITY_DBM = -104.0
_ROWS_OF_A_LAYER = 2
"""With fewer of another layer than the serving cell's, what is missing may not be measured."""


@dataclass(frozen=True)
class Phone:
    """What the reports of a journey can hold.

    Parameters
    ----------
    most : int
        Neighbours in a full report.
    weakest_dbm : float
        Its sensitivity: no level is below it.
    lists_neighbours : bool
        Whether most of its reports have neighbours: one without any then received none.
    """

    most: int
    weakest_dbm: float
    lists_neighbours: bool

    @classmethod
    def of(cls, epochs: Sequence[Epoch]) -> Phone:
        """Return what a phone's reports on one journey show of it."""
        reports = [epoch for epoch in epochs if any(map(is_level, epoch.radio))]
        counts = [_neighbours(epoch) for epoch in reports]
        levels = (row.level_dbm for epoch in reports for row in epoch.radio if is_level(row))
        return cls(
            max(counts, default=0),
            min(levels, default=_AT_SENSITIVITY_DBM),
            2 * sum(count > 0 for count in counts) > len(counts),
        )

    def bound_dbm(self, epoch: Epoch) -> float:
        """Return below which level a cell is that a report lacks; NaN where that is unknown."""
        neighbours = _neighbours(epoch)
        if not (neighbours or self.lists_neighbours):
            return math.nan
        if neighbours < self.most:
            return self.weakest_dbm
        return min(row.level_dbm for row in epoch.radio if is_level(row))


class Resolver:
    """Finds which cells of a plan the rows of reports are of, or may be of.

    Parameters
    ----------
    plan : CellPlan
        Cells are indices into it.
    field : RadioField
        Predicted levels, by which one of several cells with the same carrier and BSIC is chosen.
    """

    def __init__(self, plan: CellPlan, field: RadioField) -> None:
        self.plan, self.field = plan, field
        self.carriers = {
            key: tuple(plan.index(name) for name in ids) for key, ids in plan.ids_by_carrier.items()
        }
        self.band = {plan.index(name): i for i, name in enumerate(field.cell_ids)}
        self.layer = layer_numbers(plan.cells)
        codes = [(cell.arfcn, cell.bsic) for cell in plan.cells]
        self.codes = np.array(codes, dtype=np.float64).reshape(-1, 2)

    def cell(self, row: ReportRow, serving: int, east_m: float, north_m: float) -> int:
        """Return the cell of a row, -1 where that is open.

        Of several with its carrier and BSIC it is the one that is predicted 15 dB above all others
        in its place.

        Parameters
        ----------
        row : ReportRow
        serving : int
            The serving cell of the report, which no neighbour is; -1 where it is unknown.
        east_m, north_m : float
            Where it was received, in the CRS of the field.
        """
        if row.cell is not None:
            return self.plan.index(row.cell) if row.cell in self.plan else -1
        if row.arfcn is None or row.bsic is None:
            return -1
        known = [c for c in self.carriers.get((row.arfcn, row.bsic), ()) if c != serving]
        if len(known) < 2:
            return known[0] if known else -1
        lattice = self.field.lattice
        at = lattice.row_col(east_m, north_m)
        if not lattice.contains(*at):
            return -1
        level = [
            float(self.field.level_dbm[(*at, self.band[c])]) if c in self.band else np.nan
            for c in known
        ]
        ranked = np.nan_to_num(np.array(level), nan=-np.inf)
        order = np.argsort(-ranked)
        clear = ranked[order[0]] - ranked[order[1]] >= _APART_DB
        return known[int(order[0])] if clear else -1

    def may_be(self, row: ReportRow) -> Sequence[int] | Ints:
        """Return the cells that a row is of, may be of, or that are not reported beside it.

        Of one carrier and BSIC the phone reports the strongest cell only. A neighbour that the
        plan's carriers and codes do not tell may be a cell without them.
        """
        known: list[int] = []
        if row.cell is not None and row.cell in self.plan:
            known.append(self.plan.index(row.cell))
        if row.arfcn is not None and row.bsic is not None:
            known += self.carriers.get((row.arfcn, row.bsic), ())
        if known or row.cell is not None:
            return known
        code = np.array([row.arfcn, row.bsic], dtype=np.float64)
        fits = np.isnan(self.codes) | np.isnan(code) | (self.codes == code)
        return np.flatnonzero(fits.all(axis=1))


def is_level(row: ReportRow) -> bool:
    """Return whether a row has a level, or one that is at least so strong."""
    return bool(np.isfinite(row.level_dbm)) and row.censored >= 0


def _neighbours(epoch: Epoch) -> int:
    return sum(row.role != SERVING for row in epoch.radio)


def levels_and_bounds(
    epoch: Epoch, resolver: Resolver, place: tuple[float, float], bound_dbm: float
) -> Floats:
    """Return level and bound of each cell in one report, dBm, shape (cells, 2).

    A cell has one of them, or none; the others are NaN.

    Parameters
    ----------
    epoch : Epoch
        With the report.
    resolver : Resolver
    place : (float, float)
        Where it was received, east and north in metres.
    bound_dbm : float
        Of cells that it lacks; NaN where unknown.
    """
    cells = len(resolver.plan)
    level, bound = np.full(cells, np.nan), np.full(cells, bound_dbm)
    counts: dict[int, int] = {}
    rows = [row for row in epoch.radio if is_level(row)]
    serving = -1
    for row in sorted(rows, key=lambda row: row.role != SERVING):
        cell = resolver.cell(row, serving, *place)
        serving = cell if row.role == SERVING else serving
        if cell >= 0:
            layer = int(resolver.layer[cell])
            counts[layer] = counts.get(layer, 0) + 1
        if cell >= 0 and np.isnan(level[cell]):
            level[cell] = row.level_dbm
    for row in epoch.radio:
        if row.censored >= 0:
            bound[resolver.may_be(row)] = np.nan
    if resolver.layer.any():
        # Of other layers than the serving cell's a phone measures few cells, or none.
        measured = {layer for layer, count in counts.items() if count >= _ROWS_OF_A_LAYER}
        measured |= {int(resolver.layer[serving])} if serving >= 0 else set()
        bound[~np.isin(resolver.layer, list(measured))] = np.nan
    return np.column_stack([level, np.where(np.isnan(level), bound, np.nan)])
