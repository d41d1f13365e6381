"""Errors of dead reckoning by a log: those that it states, and those that its rows show."""

from __future__ import annotations

from math import hypot

import numpy as np

from mapfilter._types import Floats
from mapfilter.models.street_motion import MotionErrors
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.sensors.pace import WALKERS_MPS
from mapfilter.tracks.checks.speeds import FASTEST_MPS
from mapfilter.tracks.checks.turn_drift import turn_drift_radps
from mapfilter.tracks.checks.turn_noise import turns_at_standstill
from mapfilter.tracks.log import TrackLog

_LEAST_STEP_SD_M, _LEAST_HEADING_SD_DEG = 0.05, 0.5
"""Least errors that a filter assumes: particles need some spread."""
_STANDING_MPS = 0.2
_LONG_ROW_M = 15.0
"""Rows that are usually longer are no steps, whatever their speed."""


def stated_errors(log: TrackLog) -> dict[str, float]:
    """Return the errors of dead reckoning that a log states, by the names of a filter's options.

    The random walk of the heading is by distance there, at the log's median speed.
    """
    imu = log.imu
    if imu is None:
        return {}
    found = {"step_sd_m": max(imu.sigma_trans_m, _LEAST_STEP_SD_M), "scale": imu.scale}
    walk_deg = imu.drift_deg_per_sqrt_s
    if imu.turns == "headings":
        found["heading_sd_deg"] = max(imu.sigma_orient_deg, _LEAST_HEADING_SD_DEG)
        found["bias_sd_deg"] = imu.bias_sd_deg
    else:
        walk_deg = hypot(walk_deg, imu.gyro_noise_deg_per_sqrt_s)
        found["turn_rate_sd_deg_per_s"] = imu.gyro_bias_deg_per_s
    usual_mps = _usual_mps(log)
    if walk_deg > 0 and usual_mps > 0:
        found["drift_deg_per_sqrt_m"] = walk_deg / usual_mps**0.5
        if imu.turns == "gyro":
            found["turn_drift_deg_per_sqrt_m"] = found["drift_deg_per_sqrt_m"]
    return found


def standing_errors(log: TrackLog) -> dict[str, float]:
    """Return the errors of a vehicle's turns as they are at standstill, where the log states none.

    The bias there is what the rate is assumed to be off by at least; it is not taken out.
    """
    usual_mps = _usual_mps(log)
    has_headings = bool(log.motion["heading_rad"].notna().any())
    if log.imu is not None or has_headings or usual_mps <= WALKERS_MPS:
        return {}
    found = turns_at_standstill(log.motion)
    if found is None:
        return {}
    rate_deg_per_s = abs(float(np.degrees(found.bias_radps)))
    walk_deg = float(np.degrees(found.walk_rad_per_sqrt_s))
    return {
        "turn_drift_deg_per_sqrt_m": walk_deg / usual_mps**0.5,
        "turn_rate_sd_deg_per_s": max(rate_deg_per_s, KalmanOptions().turn_rate_sd_deg_per_s),
    }


def turn_drift_deg_per_s(log: TrackLog) -> float:
    """Return how fast turns drift beside the fixes, where headings are their sums; else 0."""
    if log.motion["heading_rad"].notna().any():
        return 0.0
    return abs(float(np.degrees(turn_drift_radps(log.motion, log.gnss))))


def has_long_rows(log: TrackLog) -> bool:
    """Return whether rows of motion are longer than the map filter's typical step, and no steps.

    They are a vehicle's by what the log states, or by a speed that is no walker's, or are longer
    than a walker's rows, which count as steps.
    """
    row_m = _usual_row_m(log)
    driven = bool(log.vehicle) or _usual_mps(log) > FASTEST_MPS
    return row_m > (MotionErrors().typical_step_m if driven else _LONG_ROW_M)


def by_typical_step(row_sd_m: float, log: TrackLog) -> float:
    """Return the deviation of the map filter's typical step, by that of longer rows.

    The filter's white error grows with the root of the distance from that of a typical step; a row
    of a vehicle may be 50 m long.
    """
    share = float((MotionErrors().typical_step_m / _usual_row_m(log)) ** 0.5)
    return max(share * row_sd_m, _LEAST_STEP_SD_M)


def _usual_row_m(log: TrackLog) -> float:
    """Return the median length of rows that move; 0 without any."""
    step_m = log.motion["step_m"].abs().to_numpy()
    return _median(step_m[step_m > _LEAST_STEP_SD_M])


def _usual_mps(log: TrackLog) -> float:
    """Return the median speed of rows that move; 0 without any."""
    step_m, time_s = log.motion["step_m"].to_numpy(), log.motion["time_s"].to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        speed_mps = np.abs(step_m[1:]) / np.diff(time_s)
    return _median(speed_mps[np.isfinite(speed_mps) & (speed_mps > _STANDING_MPS)])


def _median(values: Floats) -> float:
    return float(np.median(values)) if values.size else 0.0
