"""The weakest level that a database keeps, and how finely levels are kept."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from mapfilter.radio.cells import CellPlan

FLOOR_DBM: Final = -104.0
"""Sensitivity in GSM; it holds for cells of unknown technology, too."""

FLOORS_DBM: Final[Mapping[str, float]] = {
    "GSM": FLOOR_DBM,
    "UMTS": -115.0,
    "LTE": -125.0,
    "NR": -125.0,
}
"""By technology, of what phones report: RxLev, RSCP, RSRP and SS-RSRP.

The latter three are of a part of the carrier (:mod:`mapfilter.radio.reported_power`), and as much
weaker where the carrier is as strong.
"""

DECIMALS: Final = 2
"""Levels and margins are kept to 0.01 dB."""

_WEAK_SHARE = 0.05


def floor_of(plan: CellPlan, floor_dbm: float | None = None) -> float:
    """Return the floor of a database: the one that is given, or the usual one of its cells (dBm).

    A database has one floor; of several technologies the lowest counts.

    Examples
    --------
    >>> floor_of(CellPlan("EPSG:32635", ())), floor_of(CellPlan("EPSG:32635", ()), -110)
    (-104.0, -110.0)
    """
    if floor_dbm is not None:
        return float(floor_dbm)
    return min((FLOORS_DBM[name] for name in _technologies(plan)), default=FLOOR_DBM)


def floor_notes(plan: CellPlan, floor_dbm: float | None = None) -> tuple[str, ...]:
    """Return a note on the floor that was taken, where it is neither given nor that of GSM.

    Technologies that have a higher one usually are named, as it holds for their cells, too.
    """
    taken_dbm = floor_of(plan, floor_dbm)
    if floor_dbm is not None or taken_dbm == FLOOR_DBM:
        return ()
    usual = {name: FLOORS_DBM[name] for name in sorted(_technologies(plan))}
    names = [name for name, floor in usual.items() if floor == taken_dbm]
    higher = [f"{name} (usually {floor:g})" for name, floor in usual.items() if floor > taken_dbm]
    note = f"database.floor_dbm = {taken_dbm:g} is taken"
    note += f", the usual one of {' and '.join(names)} cells"
    if higher:
        note += f"; it holds for {' and '.join(higher)}, too: a database has one floor"
    return (note,)


def weak_points_note(counts: Mapping[str, int], floor_dbm: float) -> tuple[str, ...]:
    """Return a note where the floor leaves out more than 5 % of the points that have levels.

    Parameters
    ----------
    counts : mapping of str to int
        Of the manifest of a database that was built.

    Examples
    --------
    >>> weak_points_note({"points": 990, "points_below_floor": 10}, -104.0)
    ()
    """
    weak = counts["points_below_floor"]
    points = counts["points"] + weak
    if weak <= _WEAK_SHARE * points:
        return ()
    why = "likely: RSRP or RSCP, which are weaker than RxLev: lower it, or state the technology"
    return (
        f"{weak} of {points} points left out: all of their levels are below database.floor_dbm = "
        f"{floor_dbm:g} ({why} of the cells)",
    )


def _technologies(plan: CellPlan) -> set[str]:
    return {cell.technology for cell in plan.cells if cell.technology is not None}
