"""Results as JSON types, and as lines of text."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

_MOST_COUNTS = 12
_MAX_TABLE_WIDTH = 200
_PLACES = ("lon_deg", "lat_deg", "bounds_deg")


def to_jsonable(value: Any) -> Any:
    """Convert a result to JSON types: paths become text; NaN and infinity become None.

    Examples
    --------
    >>> to_jsonable({"error_m": float("nan"), "outputs": (Path("a.png"),)})
    {'error_m': None, 'outputs': ['a.png']}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: to_jsonable(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): to_jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [to_jsonable(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def text_lines(found: Mapping[str, Any], indent: str = "", within: str = "") -> Iterator[str]:
    r"""Yield one line for each figure, nested ones indented; none for what is empty.

    Rows of the same figures are a table, where it is not too wide. Of many counts the largest are
    shown, and what the others add up to. ``within`` is the name of what the figures are nested in.

    Examples
    --------
    >>> found = {"bounds_m": [385412.52], "lon_deg": 24.9412341, "seconds": {"build": 1.23456}}
    >>> print(*text_lines(found), sep="\n")
    bounds_m:
      385412.5
    lon_deg: 24.941234
    seconds:
      build: 1.235
    >>> rows = [{"name": "levels-6", "runs": 20}, {"name": "cell-20", "runs": 5}]
    >>> print(*text_lines({"cases": rows}), sep="\n")
    cases:
      name      runs
      levels-6    20
      cell-20      5
    >>> counts = {f"cell-{i}": i for i in range(1, 20)}
    >>> print(*list(text_lines({"unknown_cells": counts}))[-2:], sep="\n")
      cell-8: 8
      7 more: 28
    """
    for key, value in found.items():
        if isinstance(value, Mapping | list) and not value:
            continue
        if isinstance(value, Mapping):
            yield f"{indent}{key}:"
            yield from text_lines(_largest(value), indent + "  ", key)
        elif isinstance(value, list):
            yield f"{indent}{key}:"
            for line in _table(value) or (_one_line(item, key) for item in value):
                yield f"{indent}  {line}"
        else:
            name = within if within.endswith(_PLACES) else key
            yield f"{indent}{key}: {_short(value, name)}"


def _largest(found: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the largest of many counts, and the sum of the others; anything else as it is."""
    if len(found) <= _MOST_COUNTS or not all(type(value) is int for value in found.values()):
        return found
    rows = sorted(found.items(), key=lambda one: -one[1])
    rest = rows[_MOST_COUNTS:]
    return {**dict(rows[:_MOST_COUNTS]), f"{len(rest)} more": sum(count for _, count in rest)}


def _table(rows: list[Any]) -> list[str]:
    """Return the lines of a table, numbers to the right; none if the rows differ in keys."""
    if len(rows) < 2 or not all(
        isinstance(row, Mapping) and row.keys() == rows[0].keys() for row in rows
    ):
        return []
    names = [name for name in rows[0] if any(row[name] not in (None, "") for row in rows)]
    lines = [names, *([_short(row[name], name) for name in names] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    if sum(widths) + 2 * len(widths) > _MAX_TABLE_WIDTH:
        return []
    texts = [any(isinstance(row[name], str) for row in rows) for name in names]
    return [
        "  ".join(
            cell.ljust(width) if text else cell.rjust(width)
            for cell, width, text in zip(line, widths, texts, strict=True)
        ).rstrip()
        for line in lines
    ]


def _one_line(item: Any, name: str) -> str:
    if isinstance(item, Mapping):
        return ", ".join(f"{key} {_short(value, key)}" for key, value in item.items())
    return _short(item, name)


def _short(value: Any, name: str) -> str:
    """Format a figure: four digits, large ones and degrees to decimetres."""
    if value is None:
        return "-"
    if isinstance(value, float):
        if name.endswith(_PLACES):
            return f"{value:.6f}"
        return f"{value:.1f}" if abs(value) >= 1000 else f"{value:.4g}"
    return str(value)
