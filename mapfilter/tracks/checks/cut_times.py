"""Times that were cut to whole seconds, so that many rows have the same one."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of

_LEAST_TIMES = 5
_ROWS_A_TIME = 3
_ONE_MOMENT, _MANY_ROWS = 2, 10


def cut_times(time_s: Floats) -> str:
    """Return a sentence on rows that most likely have lost the fraction of their second, or "".

    All times are whole seconds then, and most of them are those of three rows or more.

    Parameters
    ----------
    time_s : (N,) array
        Of a table with one row for each moment.

    Examples
    --------
    >>> cut_times(np.repeat(np.arange(100.0), 10))
    '900 of 1000 rows have the time of another one, and all are whole seconds (likely: time \
stamps cut to whole seconds); rows of one time count as one moment'
    >>> cut_times(np.zeros(100))
    'all 100 rows have 1 time (likely: those of an export, not of the positions)'
    >>> cut_times(np.arange(1000.0)), cut_times(np.arange(1000) / 10)
    ('', '')
    """
    known = time_s[np.isfinite(time_s)]
    if not known.size or (known != np.round(known)).any():
        return ""
    times, rows = np.unique(known, return_counts=True)
    if len(times) <= _ONE_MOMENT and len(known) >= _MANY_ROWS * len(times):
        some = f"all {len(known)} rows have {number_of(len(times), 'time')}"
        return f"{some} (likely: those of an export, not of the positions)"
    if len(times) < _LEAST_TIMES or np.median(rows) < _ROWS_A_TIME:
        return ""
    repeated = f"{len(known) - len(times)} of {number_of(len(known), 'row')}"
    return (
        f"{repeated} have the time of another one, and all are whole seconds (likely: time stamps "
        "cut to whole seconds); rows of one time count as one moment"
    )
