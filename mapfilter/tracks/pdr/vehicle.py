"""Dead reckoning of vehicles by their speed, and a yaw rate or a gyroscope."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.angles import wrap_rad
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.equal_times import joined_times
from mapfilter.tracks.joining.moved import (
    UNDIRECTED,
    long_gaps,
    motion_from_odometry,
    odometry_gaps,
)
from mapfilter.tracks.pdr.attitude import attitude
from mapfilter.tracks.pdr.gyroscope import error_notes
from mapfilter.tracks.pdr.odometry_rows import gap_notes, speed_errors, usable_rows, usual_s
from mapfilter.tracks.pdr.signals import Signals, inertial_signals
from mapfilter.tracks.pdr.standing_bias import standing_bias
from mapfilter.tracks.pdr.turns import ORIENTATION, Turning, turning_of_rate

_STANDING_MPS, _GNSS_STANDING_MPS = 0.05, 0.3
_COURSE_MPS = 2.0
_NO_RATES = (
    "odometry: no yaw rates (a column such as Yaw rate [deg/s] or yaw_rate_radps): "
    f"{UNDIRECTED}; a phone's gyroscope and accelerometer show them, too"
)
_DENSE = 1.5
"""So many times as many yaw rates as speeds are integrated by themselves."""


def reckon_odometry(
    rows: pd.DataFrame, turning: Turning | None = None
) -> tuple[pd.DataFrame, ImuNoise, tuple[str, ...]]:
    """Return the motion of a vehicle with a speedometer and a yaw rate, and its errors.

    The gyroscope's bias is the yaw rate while the vehicle stands, smoothed over the recording;
    without a yaw rate there are no turns. Where speeds alone are missing steps are not known, but
    turns are.

    Parameters
    ----------
    rows : pandas.DataFrame
        The table ``odometry`` of :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.
    turning : Turning, optional
        Turns that another device measured, in place of yaw rates.

    Returns
    -------
    motion : pandas.DataFrame
        time_s, step_m, heading_rad (NaN), turn_rad.
    imu : ImuNoise
    notes : tuple of str
    """
    rows = joined_times(rows)
    turning = _dense_turning(rows) if turning is None else turning
    rows, unusable = usable_rows(rows)
    motion = motion_from_odometry(rows)
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    speed = rows["speed_mps"].to_numpy(dtype=np.float64)
    rate, averaged_s = rows["yaw_rate_radps"].to_numpy(dtype=np.float64), usual_s(time_s)
    if turning is not None:
        # Each rate is a mean over two intervals.
        motion, rate = _turned(motion, turning)
        averaged_s *= 2
    bias = standing_bias(time_s, rate, np.abs(speed) < _STANDING_MPS, averaged_s)
    if turning is not None and not bias.is_shown:
        walk_rad = max(bias.walk_rad_per_sqrt_s, turning.walk_rad_per_sqrt_s)
        bias = replace(bias, walk_rad_per_sqrt_s=walk_rad)
    correction = bias.offset_at(time_s)
    # Over a rest without rows nothing was read of the gyroscope.
    rested = long_gaps(time_s) & (motion["turn_rad"].to_numpy() == 0)
    biased = np.where(rested, 0.0, np.diff(correction, prepend=correction[0]))
    turn = motion["turn_rad"].to_numpy() + biased
    has_rate = bool(np.isfinite(rate).any())
    notes = (*unusable, *(bias.notes if has_rate else (_NO_RATES,)))
    # Which way it went meanwhile is as little known as over a gap.
    blind = has_rate & np.isnan(turn) & (np.abs(motion["step_m"].to_numpy()) > 0)
    if blind.any():
        blind_s = float(np.diff(time_s, prepend=time_s[0])[blind].sum())
        notes += (f"odometry: no yaw rate over {blind_s:.1f} s of driving: motion is not known",)
        motion = motion.assign(step_m=motion["step_m"].where(~blind))
    by_gyroscope = turning is None or turning.source != ORIENTATION
    notes += error_notes(bias.walk_rad_per_sqrt_s, of="yaw rate") if by_gyroscope else ()
    notes += gap_notes(time_s, speed, turn)
    if rested.any():
        longest_s = float(np.diff(time_s, prepend=time_s[0])[rested].max())
        words = number_of(int(rested.sum()), "pause")
        notes += (f"odometry: {words} (longest {longest_s:.1f} s) between rests, taken as rests",)
    return motion.assign(turn_rad=turn), bias.noise(speed_errors(rows)), notes


def reckon_velocity(
    sensors: Mapping[str, pd.DataFrame],
) -> tuple[pd.DataFrame, ImuNoise, tuple[str, ...]] | None:
    """Return the motion of a vehicle by the speed of a receiver and a gyroscope in any pose.

    Headings are the gyroscope's; the receiver's course, where it drives faster than 2 m/s, gives
    their offset, and standing the gyroscope's bias. Over gaps of the sensors motion is not known,
    over those of the speeds steps are not; errors are those of the longest part between the first.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        ``velocity``, ``gyroscope`` and ``accelerometer`` of
        :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.

    Returns
    -------
    motion, imu, notes
        As of :func:`reckon_odometry`, with headings where there was a course; None where the
        sensors do not cover the speeds.
    """
    stretches, _ = inertial_signals(sensors)
    rows = sensors.get("velocity")
    if rows is None or not stretches or stretches[0].rate_radps is None:
        return None
    rows = rows.dropna(subset=["speed_mps"]).drop_duplicates("time_s").sort_values("time_s")
    covered = ((part, rows["time_s"].between(*part.time_s[[0, -1]])) for part in stretches)
    parts = [_driven(part, rows[inside]) for part, inside in covered if inside.sum() > 1]
    if not parts:
        return None
    motion, imu, notes = max(parts, key=lambda part: len(part[0]))
    notes += _unknown_steps([part[0] for part in parts])
    if gaps := len(parts) - 1:
        for later, _, _ in parts[1:]:
            later.loc[0, ["step_m", "turn_rad"]] = np.nan
        motion = pd.concat([part[0] for part in parts], ignore_index=True)
        notes += (f"{number_of(gaps, 'gap')} of the sensors, over which motion is not known",)
    return motion, imu, notes


def _driven(signals: Signals, rows: pd.DataFrame) -> tuple[pd.DataFrame, ImuNoise, tuple[str, ...]]:
    """Return the motion over the time of sensors without gaps, by two speeds or more."""
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    speed = rows["speed_mps"].to_numpy(dtype=np.float64)
    course = rows["heading_rad"].to_numpy(dtype=np.float64)
    yaw = np.interp(time_s, signals.time_s, attitude(signals).yaw_rad)
    rate = np.gradient(yaw, time_s)
    driving = (speed > _COURSE_MPS) & np.isfinite(course)
    course_offset = np.where(driving, course - yaw, np.nan)
    # Each rate is a mean over two intervals.
    slow, averaged_s = speed < _GNSS_STANDING_MPS, 2 * usual_s(time_s)
    bias = standing_bias(time_s, rate, slow, averaged_s, course_offset)
    heading = yaw + bias.offset_at(time_s)
    lasted_s = np.diff(time_s)
    step = np.concatenate([[0.0], lasted_s * (speed[1:] + speed[:-1]) / 2])
    # Over a rest a speed is noise, which would be that of the whole pause.
    step[long_gaps(time_s)] = 0.0
    step[odometry_gaps(time_s, speed)] = np.nan
    middle = np.concatenate([heading[:1], (heading[1:] + heading[:-1]) / 2])
    motion = pd.DataFrame(
        {
            "time_s": time_s,
            "step_m": step,
            "heading_rad": wrap_rad(middle) if driving.any() else np.nan,
            "turn_rad": wrap_rad(np.diff(heading, prepend=heading[0])),
        }
    )
    notes = (*bias.notes, *error_notes(bias.walk_rad_per_sqrt_s))
    return motion, bias.noise(speed_errors(rows[["time_s"]])), notes


def _unknown_steps(parts: Sequence[pd.DataFrame]) -> tuple[str, ...]:
    """Return a note on steps that are not known, as a receiver moved without speeds."""
    gap_s = pd.concat([part["time_s"].diff()[part["step_m"].isna()] for part in parts])
    if gap_s.empty:
        return ()
    gaps = f"{number_of(len(gap_s), 'gap')} of speeds (longest {gap_s.max():.1f} s)"
    return (f"{gaps}, over which turns alone are known",)


def _dense_turning(rows: pd.DataFrame) -> Turning | None:
    """Return the turns by yaw rates that come more often than speeds; None of others.

    Those at the times of speeds alone would be samples of their noise.
    """
    rate = rows["yaw_rate_radps"].to_numpy(dtype=np.float64)
    known = np.isfinite(rate)
    if known.sum() < _DENSE * rows["speed_mps"].notna().sum():
        return None
    return turning_of_rate(rows["time_s"].to_numpy(dtype=np.float64)[known], rate[known], "")


def _turned(motion: pd.DataFrame, turning: Turning) -> tuple[pd.DataFrame, Floats]:
    """Return motion with the turns of another device, and their rate over each two intervals."""
    time_s = motion["time_s"].to_numpy(dtype=np.float64)
    turn = turning.between(time_s)
    # Over a rest without rows no turn is read.
    rested = long_gaps(time_s) & (motion["turn_rad"].to_numpy() == 0)
    turn = np.where(rested, 0.0, turn)
    turn[:1] = 0.0
    apart_s = time_s[2:] - time_s[:-2]
    rate = np.full(len(time_s), np.nan)
    rate[1:-1] = (turn[2:] + turn[1:-1]) / apart_s
    return motion.assign(turn_rad=turn), rate
