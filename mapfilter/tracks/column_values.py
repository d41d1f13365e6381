"""Values of a table's columns, read as the schema says, with the faults of each row."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import Faults
from mapfilter.tracks.readers.recorded.wound import CAUSE, TURN_RAD, Winding
from mapfilter.tracks.schema import MISSING_SIGNS, Column

_SHOWN_ROWS = 3
_PLAIN_NUMBER = r"^-?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?$"


@dataclass(frozen=True, eq=False, slots=True)
class TableFaults:
    """A table's name and its rows' numbers in messages, and the faults and notes of it."""

    where: str
    row_numbers: Ints
    faults: Faults
    notes: list[str] = field(default_factory=list)

    def add(self, field: str, expected: str, got: object, hint: str = "") -> None:
        """Note a fault of the table, or of a field of it."""
        self.faults.add(f"{self.where}{field}", expected, got, hint)

    def add_rows(
        self,
        bad: Bools,
        field: str,
        expected: str,
        got: Callable[[int], object],
        hint: Callable[[int], str],
    ) -> None:
        """Note the first rows that are bad, and how many more there are."""
        rows = np.flatnonzero(bad)
        for row in rows[:_SHOWN_ROWS]:
            self.add(f" row {self.row_numbers[row]}, {field}", expected, got(row), hint(row))
        if len(rows) > _SHOWN_ROWS:
            more = f"{number_of(len(rows) - _SHOWN_ROWS, 'more row')} like these"
            self.add(f", {field}", expected, more, hint(rows[-1]))


def column_values(column: Column, given: pd.DataFrame, found: TableFaults) -> Any:
    """Return a column of a table in the schema's type, missing values where it has none.

    Values that the schema does not allow are noted, and missing among whole numbers.
    """
    values = given.get(column.name)
    if values is None:
        values = pd.Series([None] * len(given), dtype=object)
    if column.kind == "text":
        # Of a column that is missing as a whole nothing is said of each row.
        here = column if column.name in given.columns else replace(column, required=False)
        return _texts(here, values, found)
    number, readable = _numbers(values)
    missing = np.isnan(number)
    column = replace(column, hint=column.likely(number), mistake=None)
    if column.winds:
        number, column = _unwound(number, column, found)
    bad = ~readable | np.isinf(number) | (number < column.low) | (number > column.high)
    if column.kind == "integer":
        bad |= ~missing & np.isfinite(number) & (number != np.round(number))
    if column.required and column.name in given.columns:
        bad |= missing
    elif not column.required:
        bad |= np.isin(number, MISSING_SIGNS)
    note_values(found, bad, column, values)
    if column.kind == "number":
        return number
    kept = np.where(bad | missing, 0.0, number).astype(np.int64)
    if pd.api.types.is_integer_dtype(values.dtype):
        kept = values.fillna(0).to_numpy(dtype=np.int64)
    return pd.arrays.IntegerArray(kept, bad | missing)


def _unwound(number: Floats, column: Column, found: TableFaults) -> tuple[Floats, Column]:
    """Return headings with unwrapped ones wrapped, and their column with the likely mistake."""
    outside = np.isfinite(number) & (np.abs(number) > column.high)
    if not outside.any():
        return number, column
    winding = Winding(TURN_RAD)
    wound = winding.unwound(number, outside)
    beyond = outside & (np.abs(wound) > column.high)
    if count := int(np.count_nonzero(outside & ~beyond)):
        some = f"{number_of(count, 'value')} beyond a turn, wrapped (unwrapped)"
        found.notes.append(f"{found.where}, {column.name}: {some}")
    mostly = beyond.sum() > np.isfinite(number).sum() / 2
    doubtful = mostly and winding.doubtful and winding.rows > 1 and not winding.jumps
    return wound, replace(column, hint=CAUSE) if doubtful else column


def _texts(column: Column, values: pd.Series, found: TableFaults) -> Any:
    if isinstance(values.dtype, pd.StringDtype):
        # Few texts repeat in many rows; each is kept once.
        codes, words = pd.factorize(values)
        known = [*(str(word) or None for word in words), None]
    else:
        codes = np.arange(len(values))
        # Not as text of pandas, which cannot hold half of a surrogate pair.
        filled = np.array([str(value) != "" for value in values], dtype=np.bool_)
        present = values.notna().to_numpy() & filled
        known = [text_of(v) if ok else None for v, ok in zip(values, present, strict=True)]
    texts = np.array([*known, None], dtype=object)[:-1][codes]
    if column.required:
        missing = np.array([*(text is None for text in known), True])[:-1]
        note_values(found, missing[codes], column, values)
    broken = np.array([*(text is not None and not _is_unicode(text) for text in known), True])[:-1]
    if broken.any():
        hint = "half of a surrogate pair: text cut off, or decoded twice"
        found.add_rows(
            broken[codes],
            column.name,
            column.expected,
            lambda row: repr(texts[row]),
            lambda _: hint,
        )
    # Without the dtype pandas 3 makes these strings, and None becomes NaN.
    return pd.Series(texts, dtype=object)


def text_of(value: object) -> str:
    """Return a value as text; whole numbers are floats where others of their column are missing.

    Examples
    --------
    >>> text_of(12.0), text_of(12.5), text_of(b"S1A")
    ('12', '12.5', 'S1A')
    """
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    if isinstance(value, float | np.floating) and float(value).is_integer():
        return str(int(value))
    return str(value)


def _is_unicode(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _numbers(values: pd.Series) -> tuple[Floats, Bools]:
    """Return values as floats, and which of them could be read as a number or as missing."""
    if pd.api.types.is_complex_dtype(values.dtype):
        return np.zeros(len(values)), np.zeros(len(values), dtype=bool)
    if pd.api.types.is_numeric_dtype(values.dtype):
        number = values.to_numpy(dtype=np.float64, na_value=np.nan)
        return number, np.ones(len(number), dtype=bool)
    number = np.full(len(values), np.nan)
    readable = np.ones(len(values), dtype=bool)
    left: Any = range(len(values))
    if isinstance(values.dtype, pd.StringDtype):
        number, left = _plain_numbers(values)
    given = values.to_numpy(dtype=object) if len(left) else values
    for row in left:
        if _is_empty(given[row]):
            continue
        try:
            number[row] = _number(given[row])
        except (TypeError, ValueError, OverflowError):
            readable[row] = False
    return number, readable


def _plain_numbers(values: pd.Series) -> tuple[Floats, Ints]:
    """Return texts as floats, and the rows that hold anything but digits, point and exponent."""
    texts = pa.array(values, type=pa.string(), from_pandas=True)
    plain = pc.fill_null(pc.match_substring_regex(texts, _PLAIN_NUMBER), False)
    try:
        numbers = pc.cast(pc.if_else(plain, texts, None), pa.float64())
    except pa.ArrowInvalid:
        # Such as 1e400.
        return np.full(len(values), np.nan), np.arange(len(values))
    number = np.array(numbers.to_numpy(zero_copy_only=False), dtype=np.float64)
    return number, np.flatnonzero(~plain.to_numpy(zero_copy_only=False))


def _number(value: object) -> float:
    """Return a number; ValueError for what only Python takes for one: 1_0, digits of others."""
    if isinstance(value, str) and (not value.isascii() or "_" in value):
        raise ValueError
    if isinstance(value, complex | np.complexfloating):
        raise TypeError
    return float(value)  # type: ignore[arg-type]


def note_values(found: TableFaults, bad: Bools, column: Column, values: pd.Series) -> None:
    """Note the values of a column that are bad, each with the likely mistake."""

    def got(row: int) -> object:
        return "nothing" if _is_empty(values.iloc[row]) else values.iloc[row]

    def hint(row: int) -> str:
        try:
            number = _number(values.iloc[row])
        except (TypeError, ValueError, OverflowError):
            return ""
        if number in MISSING_SIGNS:
            return "a sign for a missing value; leave the field empty"
        return column.hint if np.isfinite(number) else ""

    found.add_rows(bad, column.name, column.expected, got, hint)


def _is_empty(value: Any) -> bool:
    return value is None or value is pd.NA or (isinstance(value, str) and value == "")
