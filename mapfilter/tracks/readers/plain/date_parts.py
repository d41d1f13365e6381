"""Times of a plain CSV in parts.

Parts are a date, or year, month and day, or year and day of the year; then hour, minute and second,
or seconds of the day.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import product

import numpy as np

from mapfilter._constants import DAY_S
from mapfilter._types import Floats
from mapfilter.clocks.times import parse_times
from mapfilter.tracks.readers.plain.fields import FIELDS
from mapfilter.tracks.readers.plain.headers import columns_of
from mapfilter.tracks.readers.texts.columns import Columns

_DATE = "date"
_YEAR = ("year", "yyyy", "utc_year")
_DAYS = (
    (_YEAR, ("month", "utc_month"), ("day", "utc_day")),
    (_YEAR, ("doy", "ddd", "day_of_year", "dayofyear", "day of year", "yday")),
    ((_DATE,),),
)
_HOUR = ("hour", "hours", "hh", "utc_hour")
_MINUTE = ("min", "minute", "minutes", "mm", "utc_minute")
_CLOCKS = (
    (_HOUR, _MINUTE, ("sec", "second", "seconds", "ss", "utc_second")),
    (_HOUR, _MINUTE),
    (("sod", "seconds_of_day", "second_of_day", "secofday", "seconds of day"),),
)
"""Parts of days and of times of day; without seconds times are whole minutes."""
_OF_SATELLITES = 1
"""Parts of a clock that is a count of seconds of the day."""
_NANOS = ("nano", "utc_nano")
"""What a receiver of u-blox adds to its rounded seconds, and a sensor of Xsens to whole ones."""
_UTC = "itow"
_LAST = (23, 59, 60)
_LAST_DAY, _LAST_SECOND = 366, 86_400
_YEARS = 1980, 2099
_YEARS_S = 315_532_800.0, 4_102_444_800.0
_DAY = re.compile(r"^((?:19|20)\d\d)(-?)(\d\d)\2(\d\d)(?:[T ].*)?$")
"""A date, also without separators, such as 20260501; its midnight and zone are left out."""


def _columns(names: Sequence[str], own: Collection[str]) -> tuple[list[str], list[str]]:
    """Return the columns of days and of times of day; none where a part lacks, or others are times.

    The columns of several clocks are not told apart by their names.
    """
    times = {*FIELDS["time"]}.intersection(names) | {*columns_of("time", names, ())}
    for days, clock in product(_DAYS, _CLOCKS):
        found = [next((name for name in some if name in names), "") for some in (*days, *clock)]
        once = all(name and names.count(name) == 1 and name not in own for name in found)
        if once and not times - {*found}:
            return found[: len(days)], found[len(days) :]
    return [], []


def of_parts(names: tuple[str, ...], own: Collection[str] = ()) -> tuple[str, ...]:
    """Return names of columns of which those of the parts of a time are one; no names for others.

    Beside the seconds of a GPS week that a receiver counts they are UTC.

    Examples
    --------
    >>> of_parts(("year", "month", "day", "hour", "min", "sec", "lat"))
    ('', '', '', 'time', '', '', 'lat')
    """
    day, clock = _columns(names, own)
    if not day:
        return names
    hour = clock[0]
    utc = _UTC in names or len(clock) == _OF_SATELLITES or hour.startswith("utc_")
    nameless = {*day, *clock, *((*_NANOS, _UTC) if utc else ())} - {*own, hour}
    time = "time (utc)" if utc else "time"
    return tuple(time if name == hour else "" if name in nameless else name for name in names)


def parts_of_dates(rows: Columns, own: Collection[str] = ()) -> Columns:
    """Return columns in which that of the hours holds whole times, where there are all parts."""
    day, clock = _columns(rows.names, own)
    if not day:
        return rows
    hour = clock[0]
    midnight_s = _of_dates(rows) if day == [_DATE] else _of_numbers(rows, day)
    # The reader of times reads dates in other orders, or tells how to write them.
    others = day == [_DATE] and not np.isfinite(midnight_s).any()
    midnight_s = np.zeros(len(rows)) if others else midnight_s
    elapsed_s = _of_clock(rows, clock)
    good = np.isfinite(midnight_s) & np.isfinite(elapsed_s)
    whole_us = np.where(good, midnight_s, 0.0) * 1e6 + np.round(np.where(good, elapsed_s, 0) * 1e6)
    texts = np.datetime_as_string(whole_us.astype(np.int64).astype("datetime64[us]"), unit="us")
    _note(rows, [*day, *clock], len(clock))
    texts = np.where(good, texts, "").astype(object)
    if others:
        clocks = np.array([text.partition("T")[2] for text in texts.tolist()], dtype=object)
        rows.reading.date_column = _DATE
        return rows.filled(hour, clocks).joined(_DATE, hour)
    return rows.filled(hour, texts)


def _note(rows: Columns, parts: Sequence[str], of_clock: int) -> None:
    rows.reading.note(f"time: columns {', '.join(parts)}")
    if of_clock == _OF_SATELLITES:
        rows.reading.note(
            f"time: {parts[-1]} taken for UTC; if it is GPS time, 18 s ahead of it since 2017: "
            f"--offset {rows.reading.path.name}=-18"
        )
    if of_clock == len(_LAST) - 1:
        rows.reading.note("time: no column of seconds: whole minutes")


def _of_clock(rows: Columns, clock: Sequence[str]) -> Floats:
    """Return seconds from midnight; NaN for no times of day."""
    numbers = [rows.number(name) for name in clock]
    if len(clock) == _OF_SATELLITES:
        of_day = (numbers[0] >= 0) & (numbers[0] <= _LAST_SECOND)
        return np.where(of_day, numbers[0], np.nan)
    good = np.ones(len(rows), dtype=bool)
    for number, most in zip(numbers, _LAST, strict=False):
        good &= (number >= 0) & (number <= most)
    seconds = numbers[2] if len(numbers) == len(_LAST) else np.zeros(len(rows))
    utc = _UTC in rows.names or clock[0].startswith("utc_")
    nano = rows.number(*_NANOS) if utc else np.zeros(len(rows))
    elapsed_s = (numbers[0] * 60 + numbers[1]) * 60 + seconds + np.nan_to_num(nano) / 1e9
    return np.where(good, elapsed_s, np.nan)


def _of_dates(rows: Columns) -> Floats:
    """Return the seconds from 1970 of the midnights of dates; NaN where they are not understood."""
    words, which = np.unique(rows.texts(_DATE).astype(np.str_), return_inverse=True)
    plain = [_DAY.sub(r"\1-\3-\4", word) for word in words.tolist()]
    time_s, _ = parse_times(np.array(plain, dtype=object))
    time_s = np.where((time_s >= _YEARS_S[0]) & (time_s < _YEARS_S[1]), time_s, np.nan)
    return np.asarray((time_s // DAY_S * DAY_S)[which])


def _of_numbers(rows: Columns, day: Sequence[str]) -> Floats:
    """Return the seconds from 1970 of the midnights of days in numbers; NaN for no dates.

    Days are years, months and days, or years and days of the year.
    """
    year, *rest = (rows.number(name) for name in day)
    month, date = rest if len(rest) > 1 else (np.ones(len(rows)), rest[0])
    good = (year >= _YEARS[0]) & (year <= _YEARS[1])
    for number, most in ((month, 12), (date, 31 if len(rest) > 1 else _LAST_DAY)):
        good &= (number >= 1) & (number <= most)
    months = np.where(good, (year - 1970) * 12 + month - 1, 0.0)
    first_s = months.astype(np.int64).astype("datetime64[M]").astype("datetime64[s]")
    return np.where(good, first_s.astype(np.int64) + (date - 1) * DAY_S, np.nan)
