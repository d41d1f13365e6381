"""Time stamps of a logger before NMEA sentences: dates where the file has no others."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from mapfilter._types import Floats, Ints

_MOST_LINES, _PAUSE_S = 1000, 60.0
_DAY_S = 86_400.0
_DATE = re.compile(
    rb"(\d{4})[-/](\d\d)[-/](\d\d)[T ,;]{1,2}(\d\d):(\d\d):(\d\d)(?:[.,]\d+)?(Z|[+-]\d\d:?\d\d)?"
)
_NUMBER = re.compile(rb"\d{10,19}(?:\.\d+)?")
_DIGITS_OF_UNITS = {10: 1.0, 13: 1e3, 16: 1e6, 19: 1e9}
"""Of Unix times, which have ten digits in seconds from 2001 to 2286."""


def stamped_dates(data: bytes, line: Ints, of_day_s: Floats) -> pd.DataFrame:
    """Return the UTC midnight of sentences by the time stamps before them.

    Stamps may be local times: the day is that on which the sentence's time of day is nearest.

    Parameters
    ----------
    data : bytes
        The file.
    line : (N,) array
        Numbers of lines with a sentence, from 1, rising.
    of_day_s : (N,) array
        UTC seconds of the day of each; NaN where unknown.

    Returns
    -------
    pandas.DataFrame
        line, midnight_s, of_day_s; without rows where there are no stamps with a date.

    Examples
    --------
    >>> data = b"2024-05-02T00:30:00 $GPGGA,223000.00,"
    >>> dates = stamped_dates(data, np.array([1]), np.array([81_000.0]))
    >>> pd.to_datetime(dates["midnight_s"], unit="s").dt.date.astype(str).tolist()
    ['2024-05-01']
    """
    some = np.flatnonzero(np.isfinite(of_day_s))
    paused = np.abs(np.diff(of_day_s[some])) > _PAUSE_S
    # Sentences beside a pause, too, as those after it may be of another day.
    told = np.append(paused, False) | np.append(False, paused)[: some.size]
    told[:: max(1, some.size // _MOST_LINES)] = True
    some = some[told]
    begins = np.append(0, np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == 10) + 1)
    stamps = np.array([_stamp_s(data, int(begins[k - 1])) for k in line[some].tolist()])
    midnight_s = _DAY_S * np.round((stamps - of_day_s[some]) / _DAY_S)
    rows = {"line": line[some], "midnight_s": midnight_s, "of_day_s": of_day_s[some]}
    return pd.DataFrame(rows).dropna().reset_index(drop=True)


def _stamp_s(data: bytes, begin: int) -> float:
    """Return the time stamp at the begin of a line as UTC seconds; NaN without a date."""
    before = data[begin : data.find(b"$", begin)]
    if (date := _DATE.search(before)) is not None:
        try:
            moment = pd.Timestamp("{}-{}-{}T{}:{}:{}".format(*map(bytes.decode, date.groups()[:6])))
        except ValueError:
            return float("nan")
        return float(moment.timestamp()) - _offset_s((date[7] or b"Z").decode())
    number = _NUMBER.search(before)
    unit = 0.0 if number is None else _DIGITS_OF_UNITS.get(len(number[0].partition(b".")[0]), 0.0)
    return float(number[0]) / unit if number is not None and unit else float("nan")


def _offset_s(zone: str) -> float:
    if zone == "Z":
        return 0.0
    digits = zone[1:].replace(":", "")
    offset_s = 3600.0 * int(digits[:2]) + 60.0 * int(digits[2:])
    return -offset_s if zone[0] == "-" else offset_s
