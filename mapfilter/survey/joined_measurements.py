"""Rows of files of measurements joined to one table: sessions, places, and what is given twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapfilter._types import Bools, Floats, Ints, Ints32
from mapfilter._words import counted, number_of
from mapfilter.errors import InputError, fail, listed
from mapfilter.geodesy import project
from mapfilter.survey.measurement_rows import Rows, most_frequent
from mapfilter.survey.measurements import Measurements

_FILES_NAMED = 3


def joined_measurements(tables: Sequence[Rows], crs: str, session_gap_s: float) -> Measurements:
    """Return the rows of all files in a projected CRS; exact repetitions are left out.

    Raises
    ------
    InputError
        The CRS has none of the places.
    """
    cells = tuple(sorted({cell for table in tables for cell in table.cells}))
    places = {cell: i for i, cell in enumerate(cells)}
    names: list[str] = []
    session: list[Ints32] = []
    for table in tables:
        own = _sessions(table, session_gap_s)
        session.append((own + len(names)).astype(np.int32))
        count = int(own.max()) + 1
        stem = table.path.stem
        names += [stem] if count == 1 else [f"{stem}#{i + 1}" for i in range(count)]
    cell = [np.array([places[c] for c in t.cells], dtype=np.int32)[t.cell] for t in tables]
    columns = np.ascontiguousarray(np.concatenate([table.columns for table in tables], axis=1))
    time_s, lat_deg, lon_deg, level_dbm, accuracy_m, timing_advance, role = columns
    east_m, north_m = project(crs, lon_deg, lat_deg)
    of_session, of_cell = np.concatenate(session), np.concatenate(cell)
    joined = Measurements(
        crs,
        cells,
        {cell: identity for table in tables for cell, identity in table.identities.items()},
        tuple(names),
        of_cell,
        of_session,
        time_s,
        east_m,
        north_m,
        level_dbm,
        accuracy_m,
        _notes(tables),
        np.where(np.isnan(role), _alone(of_session, time_s, of_cell), role > 0).astype(np.bool_),
        timing_advance,
        most_frequent(table.technologies for table in tables),
        most_frequent(table.codes for table in tables),
    )
    placed = np.isfinite(east_m) & np.isfinite(north_m)
    if not placed.all():
        count = int((~placed).sum())
        if count == len(placed):
            got = f"{lat_deg[0]:g}, {lon_deg[0]:g} and {count - 1} more"
            hint = "latitude and longitude swapped, or another area"
            raise fail(InputError, "measurements", f"places where {crs} is used", got, hint)
        joined = joined.where(
            placed, f"{number_of(count, 'row')} left out: {crs} has no such places"
        )
    return _once(joined)


def _alone(session: Ints32, time_s: Floats, cell: Ints32) -> Bools:
    """Return which rows are of the only cell of their session and time."""
    known = np.isfinite(time_s)
    keys = np.column_stack([session[known], time_s[known]])
    which = np.unique(keys, axis=0, return_inverse=True)[1]
    # A cell may be given twice, or read twice in a second.
    cells = np.unique(np.column_stack([which, cell[known]]), axis=0)[:, 0]
    found = np.zeros(len(time_s), dtype=np.bool_)
    found[known] = np.bincount(cells)[which] == 1
    return found


def _notes(tables: Sequence[Rows]) -> tuple[str, ...]:
    """Return remarks by file; what more than three files share is summed up."""
    files = Counter(what for table in tables for what in table.aside)
    shared = [what for what, count in files.items() if count > _FILES_NAMED]
    found = []
    for what in shared:
        of = [table for table in tables if what in table.aside]
        total, names = sum(table.aside[what] for table in of), [table.path.name for table in of]
        found.append(f"{counted(total, what)} in {len(of)} files ({listed(names)})")
        noted = counted(of[0].aside[what], what)
        example = next((note for note in of[0].notes() if noted in note), "")
        if (at := example.find(", such as ")) >= 0:
            found[-1] += example[at:]
    kept = (
        replace(t, aside=Counter({w: n for w, n in t.aside.items() if w not in shared}))
        for t in tables
    )
    return (*found, *(note for table in kept for note in table.notes()))


def _sessions(table: Rows, gap_s: float) -> Ints:
    """Return the session of each row of a file, counted from 0 in the order of the rows."""
    named = np.array(table.session)
    time_s = table.columns[0]
    order = np.lexsort((time_s, named))
    with np.errstate(invalid="ignore"):
        begins = (np.diff(named[order]) != 0) | (np.diff(time_s[order]) > gap_s)
    ranks = np.empty(len(order), dtype=np.int64)
    ranks[order] = np.concatenate([[0], np.cumsum(begins)])
    return ranks


def _once(rows: Measurements) -> Measurements:
    """Leave out rows that repeat another in everything."""
    table = np.column_stack(
        [rows.session, rows.cell, rows.time_s, rows.east_m, rows.north_m, rows.level_dbm]
    )
    # A row without a time may be a second, equal reading.
    table[np.isnan(rows.time_s), 2] = -1.0 - np.flatnonzero(np.isnan(rows.time_s))
    _, first = np.unique(table, axis=0, return_index=True)
    if len(first) == len(rows):
        return rows
    kept = np.zeros(len(rows), dtype=np.bool_)
    kept[first] = True
    return rows.where(kept, f"{number_of(len(rows) - len(first), 'row')} left out: given twice")
