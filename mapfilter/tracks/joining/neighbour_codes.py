"""Neighbours of UMTS, LTE and NR by their codes, where a carrier is missing in reports or plan.

A phone measures neighbours on the carrier that it is served on, and others seldom. Many phones give
the scrambling code or PCI of a neighbour without the carrier, and many plans lack carriers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.layers import SHARED_CARRIER
from mapfilter.tracks.schema import SERVING

_REACH_M = 35_000.0
"""No neighbour is farther away from the serving cell."""
_APART, _SITE_M = 2.0, 1.0
"""How many times farther the next cell of the same code has to be, and at least how far in m."""


CODED = ("role", "cell", "technology", "ci", "arfcn", "bsic")
"""Columns of a report's row, after its time, that a :class:`CodedRow` has."""


@dataclass(frozen=True, slots=True)
class CodedRow:
    """A row of a report: rows of equal time are one report; ``ci`` is CI, ECI or NCI."""

    time_s: float
    role: str
    cell: str | None
    technology: str | None
    ci: int | None
    arfcn: int | None
    bsic: int | None

    @property
    def has_code_alone(self) -> bool:
        """Whether this is a neighbour that nothing but a code may tell, with a carrier or not."""
        nameless = self.cell is None and self.ci is None
        return self.role != SERVING and nameless and self.bsic is not None


def neighbours_by_code(
    rows: Sequence[CodedRow], plan: CellPlan
) -> list[tuple[int | None, str | None]]:
    """Return carrier and cell of each row, completed where a neighbour's code tells them.

    Only in UMTS, LTE and NR, whose neighbours share the carrier of the serving cell: a neighbour
    without a carrier has that of the serving cells of its report, if they have one. Where the plan
    has neither that carrier with the code, nor the carriers of cells of the code, the neighbour is
    the one of them nearest to the serving cell, if the next one is twice as far.
    """
    served: dict[float, dict[tuple[str, int | None], Cell | None]] = {}
    for row in rows:
        if row.role != SERVING:
            continue
        known = plan[row.cell] if row.cell is not None and row.cell in plan else None
        family = row.technology or (known.technology if known else None)
        carrier = known.arfcn if row.arfcn is None and known else row.arfcn
        if family in SHARED_CARRIER:
            of_it = served.setdefault(row.time_s, {})
            # A second row of that carrier, without a name, hides none that has one.
            of_it[family, carrier] = known or of_it.get((family, carrier))
    uncarried = _without_carrier(plan)
    chosen: dict[tuple[str | None, str, int], str | None] = {}
    found: list[tuple[int | None, str | None]] = []
    for row in rows:
        found.append((row.arfcn, row.cell))
        if not row.has_code_alone:
            continue
        assert row.bsic is not None
        of_it = served.get(row.time_s, {})
        like = [key for key in of_it if row.technology in (None, key[0])]
        if len(like) != 1:
            continue
        family, carrier = like[0]
        arfcn = carrier if row.arfcn is None else row.arfcn
        cells = uncarried.get((family, row.bsic), [])
        if cells and (arfcn is None or (arfcn, row.bsic) not in plan.ids_by_carrier):
            at = of_it[like[0]]
            key = (at.id if at else None, family, row.bsic)
            if key not in chosen:
                chosen[key] = _nearest(cells, at)
            found[-1] = arfcn, chosen[key]
        else:
            found[-1] = arfcn, None
    return found


def has_codes_without_carrier(plan: CellPlan) -> bool:
    """Return whether some cells of a plan can only be told by a code."""
    return bool(_without_carrier(plan))


def _without_carrier(plan: CellPlan) -> dict[tuple[str, int], list[Cell]]:
    """Return the cells of a plan that have a code and no carrier, by technology and code."""
    found: dict[tuple[str, int], list[Cell]] = {}
    for cell in plan.cells:
        if cell.technology in SHARED_CARRIER and cell.arfcn is None and cell.bsic is not None:
            found.setdefault((cell.technology, cell.bsic), []).append(cell)
    return found


def _nearest(cells: Sequence[Cell], serving: Cell | None) -> str | None:
    """Return the one of some cells of a code that is clearly nearest to the serving cell."""
    if serving is None:
        return cells[0].id if len(cells) == 1 else None
    away = sorted(
        (hypot(cell.east_m - serving.east_m, cell.north_m - serving.north_m), cell.id)
        for cell in cells
        if cell.id != serving.id
    )
    if not away or away[0][0] > _REACH_M:
        return None
    # Carriers of one sector share a code and a place.
    apart = len(away) == 1 or away[1][0] >= max(_APART * away[0][0], _SITE_M)
    return away[0][1] if apart else None
