"""Lines of separated values, read fast as columns; a bad line loses nothing but itself."""

from __future__ import annotations

import csv
import operator
import re
from collections.abc import Sequence
from itertools import takewhile

import numpy as np
import pyarrow as pa

from mapfilter._cut_ends import without_cut_row
from mapfilter._types import Ints
from mapfilter._words import number_of
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.lines import LONGEST_LINE, blocks, good_lines, parsed

SEPARATORS = ",;\t|"


def header_columns(
    data: bytes, reading: Reading, first_line: int = 1, *, ragged: int = 0
) -> Columns:
    """Read lines of which the first that is not blank names the columns.

    ``ragged`` is the least number of fields of a line whose last fields may be absent; 0 where
    every line has all fields.
    """
    start = 0
    while start < len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        header = data[start:end].decode("utf-8", "replace").strip("\n")
        start, first_line = end + 1, first_line + 1
        if header.strip():
            separator = likely_separator(header)
            names = header_names(header, separator)
            data, cut = without_cut_row(data, separator, start)
            if cut:
                reading.rows += 1
                reading.refuse(first_line + data.count(b"\n", start), cut)
            rest = _without_headers(data[start:], header, separator, reading)
            # The header may end with a separator where rows do not.
            unnamed = sum(1 for _ in takewhile(operator.not_, reversed(names)))
            ragged = ragged or max(len(names) - unnamed, 1)
            return value_columns(
                memoryview(rest), reading, names, separator, first_line, ragged=ragged
            )
    return Columns(reading, (), np.zeros(0, dtype=np.int64))


def _without_headers(data: bytes, header: str, separator: str, reading: Reading) -> bytes:
    """Return lines without those that repeat the header, as where an app was started again."""
    line = header.encode()
    again = b"\n" + line + b"\n"
    if separator not in header or (again not in data and not data.startswith(line + b"\n")):
        return data
    found, data = 0, b"\n" + data
    while again in data:
        found += data.count(again)
        data = data.replace(again, b"\n\n")
    reading.count(
        lambda n: f"{number_of(n, 'line repeats', 'lines repeat')} the header, left out", found
    )
    return data[1:]


def likely_separator(header: str) -> str:
    """Return the separator that a header line has most often."""
    return max(SEPARATORS, key=header.count)


def header_names(header: str, separator: str) -> tuple[str, ...]:
    """Return the names in a header line, in lower case."""
    fields = next(csv.reader([header[:LONGEST_LINE]], delimiter=separator), [])
    return tuple(name.strip().lower() for name in fields)


def line_columns(
    lines: Sequence[bytes],
    numbers: Sequence[int] | Ints,
    reading: Reading,
    names: Sequence[str],
    separator: str,
    *,
    ragged: int = 0,
) -> Columns:
    """Read lines picked from a file; ``numbers`` are theirs there."""
    data = b"\n".join(lines)
    columns = value_columns(memoryview(data), reading, names, separator, 1, ragged=ragged)
    places = np.asarray(numbers, dtype=np.int64)
    columns.line = places[columns.line - 1] if len(places) else columns.line
    return columns


def value_columns(
    data: memoryview,
    reading: Reading,
    names: Sequence[str],
    separator: str,
    first_line: int = 1,
    *,
    ragged: int = 0,
) -> Columns:
    """Read lines of values under known names."""
    named = tuple(names)
    lines: list[Ints] = []
    tables: list[pa.Table] = []
    for block, first in blocks(data, first_line):
        good, rows = good_lines(block, first, len(named), separator, reading, ragged or len(named))
        if rows.size:
            tables.append(parsed(good, len(named), separator))
            lines.append(rows)
    line = np.concatenate(lines) if lines else np.zeros(0, dtype=np.int64)
    columns = dict(enumerate(pa.concat_tables(tables).columns)) if tables else {}
    return Columns(reading, named, line, separator != ",", columns)


def split_blanks(data: bytes) -> bytes:
    """Return a text in which runs of blanks and tabs are one blank, none at a line's ends."""
    if b"\t" in data or b"  " in data:
        # Single blanks are no match: a list of every blank would be larger than the text.
        data = re.sub(rb"[ \t]{2,}|\t", b" ", data)
    if b"\n " in data or b" \n" in data or data[:1] == b" " or data[-1:] == b" ":
        data = re.sub(rb"^ | $", b"", data, flags=re.MULTILINE)
    return data
