"""Several views over one database as one, with their runs side by side."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from mapfilter.errors import Faults, InputError
from mapfilter.viewing.arrays import packed, unpacked

_SAME = ("database", "frame")
_NUMBERED = {
    "statuses": (("epochs", "status"),),
    "reasons": (("epochs", "reason"), ("readings", "use"), ("unused", "reason")),
}
"""Lists of a view, and the columns of a run that are numbers in them."""


def side_by_side(views: Sequence[tuple[str, Mapping[str, Any]]]) -> dict[str, Any]:
    """Return a view with the runs of all.

    Levels are those of the view whose levels reach farthest, of one with the filter's constants
    where there is one; statuses and reasons are those of all views, which other versions of
    mapfilter may have numbered in another way; names that occur twice get the number of their
    view, or the next number with which they are unlike all others.

    Parameters
    ----------
    views : sequence of (str, bundle)
        Each with its file's name, for messages.

    Raises
    ------
    InputError
        They are of different databases, or a view holds no run.
    """
    faults = Faults()
    first = views[0][1]
    for name, view in views:
        if view.get("kind") != "replay" or not view.get("runs"):
            faults.add(name, "a view of a replay", f"a view of a {view.get('kind')}")
        elif any(view.get(part) != first.get(part) for part in _SAME):
            hint = "replay all logs with the same --db"
            faults.add(name, f"runs over the database of {views[0][0]}", "another database", hint)
    faults.raise_if_any(InputError)
    found = dict(first)
    having = [view for _, view in views if view.get("levels")]
    best = max(having, key=_reach, default=first)
    found["levels"], found["why"] = best.get("levels"), best.get("why")
    for listed in _NUMBERED:
        found[listed] = list(
            dict.fromkeys(one for _, view in views for one in view.get(listed, ()))
        )
    found["words"] = {key: text for _, view in views for key, text in view.get("words", {}).items()}
    names: set[str] = set()
    runs: list[dict[str, Any]] = []
    for number, (_, view) in enumerate(views, start=1):
        for run in view["runs"]:
            name = _unlike(str(run["name"]), names, number)
            names.add(name)
            runs.append({**_renumbered(run, view, found), "name": name})
    found["runs"] = runs
    found["title"] = " | ".join(dict.fromkeys(str(view["title"]) for _, view in views))
    found["notes"] = list(dict.fromkeys(note for _, view in views for note in view["notes"]))
    return found


def _renumbered(
    run: Mapping[str, Any], view: Mapping[str, Any], found: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return a run of a view with the numbers of another one's statuses and reasons."""
    for listed, columns in _NUMBERED.items():
        old, new = view.get(listed, []), found[listed]
        if old == new[: len(old)]:
            continue
        number = np.array([new.index(one) for one in old], dtype=np.int64)
        for table, column in columns:
            if run.get(table):
                values = number.take(unpacked(run[table][column]), mode="clip")
                run = {**run, table: {**run[table], column: packed(values, "u1")}}
    return run


def _unlike(name: str, others: Collection[str], number: int) -> str:
    """Return a name that none of the others is: with a number behind it where it has to be."""
    if name not in others:
        return name
    numbered = (f"{name} ({one})" for one in itertools.count(number))
    return next(one for one in numbered if one not in others)


def _reach(view: Mapping[str, Any]) -> tuple[bool, float]:
    """Return whether the filter's constants are in a view, and over how much its levels reach."""
    grid = view["levels"]["grid"]
    return view.get("why") is not None, grid["rows"] * grid["cols"] * grid["step"] ** 2
