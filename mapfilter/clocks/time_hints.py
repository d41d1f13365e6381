"""What is most likely wrong with a text that is no time."""

from __future__ import annotations

import re

from mapfilter.clocks.named_zones import named_zone_hint


def hint_on_time(text: str) -> str:
    """Return the likely mistake behind a text that is no time; "" where none is known.

    Examples
    --------
    >>> hint_on_time("11/05/26 10:00:00")
    'which number is the day, the month, the year? Write 2026-05-13'
    """
    if (year := re.match(r"(\d{4})-\d\d", text.strip())) and not 1980 <= int(year[1]) <= 2099:
        return "a wrong year; times of 1980 to 2099 are read"
    if re.match(r"(\d{1,2})([-/.])(\d{1,2})\2\d\d(?!\d)", text.strip()):
        return "which number is the day, the month, the year? Write 2026-05-13"
    if zone_hint := named_zone_hint(text):
        return zone_hint
    if re.match(r"\d{1,2}[-/]\d{1,2}[-/]\d{2,4}", text.strip()):
        return "day or month first? Write 2021-03-04, or 4.3.2021 with dots"
    if re.match(r"\d{1,2}[-. ][^\W\d_]{3,}\.?[-. ]\d{4}", text.strip()):
        return "a month that is not named in English; write 2026-05-01T10:00:00"
    if re.match(r"\d{1,2}:\d\d", text.strip()):
        return "a time of day without its date; write 2026-05-01T08:00:00, or seconds"
    if re.search(r"\d\s?[ap]\.?m\.?$", text.strip(), re.IGNORECASE):
        return "AM and PM go with hours of 1 to 12; write 2026-05-01T14:00:00"
    return ""
