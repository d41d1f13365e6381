"""What is asked of a map: elements with some tags, in a box of degrees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

BoxDeg = tuple[float, float, float, float]
"""West, south, east, north in degrees."""


@dataclass(frozen=True, slots=True)
class Query:
    """Elements of a map, and the tags to read of them.

    Elements have one of the keys in ``wanted``, with one of its values (without values: any).
    """

    wanted: Mapping[str, tuple[str, ...]]
    tags: tuple[str, ...]
