"""Clocks that are set back while a log is recorded, so that the same times come twice.

Sorted by time, the rows of two minutes would lie between each other: a walk at twice its speed, and
levels of two streets in turns. Rows after the step are taken to go on from the row before it, until
the clock is set forward again by as much; or, where that fits the begin and the end of the other
tables better, rows before it are taken earlier. Where the other tables have no room for either, as
when all have one clock and too few rows to show it, rows are sorted. So are rows that are out of
order, which do not overlap so, and a second series that begins where the first one does.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

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


_SINGLE = ("motion", "gnss", "truth")
"""Tables with one row at a time."""


class ClockStep(NamedTuple):
    """A clock that was set back.

    ``at_s`` is the last time before it, ``back_s`` by how much the next one is less, ``late_s``
    what makes the next time that after the usual interval. ``row`` is the first row after the step,
    and ``again`` that from which on the clock is right again, the number of rows if it never is.
    """

    row: int
    at_s: float
    back_s: float
    late_s: float
    again: int


def clock_steps(time_s: Floats) -> tuple[ClockStep, ...]:
    """Return the steps of a clock in the times of a table's rows, (N,); none if there are many.

    Examples
    --------
    >>> clock_steps(np.concatenate([np.arange(8.0), np.arange(4.0, 9.0)]))
    (ClockStep(row=8, at_s=7.0, back_s=3.0, late_s=4.0, again=13),)
    >>> clock_steps(np.array([0.0, 2.0, 1.0, 3.0]))
    ()
    """
    change_s = np.diff(time_s)
    back = np.flatnonzero(change_s < 0)
    if not 0 < back.size <= _STEPS or not (change_s > 0).any():
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
    set_again = at + 2 + int(again[0]) if again.size else time_s.size
    return ClockStep(at + 1, float(time_s[at]), back_s, late_s, set_again)


def gone_on(time_s: Floats, reach_s: tuple[float, float] | None = None) -> tuple[Floats, str]:
    """Return times that go on where a clock was set back, and what a note says of it.

    Parameters
    ----------
    time_s : ndarray, shape (N,)
        As the rows of a table give them.
    reach_s : tuple of float, optional
        First and last time of the tables whose clock was not set.

    Returns
    -------
    time_s : ndarray, shape (N,)
        The same where there is no step.
    note : str
        Empty where there is no step.

    Examples
    --------
    >>> times, note = gone_on(np.concatenate([np.arange(8.0), np.arange(4.0, 9.0)]))
    >>> times.tolist() == np.arange(13.0).tolist()
    True
    >>> note
    'time goes back by 3 s after 7 s, as when a clock is set back; later rows are taken 4 s later'
    """
    steps = clock_steps(time_s)
    if not steps:
        return time_s, ""
    told = ", ".join(f"by {step.back_s:g} s after {step.at_s:g} s" for step in steps)
    options = _options(time_s, steps)
    if reach_s is not None:
        options.append((time_s, "sorted by time, as the other tables end with it"))
    # Of equal ones the first: a clock that is set again was wrong in between.
    best = min(options, key=lambda option: round(_beyond_s(option[0], reach_s), 1))
    return best[0], f"time goes back {told}, as when a clock is set back; {best[1]}"


def _options(time_s: Floats, steps: tuple[ClockStep, ...]) -> list[tuple[Floats, str]]:
    """Return the times as they may have been meant, each with what was done to them."""
    row = np.arange(time_s.size)
    late = ", ".join(f"{step.late_s:g} s" for step in steps)
    found = []
    if any(step.again < time_s.size for step in steps):
        shift_s = sum(step.late_s * ((row >= step.row) & (row < step.again)) for step in steps)
        found.append((time_s + shift_s, f"rows until it is set again are taken {late} later"))
    shift_s = sum(step.late_s * (row >= step.row) for step in steps)
    found.append((time_s + shift_s, f"later rows are taken {late} later"))
    if len(steps) == 1:
        shift_s = -steps[0].late_s * (row < steps[0].row)
        found.append((time_s + shift_s, f"earlier rows are taken {late} earlier"))
    return found


def _beyond_s(time_s: Floats, reach_s: tuple[float, float] | None) -> float:
    """Return how far begin and end are from those of the other tables; 0 where there are none."""
    if reach_s is None:
        return 0.0
    return float(abs(time_s.min() - reach_s[0]) + abs(time_s.max() - reach_s[1]))


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
    """
    known = {table: _times_of(rows) for table, rows in tables.items()}
    times = {table: time_s for table, time_s in known.items() if time_s.size}
    stepped = {table for table, time_s in times.items() if _is_set_back(table, tables, time_s)}
    # A ground truth is no part of what is located.
    steady = [times[table] for table in times.keys() - stepped - {"truth"}]
    reach_s = None
    if steady:
        reach_s = min(float(one.min()) for one in steady), max(float(one.max()) for one in steady)
    found, notes = dict(tables), []
    for table in (table for table in tables if table in stepped):
        time_s, note = gone_on(times[table], reach_s)
        found[table] = tables[table].assign(time_s=time_s)
        notes.append(f"{names.get(table, table)}: {note}")
    return found, tuple(notes)


def _times_of(rows: pd.DataFrame) -> Floats:
    """Return the times of a table's rows; none where one is not a finite number."""
    if "time_s" in rows and pd.api.types.is_numeric_dtype(rows["time_s"].dtype):
        time_s: Floats = rows["time_s"].to_numpy(dtype=np.float64, na_value=np.nan)
        if np.isfinite(time_s).all():
            return time_s
    return np.empty(0)


def _is_set_back(table: str, tables: Mapping[str, pd.DataFrame], time_s: Floats) -> bool:
    """Return whether a table of one series of times shows that its clock was set back.

    Several series may be written one after the other, such as the serving cell's and then those of
    neighbours: reports are judged by the former alone.
    """
    steps, rows = clock_steps(time_s), tables[table]
    if not steps or table in _SINGLE:
        return bool(steps)
    if table != "radio" or "role" not in rows:
        return False
    served = clock_steps(time_s[(rows["role"] == "serving").to_numpy(dtype=np.bool_)])
    return [step.back_s for step in served] == [step.back_s for step in steps]
