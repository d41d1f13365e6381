"""Texts in which each line is an event: its id, a time of day, and parameters.

Parameters are picked by their places, which may differ from line to line, for all lines at once.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats, Ints
from mapfilter.clocks.times import seconds_of_day, without_midnights
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.lines import LONGEST_LINE, blocks, line_texts

_ID = re.compile(r"#?[A-Z][A-Z0-9_]{0,30}")
_LINE_FEED, _QUOTE, _BLANK = b'\n" '


@dataclass(eq=False)
class Events:
    """Some events of a text.

    Parameters
    ----------
    reading : Reading
        Takes notes.
    separator : str
    kind : (N,) array of str
        Their ids.
    line : (N,) array of int
    time_s : (N,) array
        Seconds since the midnight before the first event of the text, NaN where not understood.
    fields : (N,) array of int
        Number of fields, the id included.
    """

    reading: Reading
    separator: str
    kind: np.ndarray
    line: Ints
    time_s: Floats
    fields: Ints
    _starts: Ints = field(repr=False)
    _values: pa.Array = field(repr=False)

    def texts(self, events: Ints, places: ArrayLike) -> pa.Array:
        """Return a field of each of some events, "" where a place is beyond the line's fields."""
        return _picked(self._values, self._starts[events], self.fields[events], places)

    def columns(self, events: Ints, **places: ArrayLike) -> Columns:
        """Return fields of some events by name; lines are those of the events."""
        found = Columns(self.reading, tuple(places), self.line[events])
        # Decimals may have commas where commas do not separate.
        found.decimal_comma = self.separator != ","
        picked = (pa.chunked_array([self.texts(events, place)]) for place in places.values())
        found._columns.update(enumerate(picked))
        return found


def _picked(values: pa.Array, starts: Ints, fields: Ints, places: ArrayLike) -> pa.Array:
    place = np.broadcast_to(np.asarray(places, dtype=np.int64), starts.shape)
    there = (place >= 0) & (place < fields)
    # The last of all values is an empty one.
    return values.take(pa.array(np.where(there, starts + place, len(values) - 1)))


def read_events(
    data: bytes,
    separator: str,
    kinds: Collection[str],
    reading: Reading,
    others: dict[str, int],
) -> Iterator[Events]:
    """Yield the events of some kinds, part by part of a text; count those of others by their id.

    Separators within quotes are blanked. Times of day are counted on over midnight.
    """
    before_s = np.nan
    for block, first_line in blocks(memoryview(data), 1):
        lines = _lines(block, separator)
        ids = pc.list_element(pc.split_pattern(lines, separator, max_splits=1), 0)
        code = pc.utf8_trim_whitespace(ids).dictionary_encode()
        words = np.array(code.dictionary.to_pylist(), dtype=object)
        index = code.indices.to_numpy()
        number = first_line + np.arange(len(lines))
        reading.rows += len(lines) - int((words[index] == "").sum())
        kept = np.isin(words, list(kinds))[index]
        for at in np.flatnonzero((words != "") & ~np.isin(words, list(kinds))).tolist():
            if _ID.fullmatch(words[at]):
                others[words[at]] = others.get(words[at], 0) + int((index == at).sum())
            else:
                reading.refuse(number[index == at], "no line of this format")
        kept &= _short(lines, number, kept, reading)
        events = _events(lines, words[index], number, kept, separator, reading)
        events.time_s[:] = without_midnights(events.time_s, before_s)
        known = events.time_s[np.isfinite(events.time_s)]
        before_s = float(known[-1]) if known.size else before_s
        yield events


def _events(
    lines: pa.Array,
    kind: np.ndarray,
    number: Ints,
    kept: Bools,
    separator: str,
    reading: Reading,
) -> Events:
    rows = np.flatnonzero(kept)
    split = pc.split_pattern(lines.take(pa.array(rows)), separator)
    ends = split.offsets.to_numpy().astype(np.int64)
    starts, fields = ends[:-1], np.diff(ends)
    values = pa.concat_arrays([pc.replace_substring(split.values, '"', ""), pa.array([""])])
    time_s = seconds_of_day(_picked(values, starts, fields, 1))
    return Events(reading, separator, kind[rows], number[rows], time_s, fields, starts, values)


def _short(lines: pa.Array, number: Ints, kept: Bools, reading: Reading) -> Bools:
    length = pc.binary_length(lines).to_numpy(zero_copy_only=False)
    long = length > LONGEST_LINE
    reading.refuse(number[kept & long], f"longer than {LONGEST_LINE} characters")
    return np.asarray(~long, dtype=bool)


def _lines(block: bytes, separator: str) -> pa.Array:
    """Return the lines of a block; separators within the quotes of a line are blanks."""
    code = np.frombuffer(block, dtype=np.uint8)
    if b'"' in block:
        quotes = np.cumsum(code == _QUOTE, dtype=np.int32)
        places = np.flatnonzero(code == ord(separator))
        feeds = np.flatnonzero(code == _LINE_FEED)
        before = np.concatenate([[0], quotes[feeds]])[np.searchsorted(feeds, places)]
        code = code.copy()
        code[places[(quotes[places] - before) % 2 == 1]] = _BLANK
    return line_texts(code)
