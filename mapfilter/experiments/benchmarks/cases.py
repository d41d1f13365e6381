"""The cases of the global-positioning benchmark: what is measured, and how badly."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import radians

from mapfilter.models.street_motion import MotionErrors
from mapfilter.simulation.imu import ImuErrors

_LEAST_HEADING_SD_DEG = 3.0
_LEAST_BIAS_DEG = 1.5
_LEAST_DRIFT_DEG = 0.05
_LEAST_SCALE = 0.015
_WALKING_MPS = 1.4


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table.

    Parameters
    ----------
    name : str
    imu : ImuErrors
        Of the dead reckoning.
    levels : bool
        Whether the phone tells levels and neighbours, or only its serving cell.
    compass : bool
        Whether it tells headings, or only turns.
    missing_ways : float
        Share of the ways that the filter's map lacks.
    level_error_db : float
        Of the prediction, over 50 m.
    smooth : bool
        Whether the whole track is smoothed and scored from its start.
    recovery_within_m : float
        For journeys with an unmeasured displacement: within how many metres it must be found
        again; 0 for those without.
    satellites : int or None
        How many of the satellites that are seen the phone receives; None without a receiver.
    spoofed : bool
        Whether a spoofer puts it elsewhere for a while.
    """

    name: str
    imu: ImuErrors = field(default_factory=ImuErrors)
    levels: bool = True
    compass: bool = True
    missing_ways: float = 0.0
    level_error_db: float = 7.0
    smooth: bool = False
    recovery_within_m: float = 0.0
    satellites: int | None = None
    spoofed: bool = False

    @property
    def told(self) -> MotionErrors:
        """What the filter is told of the dead reckoning: its data sheet, with a least noise."""
        imu = self.imu
        drift = imu.heading_drift_rad_per_sqrt_s / _WALKING_MPS**0.5
        return MotionErrors(
            step_sd_m=max(imu.sigma_trans_m, 0.1),
            heading_sd_rad=max(imu.sigma_orient_rad, radians(_LEAST_HEADING_SD_DEG)),
            bias_sd_rad=max(imu.heading_bias_sd_rad, radians(_LEAST_BIAS_DEG)),
            bias_drift_rad_per_sqrt_m=max(drift, radians(_LEAST_DRIFT_DEG)),
            scale_sd=max(imu.step_scale_sd, _LEAST_SCALE),
        )


def _noise(
    orient_deg: float, bias_deg: float = 0.0, drift_deg: float = 0.0, scale: float = 0.0
) -> ImuErrors:
    return ImuErrors(0.2, radians(orient_deg), radians(bias_deg), radians(drift_deg), scale)


_PLAIN, _BIAS_10, _BIAS_20 = _noise(6.0), _noise(6.0, 10.0, 0.2, 0.05), _noise(6.0, 20.0, 0.4, 0.1)

CASES = {
    case.name: case
    for case in (
        *(Case(f"levels-{deg}", _noise(deg)) for deg in (3, 6, 10, 20)),
        *(Case(f"cell-{deg}", _noise(deg), levels=False) for deg in (3, 6, 10, 20)),
        Case("levels-bias10", _BIAS_10),
        Case("levels-bias20", _BIAS_20),
        Case("levels-nocompass", _PLAIN, compass=False),
        Case("cell-bias10", _BIAS_10, levels=False),
        Case("levels-missing10", _PLAIN, missing_ways=0.1),
        Case("levels-error10", _PLAIN, level_error_db=10.0),
        Case("smooth-6", _PLAIN, smooth=True),
        Case("smooth-bias10", _BIAS_10, smooth=True),
        Case("recovery-levels", _PLAIN, recovery_within_m=300.0),
        Case("recovery-cell", _PLAIN, levels=False, recovery_within_m=700.0),
        *(Case(f"satellites-{count}", _BIAS_10, satellites=count) for count in range(5)),
        Case("spoofed", _BIAS_10, satellites=4, spoofed=True),
    )
}
"""All cases by name, in the order of the table."""

USUAL = tuple(name for name, case in CASES.items() if case.satellites is None)
"""Those that are run unless others are asked for."""
