"""What is most likely wrong with a text that is no time."""

from __future__ import annotations

import re
from collections.abc import Sequence

from mapfilter.clocks.named_zones import named_zone_hint
from mapfilter.clocks.short_years import short_readings


def hint_on_time(text: str, dated_by_name: bool = True) -> str:
    """Return the likely mistake behind a text that is no time; "" where none is known.

    ``dated_by_name`` tells whether times of day take the date in the name of their file.

    Examples
    --------
    >>> hint_on_time("10/10/10/")
    'which number is the day, the month, the year? Write 2026-05-13'
    >>> hint_on_time("16/05/13")[63:103]
    '(it may be 2013-05-16 or 2016-05-13), or'
    """
    if (year := re.match(r"(\d{4})-\d\d", text.strip())) and not 1980 <= int(year[1]) <= 2099:
        return "a wrong year; times of 1980 to 2099 are read"
    if re.match(r"(\d{1,2})([-/.])(\d{1,2})\2\d\d(?!\d)", text.strip()):
        asked = "which number is the day, the month, the year? Write 2026-05-13"
        readings = sorted(set(short_readings(text).values()))
        return f"{asked}{_which(readings)}" if len(readings) > 1 else asked
    if zone_hint := named_zone_hint(text):
        return zone_hint
    if re.match(r"\d{1,2}[-/]\d{1,2}[-/]\d{2,4}", text.strip()):
        asked = "day or month first? Write 2021-03-04, or 4.3.2021 with dots"
        return f"{asked}, or put the date into the name of the file, as 2021-03-04.csv"
    if re.match(r"\d{1,2}[-. ]{1,2}[^\W\d_]{3,}\.?[-. ]\d{4}", text.strip()):
        return "a month that is not named in English; write 2026-05-01T10:00:00"
    if re.match(r"\d{1,2}:\d\d", text.strip()):
        asked = "a time of day without its date; write 2026-05-01T08:00:00, or seconds"
        by_name = ", or put the date into the name of the file, as 2026-05-01.csv"
        return f"{asked}{by_name}" if dated_by_name else asked
    if re.search(r"\d\s?[ap]\.?m\.?$", text.strip(), re.IGNORECASE):
        return "AM and PM go with hours of 1 to 12; write 2026-05-01T14:00:00"
    return ""


def _which(readings: Sequence[str]) -> str:
    asked = f" (it may be {' or '.join(readings)})"
    return f"{asked}, or put the date into the name of the file, as {readings[0]}.csv"
