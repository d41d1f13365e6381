"""Results as plain facts: what JSON and the terminal show."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any


def facts(value: Any) -> Any:
    """Turn a result into what JSON knows: paths become text; NaN and infinity become None.

    Examples
    --------
    >>> facts({"error_m": float("nan"), "outputs": (Path("a.png"),)})
    {'error_m': None, 'outputs': ['a.png']}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: facts(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): facts(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [facts(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def text_lines(found: Mapping[str, Any], indent: str = "") -> Iterator[str]:
    r"""Yield one line for each figure, nested ones indented; none for what is empty.

    Examples
    --------
    >>> found = {"bounds_m": [385412.52], "lon_deg": 24.9412341, "seconds": {"build": 1.23456}}
    >>> print(*text_lines(found), sep="\n")
    bounds_m:
      385412.5
    lon_deg: 24.941234
    seconds:
      build: 1.235
    """
    for key, value in found.items():
        if isinstance(value, Mapping | list) and not value:
            continue
        if isinstance(value, Mapping):
            yield f"{indent}{key}:"
            yield from text_lines(value, indent + "  ")
        elif isinstance(value, list):
            yield f"{indent}{key}:"
            for item in value:
                shown = (
                    ", ".join(f"{k} {_short(v, k)}" for k, v in item.items())
                    if isinstance(item, Mapping)
                    else _short(item, key)
                )
                yield f"{indent}  {shown}"
        else:
            yield f"{indent}{key}: {_short(value, key)}"


def _short(value: Any, name: str) -> str:
    """Return a figure rounded to what one reads: metres to decimetres, degrees to as much."""
    if value is None:
        return "-"
    if isinstance(value, float):
        if name.endswith(("lon_deg", "lat_deg")):
            return f"{value:.6f}"
        return f"{value:.1f}" if abs(value) >= 1000 else f"{value:.4g}"
    return str(value)
