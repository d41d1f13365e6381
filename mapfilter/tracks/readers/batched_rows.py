"""Rows of steps that were delivered many at one time: given the times at which they were walked."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats

_ROWS, _LEAST_S, _LEAST_TIMES = 3.0, 2.0, 3
_SLOWEST_S, _FASTEST_S = 1.0, 0.2
"""Longest time of a step, and the shortest: others are no steps."""
_MOSTLY, _REPEATED = 0.9, 0.5


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


def without_batches(table: str, rows: pd.DataFrame, *, repeated: bool) -> tuple[pd.DataFrame, str]:
    """Return counted steps or motion with rows that came in batches apart, and a note.

    Rows that all count one step become a counter.

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
        return rows, ""
    times, count = np.unique(time_s, return_counts=True)
    rows = rows.assign(time_s=spread)
    if table == "steps" and (rows["count"] == 1).all():
        rows = rows.assign(count=np.arange(1.0, len(rows) + 1))
    note = (
        f"{table}: {len(rows)} rows came in {len(times)} batches of {np.median(count):.3g} or so, "
        f"{np.median(np.diff(times)):.3g} s apart: spread over the time since the batch before"
    )
    return rows, note
