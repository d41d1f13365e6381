"""Equal rows of reports: readings delivered twice, or neighbours without an identity."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools
from mapfilter.tracks.schema import NEIGHBOUR

_IDENTITY = ("cell", "ci", "bsic")
"""Columns of which one tells neighbours of a report apart; a carrier may have several cells."""


def repeated_readings(rows: pd.DataFrame, equal: Bools) -> Bools:
    """Return which rows equal an earlier one, and are no reading of another neighbour.

    Levels are rounded: two neighbours that are known by their level alone are two readings where
    they are equal. A report that was delivered several times, as its serving cell and its
    identified neighbours show, keeps the readings of one; without any of these, rows that all come
    equally often show it.

    Parameters
    ----------
    rows : pandas.DataFrame
        With ``time_s``; other tables than those of reports have no ``role``.
    equal : (N,) array of bool
        Which rows equal an earlier one in everything.

    Examples
    --------
    >>> report = pd.DataFrame({"time_s": 0.0, "level_dbm": [-70.0, -80.0, -80.0]})
    >>> report["role"] = ["serving", "neighbour", "neighbour"]
    >>> repeated_readings(report, report.duplicated().to_numpy()).tolist()
    [False, False, False]
    >>> twice = pd.concat([report, report], ignore_index=True)
    >>> repeated_readings(twice, twice.duplicated().to_numpy()).tolist()
    [False, False, False, True, True, True]
    """
    if "role" not in rows or not equal.any():
        return equal
    unknown = (rows["role"] == NEIGHBOUR).to_numpy(dtype=np.bool_, na_value=False)
    for name in _IDENTITY:
        if name in rows:
            unknown = unknown & rows[name].isna().to_numpy()
    doubtful = equal & unknown
    if not doubtful.any():
        return equal
    of_reports = rows["time_s"].isin(rows["time_s"].to_numpy()[doubtful]).to_numpy()
    some = rows[of_reports]
    columns = list(some.columns)
    row = some.groupby(columns, dropna=False, sort=False, observed=True).ngroup()
    readings = pd.DataFrame(
        {
            "time_s": some["time_s"],
            "row": row,
            "count": row.groupby(row).transform("size"),
            "nth": row.groupby(row).cumcount(),
            "unknown": unknown[of_reports],
        }
    )
    times = _deliveries(readings)
    wanted = -(-readings["count"] // readings["time_s"].map(times))
    repeated = np.where(readings["unknown"], readings["nth"] >= wanted, equal[of_reports])
    found = equal.copy()
    found[of_reports] = repeated
    return found


def _deliveries(readings: pd.DataFrame) -> pd.Series:
    """Return how often each report was delivered, by its time."""
    rows = readings.drop_duplicates("row")
    known = rows[~rows["unknown"]].groupby("time_s")["count"].min()
    others = rows[~rows["time_s"].isin(known.index)].sort_values("time_s")
    time_s, first, size = np.unique(others["time_s"], return_index=True, return_counts=True)
    if not len(others):
        return known
    by_all = np.gcd.reduceat(others["count"].to_numpy(), first)
    # One level alone does not show that its readings are of one neighbour.
    return pd.concat([known, pd.Series(np.where(size > 1, by_all, 1), time_s)])
