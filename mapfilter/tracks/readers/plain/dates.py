"""Times of day of a plain CSV whose dates are in a column of their own."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from mapfilter._types import Floats
from mapfilter.clocks.named_dates import dates_in_name
from mapfilter.clocks.short_years import nearest
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.texts.columns import Columns

_DATE, _DATE_OF_NAME = "date", "date in the name of the file"
_A_DATE = re.compile(r"(\d{4}([-./])\d{1,2}\2\d{1,2}|\d{1,2}([-./])\d{1,2}\3\d{4})\.?")
"""With four digits of the year: others may be a version, such as 4.2.15."""
_OF_DAY = re.compile(r"\d{1,2}:\d\d")
_DATE_BEHIND = re.compile(r"\s\d{1,4}(?:[-/.][^\W_]{1,9}[-/.]|[ ][A-Za-z]{3,9}\.?[ ])\d")
"""A date after the time of day, such as 10:15:30 1.5.2026."""
_DIGITS_OF_DAY = re.compile(r"\d{5,6}(\.\d*)?")
"""Hours, minutes and seconds without separators, such as 101530; a spreadsheet drops a 0 before."""
_FEW_DIGITS_OF_DAY = re.compile(r"\d{1,6}(\.\d*)?")
_DIGITS = re.compile(r"\d{5,6}|(?:19|20)\d{6}")
_NAMED_DATE = re.compile(r"(?<!up)date")
"""In the name of a column, which is none of updates."""
_ORDERS = {
    "year, month, day": (r"^\s*((?:19|20)\d\d)(\d\d)(\d\d)\s*$", r"\1-\2-\3"),
    "year (of the century), month, day": (r"^\s*(\d\d)(\d\d)(\d\d)\s*$", r"20\1-\2-\3"),
    "day, month, year (of the century)": (r"^\s*(\d\d)(\d\d)(\d\d)\s*$", r"20\3-\2-\1"),
}
"""Dates without separators: the first has eight digits."""
_UNCLEAR = "day or year first"
_WHOLE = 8
_LEAST_OF_DAY = 0.9
_FIRST_DAY, _LAST_DAY = np.datetime64("2016-01-01"), np.datetime64("2036-01-01")
"""Of such a date with six digits, which may be read in two orders."""

OF_DAY = "time: taken for hours, minutes and seconds of the day in one number, as 101530"


def with_dates(mapped: Mapped) -> Mapped:
    """Return columns with times of day after the dates of a column of their own, if there is one.

    That is the column ``date``, else the only one that is no field's and begins with a date. Both
    may be digits without separators, such as 20260501 or 010526 and 101530. Without such a column
    it is the date in the name of the file.
    """
    rows, name = mapped.rows, mapped.rows.find(*mapped.names("time"))
    if name is None or name == _DATE:
        return mapped
    # After midnight a later part of a file may begin with 5 for 00:00:05.
    known = rows.reading.date_order in _ORDERS
    digits = _FEW_DIGITS_OF_DAY if known else _DIGITS_OF_DAY
    if digits.fullmatch(rows.first_text(name)):
        return _of_digits(mapped, name)
    if not _OF_DAY.match(rows.first_text(name)):
        return mapped
    others = (one for one in rows.names if one not in mapped.taken)
    found = [one for one in others if _A_DATE.fullmatch(rows.first_text(one))]
    if rows.has(_DATE):
        found = [_DATE]
    if not found and not _DATE_BEHIND.search(rows.first_text(name)):
        return _of_the_name(mapped, name)
    if len(found) != 1:
        return mapped
    return _joined(mapped, rows, found[0], name)


def _of_the_name(mapped: Mapped, name: str) -> Mapped:
    """Return columns with times of day after the only date in the name of the file, if it has one.

    The name is that of the file alone: a folder may hold logs of several days.
    """
    reading = mapped.rows.reading
    days = {str(day) for day in dates_in_name(Path(reading.path.name))}
    if len(days) != 1 or name in mapped.beside:
        return mapped
    day = days.pop()
    reading.note(f"time: times of day without a date: those of {day}, by the name of the file")
    rows = mapped.rows.with_column(_DATE_OF_NAME, day).joined(_DATE_OF_NAME, name)
    return replace(mapped, rows=rows, beside=(_DATE_OF_NAME,), date=_DATE_OF_NAME)


def _joined(mapped: Mapped, rows: Columns, date: str, name: str) -> Mapped:
    rows.reading.note(f"time: columns {date} and {name}")
    rows.reading.date_column = date
    return replace(mapped, rows=rows.joined(date, name), beside=(date,), date=date)


def _of_digits(mapped: Mapped, name: str) -> Mapped:
    """Return columns with times of digits after dates of digits, if a column has such dates."""
    rows = mapped.rows
    dates = [one for one in rows.names if _NAMED_DATE.search(one) and one not in mapped.taken]
    dates = [_DATE] if _DATE in dates else dates
    order = rows.reading.date_order
    # Later parts of a file are read as the first one.
    if len(dates) != 1 or order == _UNCLEAR:
        return mapped
    date = dates[0]
    if order not in _ORDERS:
        given = np.unique(rows.texts(date)[rows.with_digits(date)].astype(np.str_)).tolist()
        if not (given and all(map(_DIGITS.fullmatch, given)) and _are_of_day(rows.number(name))):
            return mapped
        days = _orders(given)
        near = nearest(days, lambda: rows.other_dates((date,))) if len(days) > 1 else ""
        orders = [near] if near else _usual(days)
        if not orders:
            return mapped
        if len(orders) > 1:
            rows.reading.date_order = _UNCLEAR
            rows.reading.note(OF_DAY)
            rows.reading.note(f"{date}: {given[0]}: {_UNCLEAR}? Write 2026-05-01")
            return mapped
        order = rows.reading.date_order = orders[0]
        if order != next(iter(_ORDERS)):
            others = [str(some[0]) for one, some in days.items() if one != order]
            beside = f" ({given[0]}: {days[order][0]}, not {others[0]})" if others else ""
            rows.reading.note(f"{date}: {order}{beside}")
    changed = rows.rewritten(r"^\s*(\d{1,6}(?:\.\d*)?)\s*$", r"00000\1", name)
    changed = changed.rewritten(r"^\d*(\d\d)(\d\d)(\d\d)(\.\d*)?$", r"\1:\2:\3\4", name)
    changed = changed.rewritten(r"^\s*(\d{5})\s*$", r"0\1", date)
    return _joined(mapped, changed.rewritten(*_ORDERS[order], date), date, name)


def _are_of_day(number: Floats) -> bool:
    """Return whether numbers are times of day, save a few; of the seconds of a day many are not."""
    known, of_day = np.isfinite(number), np.isfinite(seconds_in_digits(number))
    return bool(np.count_nonzero(of_day) >= _LEAST_OF_DAY * np.count_nonzero(known))


def _orders(given: list[str]) -> dict[str, list[np.datetime64]]:
    """Return the days of dates of digits in each order in which they may be written."""
    found: dict[str, list[np.datetime64]] = {}
    whole = all(len(one) == _WHOLE for one in given)
    for order in list(_ORDERS)[:1] if whole else list(_ORDERS)[1:]:
        pattern, by = _ORDERS[order]
        written = [re.sub(pattern, by, one.zfill(6)) for one in given]
        try:
            days = np.array(written, dtype="datetime64[D]")
        except ValueError:
            continue
        if whole or days.max() < _LAST_DAY:
            found[order] = list(days)
    return found


def _usual(days: dict[str, list[np.datetime64]]) -> list[str]:
    """Return the orders of recent days; one with the whole year needs none."""
    whole = next(iter(_ORDERS))
    return [order for order, some in days.items() if order == whole or min(some) >= _FIRST_DAY]


def seconds_in_digits(number: Floats) -> Floats:
    """Return seconds of the day for times of day in one number; NaN for other numbers.

    Examples
    --------
    >>> seconds_in_digits(np.array([101530.25, 101560.0, 241530.0])).tolist()
    [36930.25, nan, nan]
    """
    known = np.isfinite(number)
    hours, rest = np.divmod(np.where(known, number, 0.0), 10_000.0)
    minutes, seconds = np.divmod(rest, 100.0)
    of_day = known & (hours >= 0) & (hours < 24) & (minutes < 60) & (seconds < 60)
    return np.where(of_day, 3600 * hours + 60 * minutes + seconds, np.nan)
