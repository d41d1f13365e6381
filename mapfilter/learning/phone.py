"""Noise of the phone and of its dead reckoning, from tracks and what was recorded along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.learning.tracks import JourneyTrack
from mapfilter.tracks.log import TrackLog

_WINDOW_M = 30.0
_KNOWN_M = 30.0
_LEAST = 5


@dataclass(frozen=True)
class PhoneNoise:
    """Errors of a phone over some journeys; NaN where too little was recorded.

    Parameters
    ----------
    journeys : int
        That were used.
    level_sd_db : float
        Deviation of levels from the prediction, offsets and faults taken out.
    phone_offset_sd_db : float
        Deviation of the phone's offset from journey to journey.
    heading_bias_sd_deg : float
        Deviation of a journey's constant heading error.
    heading_sd_deg : float
        Deviation of the heading over 30 m, that error taken out.
    step_scale : float
        Length of true steps over recorded ones, median of the journeys.
    step_scale_sd : float
        Its deviation from journey to journey.
    """

    journeys: int
    level_sd_db: float
    phone_offset_sd_db: float
    heading_bias_sd_deg: float
    heading_sd_deg: float
    step_scale: float
    step_scale_sd: float


def phone_noise(
    journeys: Sequence[tuple[TrackLog, JourneyTrack]], phone_db: Floats, sd_db: float
) -> PhoneNoise | None:
    """Return the noise over journeys that were located right; None without any.

    Parameters
    ----------
    phone_db : (journeys,) array
        Offset of the phone on each journey.
    sd_db : float
        Deviation of levels.
    """
    if not journeys:
        return None
    bias, spread, scale = [], [], []
    for log, track in journeys:
        turned, ratio = windows(log, track)
        if turned.size >= _LEAST:
            middle = float(np.angle(np.mean(np.exp(1j * turned))))
            bias.append(middle)
            spread.append(float(np.sqrt(np.mean(wrap_rad(turned - middle) ** 2))))
            scale.append(float(np.median(ratio)))
    several = len(bias) > 1
    return PhoneNoise(
        len(journeys),
        sd_db,
        float(np.std(phone_db)) if phone_db.size > 1 else np.nan,
        float(np.degrees(np.sqrt(np.mean(np.square(bias))))) if several else np.nan,
        float(np.degrees(np.sqrt(np.mean(np.square(spread))))) if spread else np.nan,
        float(np.median(scale)) if scale else np.nan,
        float(np.std(scale)) if several else np.nan,
    )


def windows(log: TrackLog, track: JourneyTrack) -> tuple[Floats, Floats]:
    """Return heading error and length ratio of stretches of 30 m: recorded against located.

    Returns
    -------
    turned_rad : (n,) array
        Recorded direction minus that of the track, for stretches whose ends are known within 30 m.
    ratio : (n,) array
        Length by the track over length as recorded.
    """
    motion = log.motion[log.motion["step_m"].notna() & log.motion["heading_rad"].notna()]
    if len(motion) < 2:
        return np.empty(0), np.empty(0)
    time_s = motion["time_s"].to_numpy()
    step, heading = motion["step_m"].to_numpy(), motion["heading_rad"].to_numpy()
    east, north = np.cumsum(step * np.cos(heading)), np.cumsum(step * np.sin(heading))
    walked = np.cumsum(np.abs(step))
    marks = np.searchsorted(walked, np.arange(0.0, walked[-1], _WINDOW_M))
    place_east, place_north, radius = track.at(time_s[marks])
    known = radius[1:] + radius[:-1] <= 2 * _KNOWN_M
    right, up = np.diff(east[marks]), np.diff(north[marks])
    along, across = np.diff(place_east), np.diff(place_north)
    length, by_track = np.hypot(right, up), np.hypot(along, across)
    # Where one turns back within a stretch its direction says nothing.
    known &= (length > 0.6 * _WINDOW_M) & (by_track > 0.6 * _WINDOW_M)
    turned = wrap_rad(np.arctan2(up, right) - np.arctan2(across, along))
    return turned[known], (by_track / np.maximum(length, 1e-9))[known]
