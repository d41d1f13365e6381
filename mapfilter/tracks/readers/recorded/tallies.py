"""Columns most of whose values cannot be used: a wrong unit or a lost sign, not a few bad rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError
from mapfilter.radio.asu import LARGEST_ASU, LOST_SIGN, Signs
from mapfilter.radio.level_quantity import (
    LEVELS_EXPECTED,
    QUALITY,
    TENTHS,
    LevelCounts,
    are_tenths,
)
from mapfilter.tracks.readers.recorded.recorded_field import Field
from mapfilter.tracks.readers.recorded.wound import Winding

_MOSTLY = 0.5
_UNAVAILABLE = 2e9
"""Programs write larger numbers where they have no value."""
_MARKS = (999.0, 9999.0, 99999.0, 999999.0, 32767.0, 32768.0, 65535.0)
"""Numbers of either sign that programs write where they have no value, too."""


@dataclass(slots=True)
class _Values:
    """Values of one column of a table: how many are given, and those out of range."""

    given: int = 0
    outside: int = 0
    low: float = np.inf
    high: float = -np.inf
    first: float = np.nan
    first_line: int = 0
    whole: bool = True
    different: set[float] = field(default_factory=set)


@dataclass(slots=True)
class _Texts:
    """Texts of one column of a file: numbers, and texts with digits that are none."""

    given: int = 0
    bad: int = 0
    examples: tuple[str, ...] = ()


@dataclass(slots=True)
class Tallies:
    """Counts of unusable values in columns that a log needs, over all parts of a file.

    Parameters
    ----------
    columns : dict of str to str
        Names in the file of columns that must hold numbers, by field.
    signs : Signs
        Of levels in a column that holds dBm or ASU.
    levels : LevelCounts
        Of all levels.
    """

    columns: dict[str, str] = field(default_factory=dict)
    _values: dict[tuple[str, str], _Values] = field(default_factory=dict)
    _texts: dict[tuple[str, int], _Texts] = field(default_factory=dict)
    _windings: dict[tuple[str, str], Winding] = field(default_factory=dict)
    signs: Signs = field(default_factory=Signs)
    levels: LevelCounts = field(default_factory=LevelCounts)

    def add_values(
        self, table: str, known: Field, values: Floats, given: int, outside: Bools, line: Ints
    ) -> None:
        """Count the values of a vital column that are given, and those out of range."""
        found = self._values.setdefault((table, known.name), _Values())
        found.given += given
        if known.name == "level_dbm":
            self.levels.add(values)
        if not outside.any():
            return
        bad, line = values[outside], line[outside]
        marked = (np.abs(bad) >= _UNAVAILABLE) | np.isin(np.abs(bad), _MARKS)
        found.given -= int(marked.sum())
        bad, line = bad[~marked], line[~marked]
        if not bad.size:
            return
        if not found.outside:
            found.first, found.first_line = float(bad[0]), int(line[0])
        found.outside += bad.size
        found.whole &= bool((bad % 1 == 0).all())
        if len(found.different) <= known.marks:
            found.different.update(np.unique(bad)[: known.marks + 1].tolist())
        found.low = min(found.low, float(bad.min()))
        found.high = max(found.high, float(bad.max()))

    def winding(self, table: str, known: Field) -> Winding:
        """Return what is known so far of the headings of a column."""
        return self._windings.setdefault((table, known.name), Winding(known.turn))

    def add_texts(
        self, column: str, part: int, given: int, bad: int = 0, examples: Sequence[str] = ()
    ) -> None:
        """Count the texts of a column in a part of the file; each part counts once.

        Words without a digit are missing values to programs, and neither given nor bad.
        ``examples`` are two different bad texts, or one where all are alike.
        """
        self._texts[column, part] = _Texts(given, bad, tuple(examples))

    @property
    def empty(self) -> tuple[str, ...]:
        """Columns without any number."""
        given: dict[str, int] = {}
        for (column, _), texts in self._texts.items():
            given[column] = given.get(column, 0) + texts.given
        return tuple(column for column, count in given.items() if not count)

    def check(self, path: Path, known: Mapping[str, tuple[Field, ...]]) -> None:
        """Raise InputError for every column that is mostly out of range, or mostly no numbers."""
        faults = Faults()
        for name, column in self.columns.items():
            parts = [texts for (of, _), texts in self._texts.items() if of == column.lower()]
            bad, given = sum(one.bad for one in parts), sum(one.given for one in parts)
            examples = list(dict.fromkeys(text for one in parts for text in one.examples))
            # One and the same text, such as 1.#QNAN, is a mark of missing values.
            if len(examples) > 1 and bad > _MOSTLY * given:
                got = f"{bad} of {given} values that are none, such as {examples[0][:40]!r}"
                faults.add(self._where(path, name), "numbers", got, "a unit in each field")
        for (table, name), values in self._values.items():
            of = next(one for one in known[table] if one.name == name)
            # One and the same number is a mark of missing values.
            marks = len(values.different) <= of.marks
            if not marks and values.outside > of.mostly * values.given and self._sure(table, name):
                got = (
                    f"{values.outside} of {values.given} values outside, {values.low:g} to "
                    f"{values.high:g} (first {values.first:g} in line {values.first_line})"
                )
                faults.add(self._where(path, name), of.expected, got, _mistake(of, values))
        signs = self.signs
        if signs.lost and not faults.found:
            got = f"{signs.positive} of {signs.levels} positive, {signs.above} of them above "
            expected = f"dBm below 0, or ASU up to {LARGEST_ASU}"
            where = self._where(path, "level_dbm")
            faults.add(where, expected, f"{got}{LARGEST_ASU}", LOST_SIGN)
        if self.levels.are_qualities:
            where = self._where(path, "level_dbm")
            faults.add(where, LEVELS_EXPECTED, self.levels, QUALITY)
        faults.raise_if_any(InputError)

    def _sure(self, table: str, name: str) -> bool:
        """Return whether values out of range can be no good ones."""
        winding = self._windings.get((table, name))
        return winding is None or not winding.doubtful

    def _where(self, path: Path, name: str) -> str:
        column = self.columns.get(name, name)
        return f"{path}, {name}" if column == name else f"{path}, column {column} ({name})"


def _mistake(known: Field, values: _Values) -> str:
    """Return the likely mistake behind values out of range, by the largest of them."""
    if known.name == "level_dbm" and are_tenths(values.low, values.high):
        return TENTHS
    most = max(abs(values.low), abs(values.high))
    if known.name == "level_dbm" and (values.high <= 0 or not values.whole):
        # ASU, RXLEV and bars are whole numbers.
        return LOST_SIGN if values.low >= 0 and values.high <= -known.low else ""
    return known.mistake(most)
