"""Rows of steps of one time, delivered late or cut to its second: given times of their own."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.tracks.pdr.step_counts import STEPS_PER_S, are_own_counts
from mapfilter.tracks.readers.recorded.recorded_values import duplicates

_ROWS, _LEAST_S, _LEAST_TIMES = 3.0, 2.0, 3
_SLOWEST_S, _FASTEST_S = 1.0, 0.2
"""Longest time of a step, and the shortest: others are no steps."""
_MOSTLY, _REPEATED = 0.9, 0.5
_FEWEST_CHANGES, _CHANGING, _CHANGING_ALIKE = 5.0, 0.05, 0.01
"""Least number, and shares of all times, of changes between times given once and those given twice:
a part that was delivered twice begins and ends but once. The latter share counts where rows of
different times are equal, too, so that being equal tells nothing."""
_ALIKE = _STEADY = 0.9
_STEP_M, _STEPS_PER_S = (0.3, 1.1), (1.5, 2.5)
"""Lengths of one step, and how many of them a walker makes."""


def times_of_batches(time_s: Floats) -> Floats:
    """Return times of rows that came in batches, spread over the time since the batch before.

    Batches have three rows or more in the mean, lie 2 s or more apart, and are those of somebody
    who walks: 5 rows a second at most. After a rest each row is one of the last seconds.

    Parameters
    ----------
    time_s : (N,) array
        In rising order.

    Returns
    -------
    (N,) array
        The same object where there are no batches.

    Examples
    --------
    >>> times_of_batches(np.repeat([10.0, 14.0, 18.0, 40.0], 4))[4:].round(1).tolist()
    [11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 37.0, 38.0, 39.0, 40.0]
    """
    times, first, count = np.unique(time_s, return_index=True, return_counts=True)
    if times.size < _LEAST_TIMES or time_s.size < _ROWS * times.size:
        return time_s
    apart_s = np.diff(times)
    each_s = apart_s / count[1:]
    if np.median(apart_s) < _LEAST_S or np.mean(each_s >= _FASTEST_S) < _MOSTLY:
        return time_s
    # What is delivered at first is walked as usual.
    each_s = np.minimum(np.append(np.median(each_s), each_s), _SLOWEST_S)
    left = np.repeat(first + count, count) - 1 - np.arange(time_s.size)
    spread: Floats = time_s - left * np.repeat(each_s, count)
    return spread


def times_of_cut_seconds(
    time_s: Floats, equal: Bools, *, alike: bool = False, walked: bool = False
) -> Floats:
    """Return times of rows cut to whole seconds, spread over these, where equal ones are several.

    Two steps of one second may be equal rows. Those that were delivered twice are so in all of a
    file, or in a part; where times with equal rows alone and others alternate they are of moments
    of their own.

    Parameters
    ----------
    time_s : (N,) array
        In rising order.
    equal : (N,) array of bool
        Which rows equal an earlier one.
    alike : bool
        Whether rows of different times are equal, too, but for these.
    walked : bool
        Whether they are as long, and as many, as the steps of a walker: two in all seconds count.

    Returns
    -------
    (N,) array
        The same object where there are none.

    Examples
    --------
    >>> time_s = np.repeat(np.arange(12.0), [1, 2] * 6)
    >>> times_of_cut_seconds(time_s, np.diff(time_s, prepend=-1) == 0)[:6].tolist()
    [0.0, 1.0, 1.5, 2.0, 3.0, 3.5]
    >>> twice = np.repeat(np.arange(12.0), 2)
    >>> times_of_cut_seconds(twice, np.diff(twice, prepend=-1) == 0) is twice
    True
    """
    if not equal.any() or (time_s != np.round(time_s)).any():
        return time_s
    times, first, count = np.unique(time_s, return_index=True, return_counts=True)
    repeats = np.add.reduceat(equal.astype(np.int64), first)
    doubled = 2 * repeats == count if alike else 2 * repeats >= count
    changes = np.count_nonzero(np.diff(doubled))
    share = _CHANGING_ALIKE if alike else _CHANGING
    # A part that was delivered twice lies beside one that was not.
    steady = walked and np.mean(doubled) >= _STEADY
    apart = steady or changes >= max(_FEWEST_CHANGES, share * times.size)
    if not apart or count.max() > STEPS_PER_S:
        return time_s
    spread: Floats = time_s + (np.arange(time_s.size) - np.repeat(first, count)) / np.repeat(
        count, count
    )
    return spread


def without_batches(table: str, rows: pd.DataFrame, *, repeated: bool) -> tuple[pd.DataFrame, str]:
    """Return counted steps or motion with rows of one time apart, and a note.

    They came in batches, or lost the fraction of their second. Rows that all count one step become
    a counter.

    Parameters
    ----------
    table : str
        ``steps`` or ``motion``.
    rows : pandas.DataFrame
        In the order of their times.
    repeated : bool
        Whether equal rows of one time may repeat one, as in a file with a row for each cell.
    """
    time_s = rows["time_s"].to_numpy()
    spread = times_of_batches(time_s)
    if spread is time_s or (repeated and rows.duplicated().mean() > _REPEATED):
        return (rows, "") if repeated else _apart_in_seconds(table, rows)
    times, count = np.unique(time_s, return_counts=True)
    rows = _as_counter(table, rows.assign(time_s=spread))
    note = (
        f"{table}: {len(rows)} rows came in {len(times)} batches of {np.median(count):.3g} or so, "
        f"{np.median(np.diff(times)):.3g} s apart: spread over the time since the batch before"
    )
    return rows, note


def _apart_in_seconds(table: str, rows: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Return steps of each row, cut to whole seconds, spread over these; and a note."""
    time_s = rows["time_s"].to_numpy()
    if not (np.diff(time_s) == 0).any():
        return rows, ""
    if table == "steps":
        count = rows["count"].to_numpy()
        # Of a counter the last row of a second has all its steps.
        if not ((count == 1).all() or are_own_counts(time_s, count)):
            return rows, ""
    equal = duplicates(rows)
    values = rows.drop(columns="time_s")
    alike = bool(values.value_counts(dropna=False).iloc[0] >= _ALIKE * len(rows))
    walked = alike and table == "motion" and _are_steps(rows)
    spread = times_of_cut_seconds(time_s, equal, alike=alike, walked=walked)
    if spread is time_s:
        return rows, ""
    some = number_of(int(equal.sum()), "row equals", "rows equal")
    note = f"{table}: {some} another one of the same second, as stamps are whole seconds: kept, and"
    return _as_counter(table, rows.assign(time_s=spread)), f"{note} spread over it"


def _are_steps(rows: pd.DataFrame) -> bool:
    """Return whether rows have the lengths of steps, as often as a walker makes them."""
    length_m, per_s = rows["step_m"].median(), len(rows) / rows["time_s"].nunique()
    return bool(
        _STEP_M[0] <= length_m <= _STEP_M[1] and _STEPS_PER_S[0] <= per_s <= _STEPS_PER_S[1]
    )


def _as_counter(table: str, rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows that all count one step as those of a counter."""
    if table == "steps" and (rows["count"] == 1).all():
        return rows.assign(count=np.arange(1.0, len(rows) + 1))
    return rows
