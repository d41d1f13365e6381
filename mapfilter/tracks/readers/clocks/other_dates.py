"""Dates of a file beside its column of times: of its name, of other columns, of GPS weeks."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from mapfilter.clocks.named_dates import dates_in_name

_DATE = re.compile(r"((?:19|20)\d\d)[-/.]?(\d\d)[-/.]?(\d\d)(?!\d)", re.ASCII)
_DOTTED = re.compile(r"(\d\d?)\.(\d\d?)\.((?:19|20)\d\d)(?!\d)", re.ASCII)
GPS_WEEKS = ("gps_week", "gpsweek", "gps week", "gwk")
_WEEK = re.compile(r"(\d{4})(?:\.0*)?", re.ASCII)
_FIRST_WEEK = np.datetime64("1980-01-06")
_FIRST_WHOLE, _LAST_WHOLE = 1024, 4096
"""Weeks that are not counted modulo 1024."""


def other_dates(
    path: Path, names: Sequence[str], firsts: Sequence[str], own: Collection[str]
) -> list[np.datetime64]:
    """Return dates of a file that can be read in one way only.

    Parameters
    ----------
    path : Path
    names : sequence of str
        Of the columns, in lower case.
    firsts : sequence of str
        The first text of each column.
    own : collection of str
        The columns whose dates are to be read.

    Examples
    --------
    >>> found = other_dates(Path("a.csv"), ["time", "start"], ["16/05/13", "16.5.2013"], ["time"])
    >>> str(found[0])
    '2013-05-16'
    """
    found = dates_in_name(path)
    for name, text in zip(names, firsts, strict=True):
        if name in own:
            continue
        if name in GPS_WEEKS and (week := _WEEK.fullmatch(text)):
            if _FIRST_WHOLE <= int(week[1]) < _LAST_WHOLE:
                first = _FIRST_WEEK + 7 * int(week[1])
                found += [first + day for day in range(7)]
            continue
        if whole := _DATE.match(text):
            year, month, day = whole.groups()
        elif dotted := _DOTTED.match(text):
            day, month, year = dotted.groups()
        else:
            continue
        try:
            found.append(np.datetime64(f"{year}-{month:0>2}-{day:0>2}"))
        except ValueError:
            continue
    return found
