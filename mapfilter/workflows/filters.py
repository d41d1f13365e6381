"""The filter that a configuration asks for."""

from __future__ import annotations

from mapfilter.config.sections import FilterSection
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.filter import FilterOptions
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.locators import filter_options


def filter_choice(section: FilterSection) -> FilterOptions:
    """Return the options of the filter that a configuration names.

    Raises
    ------
    ConfigError
        A custom filter cannot be imported.
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
            return KalmanFilter(method=name, smooth=section.smooth)  # type: ignore[arg-type]
