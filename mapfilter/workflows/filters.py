"""The filter that a configuration asks for."""

from __future__ import annotations

from mapfilter.config.sections import FilterSection
from mapfilter.errors import ConfigError, fail
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.filter import FilterOptions
from mapfilter.positioning.locators import filter_options


def filter_choice(section: FilterSection) -> FilterOptions:
    """Return the options of the filter that a configuration names.

    Raises
    ------
    ConfigError
        The filter takes no database, or a custom filter cannot be imported.
    """
    match section.name:
        case "candidate":
            return section.of(CandidateFilter)
        case "bayes":
            return section.bayes.of(BayesFilter)
        case "grid":
            return section.bayes.of(GridFilter)
        case name if ":" in name:
            return filter_options(name)
        case name:
            raise fail(ConfigError, "filter.name", "a filter that takes a database", repr(name))
