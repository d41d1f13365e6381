"""What is asked of a map, whatever format it has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

BoxDeg = tuple[float, float, float, float]
"""West, south, east, north in degrees."""


@dataclass(frozen=True, slots=True)
class Query:
    """Which elements of a map are wanted, and which of their tags.

    Parameters
    ----------
    wanted : mapping of str to tuple of str
        Elements that have one of these tags, with one of these values; no values: with any.
    tags : tuple of str
        Tags to be told.
    """

    wanted: Mapping[str, tuple[str, ...]]
    tags: tuple[str, ...]
