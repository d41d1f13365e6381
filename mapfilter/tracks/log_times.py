"""Timestamps of a log's tables as seconds from its start."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from mapfilter.errors import Faults


def seconds_of_tables(
    given: Mapping[str, Any], start_utc_s: float, names: Mapping[str, str], faults: Faults
) -> tuple[dict[str, pd.DataFrame], float]:
    """Convert timestamps of tables to seconds.

    Parameters
    ----------
    given : mapping of str to pandas.DataFrame
        Tables with ``time_s`` in seconds, or timestamps in ``time_s`` or ``time``.
    start_utc_s : float
        UTC seconds at second 0; NaN where the timestamps are to tell.
    names : mapping of str to str
        Names of tables in messages.
    faults : Faults
        Grows by timestamps without a zone, columns given twice and the like.

    Returns
    -------
    tables : dict of str to pandas.DataFrame
    start_utc_s : float
    """
    tables: dict[str, pd.DataFrame] = {}
    times: dict[str, pd.Series] = {}
    for table, rows in given.items():
        where = names.get(table, table)
        if not isinstance(rows, pd.DataFrame):
            faults.add(where, "a pandas.DataFrame", type(rows).__name__)
            continue
        if not rows.columns.is_unique:
            twice = ", ".join(map(str, rows.columns[rows.columns.duplicated()].unique()))
            faults.add(where, "each column once", f"{twice} more often")
            continue
        tables[table] = rows
        name = "time_s" if "time_s" in rows else "time"
        time = rows[name].infer_objects() if name in rows else pd.Series(dtype=float)
        if isinstance(time.dtype, pd.DatetimeTZDtype):
            tables[table], times[table] = rows.drop(columns=name), time
        elif pd.api.types.is_datetime64_any_dtype(time.dtype):
            hint = 'UTC or local time? add it, such as by .dt.tz_localize("UTC")'
            faults.add(f"{where}, {name}", "timestamps with a time zone", "none", hint)
            del tables[table]
    known = [time.min() for time in times.values() if time.notna().any()]
    if known and np.isnan(start_utc_s):
        origin, offset_s = min(known), 0.0
        start_utc_s = origin.timestamp()
        if plain := [names.get(t, t) for t in tables if t not in times and len(tables[t])]:
            got, hint = f"seconds in {', '.join(plain)}", "give start_utc_s, UTC seconds at 0"
            faults.add("log, time_s", "timestamps in every table, or a start", got, hint)
    else:
        origin, offset_s = pd.Timestamp(0, tz="UTC"), start_utc_s
    for table, time in times.items():
        time_s = (time - origin).dt.total_seconds() - offset_s
        tables[table] = tables[table].assign(time_s=time_s)
    return tables, start_utc_s
