"""Visits: the level of one cell in one place on one journey, or that it was not received there.

Reports of a journey in one square of some tens of metres are one visit for each cell: their errors
are the same. Its level is the median over the reports, in which a cell that is missing counts as
weaker than what a report could hold (:mod:`mapfilter.learning.report_levels`). Where the median is
such a bound, the cell was not received.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.database.field import RadioField
from mapfilter.learning.report_levels import Phone, Resolver, is_level, levels_and_bounds
from mapfilter.positioning.epochs import Epoch
from mapfilter.radio.cells import CellPlan

SQUARE_M = 40.0
"""Side of the squares: shadowing has changed little within one."""
LARGEST_RADIUS_M = 60.0
"""Reports whose place is less sure make no visit."""


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
    resolver = Resolver(plan, field)
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


def _of_journey(
    number: int, journey: Placed, resolver: Resolver
) -> dict[str, Floats | Ints | Bools]:
    """Return the columns of the visits of one journey."""
    cells, phone = len(resolver.plan), Phone.of(journey.epochs)
    levels, places = [], []
    for i, epoch in enumerate(journey.epochs):
        if not any(map(is_level, epoch.radio)):
            continue
        place = float(journey.east_m[i]), float(journey.north_m[i])
        if not (np.isfinite(place).all() and journey.radius_m[i] <= LARGEST_RADIUS_M):
            continue
        levels.append(levels_and_bounds(epoch, resolver, place, phone.bound_dbm(epoch)))
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
