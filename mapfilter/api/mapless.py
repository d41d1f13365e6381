"""Filters that need no map, which are given no database: the sites that they have of their own."""

from __future__ import annotations

from typing import Any

from mapfilter.errors import ConfigError, fail
from mapfilter.positioning import BUILT_IN
from mapfilter.positioning.belief_tracker import BeliefTracker
from mapfilter.positioning.custom_filter import own_name
from mapfilter.positioning.filter import Filter
from mapfilter.positioning.kalman.filter import KalmanFilter, KalmanTracker
from mapfilter.positioning.kalman.siteless import needs_sites, without_cells
from mapfilter.positioning.locators import filter_options
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.log import TrackLog

_OVER_SITES = "KalmanFilter().over_sites(plan)"


def own_sites(given: Any) -> CellPlan | None:
    """Return the sites that a filter without a map has of its own, None where it has none.

    Of a :class:`mapfilter.Filter` that a user made it is a plan without any, in the filter's CRS.

    Parameters
    ----------
    given : KalmanFilter, what its ``over_sites`` returned, or a Filter of the user

    Raises
    ------
    ConfigError
        The filter needs a database.
    """
    if isinstance(given, KalmanTracker):
        return given.sites.plan
    if isinstance(given, KalmanFilter):
        return None
    # Filters of beliefs, as the candidate filter, are over a database, whose plan names cells.
    own = isinstance(given, Filter) and not isinstance(given, BeliefTracker)
    if own and given.made_of is None:
        return CellPlan(given.crs, ())
    name = own_name(given, getattr(given, "__name__", type(given).__name__))
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
    given : KalmanFilter
    """
    tracker: KalmanTracker = given.over_sites(plan)
    return tracker
