"""Dates as programs and spreadsheets write them, in the order of ISO 8601."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Floats, Ints
from mapfilter.clocks.short_years import Dates, nearest
from mapfilter.clocks.times import LEAST_UNIX_S

_COMPACT = r"^((?:19|20)\d\d)(\d\d)(\d\d)(\d\d)(\d\d)(\d\d)"
"""A date and a time in one number, such as 20260501101530, with milliseconds or without."""
_COMPACT_MINUTES = r"^((?:19|20)\d\d)(\d\d)(\d\d)(\d\d)(\d\d)"
_COMPACT_RANGES = ((1.9e13, 2.1e13, 1.0), (1.9e16, 2.1e16, 1e3))
_MINUTES = (1.9e11, 2.1e11)
"""Numbers of a date, an hour and a minute, such as 202605011015."""
_PARTS = ((0, 60), (0, 59), (0, 23), (1, 31), (1, 12))
"""Seconds, minutes, hours, days and months: the least and the largest."""
_LEAST_TIMES = 0.5
_ZONE = r"(Z|[+-]\d\d:?\d\d)?"
_YEAR_LAST = r"^(\d\d?)[/-](\d\d?)[/-]((?:19|20)\d\d)(\D|$)"
_YEAR_FIRST = {"day": r"\3-\2-\1\4", "month": r"\3-\1-\2\4"}
_LAST_MONTH = 12
_DAY_OF_WEEK = r"^(?:Mon|Tue|Wed|Thu|Fri|Sat|Sun),?\s+"
_CLOCK = r"\d\d:\d\d:\d\d"
_DAY = rf"{_DAY_OF_WEEK}(\w{{3}}) +(\d\d?) ({_CLOCK})"
_IN_PLACE = (
    # The time of day before the date.
    (
        r"^(\d\d?:\d\d(?::\d\d(?:[. ]\d{1,9})?)?)\s+(\d{1,4}[-/.]\d\d?[-/.]\d{1,4})$",
        r"\2 \1",
    ),
    # A comma before the time of day, as a browser writes it, or a hyphen. A date of XML may end in
    # an offset, such as 2026-05-01-02:00.
    (r"^(\d{1,4}[/.-]\d\d?[/.-]\d{1,4}),?\s+(\d)", r"\1 \2"),
    (r"^(\d\d?[/.-]\d\d?[/.-]\d{2,4})-(\d)", r"\1 \2"),
    (r"^(\d{4}[/.-]\d\d?[/.-]\d\d?)-(\d\d?[:.]\d\d[:.]\d\d)", r"\1 \2"),
    # A time of day with dots.
    (r"^(\S+\s)(\d\d?)\.(\d\d)\.(\d\d)(\D|$)", r"\1\2:\3:\4\5"),
    # A comma for the point of a fraction, which is a blank in quotes.
    (
        r"^(\d{1,4}[/.-]\d\d?[/.-]\d{1,4}[ T]\d\d?:\d\d:\d\d)\s(\d{1,9})"
        r"(\s?(?:Z|[AaPp]\.?[Mm]\.?|[+-]\d\d(?::?\d\d)?|UTC|GMT))?$",
        r"\1.\2\3",
    ),
    # An offset behind the name of UTC, of one digit or of two.
    (r"\s(?:GMT|UTC)([+-])(\d)$", r"\10\2:00"),
    (r"\s(?:GMT|UTC)([+-]\d\d(?::?\d\d)?)$", r"\1"),
    (r"^(\d{4}):(\d\d):(\d\d)\s", r"\1-\2-\3 "),
    (r"^(\d{4})年(\d\d?)月(\d\d?)日\s*", r"\1-\2-\3 "),
)
_REWRITTEN = (
    # A zone's name after its offset, as Java writes it.
    (r"(Z|[+-]\d\d:?\d\d)\[[\w/+-]+\]$", r"\1"),
    # A date and a time of day without separators, with one between both.
    (r"^((?:19|20)\d\d)(\d\d)(\d\d)[ _-](\d\d):?(\d\d):?(\d\d)", r"\1-\2-\3 \4:\5:\6"),
    # As names of files have them.
    (
        r"^((?:19|20)\d\d)([.-]\d\d)([.-]\d\d)[ T_-](\d\d)([-._])(\d\d)[-._](\d\d)",
        r"\1\2\3 \4:\6:\7",
    ),
    (r"^((?:19|20)\d\d)[./](\d\d?)[./](\d\d?)", r"\1-\2-\3"),
    (r"^(\d{4}-\d\d?-\d\d?)_", r"\1 "),
    # The month first, by its name.
    (r"^([A-Z][a-z]{2})[a-z]*\.?\s+(\d\d?),?\s+(\d{4}),?\s+", r"\2-\1-\3 "),
    # Java's Date.toString(), such as Fri May 01 10:00:00 GMT+02:00 2026; and a date of mails.
    (rf"{_DAY} (?:GMT|UTC)([+-]\S+) (\d{{4}})$", r"\2-\1-\5 \3\4"),
    (rf"{_DAY} (?:GMT|UTC) (\d{{4}})$", r"\2-\1-\4 \3Z"),
    (rf"{_DAY} (\d{{4}})$", r"\2-\1-\4 \3"),
    (rf"{_DAY} ([A-Z]{{3,5}}) (\d{{4}})$", r"\2-\1-\5 \3 \4"),
    # A browser's, such as Fri May 01 2026 10:00:00 GMT+0200 (CEST).
    (
        rf"{_DAY_OF_WEEK}(\w{{3}}) (\d\d) (\d{{4}}) ({_CLOCK}) GMT([+-]\d{{4}})(?: \(.*\))?$",
        r"\2-\1-\3 \4\5",
    ),
    (rf"{_DAY_OF_WEEK}(\d\d? \w{{3}} \d{{4}} {_CLOCK})", r"\1"),
    (rf"{_COMPACT_MINUTES}$", r"\1-\2-\3 \4:\5"),
    (rf"{_COMPACT}{_ZONE}$", r"\1-\2-\3 \4:\5:\6\7"),
    (rf"{_COMPACT}(?:\.?(\d{{3}})|\.(\d{{1,9}})){_ZONE}$", r"\1-\2-\3 \4:\5:\6.\7\8\9"),
)


def are_compact(numbers: Floats) -> bool:
    """Return whether most numbers are dates and times without separators.

    No Unix time is so large; of the nanoseconds since a phone was started few are months, days,
    hours, minutes and seconds.

    Examples
    --------
    >>> are_compact(np.array([20260501101530.0])), are_compact(np.array([1777629330000.0]))
    (True, False)
    >>> are_compact(19_500_000_000_000 + 1e9 * np.arange(9))
    False
    """
    count = 0
    for low, high, scale in _COMPACT_RANGES:
        rest = numbers[(numbers >= low) & (numbers < high)] // scale
        good = np.ones(rest.size, dtype=bool)
        for least, most in _PARTS:
            rest, part = np.divmod(rest, 100.0)
            good &= (part >= least) & (part <= most)
        count += int(np.count_nonzero(good))
    low, high = _MINUTES
    rest = numbers[(numbers >= low) & (numbers < high)]
    good = rest == np.floor(rest)
    for least, most in _PARTS[1:]:
        rest, part = np.divmod(rest, 100.0)
        good &= (part >= least) & (part <= most)
    count += int(np.count_nonzero(good))
    return bool(count > _LEAST_TIMES * np.count_nonzero(numbers >= LEAST_UNIX_S))


def order_of(column: pa.ChunkedArray, others: Dates = tuple) -> str:
    """Return whether dates with the year at the end begin with the day or the month.

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
    others : callable
        Dates near which that of the right order lies.

    Returns
    -------
    str
        "day" or "month" where a number above 12 shows it, and none the contrary, or other dates;
        else "".

    Examples
    --------
    >>> order_of(pa.chunked_array([["01/05/2026 10:00:00", "13/05/2026 10:00:00"]]))
    'day'
    >>> unclear = pa.chunked_array([["01/05/2026 10:00:00", "02/05/2026 10:00:00"]])
    >>> order_of(unclear), order_of(unclear, lambda: [np.datetime64("2026-01-05")])
    ('', 'month')
    """
    dates = pc.unique(pc.utf8_slice_codeunits(pc.utf8_trim_whitespace(column), 0, 10))
    parts = pc.extract_regex(
        dates, r"^(?P<first>\d\d?)[/-](?P<second>\d\d?)[/-](?P<year>(?:19|20)\d\d)"
    )
    first, second, year = (
        pc.cast(pc.struct_field(parts.drop_null(), name), pa.int64()).to_numpy(zero_copy_only=False)
        for name in ("first", "second", "year")
    )
    late = [bool((one > _LAST_MONTH).any()) for one in (first, second)]
    if late[0] != late[1]:
        return "day" if late[0] else "month"
    if all(late) or not first.size:
        return ""
    readings = {"day": (second, first), "month": (first, second)}
    return nearest({o: _days(year, *one) for o, one in readings.items()}, others)


def _days(year: Ints, month: Ints, day: Ints) -> list[np.datetime64]:
    months = (12 * (year - 1970) + month - 1).astype("datetime64[M]")
    return list(months.astype("datetime64[D]") + (day - 1))


def has_year_last(column: pa.ChunkedArray) -> bool:
    """Return whether some dates have slashes or hyphens, and the year at the end.

    Examples
    --------
    >>> has_year_last(pa.chunked_array([["2026-05-01", "1/5/2026"]]))
    True
    """
    return bool(pc.any(pc.match_substring_regex(column, _YEAR_LAST)).as_py())


def plainly_written(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return texts of times with the date first, a colon in times of day and offsets alone.

    Examples
    --------
    >>> given = ["10:00:05 13/5/2026", "13.05.2026, 10.00.05", "2026-05-13 10:00:05 UTC+2"]
    >>> plainly_written(pa.chunked_array([given])).to_pylist()
    ['13/5/2026 10:00:05', '13.05.2026 10:00:05', '2026-05-13 10:00:05+02:00']
    """
    found = pc.utf8_trim_whitespace(column)
    for pattern, by in _IN_PLACE:
        found = pc.replace_substring_regex(found, pattern, by)
    return found


def with_year_first(column: pa.ChunkedArray, order: str) -> pa.ChunkedArray:
    """Return texts of times whose dates have the order of ISO 8601.

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
    order : str
        Of dates such as 13/05/2026, as of :func:`order_of`; "" leaves them.

    Examples
    --------
    >>> given = ["13/5/2026 10:00", "20260513100000", "Wed May 13 10:00:00 GMT+02:00 2026"]
    >>> with_year_first(pa.chunked_array([given]), "day").to_pylist()
    ['2026-5-13 10:00', '2026-05-13 10:00:00', '13-May-2026 10:00:00+02:00']
    """
    found = plainly_written(column)
    for pattern, by in _REWRITTEN:
        found = pc.replace_substring_regex(found, pattern, by)
    if order not in _YEAR_FIRST:
        return found
    return pc.replace_substring_regex(found, _YEAR_LAST, _YEAR_FIRST[order])
