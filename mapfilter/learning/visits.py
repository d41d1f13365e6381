"""Visits: the level of one cell in one place on one journey, or that it was not received there.

Reports of a journey in one square of some tens of metres are one visit for each cell: their errors
are the same. Its level is the median over the reports, in which a cell that is missing counts as
weaker than what a report could hold: the weakest level in a full report, else the receiver's
sensitivity. Where the median is such a bound, the cell was not received. A cell is not missing
where a nameless neighbour may be it. A report of the serving cell alone says nothing of other
cells, unless most reports of its journey have neighbours, and none says anything of a layer
(:mod:`mapfilter.radio.layers`) of which the phone measures nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.database.field import RadioField
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.layers import layer_numbers
from mapfilter.tracks.schema import SERVING

SQUARE_M = 40.0
"""Side of the squares: shadowing has changed little within one."""
LARGEST_RADIUS_M = 60.0
"""Reports whose place is less sure make no visit."""
_APART_DB = 15.0
_AT_SENSITIVITY_DBM = -104.0
_ROWS_OF_A_LAYER = 2
"""With fewer of another layer than the serving cell's, what is missing may not be measured."""


@dataclass(frozen=True, eq=False)
class Visits:
    """N visits of cells.

    Parameters
    ----------
    journey, cell : (N,) arrays of int64
        Index of the journey, and of the cell in the plan.
    square : (N,) array of int64
        Number of the square; equal in the same place on other journeys.
    east_m, north_m : (N,) arrays
        Mean position of the reports.
    level_dbm : (N,) array
        The level, or the bound below which it was.
    received : (N,) array of bool
        Whether it is a level.
    """

    journey: Ints
    cell: Ints
    square: Ints
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    received: Bools

    def __len__(self) -> int:
        return int(self.journey.size)

    def where(self, chosen: Bools | Ints) -> Visits:
        """Return some of the visits."""
        return replace(self, **{one.name: getattr(self, one.name)[chosen] for one in fields(self)})


@dataclass(frozen=True, eq=False)
class Placed:
    """A journey's reports, and where it was.

    Parameters
    ----------
    epochs : sequence of Epoch
    east_m, north_m : (epochs,) arrays
        NaN where unknown.
    radius_m : (epochs,) array
        Radius that holds the position with 95 %.
    """

    epochs: Sequence[Epoch]
    east_m: Floats
    north_m: Floats
    radius_m: Floats


def visits_of(journeys: Sequence[Placed], plan: CellPlan, field: RadioField) -> Visits:
    """Return the visits of some journeys.

    Parameters
    ----------
    journeys : sequence of Placed
        Positions in the CRS of the plan.
    plan : CellPlan
        The cells of the database. A neighbour without identity is the cell with its carrier and
        BSIC; of several the one that is predicted 15 dB above all others in its place, or none.
    field : RadioField
        Predicted levels, for that choice.
    """
    resolver = _Resolver(plan, field)
    parts = [_of_journey(n, one, resolver) for n, one in enumerate(journeys)]
    names = [one.name for one in fields(Visits)]
    kinds: Mapping[str, type] = {
        **dict.fromkeys(("journey", "cell", "square"), np.int64),
        "received": np.bool_,
    }
    columns = {
        name: np.concatenate([part[name] for part in parts]) if parts else np.empty(0)
        for name in names
    }
    return Visits(**{name: columns[name].astype(kinds.get(name, np.float64)) for name in names})


def predicted_dbm(field: RadioField, plan: CellPlan, east_m: Floats, north_m: Floats) -> Floats:
    """Return the predicted levels of all cells of a plan at positions, shape (N, cells).

    NaN where a cell is below the floor of the database.
    """
    found = np.full((east_m.size, len(plan)), np.nan)
    row, col = field.lattice.row_col(east_m, north_m)
    row = np.clip(row, 0, field.lattice.rows - 1)
    col = np.clip(col, 0, field.lattice.cols - 1)
    columns = [plan.index(name) for name in field.cell_ids]
    found[:, columns] = field.level_dbm[row, col]
    return found


@dataclass(frozen=True)
class _Phone:
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
    def of(cls, epochs: Sequence[Epoch]) -> _Phone:
        reports = [epoch for epoch in epochs if any(map(_is_level, epoch.radio))]
        counts = [_neighbours(epoch) for epoch in reports]
        levels = (row.level_dbm for epoch in reports for row in epoch.radio if _is_level(row))
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
        return min(row.level_dbm for row in epoch.radio if _is_level(row))


class _Resolver:
    """Which cell a row of a report is of: its index in the plan, -1 where that is open."""

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


def _is_level(row: ReportRow) -> bool:
    return bool(np.isfinite(row.level_dbm)) and row.censored >= 0


def _neighbours(epoch: Epoch) -> int:
    return sum(row.role != SERVING for row in epoch.radio)


def _of_journey(
    number: int, journey: Placed, resolver: _Resolver
) -> dict[str, Floats | Ints | Bools]:
    """Return the columns of the visits of one journey."""
    cells, phone = len(resolver.plan), _Phone.of(journey.epochs)
    levels, places = [], []
    for i, epoch in enumerate(journey.epochs):
        if not any(map(_is_level, epoch.radio)):
            continue
        place = float(journey.east_m[i]), float(journey.north_m[i])
        if not (np.isfinite(place).all() and journey.radius_m[i] <= LARGEST_RADIUS_M):
            continue
        levels.append(_report(epoch, resolver, place, phone.bound_dbm(epoch)))
        places.append(place)
    if not levels:
        return {one.name: np.empty(0) for one in fields(Visits)}
    level, place_m = np.array(levels), np.array(places)
    square = np.floor(place_m / SQUARE_M).astype(np.int64)
    key = (square[:, 0] << 32) + (square[:, 1] & 0xFFFFFFFF)
    keys, which = np.unique(key, return_inverse=True)
    shape = keys.size, cells
    found, heard = np.full(shape, np.nan), np.zeros(shape, dtype=np.bool_)
    middle = np.empty((keys.size, 2))
    for n in range(keys.size):
        own = which == n
        found[n], heard[n] = _median(level[own])
        middle[n] = place_m[own].mean(axis=0)
    at, cell = np.nonzero(np.isfinite(found))
    return {
        "journey": np.full(at.size, number),
        "cell": cell,
        "square": keys[at],
        "east_m": middle[at, 0],
        "north_m": middle[at, 1],
        "level_dbm": found[at, cell],
        "received": heard[at, cell],
    }


def _report(
    epoch: Epoch, resolver: _Resolver, place: tuple[float, float], bound_dbm: float
) -> Floats:
    """Return (level, bound) of each cell in one report, shape (cells, 2); NaN where unknown."""
    cells = len(resolver.plan)
    level, bound = np.full(cells, np.nan), np.full(cells, bound_dbm)
    counts: dict[int, int] = {}
    rows = [row for row in epoch.radio if _is_level(row)]
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


def _median(reports: Floats) -> tuple[Floats, Bools]:
    """Return the median level or bound of each cell over reports (n, cells, 2)."""
    level, bound = reports[..., 0], reports[..., 1]
    heard, missing = np.isfinite(level), np.isfinite(bound)
    number = heard.sum(axis=0), missing.sum(axis=0)
    received = number[0] > number[1]
    strength = np.where(heard, level, np.where(missing, -np.inf, np.nan))
    found = np.full(level.shape[1], np.nan)
    for cell in range(level.shape[1]):
        if received[cell]:
            ranked = np.sort(strength[np.isfinite(bound[:, cell]) | heard[:, cell], cell])
            found[cell] = ranked[ranked.size // 2]
        elif number[1][cell]:
            found[cell] = np.median(bound[missing[:, cell], cell])
    return found, received
