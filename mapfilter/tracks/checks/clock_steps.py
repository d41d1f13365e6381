"""Clocks that are set back while a log is recorded, so that the same times come twice.

Sorted by time, the rows of two minutes would lie between each other: a walk at twice its speed, and
levels of two streets in turns. Rows after the step are taken to go on from the row before it, until
the clock is set forward again by as much; or, where that fits the begin and the end of the other
tables better, rows before it are taken earlier. A table with too few rows to show the step follows
where its end then fits. Rows that are out of order do not overlap so, and are sorted; so is a
second series that begins where the first one does.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd

from mapfilter._types import Floats

_STEPS = 3
_ROWS, _DENSE = 3, 0.7
"""At most so many steps are those of a clock; so many times come again between the same two, and
both sides have so large a share of those that the usual interval allows."""
_INTERVALS, _SERIES_INTERVALS = 2.0, 3.0
"""A clock set forward by as much as it was set back is set again, up to so many intervals; what
begins as near to the begin of the table is another series."""
_LEAST_ROWS = 30
"""Of fewer times nothing is said."""
_SINGLE = ("motion", "gnss", "truth")
"""Tables with one row at a time."""

Reading = Literal["again", "later", "earlier"]
"""Rows are later until the clock is set again; all later rows are; or earlier ones are earlier."""


class ClockStep(NamedTuple):
    """A clock that was set back.

    ``at_s`` is the last time before it, ``back_s`` by how much the next one is less, ``late_s``
    what makes the next time that after the usual interval. ``row`` is the first row after the step,
    and ``again`` that from which on the clock is right again, the number of rows if it never is;
    ``again_s`` is its time, infinite if there is none.
    """

    row: int
    at_s: float
    back_s: float
    late_s: float
    again: int
    again_s: float


def clock_steps(time_s: Floats) -> tuple[ClockStep, ...]:
    """Return the steps of a clock in the times of a table's rows, (N,); none if there are many.

    Examples
    --------
    >>> clock_steps(np.concatenate([np.arange(28.0), np.arange(24.0, 39.0)]))
    (ClockStep(row=28, at_s=27.0, back_s=3.0, late_s=4.0, again=43, again_s=inf),)
    >>> clock_steps(np.array([0.0, 2.0, 1.0, 3.0]))
    ()
    """
    change_s = np.diff(time_s)
    back = np.flatnonzero(change_s < 0)
    if not 0 < back.size <= _STEPS or np.count_nonzero(change_s > 0) < _LEAST_ROWS:
        return ()
    usual_s = float(np.median(change_s[change_s > 0]))
    ends = [*back[1:].tolist(), time_s.size - 1]
    found = [_step(time_s, int(at), int(end), usual_s) for at, end in zip(back, ends, strict=True)]
    steps = tuple(step for step in found if step is not None)
    return steps if len(steps) == back.size else ()


def _step(time_s: Floats, at: int, end: int, usual_s: float) -> ClockStep | None:
    """Return a step after a row if rows on both sides lie densely between the same times."""
    before, after = np.unique(time_s[: at + 1]), np.unique(time_s[at + 1 :])
    if after[0] - before[0] <= _SERIES_INTERVALS * usual_s:
        return None
    first, last = after[0], min(before[-1], after[-1])
    least = max(_ROWS, _DENSE * ((last - first) / usual_s + 1))
    if min(np.sum((rows >= first) & (rows <= last)) for rows in (before, after)) < least:
        return None
    back_s = float(time_s[at] - time_s[at + 1])
    late_s = back_s + usual_s
    forward_s = np.diff(time_s[at + 1 : end + 1]) - usual_s
    again = np.flatnonzero(np.abs(forward_s - late_s) <= _INTERVALS * usual_s)
    size = time_s.size
    set_again = at + 2 + int(again[0]) if again.size else size
    again_s = float(time_s[set_again]) if set_again < size else float("inf")
    return ClockStep(at + 1, float(time_s[at]), back_s, late_s, set_again, again_s)


def with_clocks_gone_on(
    tables: Mapping[str, pd.DataFrame], names: Mapping[str, str]
) -> tuple[dict[str, pd.DataFrame], tuple[str, ...]]:
    """Return tables whose times go on where a clock was set back, and notes on it.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Rows in the order in which they were written. Times that are no finite numbers are left to
        later checks, with their table.
    names : mapping of str to str
        Of tables in notes.

    Examples
    --------
    >>> time_s = np.concatenate([np.arange(28.0), np.arange(24.0, 39.0)])
    >>> tables, notes = with_clocks_gone_on({"motion": pd.DataFrame({"time_s": time_s})}, {})
    >>> tables["motion"]["time_s"].tolist() == np.arange(43.0).tolist()
    True
    >>> print(notes[0][:70])
    motion: time goes back by 3 s after 27 s, as when a clock is set back;
    """
    known = {table: _times_of(rows) for table, rows in tables.items()}
    times = {table: time_s for table, time_s in known.items() if time_s.size}
    steps = _steps_by_table(tables, times)
    if not steps:
        return dict(tables), ()
    found, notes = dict(tables), []
    # A ground truth is no part of what is located.
    stepped = {table: one for table, one in steps.items() if table != "truth"}
    others = {t: time_s for t, time_s in times.items() if t not in steps and t != "truth"}
    reading, follow = _best_reading(times, stepped, others)
    for table in (table for table in tables if table in steps or table in follow):
        if table in steps:
            time_s = times[table] + _shift_of_rows(steps[table], reading, times[table].size)
            said = _told(steps[table], reading)
        else:
            leader = _leader(times, stepped)
            time_s = times[table] + _shift_of_times(steps[leader], reading, times[table])
            said = f"rows are taken later with those of {names.get(leader, leader)}"
        found[table] = tables[table].assign(time_s=time_s)
        notes.append(f"{names.get(table, table)}: {said}")
    return found, tuple(notes)


def _steps_by_table(
    tables: Mapping[str, pd.DataFrame], times: Mapping[str, Floats]
) -> dict[str, tuple[ClockStep, ...]]:
    """Return the steps of each table that shows some.

    Several series may be written one after the other, such as the serving cell's and then those of
    neighbours, or one satellite after another. So reports are judged by the serving cell's rows,
    and tables of many satellites or cells by whether another table shows the same steps.
    """
    every = {table: clock_steps(time_s) for table, time_s in times.items()}
    found = {table: every[table] for table in _SINGLE if every.get(table)}
    if every.get("radio") and "role" in tables["radio"]:
        # Roles that are missing are refused later.
        serving = (tables["radio"]["role"] == "serving").to_numpy(dtype=np.bool_, na_value=False)
        served = clock_steps(times["radio"][serving])
        if [step.back_s for step in served] == [step.back_s for step in every["radio"]]:
            found["radio"] = every["radio"]
    shown = [steps for table, steps in found.items() if table != "truth"]
    for table in every.keys() - {*_SINGLE, "radio"}:
        if every[table] and any(_same(every[table], steps) for steps in shown):
            found[table] = every[table]
    return found


def _same(steps: tuple[ClockStep, ...], others: tuple[ClockStep, ...]) -> bool:
    """Return whether the steps of two tables are those of one clock, but for their intervals."""
    if len(steps) != len(others):
        return False
    return all(
        max(abs(one.back_s - other.back_s), abs(one.at_s - other.at_s))
        <= (one.late_s - one.back_s) + (other.late_s - other.back_s)
        for one, other in zip(steps, others, strict=True)
    )


def _best_reading(
    times: Mapping[str, Floats],
    stepped: Mapping[str, tuple[ClockStep, ...]],
    others: Mapping[str, Floats],
) -> tuple[Reading, frozenset[str]]:
    """Return the reading with which all tables begin and end together, and which others follow.

    Of equal ones the first: a clock that is set again was wrong in between.
    """
    readings: list[Reading] = ["later"]
    if any(np.isfinite(step.again_s) for steps in stepped.values() for step in steps):
        readings.insert(0, "again")
    if not stepped or not others:
        return readings[0], frozenset()
    if all(len(steps) == 1 for steps in stepped.values()):
        readings.append("earlier")
    leader = _leader(times, stepped)
    costs: list[tuple[float, frozenset[str]]] = []
    for reading in readings:
        shifted = [
            times[table] + _shift_of_rows(steps, reading, times[table].size)
            for table, steps in stepped.items()
        ]
        reach_s = min(one.min() for one in shifted), max(one.max() for one in shifted)
        total_s, follow = 0.0, set[str]()
        for table, time_s in others.items():
            own_s = _beyond_s(time_s, reach_s)
            with_it = time_s + _shift_of_times(stepped[leader], reading, time_s)
            shared_s = _beyond_s(with_it, reach_s)
            if _is_too_sparse(time_s, stepped[leader]) and shared_s < own_s:
                follow.add(table)
                own_s = shared_s
            total_s += own_s
        costs.append((round(total_s, 1), frozenset(follow)))
    best = min(range(len(readings)), key=lambda k: costs[k][0])
    return readings[best], costs[best][1]


def _leader(times: Mapping[str, Floats], stepped: Mapping[str, object]) -> str:
    """Return the table of those that show a step which has the most rows."""
    return max(stepped, key=lambda table: times[table].size)


def _is_too_sparse(time_s: Floats, steps: tuple[ClockStep, ...]) -> bool:
    """Return whether a table has too few rows to show the steps itself."""
    unique_s = np.unique(time_s)
    usual_s = float(np.median(np.diff(unique_s))) if unique_s.size > 1 else np.inf
    return min(step.back_s for step in steps) < _ROWS * usual_s


def _shift_of_rows(steps: tuple[ClockStep, ...], reading: Reading, size: int) -> Floats:
    """Return by how much the rows of a table that shows steps are later, (size,)."""
    row, shift_s = np.arange(size), np.zeros(size)
    for step in steps:
        if reading == "earlier":
            shift_s -= step.late_s * (row < step.row)
        else:
            end = step.again if reading == "again" else size
            shift_s += step.late_s * ((row >= step.row) & (row < end))
    return shift_s


def _shift_of_times(steps: tuple[ClockStep, ...], reading: Reading, time_s: Floats) -> Floats:
    """Return by how much rows of another table are later: those that are after a step for sure."""
    shift_s = np.zeros(time_s.size)
    for step in steps:
        if reading != "earlier":
            end_s = step.again_s - step.late_s if reading == "again" else np.inf
            shift_s += step.late_s * ((time_s > step.at_s) & (time_s <= end_s))
    return shift_s


def _beyond_s(time_s: Floats, reach_s: tuple[float, float]) -> float:
    """Return how far begin and end are from those of other tables."""
    return float(abs(time_s.min() - reach_s[0]) + abs(time_s.max() - reach_s[1]))


def _told(steps: tuple[ClockStep, ...], reading: Reading) -> str:
    """Return what a note says of the steps of a table, and of what was done."""
    back = ", ".join(f"by {step.back_s:g} s after {step.at_s:g} s" for step in steps)
    late = ", ".join(f"{step.late_s:g} s" for step in steps)
    done = {
        "again": f"rows until it is set again are taken {late} later",
        "later": f"later rows are taken {late} later",
        "earlier": f"earlier rows are taken {late} earlier",
    }
    return f"time goes back {back}, as when a clock is set back; {done[reading]}"


def _times_of(rows: pd.DataFrame) -> Floats:
    """Return the times of a table's rows; none where one is not a finite number."""
    if "time_s" not in rows:
        return np.empty(0)
    try:
        # Of a CSV file they are texts still.
        seconds = pd.to_numeric(rows["time_s"], errors="coerce")
    except TypeError:
        return np.empty(0)
    time_s: Floats = seconds.to_numpy(dtype=np.float64, na_value=np.nan)
    return time_s if np.isfinite(time_s).all() else np.empty(0)
