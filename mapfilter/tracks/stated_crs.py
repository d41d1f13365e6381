"""The CRS that a table of positions states, so that it is not lost where the log is not at hand."""

from __future__ import annotations

import pandas as pd

_KEY = "crs"


def placed_in(crs: str, rows: pd.DataFrame) -> pd.DataFrame:
    """Return a table of positions that states its CRS, in ``DataFrame.attrs``.

    Parts of it and tables made of it by pandas state it, too.

    Examples
    --------
    >>> truth = placed_in("EPSG:32635", pd.DataFrame({"east_m": [1.0, 2.0]}))
    >>> crs_stated(truth.iloc[1:]), crs_stated(pd.DataFrame({"east_m": [1.0]}))
    ('EPSG:32635', '')
    """
    stating = rows.copy(deep=False)
    stating.attrs = {**rows.attrs, _KEY: crs}
    return stating


def crs_stated(rows: pd.DataFrame) -> str:
    """Return the CRS that a table of positions of a log states; "" where it states none."""
    return str(rows.attrs.get(_KEY, ""))
