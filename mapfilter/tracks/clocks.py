"""Whether the tables of a log count time alike: one clock, one unit, one start."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.errors import Faults

_APART_S = 600.0
"""Tables may begin this long after another ends."""
_TIMES_MS = (300.0, 3000.0)
"""Between these, one duration is taken for milliseconds of another."""

_EARLY_S = 30.0
_EARLY_SHARE = 0.1
_EARLIEST_UTC_S = datetime(1, 1, 1, tzinfo=UTC).timestamp()
_MOST_S = 1e11


def check_clocks(
    tables: Mapping[str, pd.DataFrame], names: Mapping[str, str], faults: Faults
) -> None:
    """See that the times of a log's tables overlap, and that none lasts about 1000 times as long.

    Parameters
    ----------
    tables : mapping of str to pandas.DataFrame
        With finite ``time_s``, sorted.
    names : mapping of str to str
        What messages call a table, and ``log`` the whole.
    faults : Faults
        Collects at most one fault, since it takes two tables to disagree.
    """
    times = {
        names.get(table, table): np.unique(rows["time_s"].to_numpy())
        for table, rows in tables.items()
        if len(rows)
    }
    if len(times) < 2:
        return
    gap_s = max(time[0] for time in times.values()) - min(time[-1] for time in times.values())
    hint = _milliseconds(times)
    if gap_s > _APART_S and not hint:
        hint = "seconds of the day, or Unix time, in one of them, or milliseconds for s"
    if hint:
        spans = "; ".join(f"{name} {time[0]:.10g}..{time[-1]:.10g}" for name, time in times.items())
        whole = names.get("log", "log")
        faults.add(f"{whole}, time_s", "tables that overlap in time", spans, hint)


def early_ends(tables: Mapping[str, pd.DataFrame]) -> tuple[str, ...]:
    """Return a note where motion or radio ends long before the other one, as if cut off."""
    ends_s = {
        table: float(tables[table]["time_s"].iloc[-1])
        for table in ("motion", "radio")
        if len(tables[table])
    }
    if len(ends_s) < 2:
        return ()
    (first, first_s), (last, last_s) = sorted(ends_s.items(), key=lambda end: end[1])
    begin_s = min(float(rows["time_s"].iloc[0]) for rows in tables.values() if len(rows))
    if last_s - first_s <= max(_EARLY_S, _EARLY_SHARE * (last_s - begin_s)):
        return ()
    return (f"{first}: ends {last_s - first_s:.0f} s before {last}, as if cut off",)


def check_start(
    start_utc_s: float, tables: Mapping[str, pd.DataFrame], faults: Faults, whole: str = "log"
) -> None:
    """See that a log's start, if it is known, and all its times are dates that calendars show."""
    if np.isnan(start_utc_s):
        return
    where = f"{whole}, start_utc_s"
    if not abs(start_utc_s) <= _MOST_S:
        hint = "milliseconds for s" if np.isfinite(start_utc_s) else ""
        faults.add(where, "UTC seconds", start_utc_s, hint)
        return
    # Times are at most 1e11 s, too: none comes near the year 9999.
    first_s = min((float(rows["time_s"].min()) for rows in tables.values() if len(rows)), default=0)
    if start_utc_s + min(first_s, 0.0) < _EARLIEST_UTC_S:
        got = f"{start_utc_s:.15g}, and times from {first_s:g} s on"
        faults.add(where, "UTC seconds, not before the year 1", got)


def _milliseconds(times: Mapping[str, Floats]) -> str:
    """Return the hint that one table's times are milliseconds, or an empty text.

    Its duration *and* its typical interval are about 1000 times those of another table: so a
    burst of a second in a long log, or a table with seldom rows, is not taken for it.
    """
    paced = {name: time for name, time in times.items() if len(time) >= 3}
    low, high = _TIMES_MS
    for name, time in paced.items():
        for other in paced.values():
            with np.errstate(over="ignore"):
                longer = np.ptp(time) / np.ptp(other)
                seldomer = np.median(np.diff(time)) / np.median(np.diff(other))
            if low <= longer <= high and low <= seldomer <= high:
                return f"milliseconds for s in {name}"
    return ""
