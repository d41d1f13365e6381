"""The filter that a configuration asks for."""

from __future__ import annotations

from dataclasses import replace

from mapfilter.config.sections import FilterSection
from mapfilter.errors import ConfigError, fail
from mapfilter.filters.candidate import CandidateOptions
from mapfilter.positioning.custom_filter import custom_filter
from mapfilter.positioning.locators import FilterChoice


def filter_choice(section: FilterSection, resolution_m: float) -> FilterChoice:
    """Return filter and options of a configuration, for a database of a resolution.

    Raises
    ------
    ConfigError
        The filter takes no database, or it is one's own and is not there.
    """
    match section.name:
        case "candidate":
            options = CandidateOptions(
                resolution_m=resolution_m,
                update_length_m=section.update_length_m,
                tracking_length_m=section.tracking_length_m,
                prediction=section.prediction,
                duplicates=section.duplicates,
                threshold=section.threshold,
                at_threshold=section.at_threshold,
                switch_check=section.switch_check,
                when_empty=section.when_empty,
            )
            return FilterChoice(options, section.margin_db)
        case "bayes" | "grid":
            return FilterChoice(replace(section.bayes.options, grid=section.name == "grid"))
        case name if ":" in name:
            return FilterChoice(custom_filter(name))
        case name:
            raise fail(ConfigError, "filter.name", "a filter that takes a database", repr(name))
