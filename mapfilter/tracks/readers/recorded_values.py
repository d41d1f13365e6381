"""Columns of recorded tables: numbers with NaN, texts as categories."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from mapfilter.tracks.readers.tables import Field


def joined_parts(parts: list[pd.DataFrame]) -> pd.DataFrame:
    """Return parts of a table in one; texts stay categories."""
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    texts = [name for name in first.columns if isinstance(first[name].dtype, pd.CategoricalDtype)]
    words = dict.fromkeys(texts, object)
    rows = pd.concat([part.astype(words) for part in parts], ignore_index=True)
    return rows.assign(**{name: _texts(rows[name]) for name in texts})


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
    texts = pd.Series(given, dtype=object)
    found = pd.Categorical(texts.where(texts != "", None))
    return _categories(found.codes, found.categories.tolist())


def _categories(codes: Any, words: list[str]) -> pd.Categorical:
    return pd.Categorical.from_codes(codes, pd.Index(words, dtype=object))
