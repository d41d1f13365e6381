"""Dead reckoning of vehicles whose headings are measured beside their speeds, as by a compass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.equal_times import joined_times
from mapfilter.tracks.joining.moved import motion_from_odometry
from mapfilter.tracks.pdr.gyroscope import sample_noise
from mapfilter.tracks.pdr.odometry_rows import gap_notes, speed_errors, usable_rows

_NEAR_S = 1.0
_LEAST_SD_DEG, _MOST_SD_DEG = 1.0, 90.0
_LASTING_DEG = 10.0
"""Lasting error of a compass among the iron of a vehicle; it is what filters assume of any."""


def has_headings(rows: pd.DataFrame) -> bool:
    """Return whether rows of odometry have headings."""
    return "heading_rad" in rows and bool(rows["heading_rad"].notna().any())


def reckon_headings(rows: pd.DataFrame) -> tuple[pd.DataFrame, ImuNoise, tuple[str, ...]]:
    """Return the motion of a vehicle with a speedometer and headings, and its errors.

    The heading of an interval is the mean of those of its ends. At rows without one it is taken
    from the rows around, at most a second away. Differences of headings have no bias to be learnt.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, rising; speed_mps, yaw_rate_radps (not used), speed_sd_mps, and heading_rad
        counter-clockwise from grid east; NaN where missing.

    Returns
    -------
    motion : pandas.DataFrame
        time_s, step_m, heading_rad, turn_rad (NaN).
    imu : ImuNoise
    notes : tuple of str

    Examples
    --------
    >>> rows = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "speed_mps": 8.0, "yaw_rate_radps": np.nan,
    ...     "speed_sd_mps": np.nan, "heading_rad": [3.1, 3.1, -3.1]})
    >>> motion, imu, notes = reckon_headings(rows)
    >>> motion["heading_rad"].abs().round(3).tolist(), imu.turns, notes
    ([3.1, 3.1, 3.142], 'headings', ())
    """
    rows = joined_times(rows)
    measured = rows.dropna(subset=["heading_rad"])
    rows, notes = usable_rows(rows.assign(yaw_rate_radps=np.nan))
    motion = motion_from_odometry(rows)
    time_s, step_m = (motion[name].to_numpy(np.float64) for name in ("time_s", "step_m"))
    known_s, known = (measured[name].to_numpy(np.float64) for name in ("time_s", "heading_rad"))
    heading = _middle(_headings_at(time_s, known_s, known))
    # Which way it went meanwhile is as little known as over a gap.
    blind = np.isnan(heading) & (np.abs(step_m) > 0)
    if blind.any():
        blind_s = float(np.diff(time_s, prepend=time_s[0])[blind].sum())
        notes += (f"odometry: no heading over {blind_s:.1f} s of driving: motion is not known",)
    scatter_deg = float(np.degrees(sample_noise(np.diff(np.unwrap(known), 2))))
    imu = replace(
        speed_errors(rows),
        sigma_orient_deg=float(np.clip(scatter_deg, _LEAST_SD_DEG, _MOST_SD_DEG)),
        bias_sd_deg=_LASTING_DEG,
    )
    speed = rows["speed_mps"].to_numpy(dtype=np.float64)
    notes += gap_notes(time_s, speed, np.full(time_s.size, np.nan))
    step_m = np.where(blind, np.nan, step_m)
    return motion.assign(step_m=step_m, heading_rad=heading, turn_rad=np.nan), imu, notes


def _headings_at(time_s: Floats, known_s: Floats, heading_rad: Floats) -> Floats:
    """Return headings at other times, NaN where none is known within a second."""
    after = np.searchsorted(known_s, time_s)
    near_s = np.minimum(
        np.abs(known_s[np.minimum(after, known_s.size - 1)] - time_s),
        np.abs(known_s[np.maximum(after - 1, 0)] - time_s),
    )
    found = np.interp(time_s, known_s, np.unwrap(heading_rad))
    return np.where(near_s <= _NEAR_S, found, np.nan)


def _middle(heading_rad: Floats) -> Floats:
    """Return the mean heading of each interval; where one end has none, that of the other."""
    first, last = heading_rad[:-1], heading_rad[1:]
    first, last = np.where(np.isnan(first), last, first), np.where(np.isnan(last), first, last)
    return wrap_rad(np.concatenate([heading_rad[:1], first + wrap_rad(last - first) / 2]))
