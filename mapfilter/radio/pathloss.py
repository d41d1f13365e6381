"""The path loss of a chosen model, and whether it was published for the case at hand."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.radio._models import ModelName, PredictionModel
from mapfilter.radio.pathloss_free import SHORTEST_FREE_DISTANCE_M, friis_db, log_distance_db
from mapfilter.radio.pathloss_hata import SHORTEST_DISTANCE_M, cost231_hata_db, okumura_hata_db
from mapfilter.radio.pathloss_walfisch import cost231_walfisch_ikegami_db
from mapfilter.radio.tr38901 import (
    SHORTEST_TR38901_DISTANCE_M,
    Scenario,
    hidden_loss_db,
    seen_loss_db,
    sight_probability,
)

Range = tuple[float, float]

_HATA = {"base_height_m": (30.0, 200.0), "mobile_height_m": (1.0, 10.0)}
_HATA_DISTANCE = {"distance_m": (1000.0, 20000.0)}
_TR38901 = {"frequency_mhz": (500.0, 1e5), "mobile_height_m": (1.5, 22.5)}
_TR38901_DISTANCE = {"distance_m": (10.0, 5000.0)}

PUBLISHED: Mapping[ModelName, Mapping[str, Range]] = MappingProxyType(
    {
        "friis": {},
        "log_distance": {},
        "okumura_hata": {"frequency_mhz": (150.0, 1500.0), **_HATA, **_HATA_DISTANCE},
        "cost231_hata": {"frequency_mhz": (1500.0, 2000.0), **_HATA, **_HATA_DISTANCE},
        "cost231_walfisch_ikegami": {
            "frequency_mhz": (800.0, 2000.0),
            "base_height_m": (4.0, 50.0),
            "mobile_height_m": (1.0, 3.0),
            "distance_m": (20.0, 5000.0),
        },
        "tr38901_uma": {**_TR38901, "base_height_m": (25.0, 25.0), **_TR38901_DISTANCE},
        "tr38901_umi": {**_TR38901, "base_height_m": (10.0, 10.0), **_TR38901_DISTANCE},
    }
)
"""The ranges that each model was published for."""

_SCENARIOS: Mapping[str, Scenario] = MappingProxyType({"tr38901_uma": "uma", "tr38901_umi": "umi"})


def path_loss_db(
    model: PredictionModel,
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    roof_height_m: ArrayLike,
    sight: ArrayLike,
) -> Floats:
    """Return the path loss in dB by the model that a prediction asks for.

    Parameters
    ----------
    model : PredictionModel
    distance_m : array_like
        Horizontal distance.
    frequency_mhz, base_height_m : float
    roof_height_m : array_like
        Mean height of the roofs around the mobile; of use to Walfisch-Ikegami only.
    sight : array_like
        0 where the antenna is hidden, 1 where it is seen, between them its probability; of use to
        Walfisch-Ikegami and TR 38.901 only. Losses in dB are averaged by it.
    """
    mobile_m, city = model.mobile_height_m, model.metropolitan
    match model.model:
        case "friis":
            return friis_db(distance_m, frequency_mhz)
        case "log_distance":
            return log_distance_db(
                distance_m, frequency_mhz, model.path_loss_exponent, model.reference_distance_m,
                model.reference_loss_db,
            )  # fmt: skip
        case "okumura_hata":
            return okumura_hata_db(
                distance_m, frequency_mhz, base_height_m, mobile_m, model.environment
            )
        case "cost231_hata":
            return cost231_hata_db(distance_m, frequency_mhz, base_height_m, mobile_m, city)
        case "cost231_walfisch_ikegami":
            return cost231_walfisch_ikegami_db(
                distance_m, frequency_mhz, base_height_m, mobile_m, roof_height_m,
                model.street_width_m, model.building_separation_m, model.street_orientation_deg,
                city, np.asarray(sight) > 0.5,
            )  # fmt: skip
        case "tr38901_uma" | "tr38901_umi":
            where = (distance_m, frequency_mhz, base_height_m, mobile_m)
            seen_db = seen_loss_db(_SCENARIOS[model.model], *where)
            hidden_db = hidden_loss_db(_SCENARIOS[model.model], *where)
            return hidden_db + np.asarray(sight, dtype=np.float64) * (seen_db - hidden_db)


def probability_of_sight(model: PredictionModel, distance_m: ArrayLike) -> Floats:
    """Return the probability of line of sight by TR 38.901, 0 with the models that have none."""
    scenario = _SCENARIOS.get(model.model)
    if scenario is None:
        return np.zeros(np.shape(distance_m))
    return sight_probability(scenario, distance_m, model.mobile_height_m)


def needs_sight(model: PredictionModel) -> bool:
    """Tell whether a model loses less where the antenna is seen."""
    return model.model == "cost231_walfisch_ikegami" or model.model in _SCENARIOS


def shortest_distance_m(model: PredictionModel) -> float:
    """Return the distance below which distances count as this one."""
    match model.model:
        case "friis":
            return SHORTEST_FREE_DISTANCE_M
        case "log_distance":
            return model.reference_distance_m
        case "tr38901_uma" | "tr38901_umi":
            return SHORTEST_TR38901_DISTANCE_M
    return SHORTEST_DISTANCE_M


def outside_published_range(
    model: ModelName,
    *,
    frequency_mhz: float,
    base_height_m: float,
    mobile_height_m: float,
    longest_distance_m: float,
    nearest_distance_m: float | None = None,
) -> tuple[str, ...]:
    """Tell in words which values lie outside the range a model was published for.

    Parameters
    ----------
    model : str
    frequency_mhz, base_height_m, mobile_height_m : float
    longest_distance_m, nearest_distance_m : float
        Between which distances it is used; the nearest need not be looked at.

    Examples
    --------
    >>> outside_published_range("cost231_walfisch_ikegami", frequency_mhz=2600.0,
    ...     base_height_m=30.0, mobile_height_m=1.5, longest_distance_m=900.0)
    ('frequency_mhz 2600 is outside 800..2000',)
    >>> outside_published_range("tr38901_uma", frequency_mhz=2600.0,
    ...     base_height_m=30.0, mobile_height_m=1.5, longest_distance_m=900.0)
    ('base_height_m 30 is not 25',)
    """
    published = PUBLISHED[model]
    values = {
        "frequency_mhz": frequency_mhz,
        "base_height_m": base_height_m,
        "mobile_height_m": mobile_height_m,
        "distance_m": longest_distance_m,
    }
    told = [
        f"{name} {values[name]:g} is "
        + (f"outside {low:g}..{high:g}" if low < high else f"not {low:g}")
        for name, (low, high) in published.items()
        if not low <= values[name] <= high
    ]
    if nearest_distance_m is not None and "distance_m" in published:
        low, high = published["distance_m"]
        if nearest_distance_m < low <= longest_distance_m:
            told.append(f"distance_m from {nearest_distance_m:g} on is outside {low:g}..{high:g}")
    return tuple(told)
