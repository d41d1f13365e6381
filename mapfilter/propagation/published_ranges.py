"""Ranges of frequency, heights and distance that propagation models were published for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mapfilter.propagation.models import ModelName

_HATA = {
    "base_height_m": (30.0, 200.0),
    "mobile_height_m": (1.0, 10.0),
    "distance_m": (1000.0, 20000.0),
}
_TR38901 = {
    "frequency_mhz": (500.0, 1e5),
    "mobile_height_m": (1.5, 22.5),
    "distance_m": (10.0, 5000.0),
}
PUBLISHED: Mapping[ModelName, Mapping[str, tuple[float, float]]] = {
    "friis": {},
    "log_distance": {},
    "okumura_hata": {"frequency_mhz": (150.0, 1500.0), **_HATA},
    "cost231_hata": {"frequency_mhz": (1500.0, 2000.0), **_HATA},
    "cost231_walfisch_ikegami": {
        "frequency_mhz": (800.0, 2000.0),
        "base_height_m": (4.0, 50.0),
        "mobile_height_m": (1.0, 3.0),
        "distance_m": (20.0, 5000.0),
    },
    "tr38901_uma": {**_TR38901, "base_height_m": (25.0, 25.0)},
    "tr38901_umi": {**_TR38901, "base_height_m": (10.0, 10.0)},
}
"""The ranges that each model was published for."""


def outside_published_range(
    model: ModelName, used: Mapping[str, float], nearest_distance_m: float = np.inf
) -> tuple[str, ...]:
    """Return remarks on the values that lie outside the range a model was published for.

    ``used`` are values by the names in :data:`PUBLISHED`; its ``distance_m`` is the longest one.
    The remark on a frequency names the models that were published for it.

    Examples
    --------
    >>> used = {"base_height_m": 30.0, "mobile_height_m": 1.5, "distance_m": 900.0}
    >>> used["frequency_mhz"] = 2600.0
    >>> print(*outside_published_range("cost231_walfisch_ikegami", used))
    frequency_mhz 2600 is outside 800..2000, set prediction.model = "tr38901_uma" or "tr38901_umi"
    >>> outside_published_range("tr38901_uma", used)
    ('base_height_m 30 is not 25',)
    """
    remarks = []
    for name, (low, high) in PUBLISHED[model].items():
        limits = f"outside {low:g}..{high:g}" if low < high else f"not {low:g}"
        if not low <= used[name] <= high:
            others = _models_for(used[name]) if name == "frequency_mhz" else ""
            remarks.append(f"{name} {used[name]:g} is {limits}{others}")
        if name == "distance_m" and nearest_distance_m < low <= used[name]:
            remarks.append(f"distance_m from {nearest_distance_m:g} on is {limits}")
    return tuple(remarks)


def _models_for(frequency_mhz: float) -> str:
    """Return how to set a model that was published for a frequency, or "" if there is none."""
    ranges = {model: of["frequency_mhz"] for model, of in PUBLISHED.items() if of}
    names = [f'"{model}"' for model, (low, high) in ranges.items() if low <= frequency_mhz <= high]
    return f", set prediction.model = {' or '.join(names)}" if names else ""
