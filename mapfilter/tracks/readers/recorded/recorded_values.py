"""Columns of recorded tables: numbers with NaN, texts as categories."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from pandas.api.types import union_categoricals

from mapfilter._constants import DAY_S
from mapfilter._types import Bools, Ints
from mapfilter.tracks.readers.recorded.recorded_field import Field

_MANY_ROWS = 10_000
_LATE_S, _LATE_SHARE = 30.0, 0.1


def joined_parts(parts: list[pd.DataFrame]) -> pd.DataFrame:
    """Return parts of a table in one; texts stay categories. The list is emptied."""
    if len(parts) == 1:
        return parts.pop()
    names = list(parts[0].columns)
    columns = {}
    # Column by column, so that no table is in memory twice.
    tables = [dict(part.items()) for part in parts]
    parts.clear()
    for name in names:
        own = [table.pop(name) for table in tables]
        if isinstance(own[0].dtype, pd.CategoricalDtype):
            every = union_categoricals(own, sort_categories=True)
            columns[name] = _categories(every.codes, every.categories.tolist())
        else:
            columns[name] = np.concatenate([values.to_numpy() for values in own])
    return pd.DataFrame(columns, copy=False)


def reordered(rows: pd.DataFrame, order: Ints) -> pd.DataFrame:
    """Return rows in another order; of many ``rows`` no column is left."""
    # Taking a column out of a table takes longer than reordering a short one.
    take = rows.pop if len(rows) > _MANY_ROWS else rows.__getitem__
    columns = {name: take(name).array[order] for name in list(rows.columns)}
    return pd.DataFrame(columns, copy=False)


def duplicates(rows: pd.DataFrame) -> Bools:
    """Return which rows repeat an earlier one in everything."""
    code = np.zeros(len(rows), dtype=np.uint64)
    for name in rows:
        values = rows[name]
        categories = isinstance(values.dtype, pd.CategoricalDtype)
        if categories:
            numbers = values.cat.codes.to_numpy(dtype=np.int64)
        else:
            # One zero, and one NaN.
            numbers = values.to_numpy(dtype=np.float64) + 0.0
            numbers[np.isnan(numbers)] = np.nan
        code = code * np.uint64(1_000_003) + pd.util.hash_array(numbers)
    # Few rows share their hash with another, so that exact comparison is cheap.
    alike = np.flatnonzero(pd.Series(code).duplicated(keep=False).to_numpy())
    found = np.zeros(len(rows), dtype=bool)
    if alike.size:
        found[alike] = rows.iloc[alike].duplicated().to_numpy()
    return found


def checked_values(known: Field, given: Any, count: int) -> Any:
    """Return a column as float64 with NaN, or as categories, for missing values."""
    if not known.text:
        if given is None or np.ndim(given) == 0:
            return np.broadcast_to(np.float64(np.nan if given is None else given), count)
        numbers = np.asarray(given, dtype=np.float64)
        infinite = np.isinf(numbers)
        return np.where(infinite, np.nan, numbers) if infinite.any() else numbers
    if given is None or isinstance(given, str):
        words, code = ([], -1) if given is None else ([given], 0)
        return _categories(np.full(count, code, dtype=np.int8), words)
    return _texts(given)


def _texts(given: Any) -> pd.Categorical:
    """Return texts as categories; an empty text is a missing one."""
    if isinstance(given, pd.Categorical):
        return given
    found = pd.Categorical(np.asarray(given, dtype=object))
    words, codes = found.categories.tolist(), found.codes
    if "" in words:
        empty = words.index("")
        del words[empty]
        codes = np.where(codes == empty, -1, codes - (codes > empty))
    return _categories(codes, words)


def _categories(codes: Any, words: list[str]) -> pd.Categorical:
    return pd.Categorical.from_codes(codes, pd.Index(words, dtype=object))


def late_rows(tables: Iterable[Sequence[pd.DataFrame]], last_s: float, *, read: bool) -> str:
    """Return a note on rows that go on long after the last one of a table; "" for none.

    Parameters
    ----------
    tables : iterable of sequence of pandas.DataFrame
        Parts of each table.
    last_s : float
        Time of the last row, used or not.
    read : bool
        Whether all columns were read.
    """
    times = [part["time_s"] for parts in tables for part in parts if "time_s" in part]
    if not times:
        return ""
    beyond_s = last_s - max(float(time.max()) for time in times)
    lasted_s = last_s - min(float(time.min()) for time in times)
    if not max(_LATE_S, _LATE_SHARE * lasted_s) < beyond_s < DAY_S:
        return ""
    held = "they are empty" if read else "of their columns none is used"
    return f"rows go on for {beyond_s:.0f} s after the last one with a value that is used: {held}"
