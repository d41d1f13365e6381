"""Cells that a plan does not have: of another network, or with parts of the identity exchanged."""

from __future__ import annotations

from collections.abc import Collection

from mapfilter.errors import listed
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import parse_cgi
from mapfilter.radio.plan_names import PlanNames, ReportedCell
from mapfilter.tracks.schema import SERVING


def foreign_cells(names: Collection[str], plan: CellPlan, of: str = "database") -> str:
    """Return why a plan may not have some cells that are named by identities; "" for no reason.

    ``of`` is what has that plan, in words.

    Examples
    --------
    >>> from mapfilter.radio.cells import Cell
    >>> identity = {"mcc": 244, "mnc": 91, "lac": 3021, "ci": 11701}
    >>> cell = Cell("A", "S", 0.0, 0.0, 30.0, 0.0, 55.0, 1800.0, **identity)
    >>> plan = CellPlan("EPSG:32635", (cell,))
    >>> foreign_cells(["244-91-11701-3021"], plan)
    '1 of them would be with lac (tac) and ci exchanged: columns exchanged?'
    >>> foreign_cells(["244-05-3021-11701"], plan)
    'they are of network 244-05, the database holds 244-91'
    """
    identities = [found for name in names if (found := parse_cgi(name)) is not None]
    if not identities:
        return ""
    table, exchanged = PlanNames(plan), 0
    networks: set[tuple[int, int]] = set()
    for mcc, mnc, lac, ci in identities:
        other = ReportedCell(SERVING, None, None, mcc, mnc, ci, lac, None, None)
        if lac is not None and table.name(other) in plan:
            exchanged += 1
        elif mcc is not None and mnc is not None:
            networks.add((mcc, mnc))
    # One among many fits by accident.
    if exchanged > len(identities) / 2:
        return f"{exchanged} of them would be with lac (tac) and ci exchanged: columns exchanged?"
    own = {
        (cell.mcc, cell.mnc)
        for cells in table.by_ci.values()
        for cell in cells
        if cell.mcc is not None and cell.mnc is not None
    }
    if not networks or not own or networks & own:
        return ""
    return f"they are of {_named(networks)}, the {of} holds {_named(own, '')}"


def _named(networks: Collection[tuple[int, int]], what: str = "network ") -> str:
    return what + listed([f"{mcc}-{mnc:02d}" for mcc, mnc in sorted(networks)], 4)
