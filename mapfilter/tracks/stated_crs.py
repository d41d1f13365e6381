"""The CRS that a table of positions states, so that it is not lost where the log is not at hand."""

from __future__ import annotations

import pandas as pd

_CRS, _BOUNDS = "crs", "bounds_m"
_PLACE = ["east_m", "north_m"]


def placed_in(crs: str, rows: pd.DataFrame) -> pd.DataFrame:
    """Return a table of positions that states its CRS, in ``DataFrame.attrs``.

    Parts of it state it, too. Tables that pandas makes of it keep the attributes also where their
    positions are other ones: these lie beyond the bounds that are kept beside it.

    Examples
    --------
    >>> truth = placed_in("EPSG:32635", pd.DataFrame({"east_m": [1.0, 2.0], "north_m": [5.0, 5.0]}))
    >>> crs_stated(truth.iloc[1:]), crs_stated(truth.assign(east_m=truth["east_m"] + 90))
    ('EPSG:32635', '')
    """
    stating = rows.copy(deep=False)
    places = rows[_PLACE]
    bounds_m = [*places.min().tolist(), *places.max().tolist()]
    stating.attrs = {**rows.attrs, _CRS: crs, _BOUNDS: bounds_m}
    return stating


def crs_stated(rows: pd.DataFrame) -> str:
    """Return the CRS that a table of positions of a log states; "" where it states none."""
    if _CRS not in rows.attrs or _BOUNDS not in rows.attrs or not set(_PLACE) <= set(rows):
        return ""
    low_m, high_m = rows.attrs[_BOUNDS][:2], rows.attrs[_BOUNDS][2:]
    places = rows[_PLACE].apply(pd.to_numeric, errors="coerce")
    within = bool(((places >= low_m) & (places <= high_m)).all(axis=None))
    return str(rows.attrs[_CRS]) if within else ""
