"""The candidate filter of Khalaf-Allah (2007) over a radio-route database."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import nan

import numpy as np

from mapfilter.database.nearest import CellPointIndex
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.filters.candidate import CandidateOptions, CandidateSearch
from mapfilter.filters.contract import Reason
from mapfilter.options import NotNegative
from mapfilter.positioning.belief_tracker import BeliefTracker, TrackState
from mapfilter.positioning.epochs import Epoch, serving_cell
from mapfilter.positioning.filter import Hypotheses, check_over

PointsOf = Callable[[str], CellPointIndex | None]


@dataclass(frozen=True, slots=True)
class CandidateFilter(CandidateOptions):
    """Global positioning by candidates (Khalaf-Allah 2007, Tables 2 and 3).

    It uses dead reckoning and the serving cell. The parameters besides ``margin_db`` are those of
    :class:`mapfilter.filters.candidate.CandidateOptions`: what the paper leaves open.

    Parameters
    ----------
    margin_db : float or None
        A point belongs to every cell within this margin of its layer's best server; by default
        the margin that the database was built with.
    """

    margin_db: NotNegative | None = None

    @property
    def name(self) -> str:
        """The filter's name."""
        return "candidate"

    def over(self, database: RadioRouteDatabase, *, ways: bool = True) -> CandidateTracker:
        """Return the filter over the area of a database."""
        check_over(self, database)
        points_of = cell_points(database, self.margin_db)
        return CandidateTracker(
            CandidateSearch(points_of, self, database.lattice.resolution_m),
            database,
            startable(points_of),
            serving_cell,
            "candidate",
            takes=("motion", "serving"),
            ways=ways,
        )


def cell_points(database: RadioRouteDatabase, margin_db: float | None = None) -> PointsOf:
    """Return a function that gives the points of a cell, read at its first use and kept.

    Parameters
    ----------
    margin_db : float or None
        As for :class:`CandidateFilter`.
    """
    known = frozenset(database.cell_ids)

    @cache
    def points_of(cell: str) -> CellPointIndex | None:
        if cell not in known:
            return None
        row, col, _ = database.cell_points(cell, margin_db)
        return CellPointIndex.of_points(database.lattice, row, col)

    return points_of


def startable(points_of: PointsOf) -> Callable[[str], Reason]:
    """Return a function: USED for a cell with points, else why no filter can start from it."""

    def reason(cell: str) -> Reason:
        points = points_of(cell)
        if points is None:
            return Reason.UNKNOWN_CELL
        return Reason.USED if len(points) else Reason.NO_POINTS_IN_CELL

    return reason


@dataclass(frozen=True, eq=False, repr=False)
class CandidateTracker(BeliefTracker):
    """The candidate filter over epochs."""

    def warm_up(self, merged: Sequence[Epoch]) -> None:
        """Read the points of the serving cells, and load the compiled search."""
        super().warm_up(merged)
        for cell in {serving_cell(epoch) for epoch in merged} - {None}:
            points = self.filter.points_of(cell)  # type: ignore[attr-defined]
            if points is not None:
                points.nearest(0.0, 0.0, 0.0)

    def hypotheses(self, state: TrackState) -> Hypotheses | None:
        """Return the candidates, all of one weight."""
        if state.belief is None:
            return None
        count = state.belief.east_m.size
        weight = np.full(count, 1 / count if count else nan)
        return Hypotheses(state.belief.east_m, state.belief.north_m, weight)
