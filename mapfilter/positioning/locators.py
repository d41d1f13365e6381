"""From what a user names or makes to a filter over a database."""

from __future__ import annotations

from typing import Any

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, fail
from mapfilter.filters.gaussian import METHODS
from mapfilter.options import Options
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.custom_filter import adapted, custom_filter, wrap_user_errors
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.positioning.kalman.filter import KalmanFilter

DEFAULT = "bayes"
BUILT_IN = ("bayes", "grid", "candidate", *METHODS)


def filter_options(name: str = DEFAULT) -> FilterOptions:
    """Return the default options of a filter.

    Parameters
    ----------
    name : str
        ``bayes``, ``grid``, ``candidate``, ``ekf``, ``iekf``, ``ukf``, ``ckf``, ``rbukf``, or a
        custom filter as ``package.module:Name``.

    Raises
    ------
    ConfigError
        There is no such filter.

    Examples
    --------
    >>> filter_options("candidate").name
    'candidate'
    """
    match name:
        case "bayes":
            return BayesFilter()
        case "grid":
            return GridFilter()
        case "candidate":
            return CandidateFilter()
        case name if name in METHODS:
            return KalmanFilter(method=name)  # type: ignore[arg-type]
        case name if ":" in name:
            return custom_filter(name)
    expected = f"{', '.join(BUILT_IN)}, or package.module:Name"
    raise fail(ConfigError, "filter", expected, repr(name))


def as_filter(given: Any, database: RadioRouteDatabase, *, ways: bool = True) -> Filter[Any]:
    """Return a filter over the area of a database.

    Parameters
    ----------
    given : str, options, Filter, or class
        A name as in :func:`filter_options`; options such as :class:`BayesFilter`; a filter that
        is already over an area; or a custom filter: a class or function that is called with the
        database, or what it returned.
    database : RadioRouteDatabase
    ways : bool
        Whether positions are matched to ways.

    Raises
    ------
    ConfigError
        It is none of these.
    """
    if isinstance(given, str):
        given = filter_options(given)
    if isinstance(given, Filter):
        return given
    if hasattr(given, "over") and not isinstance(given, type):
        found: Filter[Any] = given.over(database, ways=ways)
        return found
    name = getattr(given, "__name__", type(given).__name__)
    if callable(given):
        if isinstance(given, type) and issubclass(given, Options):
            return as_filter(given(), database, ways=ways)
        with wrap_user_errors(name, given):
            given = given(database)
    return adapted(given, database, name, ways=ways)
