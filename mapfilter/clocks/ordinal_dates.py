"""Days of a year in a text, such as 2026-133T10:00:00, and as solutions of satellites have them."""

from __future__ import annotations

import re

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

_ORDINAL = r"^((?:19|20)\d\d)[-:](\d{3})[T :](\d\d:\d\d|\d{5}(?:\D|$))"
_DATE = re.compile(r"(\d{4})[-:](\d{3})", re.ASCII)
_SECONDS = re.compile(r"^(\d{4}-\d\d-\d\d) (\d{5})(\.\d{1,9})?$", re.ASCII)
_LENGTH, _LAST_DAY, _DAY_S = 8, 366, 86_400


def with_calendar_days(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return texts of times whose days of a year, 001 to 366, are months and days.

    After such a day there may also be the seconds of it, five digits (SINEX).

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
        Without blanks around.

    Examples
    --------
    >>> given = ["2026-133T10:00:00Z", "2026:133:36000", "2026-05-13 10:00"]
    >>> with_calendar_days(pa.chunked_array([given])).to_pylist()
    ['2026-05-13 10:00:00Z', '2026-05-13 10:00:00', '2026-05-13 10:00']
    """
    found = pc.match_substring_regex(column, _ORDINAL)
    if not pc.any(found).as_py():
        return column
    dates = pc.utf8_slice_codeunits(column, 0, _LENGTH)
    days = {date: _calendar(date) for date in pc.unique(dates).to_pylist()}
    texts = [
        _with_clock(f"{days[date]} {text[_LENGTH + 1 :]}") if good and days[date] else text
        for text, date, good in zip(
            column.to_pylist(), dates.to_pylist(), found.to_pylist(), strict=True
        )
    ]
    return pa.chunked_array([pa.array(texts, pa.string())])


def _calendar(text: str) -> str:
    """Return the date of a year and a day in it; "" for no such day."""
    parts = _DATE.fullmatch(text)
    if parts is None or not 1 <= int(parts[2]) <= _LAST_DAY:
        return ""
    day = np.datetime64(f"{parts[1]}-01-01") + np.timedelta64(int(parts[2]) - 1, "D")
    return str(day) if str(day)[:4] == parts[1] else ""


def _with_clock(text: str) -> str:
    """Return a date and the seconds of the day as one with a time of day."""
    parts = _SECONDS.fullmatch(text)
    if parts is None or int(parts[2]) >= _DAY_S:
        return text
    minutes, seconds = divmod(int(parts[2]), 60)
    return f"{parts[1]} {minutes // 60:02d}:{minutes % 60:02d}:{seconds:02d}{parts[3] or ''}"
