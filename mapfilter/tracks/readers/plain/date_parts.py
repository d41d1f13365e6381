"""Times of a plain CSV in parts: year, month and day, or a date; hour, minute and second."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

import numpy as np

from mapfilter._constants import DAY_S
from mapfilter._types import Floats
from mapfilter.clocks.times import parse_times
from mapfilter.tracks.readers.plain.fields import FIELDS
from mapfilter.tracks.readers.plain.headers import columns_of
from mapfilter.tracks.readers.texts.columns import Columns

_DAY_PARTS = (("year",), ("month",), ("day",))
_DATE = "date"
_TIME_PARTS = (
    ("hour", "hours", "hh"),
    ("min", "minute", "minutes", "mm"),
    ("sec", "second", "seconds", "ss"),
)
_NANO = "nano"
"""What a receiver of u-blox adds to its rounded seconds."""
_UTC = "itow"
_LAST = (23, 59, 60)
_YEARS = 1980, 2099
_YEARS_S = 315_532_800.0, 4_102_444_800.0
_DAY = re.compile(r"^((?:19|20)\d\d)(-?)(\d\d)\2(\d\d)(?:[T ].*)?$")
"""A date, also without separators, such as 20260501; its midnight and zone are left out."""


def _columns(names: Sequence[str], own: Collection[str]) -> list[str]:
    """Return the columns of all parts; an empty list where one lacks, or there are other times."""
    times = {*FIELDS["time"]}.intersection(names) | {*columns_of("time", names, ())}
    for day in (_DAY_PARTS, ((_DATE,),)):
        found = [next((name for name in some if name in names), "") for some in day + _TIME_PARTS]
        once = all(name and names.count(name) == 1 and name not in own for name in found)
        if once and not times - {*found}:
            return found
    return []


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
    utc, hour = _UTC in names, parts[-3]
    nameless = {*parts, *((_NANO, _UTC) if utc else ())} - {*own, hour}
    time = "time (utc)" if utc else "time"
    return tuple(time if name == hour else "" if name in nameless else name for name in names)


def parts_of_dates(rows: Columns, own: Collection[str] = ()) -> Columns:
    """Return columns in which that of the hours holds whole times, where there are all parts."""
    if not (parts := _columns(rows.names, own)):
        return rows
    *day, hour = parts[:-2]
    midnight_s = _of_dates(rows) if day == [_DATE] else _of_numbers(rows, day)
    # The reader of times reads dates in other orders, or tells how to write them.
    others = day == [_DATE] and not np.isfinite(midnight_s).any()
    midnight_s = np.zeros(len(rows)) if others else midnight_s
    good = np.isfinite(midnight_s)
    numbers = [rows.number(name) for name in parts[-3:]]
    for number, most in zip(numbers, _LAST, strict=True):
        good &= (number >= 0) & (number <= most)
    nano = rows.number(_NANO) if _UTC in rows.names and rows.has(_NANO) else np.zeros(len(rows))
    hours, minutes, seconds = (np.where(good, number, 0.0) for number in numbers)
    elapsed_us = (hours * 60 + minutes) * 60e6 + seconds * 1e6 + np.nan_to_num(nano) / 1e3
    whole_us = np.where(good, midnight_s, 0.0) * 1e6 + np.round(np.where(good, elapsed_us, 0.0))
    texts = np.datetime_as_string(whole_us.astype(np.int64).astype("datetime64[us]"), unit="us")
    rows.reading.note(f"time: columns {', '.join(parts)}")
    texts = np.where(good, texts, "").astype(object)
    if others:
        clocks = np.array([text.partition("T")[2] for text in texts.tolist()], dtype=object)
        return rows.filled(hour, clocks).joined(_DATE, hour)
    return rows.filled(hour, texts)


def _of_dates(rows: Columns) -> Floats:
    """Return the seconds from 1970 of the midnights of dates; NaN where they are not understood."""
    words, which = np.unique(rows.texts(_DATE).astype(np.str_), return_inverse=True)
    plain = [_DAY.sub(r"\1-\3-\4", word) for word in words.tolist()]
    time_s, _ = parse_times(np.array(plain, dtype=object))
    time_s = np.where((time_s >= _YEARS_S[0]) & (time_s < _YEARS_S[1]), time_s, np.nan)
    return np.asarray((time_s // DAY_S * DAY_S)[which])


def _of_numbers(rows: Columns, day: Sequence[str]) -> Floats:
    """Return the seconds from 1970 of the midnights of years, months and days; NaN for no dates."""
    year, month, date = numbers = [rows.number(name) for name in day]
    good = (year >= _YEARS[0]) & (year <= _YEARS[1])
    for number, most in zip(numbers[1:], (12, 31), strict=True):
        good &= (number >= 1) & (number <= most)
    months = np.where(good, (year - 1970) * 12 + month - 1, 0.0)
    first_s = months.astype(np.int64).astype("datetime64[M]").astype("datetime64[s]")
    return np.where(good, first_s.astype(np.int64) + (date - 1) * DAY_S, np.nan)
