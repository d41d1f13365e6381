"""Parameters of a prediction and of its ground truth, and the path loss of the chosen model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults
from mapfilter.options import Below1, Options, Seed, Share
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
_Length = Annotated[float, Ge(1e-3), Le(1e4)]
_Correlation = Annotated[float, Gt(0), Le(1e5)]
_Deviation = Annotated[float, Ge(0), Le(50)]


@dataclass(frozen=True, slots=True)
class PredictionModel(Options):
    """How levels are predicted.

    Random clutter (``shadowing_db``) stands for detail in the levels. A prediction that is used
    for positioning should have none: what is drawn at random is not in the real levels.

    Parameters
    ----------
    model : str
        Propagation model, one of :data:`ModelName`.
    line_of_sight : {"buildings", "probability"}
        Whether the raster of building heights decides on line of sight, or path losses with and
        without it are averaged by their probability (TR 38.901 only).
    mobile_height_m : float
        Height of the phone above ground.
    environment : {"large_city", "city", "suburban", "open"}
        Environment of Okumura-Hata.
    path_loss_exponent : float
        Exponent of the log-distance model.
    reference_distance_m : float
        Reference distance of the log-distance model.
    reference_loss_db : float or None
        Loss at the reference distance; by default that of free space.
    street_width_m : float
        Mean width of the streets.
    building_separation_m : float
        Mean distance between the centres of buildings.
    street_orientation_deg : float
        Angle between street and direct path; 90 where it is unknown.
    default_roof_height_m : float
        Roof height where no building is near, or no building heights are given.
    metropolitan : bool
        Metropolitan centre, in place of medium-sized city and suburbs.
    shadowing_db : float
        Standard deviation of the random clutter.
    shadowing_correlation_m : float
        Correlation length of the random clutter.
    site_share : float
        Share of its variance that is common to the sectors of a site.
    seed : int
        Seed of the random clutter.

    Raises
    ------
    ConfigError
        With every fault.
    """

    model: ModelName = "cost231_walfisch_ikegami"
    line_of_sight: LineOfSight = "buildings"
    mobile_height_m: _Length = 1.5
    environment: Environment = "city"
    path_loss_exponent: Annotated[float, Ge(0.1), Le(20)] = 3.0
    reference_distance_m: _Length = 1.0
    reference_loss_db: Annotated[float, Ge(0), Le(300)] | None = None
    street_width_m: _Length = 20.0
    building_separation_m: _Length = 40.0
    street_orientation_deg: Annotated[float, Ge(0), Le(90)] = 90.0
    default_roof_height_m: _Length = 12.0
    metropolitan: bool = False
    shadowing_db: _Deviation = 0.0
    shadowing_correlation_m: _Correlation = 50.0
    site_share: Share = 0.5
    seed: Seed = 0

    def check(self, faults: Faults) -> None:
        """Check that the model defines a probability of line of sight where that is configured."""
        if self.line_of_sight == "probability" and not str(self.model).startswith("tr38901"):
            expected = "buildings, as only tr38901_uma and tr38901_umi have a probability"
            faults.add("prediction, line_of_sight", expected, "probability")


@dataclass(frozen=True, slots=True)
class GroundTruthErrors(Options):
    """How the simulated ground truth differs from its prediction.

    Parameters
    ----------
    level_error_db : float
        Standard deviation of a shadowing field that is not in the prediction.
    correlation_m : float
        Correlation length of that field.
    site_share : float
        Share of its variance that is common to the sectors of a site.
    eirp_error_db : float
        Each cell's EIRP is off by a uniform draw within ± this.
    azimuth_error_deg : float
        Each cell's azimuth is off by a uniform draw within ± this.
    slope_error : float
        Each cell's path-loss slope is off by a uniform draw within ± this fraction.
    seed : int
        Seed of all these draws.
    clutter : {"own", "shared"}
        Whether the prediction's random clutter is drawn anew, with the same deviation, or is the
        ground truth's too, as if the prediction had known it.
    local_share : float
        Share of the shadowing's variance that has ``local_correlation_m``.
    local_correlation_m : float
        The shorter correlation length.
    model : str or None
        Propagation model of the ground truth; by default that of the prediction.
    street_width_m : float or None
        Street width of the ground truth; by default that of the prediction.
    building_separation_m : float or None
        Building separation of the ground truth; by default that of the prediction.
    default_roof_height_m : float or None
        Default roof height of the ground truth; by default that of the prediction.
    roof_error : float
        Heights of buildings are off by a factor, the same for neighbours, whose logarithm is
        normal with this standard deviation.
    offset_db : float
        Added to all levels: the mean by which another propagation model differs, which drive tests
        would have taken out of the prediction.
    """

    level_error_db: _Deviation = 7.0
    correlation_m: _Correlation = 50.0
    site_share: Share = 0.5
    eirp_error_db: _Deviation = 2.0
    azimuth_error_deg: Annotated[float, Ge(0), Le(180)] = 5.0
    slope_error: Below1 = 0.05
    seed: Seed = 0
    clutter: Clutter = "own"
    local_share: Share = 0.0
    local_correlation_m: _Correlation = 20.0
    model: ModelName | None = None
    street_width_m: _Length | None = None
    building_separation_m: _Length | None = None
    default_roof_height_m: _Length | None = None
    roof_error: Share = 0.0
    offset_db: Annotated[float, Ge(-50), Le(50)] = 0.0

    def truth_of(self, prediction: PredictionModel) -> PredictionModel:
        """Return the ground truth's propagation model, for that of a prediction."""
        names = ("model", "street_width_m", "building_separation_m", "default_roof_height_m")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return replace(prediction, **given)


_SCENARIOS: Mapping[str, Scenario] = {"tr38901_uma": "uma", "tr38901_umi": "umi"}


def path_loss_db(
    model: PredictionModel,
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    roof_height_m: ArrayLike,
    sight: ArrayLike,
) -> Floats:
    """Return the path loss in dB by the model of a prediction, at horizontal distances.

    Parameters
    ----------
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
    """Return whether a model loses less where the antenna is seen."""
    return model.model == "cost231_walfisch_ikegami" or model.model in _SCENARIOS


def shortest_distance_m(model: PredictionModel) -> float:
    """Return the distance below which distances count as this one."""
    if model.model in _SCENARIOS:
        return SHORTEST_TR38901_DISTANCE_M
    special = {"friis": SHORTEST_FREE_DISTANCE_M, "log_distance": model.reference_distance_m}
    return special.get(model.model, SHORTEST_DISTANCE_M)
