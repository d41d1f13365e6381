"""Times of day of a plain CSV whose dates are in a column of their own."""

from __future__ import annotations

import re
from dataclasses import replace

from mapfilter.tracks.readers.plain.mapped import Mapped

_DATE = "date"
_A_DATE = re.compile(r"(\d{4}([-./])\d{1,2}\2\d{1,2}|\d{1,2}([-./])\d{1,2}\3\d{4})\.?")
"""With four digits of the year: others may be a version, such as 4.2.15."""
_OF_DAY = re.compile(r"\d{1,2}:\d\d")


def with_dates(mapped: Mapped) -> Mapped:
    """Return columns with times of day after the dates of a column of their own, if there is one.

    That is the column ``date``, else the only one that is no field's and begins with a date.
    """
    rows, name = mapped.rows, mapped.rows.find(*mapped.names("time"))
    if name in (None, _DATE) or not _OF_DAY.match(rows.first_text(name)):
        return mapped
    others = (one for one in rows.names if one not in mapped.taken)
    found = [one for one in others if _A_DATE.fullmatch(rows.first_text(one))]
    if rows.has(_DATE):
        found = [_DATE]
    if len(found) != 1:
        return mapped
    rows.reading.note(f"time: columns {found[0]} and {name}")
    joined = rows.joined(found[0], name)
    return replace(mapped, rows=joined, beside=(found[0],), date=found[0])
