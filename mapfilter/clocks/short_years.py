"""Dates whose year has two digits, such as 13/05/26: read where one order alone is likely."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

_DATE = re.compile(r"^(\d\d?)([/.-])(\d\d?)\2(\d\d)(?!\d)", re.ASCII)
_SHORT = r"^(\d\d?)([/.-])(\d\d?)([/.-])(\d\d)(\D|$)"
_NAMED = r"^(\d\d?)[- ]([A-Za-z]{3})[- ](\d\d)(\D|$)"
"""A month by its name, before which no one writes a short year: 13-MAY-26, as of Oracle."""
_WRITTEN = {
    "day": (r"20\5-\3-\1\6", (3, 2, 1)),
    "month": (r"20\5-\1-\3\6", (3, 1, 2)),
    "year": (r"20\1-\3-\5\6", (1, 2, 3)),
}
"""Orders by what is first: how a date is rewritten, and which part is year, month and day."""
_WITH_DOTS = ("day",)
"""Of dates with dots no one writes the month first, and next to no one a short year."""
_EARLIEST, _FIRST_DAY = np.datetime64("2000-01-01"), np.datetime64("2016-01-01")
_LAST_DAY = np.datetime64("2036-01-01")
"""Of dates with short years: those that are possible, and the first of those that are usual.

The last one is that of both."""
Dates = Callable[[], Collection[np.datetime64]]
"""Other dates of a file, or of its name, which are looked for when they are needed."""
_NEAR = np.timedelta64(2, "D")
"""Zones differ by a day, and a log may go on over midnight."""
_LAST_HOUR = 23
SHORT_YEAR = "short year"
"""The order of dates that may be read in several orders."""


def short_order(column: pa.ChunkedArray, others: Dates = tuple) -> str:
    """Return the order of dates with a short year: what is first; "" without such dates.

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
    others : callable
        Dates near which that of the right order lies.

    Returns
    -------
    str
        "day", "month" or "year" where all dates are of 2000 to 2035 in that order alone, in that
        order alone near others, or where the day or the month is first in that order alone from
        2016 on; else :data:`SHORT_YEAR`. Dates with dots and nothing after them may be times of
        day.

    Examples
    --------
    >>> [short_order(pa.chunked_array([[one]])) for one in ("13/05/26", "31.05.26", "05/13/26")]
    ['day', 'day', 'month']
    >>> short_order(pa.chunked_array([["11/05/26 10:00:00"]]))
    'short year'
    >>> of_2013 = pa.chunked_array([["16/05/13 10:00:00"]])
    >>> short_order(of_2013), short_order(of_2013, lambda: [np.datetime64("2013-05-16")])
    ('short year', 'day')
    """
    texts = pc.unique(pc.utf8_slice_codeunits(pc.utf8_trim_whitespace(column), 0, 9))
    dates = [found for one in texts.to_pylist() if one and (found := _DATE.match(one))]
    if not dates:
        return "day" if pc.any(pc.match_substring_regex(texts, _NAMED)).as_py() else ""
    if any(one[2] == "." for one in dates) and all(
        one[0] == one.string and int(one[1]) <= _LAST_HOUR for one in dates
    ):
        return SHORT_YEAR
    orders = _readings(dates)
    if len(orders) > 1 and (near := nearest(orders, others)):
        return near
    recent = [order for order, days in orders.items() if min(days) >= _FIRST_DAY]
    # Next to no one writes a short year first, but few logs are so old that it needs no doubt.
    sure = len(recent) == 1 and (len(orders) == 1 or recent[0] != "year")
    return recent[0] if sure else SHORT_YEAR


def short_readings(text: str) -> dict[str, str]:
    """Return the dates that a text with a short year may begin with, in ISO 8601, by their order.

    Examples
    --------
    >>> short_readings("16/05/13 10:00:00"), short_readings("1.5.2026")
    ({'day': '2013-05-16', 'year': '2016-05-13'}, {})
    """
    found = _DATE.match(text.strip())
    return {order: str(days[0]) for order, days in _readings([found] if found else []).items()}


def nearest(readings: dict[str, list[np.datetime64]], others: Dates) -> str:
    """Return the only reading of dates that has one near other dates; "" where none has.

    Examples
    --------
    >>> of = {"day": [np.datetime64("2026-05-04")], "month": [np.datetime64("2026-04-05")]}
    >>> nearest(of, lambda: [np.datetime64("2026-04-06")]), nearest(of, tuple)
    ('month', '')
    """
    known = others()
    near = [
        order
        for order, days in readings.items()
        if any(abs(day - one) <= _NEAR for day in days for one in known)
    ]
    return near[0] if len(near) == 1 else ""


def with_long_years(column: pa.ChunkedArray, order: str) -> pa.ChunkedArray:
    """Return texts of times whose dates with a short year have the order of ISO 8601.

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
        Without blanks around.
    order : str
        As of :func:`short_order`; others leave the texts.

    Examples
    --------
    >>> with_long_years(pa.chunked_array([["13/05/26 10:00", "13/05/2026"]]), "day").to_pylist()
    ['2026-05-13 10:00', '13/05/2026']
    """
    if order not in _WRITTEN:
        return column
    named = pc.replace_substring_regex(column, _NAMED, r"\1-\2-20\3\4")
    return pc.replace_substring_regex(named, _SHORT, _WRITTEN[order][0])


def _readings(dates: Collection[re.Match[str]]) -> dict[str, list[np.datetime64]]:
    """Return the days of dates in each order in which all of them are possible."""
    dots = any(one[2] == "." for one in dates)
    short = all(len(one[1]) == 2 for one in dates)
    parts = [(int(one[1]), int(one[3]), int(one[4])) for one in dates]
    found: dict[str, list[np.datetime64]] = {}
    for order in _WRITTEN:
        if (dots and order not in _WITH_DOTS) or (order == "year" and not short):
            continue
        days = [day for one in parts if (day := _day_of(one, order)) is not None]
        if len(days) == len(parts):
            found[order] = days
    return found if parts else {}


def _day_of(parts: tuple[int, int, int], order: str) -> np.datetime64 | None:
    year, month, day = (parts[place - 1] for place in _WRITTEN[order][1])
    try:
        date = np.datetime64(f"{2000 + year}-{month:02d}-{day:02d}")
    except ValueError:
        return None
    return date if _EARLIEST <= date < _LAST_DAY else None
