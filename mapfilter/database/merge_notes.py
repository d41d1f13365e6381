"""What a merged database says of those that it is made of: their names, and cells that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from itertools import count as counted
from pathlib import Path

from mapfilter._words import number_of
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import listed
from mapfilter.radio.cells import Cell

_USUAL = "database"
"""Name of the folder that ``build`` writes, which tells nothing."""
_MOST_SHOWN = 6


def names_apart(paths: Sequence[Path]) -> list[str]:
    """Return a short name of each path: as many of its last parts as tell them apart.

    Two parts at least where a folder has the usual name of databases.

    Examples
    --------
    >>> names_apart([Path("/x/north.db"), Path("/x/south.db")])
    ['north.db', 'south.db']
    >>> names_apart([Path("/x/north/database"), Path("/x/south/database")])
    ['north/database', 'south/database']
    """
    parts = [path.absolute().parts for path in paths]
    different = len(set(parts))
    least = 2 if any(path.name == _USUAL for path in paths) else 1
    count = next(n for n in counted(least) if len({one[-n:] for one in parts}) == different)
    return [Path(*one[-count:]).as_posix() for one in parts]


def merge_notes(databases: Sequence[RadioRouteDatabase]) -> tuple[str, ...]:
    """Return which cells have other values in a later database, whose entries a merged one keeps.

    Parameters
    ----------
    databases : sequence of RadioRouteDatabase
        In the order in which they are merged.
    """
    known: dict[str, Cell] = {}
    notes = []
    for name, database in zip(names_apart([d.path for d in databases]), databases, strict=True):
        changed = [
            f"{cell.id} ({differences})"
            for cell in database.plan.cells
            if (differences := _differences(known.get(cell.id, cell), cell))
        ]
        if changed:
            many = number_of(len(changed), "cell differs", "cells differ")
            shown = listed(changed, _MOST_SHOWN)
            notes.append(
                f"{name}: {many} from an earlier database, and the later entry is kept: {shown}"
            )
        known |= {cell.id: cell for cell in database.plan.cells}
    return tuple(notes)


def _differences(older: Cell, cell: Cell) -> str:
    names = (one.name for one in fields(Cell))
    pairs = ((name, getattr(older, name), getattr(cell, name)) for name in names)
    return ", ".join(
        f"{name} {_shown(before)}, now {_shown(now)}"
        for name, before, now in pairs
        if before != now
    )


def _shown(value: object) -> str:
    if value is None or value == "":
        return "none"
    return f"{value:g}" if isinstance(value, float) else str(value)
