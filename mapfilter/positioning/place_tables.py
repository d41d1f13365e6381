"""Tables of positions with points, for geopandas."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd


def with_points(table: pd.DataFrame, crs: str) -> gpd.GeoDataFrame:
    """Return a table with points in a CRS, without its rows that have no position.

    Parameters
    ----------
    table : pandas.DataFrame
        With ``east_m`` and ``north_m``; NaN where there is no position.
    """
    # A process that draws does without.
    import geopandas as gpd

    table = table[np.isfinite(table["east_m"])].reset_index(drop=True)
    points = gpd.points_from_xy(table["east_m"], table["north_m"])
    return gpd.GeoDataFrame(table, geometry=points, crs=crs)
