"""Dates whose year has two digits, such as 13/05/26: read where one order alone is possible."""

from __future__ import annotations

import re

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
_FIRST_DAY, _LAST_DAY = np.datetime64("2016-01-01"), np.datetime64("2036-01-01")
"""Of dates with short years, which may be read in several orders."""
_LAST_HOUR = 23
SHORT_YEAR = "short year"
"""The order of dates that may be read in several orders."""


def short_order(column: pa.ChunkedArray) -> str:
    """Return the order of dates with a short year: what is first; "" without such dates.

    Returns
    -------
    str
        "day", "month" or "year" where all dates are of 2016 to 2035 in that order alone, else
        :data:`SHORT_YEAR`; dates with dots and nothing after them may be times of day.

    Examples
    --------
    >>> [short_order(pa.chunked_array([[one]])) for one in ("13/05/26", "31.05.26", "05/13/26")]
    ['day', 'day', 'month']
    >>> short_order(pa.chunked_array([["11/05/26 10:00:00"]]))
    'short year'
    """
    texts = pc.unique(pc.utf8_slice_codeunits(pc.utf8_trim_whitespace(column), 0, 9))
    dates = [found for one in texts.to_pylist() if one and (found := _DATE.match(one))]
    if not dates:
        return "day" if pc.any(pc.match_substring_regex(texts, _NAMED)).as_py() else ""
    dots = any(one[2] == "." for one in dates)
    if dots and all(one[0] == one.string and int(one[1]) <= _LAST_HOUR for one in dates):
        return SHORT_YEAR
    parts = [(int(one[1]), int(one[3]), int(one[4])) for one in dates]
    short = all(len(one[1]) == 2 for one in dates)
    orders = [
        order
        for order in _WRITTEN
        if (not dots or order in _WITH_DOTS)
        and (short or order != "year")
        and all(_is_recent(one, order) for one in parts)
    ]
    return orders[0] if len(orders) == 1 else SHORT_YEAR


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


def _is_recent(parts: tuple[int, int, int], order: str) -> bool:
    year, month, day = (parts[place - 1] for place in _WRITTEN[order][1])
    try:
        date = np.datetime64(f"{2000 + year}-{month:02d}-{day:02d}")
    except ValueError:
        return False
    return bool(_FIRST_DAY <= date < _LAST_DAY)
