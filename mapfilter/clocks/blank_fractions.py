"""Digits behind a blank after the seconds: decimals of a second, or milliseconds."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

_FRACTION = (
    r"^(?P<before>.*\d:\d\d:\d\d)\s(?P<digits>\d{1,3})"
    r"(?P<after>\s?(?:Z|[AaPp]\.?[Mm]\.?|[+-]\d\d(?::?\d\d)?|[A-Z]{3,5})|\s+\d{1,4}[-/.].*)?$"
)
"""Before the end, a zone or a date; digits before a point or a hyphen are of a date themselves."""
_WIDTH = 3


def with_whole_milliseconds(column: pa.ChunkedArray) -> tuple[pa.ChunkedArray, tuple[str, ...]]:
    """Return texts of times whose milliseconds behind a blank have three digits, and notes.

    Digits of several widths may be decimals that lost their last zeros, or whole milliseconds
    without their first ones. They are those by which times run back less often.

    Examples
    --------
    >>> found, notes = with_whole_milliseconds(
    ...     pa.chunked_array([["10:00:05 5", "10:00:05 95", "10:00:05 105"]])
    ... )
    >>> found.to_pylist()
    ['10:00:05 005', '10:00:05 095', '10:00:05 105']
    """
    parts = pc.extract_regex(column, _FRACTION)
    digits = pc.struct_field(parts, "digits")
    widths = pc.unique(pc.drop_null(pc.utf8_length(digits))).to_pylist()
    if not widths:
        return column, ()
    if len(widths) == 1:
        note = "decimals of a second behind a blank"
        return column, () if widths == [_WIDTH] else (f"time: {note}",)
    decimals = _runs_back(parts, pc.utf8_rpad(digits, _WIDTH, "0"))
    whole = pc.utf8_lpad(digits, _WIDTH, "0")
    if decimals <= _runs_back(parts, whole):
        return column, ("time: decimals of a second behind a blank",)
    after = pc.fill_null(pc.struct_field(parts, "after"), "")
    times = pc.binary_join_element_wise(pc.struct_field(parts, "before"), whole, " ")
    found = pc.coalesce(pc.binary_join_element_wise(times, after, ""), column)
    return found, ("time: whole milliseconds behind a blank",)


def _runs_back(parts: pa.ChunkedArray, digits: pa.ChunkedArray) -> int:
    """Return how often the digits of one second fall from row to row."""
    before = pc.drop_null(pc.struct_field(parts, "before"))
    number = pc.cast(pc.drop_null(digits), pa.int64()).to_numpy()
    same = pc.equal(before.slice(1), before.slice(0, len(before) - 1))
    return int(np.count_nonzero((np.diff(number) < 0) & same.to_numpy()))
