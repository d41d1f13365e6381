"""Parameters of a prediction and of its ground truth, and the path loss of the chosen model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import ConfigError, Faults
from mapfilter.propagation.empirical import (
    SHORTEST_DISTANCE_M,
    SHORTEST_FREE_DISTANCE_M,
    Environment,
    cost231_hata_db,
    cost231_walfisch_ikegami_db,
    friis_db,
    log_distance_db,
    okumura_hata_db,
)
from mapfilter.propagation.tr38901 import (
    SHORTEST_TR38901_DISTANCE_M,
    Scenario,
    hidden_loss_db,
    seen_loss_db,
    sight_probability,
)

ModelName = Literal[
    "friis",
    "log_distance",
    "okumura_hata",
    "cost231_hata",
    "cost231_walfisch_ikegami",
    "tr38901_uma",
    "tr38901_umi",
]
LineOfSight = Literal["buildings", "probability"]
Clutter = Literal["own", "shared"]
Range = tuple[float, float]


@dataclass(frozen=True)
class PredictionModel:
    """How levels are predicted.

    Parameters
    ----------
    model : str
        One of :data:`ModelName`.
    line_of_sight : {"buildings", "probability"}
        By the raster of building heights; or the path losses with and without line of sight are
        averaged by their probability (TR 38.901 only).
    mobile_height_m : float
        Height of the phone above ground.
    environment : {"large_city", "city", "suburban", "open"}
        Of Okumura-Hata.
    path_loss_exponent, reference_distance_m, reference_loss_db : float
        Of log-distance; the loss at the reference distance is that of free space when it is None.
    street_width_m, building_separation_m : float
        Mean width of the streets, and mean distance between the buildings' centres.
    street_orientation_deg : float
        Angle between street and direct path, 0..90.
    default_roof_height_m : float
        Where no building is near, or no building heights are given.
    metropolitan : bool
        Metropolitan centre, or medium-sized city and suburbs.
    shadowing_db, shadowing_correlation_m, site_share : float
        Random clutter that stands for detail in the levels: deviation, correlation length, and the
        share of its variance that is common to the sectors of a site. A prediction that is used for
        positioning should have none.
    """

    model: ModelName = "cost231_walfisch_ikegami"
    line_of_sight: LineOfSight = "buildings"
    mobile_height_m: float = 1.5
    environment: Environment = "city"
    path_loss_exponent: float = 3.0
    reference_distance_m: float = 1.0
    reference_loss_db: float | None = None
    street_width_m: float = 20.0
    building_separation_m: float = 40.0
    street_orientation_deg: float = 90.0
    default_roof_height_m: float = 12.0
    metropolitan: bool = False
    shadowing_db: float = 0.0
    shadowing_correlation_m: float = 50.0
    site_share: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        faults = Faults()
        choices = {"model": ModelName, "line_of_sight": LineOfSight, "environment": Environment}
        for name, allowed in choices.items():
            if getattr(self, name) not in get_args(allowed):
                expected = ", ".join(get_args(allowed))
                faults.add(f"prediction, {name}", expected, repr(getattr(self, name)))
        if self.line_of_sight == "probability" and not self.model.startswith("tr38901"):
            expected = "buildings, as only tr38901_uma and tr38901_umi have a probability"
            faults.add("prediction, line_of_sight", expected, "probability")
        lengths = ["mobile_height_m", "street_width_m", "building_separation_m"]
        lengths += ["default_roof_height_m", "reference_distance_m"]
        limits: dict[str, Range] = dict.fromkeys(lengths, (1e-3, 1e4))
        limits["path_loss_exponent"] = 0.1, 20
        if self.reference_loss_db is not None:
            limits["reference_loss_db"] = 0, 300
        limits |= {"street_orientation_deg": (0, 90), "shadowing_db": (0, 50)}
        limits |= {"shadowing_correlation_m": (0, 1e5), "site_share": (0, 1), "seed": (0, np.inf)}
        _check(self, "prediction", limits, faults)
        faults.raise_if_any(ConfigError)


@dataclass(frozen=True)
class GroundTruthErrors:
    """How the simulated ground truth differs from its prediction.

    Parameters
    ----------
    level_error_db, correlation_m : float
        Deviation and correlation length of a shadowing field independent of the prediction's.
    site_share : float
        Share of that field's variance common to the sectors of a site, 0..1.
    eirp_error_db, azimuth_error_deg, slope_error : float
        Each cell's EIRP, azimuth and path-loss slope are off by uniform draws within ± these; the
        last is a fraction.
    clutter : {"own", "shared"}
        Whether the ground truth's random clutter is drawn anew, with the same deviation, or is
        that of the prediction.
    local_share, local_correlation_m : float
        Share of the shadowing's variance that has another, shorter correlation length.
    model : str or None
        The ground truth's propagation model; None for the prediction's.
    street_width_m, building_separation_m, default_roof_height_m : float or None
        Likewise, of the ground truth.
    roof_error : float
        Heights of buildings are off by a factor, the same for neighbours, whose logarithm is
        normal with this deviation.
    offset_db : float
        Added to all levels: the mean by which another propagation model differs, which drive tests
        would have taken out of the prediction.
    """

    level_error_db: float = 7.0
    correlation_m: float = 50.0
    site_share: float = 0.5
    eirp_error_db: float = 2.0
    azimuth_error_deg: float = 5.0
    slope_error: float = 0.05
    seed: int = 0
    clutter: Clutter = "own"
    local_share: float = 0.0
    local_correlation_m: float = 20.0
    model: ModelName | None = None
    street_width_m: float | None = None
    building_separation_m: float | None = None
    default_roof_height_m: float | None = None
    roof_error: float = 0.0
    offset_db: float = 0.0

    def __post_init__(self) -> None:
        faults = Faults()
        limits: dict[str, Range] = {"level_error_db": (0, 50), "eirp_error_db": (0, 50)}
        limits |= {"correlation_m": (0, 1e5), "local_correlation_m": (0, 1e5)}
        limits |= dict.fromkeys(("site_share", "local_share", "slope_error", "roof_error"), (0, 1))
        limits |= {"azimuth_error_deg": (0, 180), "offset_db": (-50, 50), "seed": (0, np.inf)}
        _check(self, "ground_truth", limits, faults)
        if self.clutter not in get_args(Clutter):
            faults.add("ground_truth, clutter", "own or shared", repr(self.clutter))
        faults.raise_if_any(ConfigError)

    def truth_of(self, prediction: PredictionModel) -> PredictionModel:
        """Return the ground truth's propagation model, for that of a prediction."""
        names = ("model", "street_width_m", "building_separation_m", "default_roof_height_m")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return replace(prediction, **given)


def _check(owner: Any, section: str, limits: Mapping[str, Range], faults: Faults) -> None:
    for name, (low, high) in limits.items():
        value = getattr(owner, name)
        if not low <= value <= high:
            hint = "per cent given for a fraction" if high == 1 and 1 < value <= 100 else ""
            expected = f"a number ≥ {low:g}" if high == np.inf else f"{low:g}..{high:g}"
            faults.add(f"{section}, {name}", expected, value, hint)


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
    distance_m : array_like
        Horizontal distance.
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
            reference = model.reference_distance_m, model.reference_loss_db
            return log_distance_db(distance_m, frequency_mhz, model.path_loss_exponent, *reference)
        case "okumura_hata":
            return okumura_hata_db(
                distance_m, frequency_mhz, base_height_m, mobile_m, model.environment
            )
        case "cost231_hata":
            return cost231_hata_db(distance_m, frequency_mhz, base_height_m, mobile_m, city)
        case "cost231_walfisch_ikegami":
            place = distance_m, frequency_mhz, base_height_m, mobile_m, roof_height_m
            streets = (model.street_width_m, model.building_separation_m)
            seen = np.asarray(sight) > 0.5
            return cost231_walfisch_ikegami_db(
                *place, *streets, model.street_orientation_deg, city, seen
            )
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
    """Return remarks on the values that lie outside the range a model was published for.

    ``nearest_distance_m`` and ``longest_distance_m`` limit the distances at which it is used.

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
    remarks = [
        f"{name} {values[name]:g} is "
        + (f"outside {low:g}..{high:g}" if low < high else f"not {low:g}")
        for name, (low, high) in published.items()
        if not low <= values[name] <= high
    ]
    if nearest_distance_m is not None and "distance_m" in published:
        low, high = published["distance_m"]
        if nearest_distance_m < low <= longest_distance_m:
            remarks.append(
                f"distance_m from {nearest_distance_m:g} on is outside {low:g}..{high:g}"
            )
    return tuple(remarks)
