"""From located journeys to findings, and from findings to a patch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Ints
from mapfilter.database.field import RadioField
from mapfilter.learning.fit import Learned, fit_network
from mapfilter.learning.network import Finding
from mapfilter.learning.patch import Change
from mapfilter.learning.patterns import Patterns
from mapfilter.learning.visits import Placed, Visits, predicted_dbm, visits_of
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.schema import SERVING


@dataclass(frozen=True, eq=False)
class Lesson:
    """What journeys tell of the cells of a database.

    Parameters
    ----------
    learned : Learned
    visits : Visits
    """

    learned: Learned
    visits: Visits

    @property
    def trusted(self) -> Bools:
        """Which journeys were located where they were."""
        return np.asarray(self.learned.trust > 0.5)

    @property
    def visits_by_journey(self) -> Ints:
        """Number of visits of each journey."""
        return np.bincount(self.visits.journey, minlength=len(self.learned.trust))


@dataclass(frozen=True)
class UnlistedCell:
    """A cell that serves, and that the database lacks.

    Parameters
    ----------
    cell : str
    journeys : int
        In which it served.
    east_m, north_m : float
        Mean position of its reports; NaN where none is known.
    """

    cell: str
    journeys: int
    east_m: float
    north_m: float


def lesson_of(
    journeys: Sequence[Placed], plan: CellPlan, field: RadioField, floor_dbm: float
) -> Lesson:
    """Learn the cells of a database from located journeys.

    Parameters
    ----------
    journeys : sequence of Placed
        In the CRS of the database.
    plan, field, floor_dbm
        Of the database.
    """
    visits = visits_of(journeys, plan, field)
    first, place = _places(visits)
    east_m, north_m = visits.east_m[first], visits.north_m[first]
    level_dbm = predicted_dbm(field, plan, east_m, north_m)
    patterns = Patterns(plan, east_m, north_m, level_dbm, floor_dbm)
    return Lesson(fit_network(visits, patterns, place, len(journeys)), visits)


def changes_of(findings: Sequence[Finding], offsets_db: dict[str, float]) -> tuple[Change, ...]:
    """Return the changes that findings propose: what cells point to first, offsets last.

    Parameters
    ----------
    offsets_db : mapping of str to float
        Offsets of moved cells from what is predicted in their new place.
    """
    order = ("rotated", "swapped", "turned", "moved", "offset", "dead")
    ranked = sorted(findings, key=lambda one: order.index(one.kind))
    return tuple(_change(one, offsets_db) for one in ranked)


def unlisted_cells(journeys: Sequence[Placed], plan: CellPlan) -> tuple[UnlistedCell, ...]:
    """Return the serving cells that a plan lacks, the most frequent first."""
    places: dict[str, list[tuple[float, float]]] = {}
    seen: dict[str, set[int]] = {}
    for number, journey in enumerate(journeys):
        for i, epoch in enumerate(journey.epochs):
            for row in epoch.radio:
                if row.role == SERVING and row.cell is not None and row.cell not in plan:
                    at = float(journey.east_m[i]), float(journey.north_m[i])
                    places.setdefault(row.cell, []).append(at)
                    seen.setdefault(row.cell, set()).add(number)
    found = []
    for cell in sorted(places, key=lambda name: -len(places[name])):
        every = np.array(places[cell])
        known = every[np.isfinite(every).all(axis=1)]
        middle = known.mean(axis=0) if len(known) else np.full(2, math.nan)
        found.append(UnlistedCell(cell, len(seen[cell]), float(middle[0]), float(middle[1])))
    return tuple(found)


def _places(visits: Visits) -> tuple[Ints, Ints]:
    """Return the first visit of each journey and square, and the number of each visit's."""
    key = np.stack([visits.journey, visits.square])
    _, first, place = np.unique(key, axis=1, return_index=True, return_inverse=True)
    return first, place.ravel()


def _change(one: Finding, offsets_db: dict[str, float]) -> Change:
    nothing = math.nan
    east_m, north_m = one.place_m or (nothing, nothing)
    offset_db = one.value if one.kind == "offset" else nothing
    if one.kind == "moved":
        offset_db = offsets_db.get(one.cells[0], nothing)
    return Change(
        one.kind,
        one.cells,
        offset_db=offset_db,
        turn_deg=one.value if one.kind in ("turned", "rotated") else nothing,
        east_m=east_m,
        north_m=north_m,
        log_bayes_factor=one.log_bayes_factor,
        probability=one.probability,
        journeys=one.journeys,
        agreeing=one.agreeing,
    )
