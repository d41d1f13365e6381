"""Equal readings of neighbours that nothing names: several cells of a report, or one twice."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools
from mapfilter.tracks.schema import NEIGHBOUR

_NAMES = ("cell", "ci", "bsic")
"""Columns of which one tells the cells of a report apart."""


def without_other_cells(rows: pd.DataFrame, duplicate: Bools) -> Bools:
    """Return which of the duplicates of reports repeat an earlier row, and are no other cell.

    Two neighbours of a report without any identity may have equal levels. A report that was
    delivered several times repeats them as often as the rows that name their cell.

    Parameters
    ----------
    rows : pandas.DataFrame
        With ``time_s`` and ``role``.
    duplicate : (N,) array of bool
        Rows that equal an earlier one in everything.

    Examples
    --------
    >>> rows = pd.DataFrame({"time_s": 0.0, "role": ["serving", "neighbour", "neighbour"]})
    >>> rows["cell"], rows["level_dbm"] = ["A", None, None], [-60.0, -90.0, -90.0]
    >>> without_other_cells(rows, rows.duplicated().to_numpy()).tolist()
    [False, False, False]
    >>> twice = pd.concat([rows, rows], ignore_index=True)
    >>> without_other_cells(twice, twice.duplicated().to_numpy()).tolist()
    [False, False, False, True, True, True]
    """
    named = np.zeros(len(rows), dtype=np.bool_)
    for name in _NAMES:
        if name in rows:
            named |= rows[name].notna().to_numpy()
    named |= (rows["role"] != NEIGHBOUR).to_numpy(dtype=np.bool_)
    if not (duplicate & ~named).any():
        return duplicate
    time_s = rows["time_s"]
    some = np.flatnonzero(time_s.isin(time_s[duplicate & ~named]).to_numpy())
    of_time = rows.iloc[some]
    groups = of_time.groupby(list(of_time.columns), dropna=False, observed=True, sort=False)
    copy, copies = groups.cumcount(), groups["time_s"].transform("size")
    # How often a report was delivered; once where it names no cell.
    delivered = copies.where(named[some], 1).groupby(of_time["time_s"]).transform("max")
    repeats = (copy >= np.ceil(copies / delivered)).to_numpy()
    found = duplicate.copy()
    found[some] = np.where(named[some], duplicate[some], repeats)
    return found
