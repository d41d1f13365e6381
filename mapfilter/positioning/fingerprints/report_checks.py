"""Checks of the columns that reports are made of: lengths, indices, cells and levels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._arguments import Setting, WholeNumber, check_arguments
from mapfilter._inputs import shown
from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import projected_crs
from mapfilter.radio.level_quantity import likely_of_positive
from mapfilter.tracks.column_values import text_of

_LOW_DBM, _HIGH_DBM = -200.0, 30.0
"""Phones report none above 0 dBm; what is predicted or drawn close to an antenna may be."""
NOT_RECEIVED_DBM = 100.0
"""What tables of fingerprints have where a transmitter was not received."""
_MOST_SHOWN = 3


def checked_columns(
    crs: str,
    count: int,
    readings: Mapping[str, Any],
    reports: Mapping[str, Any],
) -> tuple[str, dict[str, np.ndarray[Any, Any]]]:
    """Check columns of readings and of reports, all together.

    Parameters
    ----------
    count : int
        Number of reports.
    readings : mapping of str to (N,) array_like
        Among them ``report``, ``cell`` and ``level_dbm``.
    reports : mapping of str to (count, …) array_like
        Those that are given, by their names.

    Returns
    -------
    crs : str
        As :func:`mapfilter.geodesy.projected_crs` returns it.
    columns : dict of str to ndarray
        ``report`` as int64, ``cell`` as text, ``level_dbm`` as float64.

    Raises
    ------
    InputError
        With every fault: a column of another length, a report that there is not, a reading without
        a cell, text for a level, or levels that are none in dBm.
    ConfigError
        The number of reports is none.
    """
    check_arguments("make_reports", keywords=[Setting("count", count, WholeNumber)])
    faults = Faults()
    try:
        crs = projected_crs(crs, "reports, crs")
    except InputError as error:
        faults.found.extend(error.faults)
    number = _length(readings["report"])
    for name, given in readings.items():
        each = f"one for each of {number} in report"
        _check_length(f"readings, {name}", given, number, each, faults)
    for name, given in reports.items():
        each = f"one for each of {number_of(count, 'report')}"
        _check_length(f"reports, {name}", given, count, each, faults)
    if "places" in reports and np.shape(reports["places"]) != (count, 2):
        got = f"the shape {np.shape(reports['places'])}"
        faults.add("reports, places", f"east and north, the shape ({count}, 2)", got)
    faults.raise_if_any(InputError)
    columns = {
        "report": _reports(readings["report"], count, faults),
        "cell": _cells(readings["cell"], faults),
        "level_dbm": _levels(readings["level_dbm"], faults),
    }
    faults.raise_if_any(InputError)
    return crs, columns


def serving_cells(given: Any) -> np.ndarray[Any, Any]:
    """Return the serving cells of reports as text, "" where there is none."""
    if _are_texts(given):
        return np.asarray(given)
    return np.array(["" if pd.isna(one) else text_of(one) for one in pd.Series(given)], dtype=str)


def _are_texts(given: Any) -> bool:
    # Of a list NumPy would make texts of numbers and of NaN, too.
    return isinstance(given, np.ndarray) and given.dtype.kind == "U"


def _length(given: Any) -> int | None:
    """Return the number of values of a column; None for what is none."""
    if isinstance(given, str | bytes) or getattr(given, "ndim", 1) == 0:
        return None
    return len(given) if hasattr(given, "__len__") else None


def _check_length(where: str, given: Any, count: int | None, each: str, faults: Faults) -> None:
    length = _length(given)
    if length is None:
        faults.add(where, "a column of values", shown(given))
    elif count is not None and length != count:
        faults.add(where, each, length)


def _reports(given: Any, count: int, faults: Faults) -> np.ndarray[Any, Any]:
    number = _numbers("report", given, faults)
    with np.errstate(invalid="ignore"):
        wrong = ~((number >= 0) & (number < count) & (number == np.floor(number)))
    expected = f"a whole number in 0..{count - 1}" if count else "no reading where count is 0"
    _add("report", wrong, expected, given, "", faults)
    return np.where(wrong, 0, number).astype(np.int64)


def _levels(given: Any, faults: Faults) -> Floats:
    level = _numbers("level_dbm", given, faults)
    known = level[~np.isnan(level)]
    # Where most of them are positive, so is the scale.
    high = _HIGH_DBM if not known.size or np.median(known) <= 0 else 0.0
    with np.errstate(invalid="ignore"):
        wrong = (level > high) | (level < _LOW_DBM)
    above = known[known > high]
    hint = likely_of_positive(known) if above.size else ""
    if above.size and (above == NOT_RECEIVED_DBM).all():
        hint = "what stands for a transmitter that was not received; leave the reading out"
    _add("level_dbm", wrong, "dBm in -200..0", given, hint, faults)
    return level


def _cells(given: Any, faults: Faults) -> np.ndarray[Any, Any]:
    if _are_texts(given):
        cells = np.asarray(given)
        wrong: Bools = cells == ""
    else:
        cells = np.asarray(pd.Series(given), dtype=object)
        wrong = np.array([pd.isna(cell) or cell == "" for cell in cells], dtype=np.bool_)
        cells = np.array([text_of(cell) for cell in cells], dtype=str)
    _add("cell", wrong, "the id of a transmitter", given, "leave the reading out", faults)
    return cells


def _numbers(name: str, given: Any, faults: Faults) -> Floats:
    try:
        number: Floats = pd.Series(given).to_numpy(dtype=np.float64, na_value=np.nan)
    except (TypeError, ValueError) as error:
        faults.add(f"readings, {name}", "numbers", error)
        return np.zeros(len(given))
    return number


def _add(name: str, wrong: Bools, expected: str, given: Any, hint: str, faults: Faults) -> None:
    at = np.flatnonzero(wrong)
    values = pd.Series(given)
    for row in at[:_MOST_SHOWN]:
        value = values.iloc[row]
        got = value.item() if isinstance(value, np.generic) else value
        got = "nothing" if pd.isna(value) else shown(got)
        faults.add(f"reading {row + 1}, {name}", expected, got, hint)
    if len(at) > _MOST_SHOWN:
        more = f"{number_of(len(at) - _MOST_SHOWN, 'more reading')} like these"
        faults.add(f"readings, {name}", expected, more, hint)
