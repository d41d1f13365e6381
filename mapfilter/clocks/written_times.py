"""A column of times as texts, of any usual layout, in UTC seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import nan
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Floats
from mapfilter.clocks.blank_fractions import with_whole_milliseconds
from mapfilter.clocks.named_zones import with_offsets
from mapfilter.clocks.ordinal_dates import with_calendar_days
from mapfilter.clocks.plain_times import plain_times
from mapfilter.clocks.short_years import (
    SHORT_YEAR,
    Dates,
    short_order,
    short_readings,
    with_long_years,
)
from mapfilter.clocks.times import LEAST_UNIX_S, parse_times, unix_seconds
from mapfilter.clocks.written_dates import (
    are_compact,
    has_year_last,
    order_of,
    plainly_written,
    with_year_first,
)

_ORDERS = ("day", "month", "year")
_DATE_LETTERS = 10
Later = Callable[[], Iterable[pa.ChunkedArray]]
"""The same column in later parts of a file, as texts."""


class WrittenTimes(NamedTuple):
    """Times of a column.

    Parameters
    ----------
    time_s : (N,) array
        UTC seconds, NaN where not understood. Without a zone, as if the zone were UTC.
    zoned : bool
        Whether the times are UTC: by their own zone or by the given one.
    order : str
        "day", "month" or "year", if dates have the year at the end or in two digits: what is first;
        else "".
    notes : tuple of str
        What dates and zones were taken for.
    """

    time_s: Floats
    zoned: bool
    order: str = ""
    notes: tuple[str, ...] = ()


def written_times(
    column: pa.ChunkedArray,
    zone: str = "",
    layout: str = "ISO8601",
    after_s: float = nan,
    order: str = "",
    later: Later | None = None,
    others: Dates = tuple,
) -> WrittenTimes:
    """Read a column of times.

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
    zone, layout, after_s
        As of :func:`mapfilter.clocks.times.parse_times`.
    order : str
        That of the dates of parts before this one.
    later : callable, optional
        Asked where the order is unclear: a date with a day above 12 may come later.
    others : callable
        Asked then as well: dates near which these lie, as that of the file's name.

    Examples
    --------
    >>> from datetime import UTC, datetime
    >>> found = written_times(pa.chunked_array([["13/05/26 10:00:00 CEST"]]))
    >>> datetime.fromtimestamp(found.time_s[0], UTC).isoformat(), found.zoned, found.order
    ('2026-05-13T08:00:00+00:00', True, 'day')
    """
    if layout == "ISO8601" and (numbers := _numbers(column)) is not None:
        return WrittenTimes(numbers, True)
    if (plain := plain_times(column, zone, layout, after_s)) is not None:
        return WrittenTimes(*plain)
    if layout != "ISO8601":
        column = pc.utf8_trim_whitespace(column)
        return WrittenTimes(*parse_times(_texts(column), zone, layout, after_s))
    column, order, notes = in_iso_order(column, zone, order, later, others)
    time_s, zoned = parse_times(_texts(column), zone, layout, after_s)
    return WrittenTimes(time_s, zoned, order, notes)


def in_iso_order(
    column: pa.ChunkedArray,
    zone: str = "",
    order: str = "",
    later: Later | None = None,
    others: Dates = tuple,
) -> tuple[pa.ChunkedArray, str, tuple[str, ...]]:
    """Return times in the order of ISO 8601, with offsets for names of zones.

    Parameters
    ----------
    column, zone, order, later, others
        As of :func:`written_times`.

    Returns
    -------
    column : pyarrow.ChunkedArray of str
        Dates whose order is unclear stay as they are.
    order : str
    notes : tuple of str
    """
    column, on_fractions = with_whole_milliseconds(column)
    column = with_calendar_days(plainly_written(column))
    notes: list[str] = []
    if order not in _ORDERS:
        order, notes = _order(column, later, others)
    ordered = with_long_years(with_year_first(column, order), order)
    ordered, on_zones = with_offsets(ordered, zone)
    return ordered, order, (*on_fractions, *notes, *on_zones)


def _order(column: pa.ChunkedArray, later: Later | None, others: Dates) -> tuple[str, list[str]]:
    dates, more = _dates(column), iter(later() if later is not None else ())
    while True:
        short = short_order(dates)
        order = order_of(dates) or ("" if short == SHORT_YEAR else short)
        unclear = not order and (short or has_year_last(dates))
        following = next(more, None) if unclear else None
        if following is None:
            break
        dates = pa.chunked_array([*dates.chunks, *_dates(plainly_written(following)).chunks])
    # A date nearby knows better than a usual year.
    near = order_of(dates, others) or short_order(dates, others)
    by = "" if near == order else ", by a date in the file or in its name"
    order = order if near in ("", SHORT_YEAR) else near
    if not order:
        return "", []
    years = "a short year" if short else "slashes or hyphens"
    return order, [f"time: the {order} first in dates with {years}{by}{_rejected(dates, order)}"]


def _rejected(dates: pa.ChunkedArray, order: str) -> str:
    """Return in words what else the first date with a short year may be; "" for nothing else."""
    for text in dates.to_pylist():
        readings = short_readings(text or "")
        if taken := readings.pop(order, ""):
            others = sorted(set(readings.values()) - {taken})
            return f" ({text.split()[0]}: {taken}, not {' or '.join(others)})" if others else ""
    return ""


def _dates(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return the different beginnings of plainly written texts, as long as a date."""
    cut = pc.utf8_slice_codeunits(column, 0, _DATE_LETTERS)
    return pa.chunked_array([pc.unique(cut)], pa.string())


def _numbers(column: pa.ChunkedArray) -> Floats | None:
    """Return Unix times, NaN for other numbers; None where not all are numbers, or dates."""
    try:
        number = np.asarray(pc.cast(column, pa.float64()).to_numpy(), dtype=np.float64)
    except pa.ArrowInvalid:
        return None
    if are_compact(number):
        return None
    return unix_seconds(np.where(np.abs(number) > LEAST_UNIX_S, number, np.nan))


def _texts(column: pa.ChunkedArray) -> np.ndarray:
    """Return texts, of which equal ones are one object."""
    coded = column.dictionary_encode().combine_chunks()
    words = np.array(coded.dictionary.to_pylist(), dtype=object)
    if not len(words):
        return np.full(len(column), "", dtype=object)
    return np.asarray(words[coded.indices.to_numpy(zero_copy_only=False)])
