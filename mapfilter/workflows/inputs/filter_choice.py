"""The filter that a configuration names, with the values of its section."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from mapfilter.config.fields import Section
from mapfilter.config.sections import FilterSection
from mapfilter.errors import ConfigError, fail
from mapfilter.positioning.filter import FilterOptions
from mapfilter.positioning.locators import BUILT_IN, filter_options


def option_sections(section: FilterSection, options: object) -> list[tuple[str, Section]]:
    """Return the sections that hold a filter's options, with their full names."""
    inner = [(f"filter.{name}", value) for name, value in section if isinstance(value, Section)]
    sections: list[tuple[str, Section]] = [("filter", section), *inner]
    return [(name, part) for name, part in sections if isinstance(options, part.kinds)]


def filter_choice(section: FilterSection) -> FilterOptions:
    """Return the options of the filter that a configuration names, with the values of its section.

    Raises
    ------
    ConfigError
        A custom filter cannot be imported, or the filter cannot smooth.
    """
    options: Any = filter_options(section.name)
    for _, part in option_sections(section, options):
        shared = {one.name for one in fields(options)} & set(type(part).model_fields)
        options = replace(options, **{name: getattr(part, name) for name in shared})
    if section.smooth:
        if not hasattr(options, "smooth"):
            able = ", ".join(name for name in BUILT_IN if hasattr(filter_options(name), "smooth"))
            raise fail(ConfigError, "filter.smooth (--smooth)", able, section.name)
        options = replace(options, smooth=True)
    chosen: FilterOptions = options
    return chosen
