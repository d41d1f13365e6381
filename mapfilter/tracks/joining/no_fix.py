"""Rows of positions that hold none: what receivers write while they have no fix."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Bools, Ints
from mapfilter._words import number_of

_MISSING = r"\s*(?:[nN][aA][nN]|[nN][uU][lL][lL]|[nN][oO][nN][eE])?\s*"
_ZERO = r"\s*[-+]?(?:0+\.?0*|\.0+)(?:[eE][-+]?[0-9]+)?\s*"
"""Texts that stand for no number, and for 0."""
_SHOWN = "latitude and longitude both empty, or both 0: no fix"


def holds_no_fix(lat_deg: object, lon_deg: object) -> bool:
    """Return whether a latitude and a longitude are both missing, or both 0.

    Examples
    --------
    >>> holds_no_fix(0.0, "0.0"), holds_no_fix(None, "NaN"), holds_no_fix(0.0, 8.6)
    (True, True, False)
    >>> holds_no_fix(None, 8.6), holds_no_fix(0, None)
    (False, False)
    """
    kinds = {_kind(lat_deg), _kind(lon_deg)}
    return kinds in ({"missing"}, {"zero"})


def rows_without_fix(lat_deg: pd.Series, lon_deg: pd.Series) -> Bools:
    """Return which rows hold no position, shape (N,); values are numbers or texts."""
    of_lat, of_lon = _kinds(lat_deg), _kinds(lon_deg)
    return np.asarray((of_lat == of_lon) & (of_lat != ""), dtype=np.bool_)


def no_fix_note(where: str, count: int, first: str) -> str:
    """Return the note on rows without a position.

    Examples
    --------
    >>> no_fix_note("gnss.csv", 2, "row 7")
    'gnss.csv: 2 rows without a position left out (latitude and longitude both empty, or both 0: \
no fix; first row 7)'
    """
    some = number_of(count, "row")
    return f"{where}: {some} without a position left out ({_SHOWN}; first {first})"


def first_row(row_numbers: Ints, rows: Bools) -> str:
    """Return the first of some rows by its number, as messages name it."""
    return f"row {row_numbers[int(np.argmax(rows))]}"


def _kinds(values: pd.Series) -> Any:
    """Return "missing", "zero" or "" for each value."""
    if pd.api.types.is_numeric_dtype(values.dtype):
        numbers = values.to_numpy(dtype=np.float64, na_value=np.nan)
        return np.where(np.isnan(numbers), "missing", np.where(numbers == 0, "zero", ""))
    if not isinstance(values.dtype, pd.StringDtype):
        return np.array([_kind(value) for value in values], dtype=object)
    texts = pc.fill_null(pa.array(values, type=pa.string()), "")
    missing, zero = (
        pc.match_substring_regex(texts, rf"^(?:{pattern})$").to_numpy(zero_copy_only=False)
        for pattern in (_MISSING, _ZERO)
    )
    return np.where(missing, "missing", np.where(zero, "zero", ""))


def _kind(value: Any) -> str:
    """Return "missing", "zero", or "" for anything else."""
    if value is None or value is pd.NA or value is pd.NaT:
        return "missing"
    if isinstance(value, str):
        kinds = (("missing", _MISSING), ("zero", _ZERO))
        return next((kind for kind, pattern in kinds if re.fullmatch(pattern, value)), "")
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return ""
    return "missing" if value != value else "zero" if value == 0 else ""
