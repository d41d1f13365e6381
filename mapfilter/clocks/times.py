"""Times as recordings write them, in UTC seconds."""

from __future__ import annotations

import re
from math import nan

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import ArrayLike

from mapfilter._constants import DAY_S, GPS_EPOCH_S
from mapfilter._types import Floats
from mapfilter.clocks.local_times import utc_from_local_s
from mapfilter.gnss.almanacs import WEEK_S
from mapfilter.gnss.orbits import LEAPS_UTC_S

_DAYS, _NEAREST_S = (36_526.0, 73_050.0), 1e-3
"""Days of the years 2000 to 2099 since 1900, and rows a thousand a second."""
_UNITS = ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3))
_DOTTED = re.compile(r"^\s*(\d\d?)\.(\d\d?)\.((?:19|20)\d\d)(?!\d)", re.ASCII)
"""Day, month and year with dots, which no one writes in another order."""
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_NAMED = re.compile(
    rf"^\s*(\d\d?)[- ]({'|'.join(_MONTHS)})[a-z]*\.?[- ]((?:19|20)\d\d)(?!\d)",
    re.ASCII | re.IGNORECASE,
)
"""Day, month in English, and year."""
_HALF_DAY = re.compile(
    r"(?<=[\sT])(0?[1-9]|1[0-2])(:[0-5]\d(?::[0-5]\d(?:\.\d{1,9})?)?)\s?([ap])\.?m\.?(?=\s*(?:$|Z|[+-]))",
    re.IGNORECASE,
)
"""Hours of half a day, minutes, and AM or PM."""
LEAST_UNIX_S = 1e8
"""Seconds above are Unix times (since March 1973), below those from an unknown start."""
_MILLISECONDS = re.compile(r"(?<=[ T])(\d\d:\d\d:\d\d):(\d{3})\b", re.ASCII)
"""A time of day whose milliseconds follow a colon."""
_LEAP = r"(?:\d:[0-5]\d:|_\d\d\.[0-5]\d\.|\dT\d\d[0-5]\d)60(?:\D|$)"
_LEAP_60 = re.compile(r"(?:(?<=\d:[0-5]\d:)|(?<=_\d\d\.\d\d\.)|(?<=\dT\d{4}))60(?=\D|$)")
"""Second 60 of a time of day: hours and minutes before it."""
_UTC = re.compile(r"\s{0,3}\b(?:UTC|GMT)\s{0,3}$")
_ZONED = r"(?:Z|z|[+-]\d\d:?\d\d|(?::\d\d|T\d{4,6})(?:[.,]\d{1,9})?\s?[+-]\d\d)\s*$"
"""Ends of times that state their zone: whole hours only after a time of day, not after a month."""
_PLAIN_TIME = r"^(?:[01]\d|2[0-3]):[0-5]\d:[0-5]\d(?:\.\d{1,9})?$"
_TIME = re.compile(r"([01]?\d|2[0-3]):([0-5]\d):([0-5]\d|60)(?:[., ](\d{1,9}))?", re.ASCII)


def utc_from_gps_s(gps_s: ArrayLike) -> Floats:
    """Turn seconds since 6 January 1980 in GPS time into UTC seconds (Unix time).

    Leap seconds are those announced until 2026.

    Examples
    --------
    >>> from datetime import UTC, datetime
    >>> float(utc_from_gps_s(1930 * WEEK_S + 18.0)) - datetime(2017, 1, 1, tzinfo=UTC).timestamp()
    0.0
    """
    elapsed = np.asarray(gps_s, dtype=np.float64)
    leaps = np.sort(np.asarray(LEAPS_UTC_S))
    # From the date of leap second k on, GPS time is k seconds ahead.
    starts = leaps - GPS_EPOCH_S + np.arange(1, len(leaps) + 1)
    return np.asarray(GPS_EPOCH_S + elapsed - np.searchsorted(starts, elapsed, side="right"))


def utc_from_week_s(week: ArrayLike, tow_s: ArrayLike) -> Floats:
    """Turn GPS weeks, counted on, and seconds of the week into UTC seconds."""
    return utc_from_gps_s(np.asarray(week) * WEEK_S + np.asarray(tow_s))


def unix_seconds(values: ArrayLike) -> Floats:
    """Turn Unix times in s, ms, µs or ns, each told by its size, into seconds.

    Examples
    --------
    >>> unix_seconds([1599319703, 1599319703000, 1599319703000000000]).tolist()
    [1599319703.0, 1599319703.0, 1599319703.0]
    """
    number = np.array(values, dtype=np.float64)
    for least, scale in _UNITS:
        large = np.abs(number) > least
        number[large] /= scale
    return number


def in_days(numbers: Floats) -> bool:
    """Return whether numbers are in the range of a spreadsheet's days of this century."""
    low, high = _DAYS
    return bool(numbers.size and low <= numbers.min() and numbers.max() <= high)


def are_days(numbers: Floats) -> bool:
    """Return whether numbers are days of a spreadsheet: as seconds, rows would be too near.

    Examples
    --------
    >>> are_days(46_143 + np.arange(60) / 86_400), are_days(46_143 + np.arange(60.0))
    (True, False)
    """
    steps = np.diff(np.unique(numbers))
    return in_days(numbers) and bool(steps.size and np.median(steps) < _NEAREST_S)


def parse_times(
    texts: np.ndarray, zone: str = "", layout: str = "ISO8601", after_s: float = nan
) -> tuple[Floats, bool]:
    """Read dates and times.

    Parameters
    ----------
    texts : (N,) array of str
        A leap second (``:60``) is the first second of the next minute.
    zone : str
        Zone of times that state none.
    layout : str
        Format as of ``strptime``, or "ISO8601"; numbers are Unix times then, and days with dots
        (31.12.2026), names of months (31-Dec-2026), AM or PM after the time and milliseconds after
        a colon are read, too.
    after_s : float
        As of :func:`utc_from_local_s`.

    Returns
    -------
    time_s : (N,) array
        UTC seconds, NaN where not understood. Without a zone, as if the zone were UTC.
    zoned : bool
        Whether the times are UTC: by their own zone or by ``zone``.
    """
    given = pd.Series(texts, dtype=object).astype(str)
    time_s = np.full(len(given), np.nan)
    if layout == "ISO8601":
        number = pd.to_numeric(given, errors="coerce").to_numpy(dtype=np.float64)
        is_number = np.isfinite(number) & (np.abs(number) > LEAST_UNIX_S)
        time_s[is_number] = unix_seconds(number[is_number])
    else:
        is_number = np.zeros(len(given), dtype=bool)
    rest = given[~is_number]
    if rest.empty:
        return time_s, True
    leap = rest.str.contains(_LEAP, regex=True).to_numpy()
    plain = rest.str.replace(_LEAP_60, "59", regex=True) if leap.any() else rest
    plain = plain.str.replace(_UTC, "Z", regex=True) if layout == "ISO8601" else plain
    aware = plain.str.contains(_ZONED, regex=True).to_numpy()
    # Other years are beyond the range of timestamps, or no dates.
    if layout == "ISO8601":
        plain = plain.str.replace(",", ".", regex=False)
        if plain.str.match(_DOTTED).any():
            plain = plain.str.replace(
                _DOTTED, lambda m: f"{m[3]}-{int(m[2]):02d}-{int(m[1]):02d}", regex=True
            )
        if plain.str.match(_NAMED).any():
            plain = plain.str.replace(_NAMED, _with_month_number, regex=True)
        plain = plain.str.replace(_MILLISECONDS, r"\1.\2", regex=True)
        plain = plain.str.replace(_HALF_DAY, _with_whole_day, regex=True)
    plain = plain.where(plain.str.match(r"\s*(?:19|20)\d\d"), "")
    moments = pd.to_datetime(plain, format=layout, utc=True, errors="coerce")
    seconds = (moments - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy(dtype=np.float64)
    seconds = seconds + leap
    if zone and not aware.all():
        local_s = np.where(aware, np.nan, seconds)
        seconds = np.where(aware, seconds, utc_from_local_s(local_s, zone, after_s))
    time_s[~is_number] = seconds
    understood = np.isfinite(seconds)
    # A line of units or another header among Unix times has no zone.
    zoned = bool(zone) or bool(aware[understood].all() if understood.any() else is_number.any())
    return time_s, zoned


def _with_month_number(found: re.Match[str]) -> str:
    month = _MONTHS.index(found[2].lower()) + 1
    return f"{found[3]}-{month:02d}-{int(found[1]):02d}"


def _with_whole_day(found: re.Match[str]) -> str:
    hour = int(found[1]) % 12 + (12 if found[3].lower() == "p" else 0)
    return f"{hour:02d}{found[2]}"


def seconds_of_day(texts: pa.Array) -> Floats:
    """Read times of day ``HH:MM:SS`` with or without a fraction, NaN for other texts.

    The fraction may be behind a point, a comma or a blank.

    Examples
    --------
    >>> seconds_of_day(pa.array(["15:42:01.744", "9:00:00,5", "23:59:60 5", "25:00:00"])).tolist()
    [56521.744, 32400.5, 86400.5, nan]
    """
    trimmed = pc.utf8_trim_whitespace(texts)
    plain = pc.match_substring_regex(trimmed, _PLAIN_TIME)
    dated = pc.binary_join_element_wise("1970-01-01 ", pc.if_else(plain, trimmed, None), "")
    ns = pc.fill_null(pc.cast(pc.cast(dated, pa.timestamp("ns")), pa.int64()), -1)
    elapsed = np.asarray(ns.to_numpy(zero_copy_only=False), dtype=np.float64)
    time_s = np.where(elapsed < 0, np.nan, elapsed / 1e9)
    for at in np.flatnonzero(elapsed < 0).tolist():
        if found := _TIME.fullmatch(trimmed[at].as_py()):
            hours, minutes, seconds, fraction = found.groups("0")
            time_s[at] = 3600 * int(hours) + 60 * int(minutes) + float(f"{seconds}.{fraction}")
    return time_s


def without_midnights(seconds: Floats, before_s: float = np.nan) -> Floats:
    """Count times of day on where they pass midnight, from the day of the first one.

    A step of more than half a day is one over midnight. NaN stays NaN; ``before_s`` is the time
    before the first one, such as the last one of a part read before, counted on.

    Examples
    --------
    >>> without_midnights(np.array([86399.0, np.nan, 1.0])).tolist()
    [86399.0, nan, 86401.0]
    """
    counted = seconds.copy()
    known = np.isfinite(seconds)
    start = [before_s] if np.isfinite(before_s) else []
    counted[known] = np.unwrap(np.concatenate([start, seconds[known]]), period=DAY_S)[len(start) :]
    return counted
