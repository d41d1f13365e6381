"""Lines of separated values: those with all fields, and those that can be mended.

Quotes are taken away line by line, so one that is never closed ends with its line.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from pyarrow import csv as arrow_csv

from mapfilter._arrow import arrow_bytes
from mapfilter._types import Bools, Ints
from mapfilter.tracks.readers.recorded.reading import Reading

_DECIMAL = re.compile(r"\A\s*[-+]?\d+,\d+\s*")
_THOUSANDS = re.compile(r"\A\s*[-+]?[1-9]\d{0,2}(,\d{3})+\s*")
LONGEST_LINE = 1 << 16
"""Characters of a line; a longer one is refused."""

_BLOCK_BYTES = 1 << 21
_LINE_FEED, _QUOTE = 10, 34


def blocks(data: memoryview, first_line: int, size_bytes: int = 0) -> Iterator[tuple[bytes, int]]:
    """Cut a text into blocks of whole lines; yield each with the number of its first line."""
    size = size_bytes or _BLOCK_BYTES
    start = 0
    while start < len(data):
        end = min(start + size, len(data))
        while end < len(data):
            piece = bytes(data[end : end + _BLOCK_BYTES])
            cut = piece.find(b"\n")
            end += cut + 1 if cut >= 0 else len(piece)
            if cut >= 0:
                break
        block = bytes(data[start:end])
        yield block, first_line
        first_line += block.count(b"\n")
        start = end


def line_texts(code: NDArray[np.uint8]) -> pa.StringArray:
    """Return the lines of a UTF-8 text, given as its bytes."""
    ends = np.flatnonzero(code == _LINE_FEED)
    if not len(code) or code[-1] != _LINE_FEED:
        ends = np.append(ends, len(code))
    # A line's feed belongs to it here, and is trimmed.
    edges = np.concatenate([[0], ends[:-1] + 1, [min(int(ends[-1]) + 1, len(code))]])
    buffers = pa.py_buffer(edges.astype(np.int32)), pa.py_buffer(np.ascontiguousarray(code))
    return pc.utf8_rtrim(pa.StringArray.from_buffers(len(ends), *buffers), "\n")


def good_lines(
    block: bytes, first_line: int, count: int, separator: str, reading: Reading, least: int
) -> tuple[bytes, Ints]:
    """Return the lines that have all fields, and their numbers; refuse the others."""
    if least < count and b'"' not in block:
        block = _padded(block, count, separator, least)
    code = np.frombuffer(block, dtype=np.uint8)
    ends = np.flatnonzero(code == _LINE_FEED)
    if not len(block) or block[-1] != _LINE_FEED:
        ends = np.append(ends, len(block))
    starts = np.concatenate([[0], ends[:-1] + 1]).astype(np.int64)
    # A sum over separators up to each line's end is cheaper than one for each line.
    places = np.flatnonzero(code == ord(separator))
    fields = np.searchsorted(places, ends) - np.searchsorted(places, starts) + 1
    length = ends - starts
    right = (fields == count) & (length <= LONGEST_LINE) & (length > 0)
    if b'"' in block:
        right &= ~_quoted_separators(code, starts, ends, places)
    if right.all():
        reading.rows += len(starts)
        return block.replace(b'"', b""), first_line + np.arange(len(starts))
    good: list[bytes] = []
    rows: list[int] = []
    for (first, last), number in _runs(right):
        if number:
            good.append(block[starts[first] : ends[last - 1]].replace(b'"', b""))
            rows.extend(range(first_line + first, first_line + last))
            continue
        for at in range(first, last):
            text = block[starts[at] : ends[at]]
            mended = _mended(text, count, separator, least, first_line + at, reading)
            if mended is not None:
                good.append(mended)
                rows.append(first_line + at)
    reading.rows += int(right.sum())
    return b"\n".join(good), np.array(rows, dtype=np.int64)


def _quoted_separators(code: NDArray[np.uint8], starts: Ints, ends: Ints, places: Ints) -> Bools:
    """Return which lines have a separator within quotes; none where a quote is never closed."""
    quotes = np.flatnonzero(code == _QUOTE)
    before, after = np.searchsorted(quotes, starts), np.searchsorted(quotes, ends)
    of = np.searchsorted(starts, places, side="right") - 1
    within = (np.searchsorted(quotes, places) - before[of]) % 2 == 1
    found: Bools = np.zeros(len(starts), dtype=bool)
    found[of[within]] = (after - before)[of[within]] % 2 == 0
    return found


def _padded(block: bytes, count: int, separator: str, least: int) -> bytes:
    """Return lines in which absent last fields are empty ones."""
    code = np.frombuffer(block, dtype=np.uint8)
    ends = np.append(np.flatnonzero(code == _LINE_FEED), len(code))
    starts = np.concatenate([[0], ends[:-1] + 1])
    places = np.flatnonzero(code == ord(separator))
    fields = np.searchsorted(places, ends) - np.searchsorted(places, starts) + 1
    absent = np.where((fields >= least) & (ends > starts), np.maximum(count - fields, 0), 0)
    if not absent.any():
        return block
    return bytes(np.insert(code, np.repeat(ends, absent), ord(separator)).tobytes())


def _runs(right: Bools) -> Iterator[tuple[tuple[int, int], bool]]:
    edges = np.concatenate([[0], np.flatnonzero(np.diff(right)) + 1, [len(right)]]).tolist()
    for first, last in pairwise(edges):
        yield (first, last), bool(right[first])


def _mended(
    text: bytes, count: int, separator: str, least: int, line: int, reading: Reading
) -> bytes | None:
    """Return a line with the right number of fields, or refuse it; None for blank lines, too."""
    if not text.strip():
        return None
    reading.rows += 1
    if len(text) > LONGEST_LINE:
        reading.refuse(line, f"longer than {LONGEST_LINE} characters")
        return None
    words = text.decode("utf-8", "replace")
    fields = words.split(separator)
    if '"' in words:
        try:
            fields = next(csv.reader([words], delimiter=separator), [])
        except csv.Error:
            fields = []
        if separator == ",":
            fields = [_with_point(value) for value in fields]
        # A separator within quotes would separate again.
        other = "_" if separator == " " else " "
        fields = [value.replace(separator, other).replace("\n", " ") for value in fields]
    if len(fields) > count and not any(value.strip() for value in fields[count:]):
        fields = fields[:count]
    if least <= len(fields) < count:
        fields += [""] * (count - len(fields))
    if len(fields) == count:
        return separator.join(fields).replace('"', "").encode()
    few = len(fields) < count
    hint = "cut off, or another separator"
    if not few:
        hint = "a separator within a field" + (", as decimal commas" if separator == "," else "")
    reading.refuse(line, f"{'fewer' if few else 'more'} fields than {count} (likely: {hint})")
    return None


def _with_point(value: str) -> str:
    """Return a number with a decimal comma with a point; others, and thousands, as they are."""
    is_decimal = _DECIMAL.fullmatch(value) is not None and _THOUSANDS.fullmatch(value) is None
    return value.replace(",", ".") if is_decimal else value


def parsed(block: bytes, count: int, separator: str) -> pa.Table:
    """Return lines that all have as many fields as columns of texts, c0, c1, …."""
    names = [f"c{i}" for i in range(count)]
    return arrow_csv.read_csv(
        pa.BufferReader(arrow_bytes(block)),
        read_options=arrow_csv.ReadOptions(
            column_names=names, block_size=len(block) + 2, use_threads=False
        ),
        parse_options=arrow_csv.ParseOptions(
            delimiter=separator, quote_char=False, ignore_empty_lines=count > 1
        ),
        convert_options=arrow_csv.ConvertOptions(
            column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False
        ),
    )
