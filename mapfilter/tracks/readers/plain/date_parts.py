"""Times of a plain CSV in parts: columns of the year, month, day, hour, minute and second."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from mapfilter._types import Floats
from mapfilter.tracks.readers.plain.fields import FIELDS
from mapfilter.tracks.readers.plain.headers import columns_of
from mapfilter.tracks.readers.texts.columns import Columns

_PARTS = (("year",), ("month",), ("day",), ("hour",), ("min", "minute"), ("sec", "second"))
_NANO = "nano"
"""What a receiver of u-blox adds to its rounded seconds."""
_UTC = "itow"
_LAST = (0, 12, 31, 23, 59, 60)
_YEARS = 1980, 2099


def _columns(names: Sequence[str], own: Collection[str]) -> list[str]:
    """Return the columns of all parts; an empty list where one lacks, or there are other times."""
    found = [next((name for name in some if name in names), "") for some in _PARTS]
    whole = {*FIELDS["time"]}.intersection(names) or columns_of("time", names, ())
    once = all(name and names.count(name) == 1 and name not in own for name in found)
    return found if once and not whole else []


def of_parts(names: tuple[str, ...], own: Collection[str] = ()) -> tuple[str, ...]:
    """Return names of columns of which those of the parts of a time are one; no names for others.

    Beside the seconds of a GPS week that a receiver counts they are UTC.

    Examples
    --------
    >>> of_parts(("year", "month", "day", "hour", "min", "sec", "lat"))
    ('', '', '', 'time', '', '', 'lat')
    """
    if not (parts := _columns(names, own)):
        return names
    utc = _UTC in names
    nameless = {*parts, *((_NANO, _UTC) if utc else ())} - {*own, parts[3]}
    time = "time (utc)" if utc else "time"
    return tuple(time if name == parts[3] else "" if name in nameless else name for name in names)


def parts_of_dates(rows: Columns, own: Collection[str] = ()) -> Columns:
    """Return columns in which that of the hours holds whole times, where there are all parts."""
    if not (parts := _columns(rows.names, own)):
        return rows
    numbers = [rows.number(name) for name in parts]
    good = (numbers[0] >= _YEARS[0]) & (numbers[0] <= _YEARS[1])
    for number, least, most in zip(numbers[1:], (1, 1, 0, 0, 0), _LAST[1:], strict=True):
        good &= (number >= least) & (number <= most)
    nano = rows.number(_NANO) if _UTC in rows.names and rows.has(_NANO) else np.zeros(len(rows))
    seconds = [np.where(good, number, 0.0) for number in numbers]
    texts = _whole(seconds, np.where(good, np.nan_to_num(nano), 0.0))
    rows.reading.note(f"time: columns {', '.join(parts)}")
    return rows.filled(parts[3], np.where(good, texts, "").astype(object))


def _whole(parts: Sequence[Floats], nano: Floats) -> np.ndarray:
    """Return times as ISO 8601, to the microsecond."""
    year, month, day, hour, minute, second = parts
    months = (np.maximum(year, 1970) - 1970) * 12 + np.maximum(month, 1) - 1
    first = months.astype(np.int64).astype("datetime64[M]").astype("datetime64[us]")
    elapsed_us = (((np.maximum(day, 1) - 1) * 24 + hour) * 60 + minute) * 60e6 + second * 1e6
    whole = first + np.round(elapsed_us + nano / 1e3).astype(np.int64).astype("timedelta64[us]")
    return np.asarray(np.datetime_as_string(whole, unit="us"))
