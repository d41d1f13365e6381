"""The errors of a walker's dead reckoning, as its recording shows them, and notes on it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._words import number_of
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.pdr.gyroscope import Gyroscope
from mapfilter.tracks.pdr.heading import YawOffset
from mapfilter.tracks.pdr.height import Climb

STEP_SHARE = 0.1
SCALE = 0.1
_SCALE_WANDER, _SCALE_WANDER_S = 0.06, 15.0
_COMPASS_BIAS_RAD = np.radians(5.0)
_NO_GYROSCOPE_CORRELATION_S = 6.0
_LEAST_HEADING_DEG = 1.0


def walk_noise(
    rows: pd.DataFrame,
    offset: YawOffset,
    direction_sd_rad: float,
    sway_rad: float,
    *,
    compass: bool,
    gyroscope: Gyroscope | None,
) -> ImuNoise:
    """Return the errors of the motion, as far as the recording shows them.

    ``direction_sd_rad`` is that of the direction of walking, seen from the phone, and of the
    magnetic declination; ``sway_rad`` the white noise of the course from step to step. The errors
    of step lengths, 10 % each, 10 % from walker to walker and 6 % over 15 s, are those of the
    literature and of the walks in ``docs/howto/raw-imu``.
    """
    stepped = rows[rows["step_m"] > 0]
    between_s = np.diff(stepped["time_s"])
    period_s = float(np.median(between_s)) if between_s.size else 0.5
    lasting = np.sqrt(np.mean(offset.sd_rad**2) + direction_sd_rad**2 + _COMPASS_BIAS_RAD**2)
    white = max(float(np.degrees(sway_rad)), _LEAST_HEADING_DEG)
    walk = 0.0 if gyroscope is None else float(np.degrees(gyroscope.walk_rad_per_sqrt_s))
    if gyroscope is None:
        white = float(np.degrees(offset.spread_rad))
    return ImuNoise(
        period_s=period_s,
        sigma_trans_m=STEP_SHARE * float(stepped["step_m"].mean()),
        sigma_orient_deg=min(white, 180.0),
        bias_sd_deg=min(float(np.degrees(lasting)), 180.0) if compass else 0.0,
        drift_deg_per_sqrt_s=walk if compass else 0.0,
        scale=SCALE,
        heading_correlation_s=_NO_GYROSCOPE_CORRELATION_S if gyroscope is None else 0.0,
        step_scale_wander=_SCALE_WANDER,
        step_scale_correlation_s=_SCALE_WANDER_S,
        turns="headings" if compass else "gyro",
        gyro_noise_deg_per_sqrt_s=0.0 if compass else walk,
        gyro_bias_deg_per_s=0.0 if compass else float(np.degrees(offset.rate_sd_radps)),
    )


def walk_notes(
    rows: pd.DataFrame, gaps: int, found: tuple[Climb, ...], *, compass: bool
) -> list[str]:
    """Return notes on what was found."""
    stepped = rows["step_m"] > 0
    words = [f"motion: {int(stepped.sum())} steps, {rows['step_m'].sum():.0f} m"]
    if compass:
        share = float(rows.loc[stepped, "disturbed"].mean())
        if share > 0.1:
            words.append(f"compass disturbed for {share:.0%} of the steps, gyroscope used there")
    else:
        words.append(
            "no compass (magnetometer): turns only, the heading at the start is unknown until "
            "positions or a map tell it"
        )
    if gaps:
        words.append(f"{number_of(gaps, 'gap')} of the sensors: motion unknown there")
    for climb in found:
        words.append(f"{climb.kind}: {climb.rise_m:+.1f} m in {climb.end_s - climb.begin_s:.0f} s")
    return words
