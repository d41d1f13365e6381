"""Texts of a column read as numbers; what is none is noted, and taken for missing."""

from __future__ import annotations

import re

import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Ints
from mapfilter._words import number_of
from mapfilter.tracks.readers.recorded.reading import Reading

DIGIT = r"\d"
"""Of what is no word for a missing value."""
MISSING = ("", "-", "nan", "NaN", "NA", "N/A", "null", "NULL", "None", "none", "#N/A")
"""Texts of missing values."""
_NUMBER = r"^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$"
_WHOLE = r"^(?:[-+]?(\d{1,18}|[0-8]\d{18})|0[xX][0-9a-fA-F]{1,15})$"
_SHORTENED = re.compile(r"\d{1,9}(?:[.,]\d{1,17})?[eE]\+?\d{1,3}")


def read_numbers(
    column: pa.ChunkedArray, name: str, lines: Ints, reading: Reading
) -> pa.ChunkedArray:
    """Return the texts of a column as numbers, null where they are none.

    Parameters
    ----------
    column : pyarrow.ChunkedArray
        Of texts, with points in numbers.
    name : str
        The column's name, for notes.
    lines : (N,) array of int
        The file's line of each row.
    reading : Reading
        Takes notes.
    """
    return _cast(column, pa.float64(), _NUMBER, name, lines, reading)


def read_whole_numbers(
    column: pa.ChunkedArray, name: str, lines: Ints, reading: Reading
) -> pa.ChunkedArray:
    """Return the texts of a column as whole numbers, exactly; parameters as of the other.

    Those that begin with 0x are hexadecimal, and zeros after a point are left out.
    """
    column = pc.replace_substring_regex(pc.utf8_trim_whitespace(column), r"\.0*$", "")
    return _cast(column, pa.int64(), _WHOLE, name, lines, reading)


def _cast(
    column: pa.ChunkedArray,
    kind: pa.DataType,
    pattern: str,
    name: str,
    lines: Ints,
    reading: Reading,
) -> pa.ChunkedArray:
    part = int(lines[0]) if len(lines) else 0
    try:
        numbers = pc.cast(column, kind)
    except pa.ArrowInvalid:
        pass
    else:
        given = pc.is_valid(numbers)
        if pa.types.is_floating(kind):
            given = pc.and_not(given, pc.is_nan(numbers))
        reading.tallies.add_texts(name, part, pc.sum(given).as_py() or 0)
        return numbers
    column = pc.utf8_trim_whitespace(column)
    missing = pc.is_in(column, pa.array(MISSING))
    good = pc.match_substring_regex(column, pattern)
    wrong = pc.and_not(pc.invert(good), missing)
    # A word such as "unknown" stands for a missing value.
    odd = pc.and_(wrong, pc.match_substring_regex(column, DIGIT))
    count = pc.sum(odd).as_py() or 0
    examples = pc.unique(pc.filter(column, odd))[:2].to_pylist()
    reading.tallies.add_texts(name, part, pc.sum(good).as_py() + count, count, examples)
    if bad := pc.sum(wrong).as_py():
        at = pc.index(wrong, value=True).as_py()
        first = f"first {column[at].as_py()[:40]!r} in line {lines[at]}"
        if pa.types.is_integer(kind) and _SHORTENED.fullmatch(column[at].as_py()):
            first += "; shortened by a spreadsheet: show all digits there, and export again"
        reading.count(
            lambda n: (
                f"{name}: {number_of(n, 'value is no number', 'values are no numbers')}, "
                f"taken as missing ({first})"
            ),
            bad,
            key=f"{name}, {kind}",
            source=part,
            ignored=True,
        )
    column = pc.replace_substring_regex(column, r"^\+", "")
    return pc.cast(pc.if_else(good, column, None), kind)
