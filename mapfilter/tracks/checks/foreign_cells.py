"""Cells that a plan does not have: of another network, or with parts of the identity exchanged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

from pandas import DataFrame, isna

from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import parse_cgi
from mapfilter.radio.plan_names import PlanNames, ReportedCell
from mapfilter.tracks.schema import NEIGHBOUR, SERVING

_UPLINK_APART = 18_000
"""EARFCN of an uplink less that of its downlink, of paired bands of LTE (3GPP TS 36.101, 5.7.3)."""
_NAMED = 4


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
    own = _networks(table)
    if not networks or not own or networks & own:
        return ""
    return f"they are of {_named(networks)}, the {of} holds {_named(own, '')}"


def other_networks(radio: DataFrame, plan: CellPlan) -> str:
    """Return how many reports are of networks that a plan does not hold; "" for none.

    Parameters
    ----------
    radio : pandas.DataFrame
        Rows of cells that the plan lacks: cell and, where the log has them, mcc and mnc.

    Examples
    --------
    >>> from mapfilter.radio.cells import Cell
    >>> identity = {"mcc": 244, "mnc": 91, "lac": 3021, "ci": 11701}
    >>> cell = Cell("A", "S", 0.0, 0.0, 30.0, 0.0, 55.0, 1800.0, **identity)
    >>> plan = CellPlan("EPSG:32635", (cell,))
    >>> other_networks(DataFrame({"cell": ["244-91-1-2", "244-5-1-2", "244-5-1-3"]}), plan)
    '2 of them are of network 244-05, the plan holds 244-91'
    """
    own = _networks(PlanNames(plan))
    if not own:
        return ""
    named = (parse_cgi(str(name)) for name in radio["cell"])
    networks = [None if found is None else found[:2] for found in named]
    if {"mcc", "mnc"} <= set(radio):
        stated = zip(radio["mcc"], radio["mnc"], strict=True)
        networks = [
            by_name if isna(mcc) or isna(mnc) else (int(mcc), int(mnc))
            for by_name, (mcc, mnc) in zip(networks, stated, strict=True)
        ]
    others = Counter(network for network in networks if network is not None and network not in own)
    if not others:
        return ""
    count = others.total()
    some = f"{count} of them {'is' if count == 1 else 'are'}"
    return f"{some} of {_named(others)}, the plan holds {_named(own, '')}"


def _networks(table: PlanNames) -> set[tuple[int, int]]:
    """Return mcc and mnc of the cells of a plan that have both."""
    return {
        (cell.mcc, cell.mnc)
        for cells in table.by_ci.values()
        for cell in cells
        if cell.mcc is not None and cell.mnc is not None
    }


def unknown_neighbours_note(radio: DataFrame, plan: CellPlan) -> tuple[str, ...]:
    """Return a note where no cell of a plan can be most of the neighbours that a log names by code.

    Parameters
    ----------
    radio : pandas.DataFrame
        Of a track log whose cells are named by the plan: role, cell, arfcn and bsic.
    """
    by_code = (radio["role"] == NEIGHBOUR) & radio["cell"].isna() & radio["bsic"].notna()
    arfcn = radio["arfcn"][by_code]
    if arfcn.empty or not len(plan):
        return ()
    if all(cell.bsic is None for cell in plan.cells):
        rows = number_of(len(arfcn), "neighbour")
        return (f"{rows} can be no cell of the plan, as it states no codes (bsic)",)
    held = Counter(cell.arfcn for cell in plan.cells if cell.arfcn is not None)
    # Cells without a carrier may be on any.
    elsewhere = arfcn[arfcn.notna() & ~arfcn.isin(list(held))]
    if sum(held.values()) < len(plan) or 2 * len(elsewhere) <= len(arfcn):
        return ()
    found = Counter(int(one) for one in elsewhere)
    uplink = sum(one + sign * _UPLINK_APART in held for one in found for sign in (-1, 1))
    likely = " (likely: carriers of the uplink in one of them)" if uplink else ""
    neighbours = number_of(len(arfcn), "neighbour")
    return (
        f"{len(elsewhere)} of {neighbours} can be no cell of the plan: they are on carriers "
        f"(arfcn, EARFCN) {_most(found)}, and its cells on {_most(held)}{likely}",
    )


def _most(carriers: Counter[int]) -> str:
    return listed([str(carrier) for carrier, _ in carriers.most_common()], _NAMED)


def _named(networks: Collection[tuple[int, int]], what: str = "network ") -> str:
    return what + listed([f"{mcc}-{mnc:02d}" for mcc, mnc in sorted(networks)], 4)
