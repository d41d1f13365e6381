"""Kinds of measurement in a log: the rows of each, and the log without some."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from difflib import get_close_matches
from typing import get_args

import pandas as pd

from mapfilter._arguments import shown
from mapfilter.errors import ConfigError, fail
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import NEIGHBOUR, TABLES, Kind, Without

_PART_OF: dict[Without, str] = {"fixes": "gnss", "ta": "radio", "neighbours": "radio"}
"""Tables of those parts that are not left out by the name of their table."""


def rows_by_kind(log: TrackLog) -> dict[Kind, pd.DataFrame]:
    """Return the rows of each kind of measurement."""
    found: dict[Kind, pd.DataFrame] = {}
    for name, table in TABLES.items():
        rows = getattr(log, name)
        for kind in table.kinds:
            found[kind] = rows if len(table.kinds) == 1 else rows[rows["role"] == kind]
    return found


def leave_out(log: TrackLog, kinds: Collection[Without]) -> TrackLog:
    """Return a log without some kinds of measurements; its notes count them.

    Parameters
    ----------
    kinds : collection of str
        Tables by their names, such as ``tdoa`` and ``radio`` (all reports); ``gnss`` leaves out
        ``fixes`` and ``pseudoranges``. Of the reports: ``ta`` (timing advances) and ``neighbours``
        (all cells but the serving one).

    Raises
    ------
    ConfigError
        One of them is no kind, or they are no list.

    Examples
    --------
    >>> from mapfilter.tracks.log import make_log
    >>> received = pd.DataFrame({"time_s": [0.0, 0.0], "role": ["serving", "neighbour"]})
    >>> log = make_log("EPSG:32635", radio=received.assign(timing_advance=[1, None]))
    >>> alone = leave_out(log, ["neighbours", "ta"])
    >>> alone.radio["role"].tolist(), alone.radio["timing_advance"].isna().all()
    (['serving'], np.True_)
    >>> print(*alone.notes, sep="; ")
    ta: 1 left out; neighbours: 1 left out
    """
    _check_kinds(kinds)
    wanted, notes = set(kinds), list(log.notes)
    if "gnss" in wanted:
        wanted.discard("fixes")
        if len(log.pseudoranges):
            wanted.add("pseudoranges")
    if "radio" in wanted:
        wanted.discard("neighbours")
    for kind in (one for one in get_args(Without) if one in wanted):
        table = _PART_OF.get(kind, kind)
        rows = getattr(log, table)
        if kind == "ta":
            count = int(rows["timing_advance"].notna().sum())
            kept = rows.assign(timing_advance=pd.array([pd.NA] * len(rows), dtype="Int64"))
        elif kind == "neighbours":
            neighbour = rows["role"] == NEIGHBOUR
            count, kept = int(neighbour.sum()), rows[~neighbour].reset_index(drop=True)
        else:
            count, kept = len(rows), rows.iloc[:0]
        log = replace(log, **{table: kept})
        if count:
            notes.append(f"{kind}: {count} left out")
    return replace(log, notes=tuple(notes))


def _check_kinds(kinds: object) -> None:
    known = get_args(Without)
    given = kinds if isinstance(kinds, Collection) and not isinstance(kinds, str) else None
    for one in [kinds] if given is None else given:
        if given is not None and one in known:
            continue
        expected, near = f"a list, each of {', '.join(known)}", ""
        if isinstance(one, str):
            near = next(iter(get_close_matches(one, known, 1)), "")
        hint = "a text; give a list of it" if one in known else near
        raise fail(ConfigError, "without", expected, shown(one), hint)
