"""The bias of a vehicle's gyroscope, learnt from its yaw rates while the vehicle stands."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.pdr.gyroscope import MOST_BIAS_RADPS, WALK_RAD_PER_SQRT_S, shown_bias
from mapfilter.tracks.pdr.heading import Compass, YawOffset, yaw_offset
from mapfilter.tracks.pdr.odometry_rows import usual_s

_SETTLING_S = 0.4
_FEWEST_STANDING, _LEAST_STANDING_S = 5, 1.0
"""Rows at standstill that show a bias, and how long they last together: the scatter of fewer says
nothing of their error."""
_APART_RADPS, _DEVIATIONS = 0.05, 4.0
"""How far a rate at standstill may be from the usual one, also in deviations of its noise."""
_LEAST_RATE_SD_RADPS = 5e-4
_COURSE_BIAS_DEG = 2.0
_MOST_SPANS = 50_000
_UNSEEN_BIAS_DEG_PER_S = 0.05
"""Error of the bias that standing does not show: of 0.02 deg/s a count, and of warming up."""


@dataclass(frozen=True, eq=False)
class StandingBias:
    """What rows at standstill show of a vehicle's gyroscope, N rows.

    Parameters
    ----------
    yaw : YawOffset
        What has to be added to the yaw of the rates.
    walk_rad_per_sqrt_s : float
        Random walk of the yaw by the noise of the rates.
    stood : (N,) array of bool
        Rows at standstill.
    is_shown : bool
        Whether these are enough to show a bias.
    """

    yaw: YawOffset
    walk_rad_per_sqrt_s: float
    stood: Bools
    is_shown: bool

    def offset_at(self, time_s: Floats) -> Floats:
        """Return what has to be added to the yaw at times, rad."""
        return np.interp(time_s, self.yaw.time_s, self.yaw.offset_rad)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was learnt of the bias."""
        yaw, number = self.yaw, int(self.stood.sum())
        if not number:
            return ("yaw rate: the vehicle never stands, so that the bias could not be learnt",)
        some = number_of(number, "row")
        if not self.is_shown:
            needed = f"{_FEWEST_STANDING} rows and {_LEAST_STANDING_S:g} s"
            return (f"yaw rate: {some} at standstill, too few to learn the bias (of {needed})",)
        bias = f"{np.degrees(yaw.rate_radps):+.3f} ± {np.degrees(yaw.rate_sd_radps):.3f} deg/s"
        return (f"yaw rate: bias {bias}, of {some} at standstill",)

    def noise(self, of_steps: ImuNoise) -> ImuNoise:
        """Return the errors of motion, of which those of steps are given."""
        yaw, walk = self.yaw, float(np.degrees(self.walk_rad_per_sqrt_s))
        bias = float(np.hypot(np.degrees(yaw.rate_sd_radps), _UNSEEN_BIAS_DEG_PER_S))
        with_course = bool(yaw.sd_rad[0] < np.pi)
        lasting = float(np.degrees(np.sqrt(np.mean(yaw.sd_rad**2)))) if with_course else 0.0
        return replace(
            of_steps,
            sigma_orient_deg=1.0,
            bias_sd_deg=min(lasting + _COURSE_BIAS_DEG, 180.0) if with_course else 0.0,
            drift_deg_per_sqrt_s=walk if with_course else 0.0,
            turns="headings" if with_course else "gyro",
            gyro_noise_deg_per_sqrt_s=0.0 if with_course else walk,
            gyro_bias_deg_per_s=0.0 if with_course else bias,
        )


def standing_bias(
    time_s: Floats,
    rate_radps: Floats,
    slow: Bools,
    averaged_s: float,
    course_offset_rad: Floats | None = None,
) -> StandingBias:
    """Smooth the gyroscope's bias, and the offset between its yaw and the course.

    Parameters
    ----------
    time_s, rate_radps : (N,) array
        Yaw rates; NaN where missing.
    slow : (N,) array of bool
        Where the speed is that of a vehicle which stands.
    averaged_s : float
        Time that each rate is a mean over.
    course_offset_rad : (N,) array, optional
        What has to be added to the yaw for the course, counter-clockwise from east; NaN where there
        is none.
    """
    stood = _settled(time_s, slow) & np.isfinite(rate_radps)
    few = stood.sum() < _FEWEST_STANDING or stood.sum() * usual_s(time_s) < _LEAST_STANDING_S
    usable, spread = np.zeros_like(stood) if few else stood, 0.0
    # Seconds with rows only, and longer spans of a long recording, bound the smoother's steps.
    elapsed_s = time_s - time_s[0]
    span_s = max(1.0, float(np.ceil(len(np.unique(np.floor(elapsed_s))) / _MOST_SPANS)))
    number, span = np.unique(np.floor(elapsed_s / span_s), return_inverse=True)
    rates, sds, north = (np.full(len(number), np.nan) for _ in range(3))
    if usable.any():
        usual = float(np.median(rate_radps[usable]))
        spread = MAD_TO_SD * float(np.median(np.abs(rate_radps[usable] - usual)))
        near = np.abs(rate_radps - usual) < max(_APART_RADPS, _DEVIATIONS * spread)
        usable = usable & near & (abs(usual) < MOST_BIAS_RADPS)
    bias = 0.0
    if usable.any():
        bias = float(shown_bias(rate_radps[usable, None], spread)[0])
        still = pd.Series(rate_radps[usable]).groupby(span[usable]).agg(["median", "size"])
        rates[still.index] = still["median"]
        sds[still.index] = np.maximum(spread / np.sqrt(still["size"]), _LEAST_RATE_SD_RADPS)
    walk = float(np.hypot(WALK_RAD_PER_SQRT_S, spread * averaged_s**0.5))
    if course_offset_rad is not None:
        known = np.isfinite(course_offset_rad)
        north[span[known]] = np.pi / 2 - course_offset_rad[known]
    missing, none = np.isnan(north), np.full(len(number), np.nan)
    centre_s = time_s[0] + (number + 0.5) * span_s
    compass = Compass(centre_s, np.nan_to_num(north), none, none, missing)
    found = yaw_offset(
        compass,
        rates,
        sds,
        use_compass=not missing.all(),
        walk_rad_per_sqrt_s=walk,
        usual_radps=bias,
    )
    return StandingBias(found, walk, stood, not few)


def _settled(time_s: Floats, standing: Bools) -> Bools:
    """Return where a vehicle has stood for 0.4 s and still stands: its body has come to rest."""
    moving_s = np.where(standing, -np.inf, time_s)
    settled: Bools = standing & (time_s - np.maximum.accumulate(moving_s) > _SETTLING_S)
    settled[:-1] &= standing[1:]
    return settled
