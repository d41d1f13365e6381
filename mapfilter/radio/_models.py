"""The parameters of a prediction, and of the errors that reality adds to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from mapfilter.errors import ConfigError, Faults


@dataclass(frozen=True)
class PredictionModel:
    """How levels are predicted.

    Parameters
    ----------
    model : {"cost231_walfisch_ikegami", "cost231_hata"}
    mobile_height_m : float
        Height of the phone above ground.
    street_width_m, building_separation_m : float
        Mean width of the streets, and mean distance between the buildings' centres.
    street_orientation_deg : float
        Angle between street and direct path, 0..90; 90 where nothing is known.
    default_roof_height_m : float
        Where no building is near, or no building heights are given.
    metropolitan : bool
        Metropolitan centre, or medium-sized city and suburbs.
    shadowing_db, shadowing_correlation_m, site_share : float
        The clutter detail that a planning tool's prediction has: deviation, correlation length, and
        the share of its variance that is common to the sectors of a site.
    seed : int

    Raises
    ------
    ConfigError
        With every fault.
    """

    model: Literal["cost231_walfisch_ikegami", "cost231_hata"] = "cost231_walfisch_ikegami"
    mobile_height_m: float = 1.5
    street_width_m: float = 20.0
    building_separation_m: float = 40.0
    street_orientation_deg: float = 90.0
    default_roof_height_m: float = 15.0
    metropolitan: bool = False
    shadowing_db: float = 6.0
    shadowing_correlation_m: float = 50.0
    site_share: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        faults = Faults()
        if self.model not in ("cost231_walfisch_ikegami", "cost231_hata"):
            expected = "cost231_walfisch_ikegami or cost231_hata"
            faults.add("prediction, model", expected, repr(self.model))
        positive = ("mobile_height_m", "street_width_m", "building_separation_m")
        _check(self, "prediction", [*positive, "default_roof_height_m"], 1e-3, 1e4, faults)
        _check(self, "prediction", ["street_orientation_deg"], 0, 90, faults)
        _check(self, "prediction", ["shadowing_db"], 0, 50, faults)
        _check(self, "prediction", ["shadowing_correlation_m"], 0, 1e5, faults)
        _check(self, "prediction", ["site_share"], 0, 1, faults)
        _check(self, "prediction", ["seed"], 0, np.inf, faults)
        faults.raise_if_any(ConfigError)


@dataclass(frozen=True)
class RealityErrors:
    """How reality differs from its prediction.

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

    def __post_init__(self) -> None:
        faults = Faults()
        _check(self, "reality", ["level_error_db", "eirp_error_db"], 0, 50, faults)
        _check(self, "reality", ["correlation_m"], 0, 1e5, faults)
        _check(self, "reality", ["azimuth_error_deg"], 0, 180, faults)
        _check(self, "reality", ["site_share", "slope_error"], 0, 1, faults)
        _check(self, "reality", ["seed"], 0, np.inf, faults)
        faults.raise_if_any(ConfigError)


def _check(
    owner: Any, section: str, names: Sequence[str], low: float, high: float, faults: Faults
) -> None:
    for name in names:
        value = getattr(owner, name)
        if not low <= value <= high:
            hint = "per cent given for a fraction" if high == 1 and 1 < value <= 100 else ""
            expected = f"a number ≥ {low:g}" if high == np.inf else f"{low:g}..{high:g}"
            faults.add(f"{section}, {name}", expected, value, hint)
