"""The parameters of a prediction, and of the errors that reality adds to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from mapfilter.errors import ConfigError, Faults
from mapfilter.radio.pathloss_hata import Environment

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


@dataclass(frozen=True)
class PredictionModel:
    """How levels are predicted.

    Parameters
    ----------
    model : str
        One of :data:`ModelName`.
    line_of_sight : {"buildings", "probability"}
        Who sees an antenna: the raster of building heights tells, or the path losses with and
        without line of sight are averaged by their probability (TR 38.901 only).
    mobile_height_m : float
        Height of the phone above ground.
    environment : {"large_city", "city", "suburban", "open"}
        Of Okumura-Hata.
    path_loss_exponent, reference_distance_m, reference_loss_db : float
        Of log-distance; the loss at the reference distance is that of free space when it is None.
    street_width_m, building_separation_m : float
        Mean width of the streets, and mean distance between the buildings' centres.
    street_orientation_deg : float
        Angle between street and direct path, 0..90; 90 where nothing is known.
    default_roof_height_m : float
        Where no building is near, or no building heights are given.
    metropolitan : bool
        Metropolitan centre, or medium-sized city and suburbs.
    shadowing_db, shadowing_correlation_m, site_share : float
        Random clutter that stands for detail in the levels: deviation, correlation length, and the
        share of its variance that is common to the sectors of a site. A prediction that is used for
        positioning should have none: what is drawn at random is nowhere in the world.
    seed : int

    Raises
    ------
    ConfigError
        With every fault.
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
            expected = "buildings, as only tr38901_uma and tr38901_umi tell a probability"
            faults.add("prediction, line_of_sight", expected, "probability")
        positive = ["mobile_height_m", "street_width_m", "building_separation_m"]
        positive += ["default_roof_height_m", "reference_distance_m"]
        _check(self, "prediction", positive, 1e-3, 1e4, faults)
        _check(self, "prediction", ["path_loss_exponent"], 0.1, 20, faults)
        if self.reference_loss_db is not None:
            _check(self, "prediction", ["reference_loss_db"], 0, 300, faults)
        _check(self, "prediction", ["street_orientation_deg"], 0, 90, faults)
        _check(self, "prediction", ["shadowing_db"], 0, 50, faults)
        _check(self, "prediction", ["shadowing_correlation_m"], 0, 1e5, faults)
        _check(self, "prediction", ["site_share"], 0, 1, faults)
        _check(self, "prediction", ["seed"], 0, np.inf, faults)
        faults.raise_if_any(ConfigError)


@dataclass(frozen=True)
class RealityErrors:
    """How the simulated ground truth differs from its prediction.

    Parameters
    ----------
    level_error_db, correlation_m : float
        Deviation and correlation length of a shadowing field of its own.
    site_share : float
        Share of that field's variance common to the sectors of a site, 0..1.
    eirp_error_db, azimuth_error_deg, slope_error : float
        Each cell's EIRP, azimuth and path-loss slope are off by uniform draws within ± these; the
        last is a fraction.
    seed : int
    clutter : {"own", "shared"}
        Whether the prediction's random clutter is drawn anew, with the same deviation, or is the
        ground truth's too, as if the prediction had known it.
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

    Raises
    ------
    ConfigError
        With every fault.
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
        _check(self, "reality", ["level_error_db", "eirp_error_db"], 0, 50, faults)
        _check(self, "reality", ["correlation_m", "local_correlation_m"], 0, 1e5, faults)
        _check(self, "reality", ["azimuth_error_deg"], 0, 180, faults)
        _check(self, "reality", ["site_share", "local_share", "slope_error"], 0, 1, faults)
        _check(self, "reality", ["roof_error"], 0, 1, faults)
        _check(self, "reality", ["offset_db"], -50, 50, faults)
        _check(self, "reality", ["seed"], 0, np.inf, faults)
        if self.clutter not in get_args(Clutter):
            faults.add("reality, clutter", "own or shared", repr(self.clutter))
        faults.raise_if_any(ConfigError)

    def truth_of(self, prediction: PredictionModel) -> PredictionModel:
        """Return the ground truth's propagation model, for that of a prediction.

        Raises
        ------
        ConfigError
            What differs from the prediction is out of range.
        """
        names = ("model", "street_width_m", "building_separation_m", "default_roof_height_m")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return replace(prediction, **given)


def _check(
    owner: Any, section: str, names: Sequence[str], low: float, high: float, faults: Faults
) -> None:
    for name in names:
        value = getattr(owner, name)
        if not low <= value <= high:
            hint = "per cent given for a fraction" if high == 1 and 1 < value <= 100 else ""
            expected = f"a number ≥ {low:g}" if high == np.inf else f"{low:g}..{high:g}"
            faults.add(f"{section}, {name}", expected, value, hint)
