"""Columns of texts, read as numbers, times and words; what is none is taken for missing."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import nan
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Bools, Floats, Ints
from mapfilter.clocks.local_times import is_beside_change
from mapfilter.clocks.times import parse_times, seconds_of_day
from mapfilter.clocks.written_times import written_times
from mapfilter.tracks.readers.clocks.local_parts import note_changes
from mapfilter.tracks.readers.clocks.other_dates import other_dates
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.numbers import DIGIT, read_numbers, read_whole_numbers


@dataclass(eq=False)
class Columns:
    """Lines of separated values.

    Parameters
    ----------
    reading : Reading
        Takes notes.
    names : tuple of str
        Lower case, without blanks around.
    line : (N,) array of int
        The file's line of each row.
    decimal_comma : bool
        Whether numbers may have a comma for the point.
    """

    reading: Reading
    names: tuple[str, ...]
    line: Ints
    decimal_comma: bool = False
    _columns: dict[int, pa.ChunkedArray | Callable[[], pa.ChunkedArray]] = field(
        default_factory=dict, repr=False
    )

    def __len__(self) -> int:
        return len(self.line)

    def has(self, *names: str) -> bool:
        """Return whether all these columns are there."""
        return all(name in self.names for name in names)

    def find(self, *names: str) -> str | None:
        """Return the first of these names that is a column."""
        return next((name for name in names if name in self.names), None)

    def _raw(self, *names: str) -> pa.ChunkedArray | None:
        name = self.find(*names)
        column = None if name is None else self._columns.get(self.names.index(name))
        return column() if callable(column) else column

    def texts(self, *names: str) -> np.ndarray:
        """Return the first of these columns that is there as texts, "" where missing."""
        column = self._raw(*names)
        if column is None:
            return np.full(len(self), "", dtype=object)
        trimmed = pc.utf8_trim_whitespace(column).dictionary_encode().combine_chunks()
        words = np.array(trimmed.dictionary.to_pylist(), dtype=object)
        index = trimmed.indices.to_numpy(zero_copy_only=False)
        return words[index] if len(words) else np.full(len(self), "", dtype=object)

    def mapped(self, meaning: Callable[[str], Any], *names: str) -> np.ndarray:
        """Return what each word of a column means; a function of words that are few."""
        column = self._raw(*names)
        if column is None:
            return np.full(len(self), meaning(""), dtype=object)
        trimmed = pc.utf8_trim_whitespace(column).dictionary_encode().combine_chunks()
        words = [meaning(word) for word in trimmed.dictionary.to_pylist()]
        index = trimmed.indices.to_numpy(zero_copy_only=False)
        found = np.empty(len(words), dtype=object)
        found[:] = words
        return found[index] if len(words) else np.full(len(self), meaning(""), dtype=object)

    def flags(self, *names: str, true: Collection[str]) -> Bools:
        """Return in which rows a column has one of some words."""
        column = self._raw(*names)
        if column is None:
            return np.zeros(len(self), dtype=bool)
        found = pc.is_in(pc.utf8_trim_whitespace(column), pa.array(list(true)))
        return np.asarray(found.to_numpy(), dtype=bool)

    def times(
        self, *names: str, zone: str = "", layout: str = "ISO8601", after_s: float = nan
    ) -> tuple[Floats, bool]:
        """Return UTC seconds of a column of times, see :func:`parse_times`; note odd local ones."""
        time_s, zoned = self._times(names, zone, layout, after_s)
        changes = bool(zone) and is_beside_change(time_s, zone)
        if changes or (zone and not self.reading.by_zone):
            one_s, other_s = (self._times(names, z, layout, nan)[0] for z in ("+00:00", "+01:00"))
            self.reading.by_zone |= not np.array_equal(one_s, other_s, equal_nan=True)
            if changes:
                local_s = np.where(one_s == other_s, np.nan, one_s)
                note_changes(self.reading, local_s, time_s, zone, after_s)
        return time_s, zoned

    def _times(
        self, names: Sequence[str], zone: str, layout: str, after_s: float
    ) -> tuple[Floats, bool]:
        rows, reading = self, self.reading
        if self.decimal_comma and layout == "ISO8601":
            rows = self.rewritten(r"^(\s*\d+),(\d+\s*)$", r"\1.\2", *names)
        column = rows._raw(*names)
        if column is None:
            return parse_times(rows.texts(*names), zone, layout, after_s)
        later = partial(self._later, self.find(*names) or "")
        others = partial(self.other_dates, names)
        found = written_times(column, zone, layout, after_s, reading.date_order, later, others)
        reading.date_order = found.order or reading.date_order
        for note in found.notes:
            reading.note(note)
        return found.time_s, found.zoned

    def _later(self, name: str) -> Iterator[pa.ChunkedArray]:
        """Yield a column of times, or of their dates, of later parts of the file."""
        for rows in self.reading.later():
            column = rows._raw(*filter(None, (self.reading.date_column, name)))
            if column is not None:
                yield column

    def other_dates(self, own: Sequence[str]) -> list[np.datetime64]:
        """Return dates of the file's name, and of other columns than these."""
        taken = {*own, self.reading.date_column}
        firsts = [self.first_text(name) for name in self.names]
        return other_dates(self.reading.path, self.names, firsts, taken)

    def times_of_part(
        self, *names: str, zone: str = "", layout: str = "ISO8601"
    ) -> tuple[Floats, bool]:
        """Return what :meth:`times` does of a part of a file, after the parts before it."""
        time_s, zoned = self.times(*names, zone=zone, layout=layout, after_s=self.reading.passed_s)
        self.reading.passed_s = max([self.reading.passed_s, *time_s[np.isfinite(time_s)][-1:]])
        return time_s, zoned

    def contains(self, part: str, *names: str) -> Bools:
        """Return in which rows a column contains a text."""
        column = self._raw(*names)
        if column is None:
            return np.zeros(len(self), dtype=bool)
        return np.asarray(pc.match_substring(column, part).to_numpy(), dtype=bool)

    def changes(self, *names: str) -> Bools:
        """Return in which rows a column differs from the row before; the first one does not."""
        changed = np.zeros(len(self), dtype=bool)
        column = self._raw(*names)
        if column is not None and len(self) > 1:
            trimmed = pc.utf8_trim_whitespace(column)
            changed[1:] = pc.not_equal(trimmed.slice(1), trimmed.slice(0, len(self) - 1)).to_numpy()
        return changed

    def seconds_of_day(self, *names: str) -> Floats:
        """Return times of day of a column, NaN where it has none; see :func:`seconds_of_day`."""
        column = self._raw(*names)
        if column is None:
            return np.full(len(self), np.nan)
        return seconds_of_day(column.combine_chunks())

    def rewritten(self, pattern: str, by: str, *names: str) -> Columns:
        """Return columns in which the texts of one that match a pattern are rewritten."""
        name = self.find(*names)
        column = self._raw(*names)
        if name is None or column is None:
            return self
        changed = pc.replace_substring_regex(column, pattern, by)
        return replace(self, _columns={**self._columns, self.names.index(name): changed})

    def picked(self, columns: Mapping[str, tuple[str, Ints, Ints]], line: Ints) -> Columns:
        """Return columns of other rows: by name a column of these, rows of it, and their places.

        ``line`` is the file's line of each new row. A column is made when it is read: most of many
        never are, and all at once need not fit into memory.
        """
        made = [partial(self._picked, len(line), *one) for one in columns.values()]
        return replace(self, names=tuple(columns), line=line, _columns=dict(enumerate(made)))

    def _picked(self, count: int, name: str, rows: Ints, places: Ints) -> pa.ChunkedArray:
        column, index = self._raw(name), np.full(count, -1, dtype=np.int64)
        index[places] = rows
        if column is None:
            return pa.chunked_array([pa.repeat("", count)])
        return pc.fill_null(column.take(pa.array(index, mask=index < 0)), "")

    def with_digits(self, *names: str) -> Bools:
        """Return in which rows a column has a digit: words stand for missing numbers and times."""
        column = self._raw(*names)
        if column is None:
            return np.zeros(len(self), dtype=bool)
        return np.asarray(pc.match_substring_regex(column, DIGIT).to_numpy(), dtype=bool)

    def first_text(self, name: str) -> str:
        """Return the first text of a column that has a digit; "" where there is none."""
        column = self._raw(name)
        if column is None:
            return ""
        # A receiver without a fix may leave a column blank for long.
        at = pc.index(pc.match_substring_regex(column, DIGIT), value=True).as_py()
        return "" if at < 0 else str(column[at].as_py()).strip()

    def joined(self, before: str, name: str) -> Columns:
        """Return columns in which the texts of one follow those of another, after a blank.

        Where that is blank, it stays so.
        """
        first, second = self._raw(before), self._raw(name)
        if first is None or second is None:
            return self
        first, second = map(pc.utf8_trim_whitespace, (first, second))
        both = pc.binary_join_element_wise(first, second, " ")
        both = pc.if_else(pc.equal(second, ""), "", both)
        return replace(self, _columns={**self._columns, self.names.index(name): both})

    def filled(self, name: str, texts: np.ndarray) -> Columns:
        """Return columns of which one has other texts."""
        column = pa.chunked_array([pa.array(texts, pa.string())])
        return replace(self, _columns={**self._columns, self.names.index(name): column})

    def first_row(self) -> dict[str, str]:
        """Return the texts of the first row by column."""
        columns = ((name, self._raw(name)) for name in self.names)
        return {name: str(one[0].as_py()).strip() for name, one in columns if one is not None}

    def after_first(self) -> Columns:
        """Return columns without the first row."""
        held = {at: one() if callable(one) else one for at, one in self._columns.items()}
        columns = {at: one.slice(1) for at, one in held.items()}
        return replace(self, line=self.line[1:], _columns=columns)

    def with_column(self, name: str, text: str) -> Columns:
        """Return columns with another one, which has the same text in each row."""
        column = pa.chunked_array([pa.repeat(text, len(self))])
        columns = {**self._columns, len(self.names): column}
        return replace(self, names=(*self.names, name), _columns=columns)

    def number(self, *names: str) -> Floats:
        """Return the first of these columns that is there as numbers, NaN where missing.

        What is no number is noted and taken for missing.
        """
        column = self._raw(*names)
        if column is None:
            return np.full(len(self), np.nan)
        if self.decimal_comma:
            column = pc.replace_substring(column, ",", ".")
        numbers = read_numbers(column, self.find(*names) or "", self.line, self.reading)
        return np.asarray(numbers.to_numpy(), dtype=np.float64)

    def whole(self, *names: str) -> tuple[Ints, Bools]:
        """Return whole numbers exactly (0 where missing), and which of them are there.

        Those that begin with 0x are hexadecimal.
        """
        column = self._raw(*names)
        if column is None:
            return np.zeros(len(self), dtype=np.int64), np.zeros(len(self), dtype=bool)
        numbers = read_whole_numbers(column, self.find(*names) or "", self.line, self.reading)
        there = np.asarray(pc.is_valid(numbers).to_numpy(), dtype=bool)
        return np.asarray(pc.fill_null(numbers, 0).to_numpy(), dtype=np.int64), there
