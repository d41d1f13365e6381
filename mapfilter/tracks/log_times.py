"""Timestamps of a log's tables as seconds from its start."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from mapfilter.errors import Faults

_DATE = re.compile(r"\s{0,9}(?:\d{1,4}[-/:]\d|\d\d?\.\d\d?\.\d)", re.ASCII)
"""Begin of a date or a time of day; numbers as texts are read as numbers."""


def seconds_of_tables(
    given: Mapping[str, Any], start_utc_s: float, names: Mapping[str, str], faults: Faults
) -> tuple[dict[str, pd.DataFrame], float]:
    """Convert timestamps of tables to seconds.

    Parameters
    ----------
    given : mapping of str to pandas.DataFrame
        Tables with ``time_s`` in seconds, or timestamps in ``time_s`` or ``time``, or in the index.
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
        if not {"time_s", "time"}.intersection(rows.columns) and _is_of_times(rows.index):
            rows = rows.rename_axis("time_s").reset_index()
        tables[table] = rows
        name = "time_s" if "time_s" in rows else "time"
        time = _as_timestamps(rows[name]) if name in rows else pd.Series(dtype=float)
        if isinstance(time.dtype, pd.DatetimeTZDtype):
            tables[table], times[table] = rows.drop(columns=name), time
        elif pd.api.types.is_datetime64_any_dtype(time.dtype):
            hint = 'UTC or local time? add it, such as by .dt.tz_localize("UTC")'
            faults.add(f"{where}, {name}", "timestamps with a time zone", "none", hint)
            del tables[table]
        elif other := _other_times(time):
            faults.add(f"{where}, {name}", "timestamps with a time zone, or seconds", *other)
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


def _is_of_times(index: pd.Index) -> bool:
    """Return whether an index holds the times of its rows."""
    return isinstance(index, pd.DatetimeIndex) or index.name in ("time_s", "time")


def _as_timestamps(time: pd.Series) -> pd.Series:
    """Return times of any kind of timestamps as those of pandas, others as they are."""
    if isinstance(time.dtype, pd.ArrowDtype) and pa.types.is_timestamp(time.dtype.pyarrow_dtype):
        return pd.Series(pd.DatetimeIndex(time), index=time.index)
    known = time.infer_objects()
    if known.dtype == object and _are_zoned(known.dropna()):
        # Before and after the clocks are put back pandas keeps several offsets as objects.
        return pd.to_datetime(known, utc=True)
    return known


def _are_zoned(times: pd.Series) -> bool:
    """Return whether all are moments with a time zone, each with its own."""
    return len(times) > 0 and all(
        isinstance(one, datetime) and one.tzinfo is not None for one in times
    )


def _other_times(time: pd.Series) -> tuple[str, str] | None:
    """Return what times are that are neither timestamps nor seconds, and what makes them these."""
    if pd.api.types.is_timedelta64_dtype(time.dtype):
        return "durations", "make seconds of them: .dt.total_seconds()"
    first = time.dropna().head(1).tolist()
    if not first or not isinstance(first[0], str) or not _DATE.match(first[0]):
        return None
    return (
        f"texts such as {first[0][:40]!r}",
        "make timestamps of them: pd.to_datetime(…, utc=True)",
    )
