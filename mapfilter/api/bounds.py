"""Bound what a database allows."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from mapfilter._arguments import Argument, Setting, WholeNumber, check_arguments
from mapfilter.api.given import database_argument, opened
from mapfilter.api.python_words import python_words
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.evaluation.first_fix import FirstFixOptions
from mapfilter.evaluation.map_bound import MapBound, on_lattice
from mapfilter.evaluation.map_bound import bound as bound_of
from mapfilter.evaluation.radio_map import ErrorModel
from mapfilter.positioning.place_tables import with_points

if TYPE_CHECKING:
    import geopandas as gpd
    from matplotlib.axes import Axes


@dataclass(frozen=True, repr=False, eq=False)
class Bound:
    """Where positioning will work, before any drive.

    Parameters
    ----------
    found : MapBound
        All figures.
    """

    found: MapBound
    database: RadioRouteDatabase

    def __repr__(self) -> str:
        along_m = self.found.at_points()["along_bound_m"]
        median_m = float(np.nanmedian(along_m))
        return f"Bound: {along_m.size} points, {median_m:.1f} m along the street (median)"

    def _repr_html_(self) -> str:
        """Return the summary and the last points, as notebooks show them."""
        return f"<p>{escape(repr(self))}</p>{self.to_dataframe().tail().to_html()}"

    def to_dataframe(self) -> pd.DataFrame:
        """Return the figures of each point; see also ``found.by_way()`` and ``found.twins()``."""
        return self.found.to_dataframe()

    def to_geodataframe(self) -> gpd.GeoDataFrame:
        """Return the same with points in the CRS of the database."""
        return with_points(self.to_dataframe(), self.database.lattice.crs)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the least position error along the street at each point.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; a new figure when left out.

        Raises
        ------
        ConfigError
            What is given are no axes, such as a figure.
        """
        from mapfilter.report.basemap import BaseMap
        from mapfilter.report.coverage import plot_point_values

        radio, database = self.found.radio, self.database
        base = BaseMap(
            radio.lattice.bounds_m,
            attribution=database.attribution,
            whole_m=database.lattice.bounds_m,
        )
        values = on_lattice(radio, self.found.at_points()["along_bound_m"])
        title = "Least position error along the street from one report of levels"
        return plot_point_values(
            values, radio.lattice, database.plan, base, ax, title=title, label="bound / m"
        )


@python_words()
def bound(
    database: RadioRouteDatabase | Path | str,
    *,
    errors: ErrorModel | None = None,
    options: FirstFixOptions | None = None,
    seed: int = 0,
) -> Bound:
    """Bound the accuracy of positions by a database (Cramér-Rao), and the metres to a first fix.

    Parameters
    ----------
    database : RadioRouteDatabase or path
    errors : ErrorModel, optional
        Assumed errors of the predicted levels.
    options : FirstFixOptions, optional
        Of the simulated journeys.
    seed : int
        Of these journeys.

    Raises
    ------
    InputError
        The database has no cells, or is too large for the memory.
    StoreError
        The path holds no database, or one that is damaged.
    ConfigError
        An argument is none of these, or the seed is none.
    """
    check_arguments(
        "bound",
        database_argument(database),
        keywords=[
            Argument("errors", errors, ErrorModel | None, "ErrorModel"),
            Argument("options", options, FirstFixOptions | None, "FirstFixOptions"),
            Setting("seed", seed, WholeNumber),
        ],
    )
    database = opened(database)
    return Bound(bound_of(database, errors=errors, options=options, seed=seed), database)
