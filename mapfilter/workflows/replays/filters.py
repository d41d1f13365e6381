"""The filters of a replay: over its database, or over the sites of the cells of a log."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.radio.cells import CellPlan
from mapfilter.workflows.inputs.planned_cells import cells_beside_log, plan_antennas


@dataclass(frozen=True, eq=False)
class ReplayFilters:
    """Makes the filters of logs, one of each kind: preparing an area may take long.

    Parameters
    ----------
    config : Config
        Its cells are the sites where there is no database.
    database : RadioRouteDatabase or None
        None where the filter only takes sites.
    """

    config: Config
    database: RadioRouteDatabase | None
    _plans: dict[str, CellPlan] = field(default_factory=dict, repr=False)
    _made: dict[tuple[str, FilterOptions, bool], Filter[Any]] = field(
        default_factory=dict, repr=False
    )

    @property
    def has_sites(self) -> bool:
        """Whether sites of cells are known at all."""
        return self.database is not None or self.config.cells.plan is not None

    def plan(self, crs: str) -> CellPlan:
        """Return the cells of the database, or those of the configuration in the CRS of a log."""
        if self.database is not None:
            return self.database.plan
        if crs not in self._plans:
            self._plans[crs] = cells_beside_log(self.config, crs)
        return self._plans[crs]

    def over(self, crs: str, options: FilterOptions, *, cells: bool) -> Filter[Any]:
        """Return the filter by options; equal ones share it.

        Parameters
        ----------
        crs : str
            Of the database, or of the log where there is none.
        options : FilterOptions
        cells : bool
            Whether the cells of the database are used, or its streets alone.
        """
        key = crs, options, cells
        if key not in self._made:
            self._made[key] = self._filter(*key)
        return self._made[key]

    def _filter(self, crs: str, options: FilterOptions, cells: bool) -> Filter[Any]:
        database = self.database
        if database is not None and not isinstance(options, KalmanFilter):
            return options.over(database if cells else database.without_cells())
        plan = self.plan(crs)
        return cast(KalmanFilter, options).over_sites(plan, plan_antennas(self.config, plan))
