"""Filters that need no map, which are given no database: the sites that they have of their own."""

from __future__ import annotations

from typing import Any

from mapfilter.errors import ConfigError, fail
from mapfilter.positioning import BUILT_IN
from mapfilter.positioning.kalman.filter import KalmanFilter, KalmanTracker
from mapfilter.positioning.kalman.siteless import needs_sites, without_cells
from mapfilter.positioning.locators import filter_options
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.log import TrackLog

_OVER_SITES = "KalmanFilter().over_sites(plan)"


def own_sites(given: Any) -> CellPlan | None:
    """Return the sites that a filter without a map has of its own, None where it has none.

    Parameters
    ----------
    given : KalmanFilter, its class, or what its ``over_sites`` returned

    Raises
    ------
    ConfigError
        The filter needs a database.
    """
    if isinstance(given, KalmanTracker):
        return given.sites.plan
    if isinstance(given, KalmanFilter) or given is KalmanFilter:
        return None
    own = getattr(given, "name", None)
    name = own if isinstance(own, str) else getattr(given, "__name__", type(given).__name__)
    able = ", ".join(one for one in BUILT_IN if isinstance(filter_options(one), KalmanFilter))
    expected = f"a database of open_database or build, or its path, for the filter {name}"
    hint = f'left out; {able} need none, as in locate(log, filter="ekf")'
    raise fail(ConfigError, "locate, database", expected, "None", hint)


def without_sites(log: TrackLog) -> TrackLog:
    """Return a log for a filter that has no sites: levels, timing and time differences left out.

    Raises
    ------
    ConfigError
        The log has these, and no positions to start from.
    """
    if needs_sites(log):
        expected = "a database, or a filter over sites, for the radio of the log"
        hint = f"a log without positions; {_OVER_SITES} takes the sites of a cell plan"
        raise fail(ConfigError, "locate, database", expected, "None", hint)
    return without_cells(log, f"a database, or {_OVER_SITES} of a cell plan")


def over_sites(given: Any, plan: CellPlan) -> KalmanTracker:
    """Return a filter without a map over some sites.

    Parameters
    ----------
    given : KalmanFilter or its class
    """
    options: KalmanFilter = given() if isinstance(given, type) else given
    return options.over_sites(plan)
