"""The CRS that a table of positions states, so that it is not lost where the log is not at hand."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats

_CRS, _BOUNDS = "crs", "bounds_m"
_PLACE = ["east_m", "north_m"]
_PARTS = 64
"""Parts of a way, each with bounds of its own: elsewhere near it are other coordinates."""


def placed_in(crs: str, rows: pd.DataFrame) -> pd.DataFrame:
    """Return a table of positions that states its CRS, in ``DataFrame.attrs``.

    Parts of it state it, too. Tables that pandas makes of it keep the attributes also where their
    positions are other ones: these lie beyond the bounds of the parts of the way, which are kept
    beside it.

    Examples
    --------
    >>> truth = placed_in("EPSG:32635", pd.DataFrame({"east_m": [1.0, 2.0], "north_m": [5.0, 5.0]}))
    >>> crs_stated(truth.iloc[1:]), crs_stated(truth.assign(east_m=truth["east_m"] + 90))
    ('EPSG:32635', '')
    """
    stating = rows.copy(deep=False)
    places_m = np.column_stack([rows[name].to_numpy(dtype=np.float64) for name in _PLACE])
    # A text, as pandas copies the attributes with every table that it makes.
    bounds_m = " ".join(map(repr, _bounds_m(places_m)))
    stating.attrs = {**rows.attrs, _CRS: crs, _BOUNDS: bounds_m}
    return stating


def crs_stated(rows: pd.DataFrame) -> str:
    """Return the CRS that a table of positions of a log states; "" where it states none."""
    if _CRS not in rows.attrs or _BOUNDS not in rows.attrs or not set(_PLACE) <= set(rows):
        return ""
    places_m = rows[_PLACE].apply(pd.to_numeric, errors="coerce").to_numpy(dtype=np.float64)
    within = np.zeros(len(rows), dtype=np.bool_)
    for part_m in np.array(rows.attrs[_BOUNDS].split(), dtype=np.float64).reshape(-1, 4):
        within |= ((places_m >= part_m[:2]) & (places_m <= part_m[2:])).all(axis=1)
    return str(rows.attrs[_CRS]) if within.all() else ""


def _bounds_m(places_m: Floats) -> list[float]:
    """Return west, south, east and north of each part of a way, with the place that ends it."""
    if not len(places_m):
        return []
    size = max(1, -(-len(places_m) // _PARTS))
    parts = (places_m[start : start + size + 1] for start in range(0, len(places_m), size))
    return [
        edge for part in parts for edge in (*part.min(axis=0).tolist(), *part.max(axis=0).tolist())
    ]
