"""From what a user names or makes to a filter over a database."""

from __future__ import annotations

from dataclasses import replace
from difflib import get_close_matches
from importlib import import_module
from typing import Any

from mapfilter._arguments import shown
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, fail
from mapfilter.options import Options
from mapfilter.positioning import BUILT_IN as BUILT_IN
from mapfilter.positioning import DEFAULT as DEFAULT
from mapfilter.positioning.custom_filter import GivenFilter, adapted, custom_filter, own_name
from mapfilter.positioning.filter import Filter, FilterOptions


def filter_options(name: str = DEFAULT) -> FilterOptions:
    """Return the default options of a filter.

    Parameters
    ----------
    name : str
        One of :data:`mapfilter.positioning.BUILT_IN`, or a custom filter as
        ``package.module:Name``.

    Raises
    ------
    ConfigError
        There is no such filter.

    Examples
    --------
    >>> filter_options("candidate").name
    'candidate'
    """
    if ":" in name:
        return custom_filter(name)
    if name not in BUILT_IN:
        expected = f"{', '.join(BUILT_IN)}, or package.module:Name"
        raise fail(ConfigError, "filter", expected, repr(name), _likely(name))
    module, _, kind = BUILT_IN[name].partition(":")
    options = getattr(import_module(module), kind)()
    found: FilterOptions = options if options.name == name else replace(options, method=name)
    return found


def _likely(name: str) -> str:
    """Return the filter that a wrong name is likely to mean, or ""."""
    module, dot, kind = name.rpartition(".")
    if dot:
        return f"{module}:{kind}"
    return next(iter(get_close_matches(name.lower(), BUILT_IN, n=1)), "")


def given_options(given: Any) -> Any:
    """Return options for their name or class, with their defaults; all else as it is."""
    if isinstance(given, str):
        return filter_options(given)
    return given() if isinstance(given, type) and issubclass(given, Options) else given


def as_filter(given: Any, database: RadioRouteDatabase, *, ways: bool = True) -> Filter[Any]:
    """Return a filter over the area of a database.

    Parameters
    ----------
    given : str, options, Filter, or class
        A name as in :func:`filter_options`; options such as :class:`mapfilter.BayesFilter`; a
        filter that is already over an area; or a custom filter: a class or function that is called
        with the database, or what it returned.
    ways : bool
        Whether positions are matched to ways.

    Raises
    ------
    ConfigError
        It is none of these.
    """
    given = given_options(given)
    if isinstance(given, Filter):
        return given
    if hasattr(given, "over") and not isinstance(given, type):
        found: Filter[Any] = given.over(database, ways=ways)
        return found
    if callable(given):
        return GivenFilter(given).over(database, ways=ways)
    if not any(callable(getattr(given, one, None)) for one in ("begin", "step", "init", "locate")):
        expected = "the name of a filter, options such as BayesFilter(), or a class"
        raise fail(ConfigError, "filter", expected, shown(given))
    return adapted(given, database, own_name(given, type(given).__name__), ways=ways)
