"""Identities of cells as recordings write them, by radio technology."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.radio.identities import LIMITS, UNAVAILABLE, parse_cgi, parted_network
from mapfilter.tracks.readers.recorded.reading import Reading

_NO_CELL = (2**28 - 1, 2**36 - 1)
"""Identities with all bits set of LTE and NR, which are of no cell."""


def available(values: Ints, there: Bools) -> Floats:
    """Return whole numbers as floats, NaN where missing or marked as not available."""
    number = values.astype(np.float64)
    return np.where(there & ~np.isin(values, UNAVAILABLE), number, np.nan)


def parse_identities(texts: np.ndarray) -> dict[str, Floats]:
    """Read CGI (``MCC-MNC-LAC-CI``), ECGI and NCGI (``MCC-MNC-CI``) into mcc, mnc, lac and ci.

    MCC and MNC may be one number.

    Examples
    --------
    >>> found = parse_identities(np.array(["262-01-1234-5678", "302:720:9751830"], dtype=object))
    >>> found["ci"].tolist(), found["lac"].tolist()
    ([5678.0, 9751830.0], [1234.0, nan])
    """
    rows: dict[object, tuple[float, ...]] = {}
    for text in pd.unique(pd.Series(texts, dtype=object)):
        found = parse_cgi(parted_network(str(text)))
        parts = (None,) * 4 if found is None else found
        rows[text] = tuple(math.nan if part is None else float(part) for part in parts)
    table = np.array([rows[text] for text in texts], dtype=np.float64).reshape(-1, 4)
    return dict(zip(("mcc", "mnc", "lac", "ci"), table.T, strict=True))


def cell_names(mcc: Floats, mnc: Floats, lac: Floats, ci: Floats) -> np.ndarray:
    """Return ids ``MCC-MNC-LAC-CI`` of the parts that are known; None without a ci.

    Examples
    --------
    >>> cell_names(*np.array([[302.0, np.nan], [720.0, np.nan], [29100.0, np.nan], [7.0, 8.0]]))
    array(['302-720-29100-7', '8'], dtype=object)
    """
    parts = [np.nan_to_num(part, nan=-1.0) for part in (mcc, mnc, lac, ci)]
    codes = np.zeros(len(ci), dtype=np.int64)
    for part in parts:
        found, values = pd.factorize(part)
        codes = pd.factorize(codes * len(values) + found)[0]
    _, first = np.unique(codes, return_index=True)
    names = np.empty(len(first), dtype=object)
    names[:] = [
        "-".join(str(int(part[at])) for part in parts if part[at] >= 0)
        if parts[3][at] >= 0
        else None
        for at in first
    ]
    return names[codes]


def without_zeros(identity: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return mcc, mnc, lac and ci with NaN where a program writes 0 for all that it does not know.

    No country has the code 0.

    Examples
    --------
    >>> zero, known = np.zeros(2), np.array([0.0, 244.0])
    >>> without_zeros({"mcc": known, "mnc": zero, "lac": zero, "ci": zero})["ci"].tolist()
    [nan, 0.0]
    """
    none = (identity["mcc"] == 0) & (identity["ci"] == 0)
    return {name: np.where(none, np.nan, identity[name]) for name in ("mcc", "mnc", "lac", "ci")}


def _beyond(label: str, limit: str, line: int, count: int) -> str:
    some = number_of(count, "value is", "values are")
    return f"{label}: {some} not {limit}, ignored (first in line {line})"


def add_radio(reading: Reading, columns: Mapping[str, Any], lines: ArrayLike) -> None:
    """Add reported cells, with names of those identified, and codes checked by technology.

    Rows without any of an identity, a level and a timing advance are refused.
    """
    line = np.asarray(lines, dtype=np.int64)
    count = len(line)
    given = dict(columns)
    for name in ("mcc", "mnc", "lac", "ci", "arfcn", "bsic", "timing_advance", "level_dbm"):
        given[name] = np.broadcast_to(np.asarray(given.get(name, np.nan), dtype=np.float64), count)
    given["ci"] = np.where(np.isin(given["ci"], _NO_CELL), np.nan, given["ci"])
    given |= without_zeros(given)
    families = given.get("technology")
    if families is None:
        families = np.full(count, None, dtype=object)
    given["technology"] = families
    for family, limits in LIMITS.items():
        of = np.asarray(families == family, dtype=bool)
        for name, most in limits.items():
            bad = of & ~np.isnan(given[name]) & ~((given[name] >= 0) & (given[name] <= most))
            if bad.any():
                limit = f"0..{most} as in {family}"
                reading.count(
                    partial(_beyond, f"radio, {name}", limit, line[bad][0]),
                    int(bad.sum()),
                    key=f"radio, {name}: {limit}",
                    ignored=True,
                )
                given[name] = np.where(bad, np.nan, given[name])
    if "cell" not in given:
        given["cell"] = cell_names(given["mcc"], given["mnc"], given["lac"], given["ci"])
    names = np.asarray(given["cell"], dtype=object)
    cell = ~pd.isna(names) & (names != "")
    known = cell | ~np.isnan(given["level_dbm"]) | ~np.isnan(given["timing_advance"])
    reading.refuse(line[~known], "radio: neither a cell nor a level")
    if not known.all():
        given = {
            name: np.asarray(values)[known] if np.ndim(values) else values
            for name, values in given.items()
        }
    reading.add("radio", given, line[known])
