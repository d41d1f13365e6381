"""Times of measured levels: numbers at once, texts as one column, by the reader of recordings."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa

from mapfilter._types import Floats
from mapfilter.clocks.named_dates import dates_in_name
from mapfilter.clocks.short_years import Dates
from mapfilter.clocks.written_times import written_times
from mapfilter.radio.tables import number

_LATEST_S = 4_102_444_800.0
_MINUTES = (1.9e11, 2.1e11)
"""Numbers that may be a date, an hour and a minute, such as 202605011015."""
_DAY_ALONE = re.compile(r"\d{1,4}([-./])\d{1,2}\1\d{1,4}\.?", re.ASCII)
_TIME_OF_DAY = re.compile(r"\d{1,2}:\d\d", re.ASCII)
_NO_TIME = " -"
_TEXTS_KEPT = 1 << 14


def read_times(texts: Sequence[str]) -> tuple[Floats, tuple[str, ...]]:
    """Return Unix seconds of times as texts (UTC by default), NaN for others, and notes on them.

    A day alone is no time.

    Examples
    --------
    >>> read_times(["1599319703000", "2020-09-05T15:28:23Z", "05.09.2020 15:28:23"])[0].tolist()
    [1599319703.0, 1599319703.0, 1599319703.0]
    """
    return _read(pa.chunked_array([pa.array(map(_of_a_time, texts), pa.string())]))


def with_date(text: str, date: str) -> str:
    """Return a time of day after the date of its row; other times as they are.

    Examples
    --------
    >>> with_date("10:00:00", "13.05.2026"), with_date("2026-05-13 10:00", "13.05.2026")
    ('13.05.2026 10:00:00', '2026-05-13 10:00')
    """
    return f"{date} {text}" if date and _TIME_OF_DAY.match(text) else text


@dataclass(slots=True)
class WaitingTimes:
    """Times as texts of rows, which are read when all are there: one may tell how others are.

    ``rows`` and ``lines`` are numbers of the rows, and of their lines in the file.
    """

    rows: array[int] = field(default_factory=lambda: array("q"))
    lines: array[int] = field(default_factory=lambda: array("q"))
    _chunks: list[pa.Array] = field(default_factory=list)
    _texts: list[str] = field(default_factory=list)

    def seconds(self, row: int, line: int, text: str) -> float:
        """Return Unix seconds of a number (s, ms or µs); else NaN, and a text is kept for later."""
        value = number(text)
        if value is not None and not _MINUTES[0] <= value < _MINUTES[1]:
            value /= 1e6 if value > 1e14 else 1e3 if value > 1e11 else 1.0
            if 0 < value < _LATEST_S:
                return value
        if text:
            self.rows.append(row)
            self.lines.append(line)
            self._texts.append(_of_a_time(text))
            if len(self._texts) >= _TEXTS_KEPT:
                self._pack()
        return math.nan

    def read(self, path: Path) -> tuple[Floats, tuple[str, ...]]:
        """Return the seconds of all rows that wait, NaN for no times, and notes on them.

        A date in the name of the file tells which number of dates is the day.
        """
        self._pack()
        return _read(pa.chunked_array(self._chunks, pa.string()), partial(dates_in_name, path))

    def text(self, which: int) -> str:
        """Return the text of one of the rows."""
        text = pa.chunked_array(self._chunks, pa.string())[which].as_py()
        return str(text).removesuffix(_NO_TIME)

    def _pack(self) -> None:
        """Keep texts in less memory."""
        self._chunks.append(pa.array(self._texts, pa.string()))
        self._texts.clear()


def _of_a_time(text: str) -> str:
    """Return a text as it is; a day alone with a mark by which it is no time."""
    return f"{text}{_NO_TIME}" if _DAY_ALONE.fullmatch(text.strip()) else text


def _read(column: pa.ChunkedArray, others: Dates = tuple) -> tuple[Floats, tuple[str, ...]]:
    found = written_times(column, others=others)
    known = (found.time_s > 0) & (found.time_s < _LATEST_S)
    return np.where(known, found.time_s, np.nan), found.notes
