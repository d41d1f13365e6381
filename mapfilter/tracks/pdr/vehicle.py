"""Dead reckoning of vehicles: speed and yaw rate, the gyroscope's bias learnt while standing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.geodesy import wrap_rad
from mapfilter.tracks.equal_times import joined_times
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.moved import UNDIRECTED, long_gaps, motion_from_odometry, odometry_gaps
from mapfilter.tracks.pdr.attitude import attitude
from mapfilter.tracks.pdr.gyroscope import (
    MOST_BIAS_RADPS,
    WALK_RAD_PER_SQRT_S,
    error_notes,
    shown_bias,
)
from mapfilter.tracks.pdr.heading import Compass, YawOffset, yaw_offset
from mapfilter.tracks.pdr.odometry_rows import gap_notes, speed_errors, usable_rows, usual_s
from mapfilter.tracks.pdr.signals import Signals, inertial_signals
from mapfilter.tracks.pdr.turns import ORIENTATION, Turning, turning_of_rate

_STANDING_MPS, _GNSS_STANDING_MPS = 0.05, 0.3
_SETTLING_S = 0.4
_FEWEST_STANDING, _LEAST_STANDING_S = 5, 1.0
"""Rows at standstill that show a bias, and how long they last together: the scatter of fewer says
nothing of their error."""
_APART_RADPS, _DEVIATIONS = 0.05, 4.0
"""How far a rate at standstill may be from the usual one, also in deviations of its noise."""
_LEAST_RATE_SD_RADPS = 5e-4
_COURSE_MPS = 2.0
_COURSE_BIAS_DEG = 2.0
_MOST_SPANS = 50_000
_DENSE = 1.5
"""So many times as many yaw rates as speeds are integrated by themselves."""
_UNSEEN_BIAS_DEG_PER_S = 0.05
"""Error of the bias that standing does not show: of 0.02 deg/s a count, and of warming up."""


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
    stood = _settled(time_s, np.abs(speed) < _STANDING_MPS) & np.isfinite(rate)
    standing = _enough(time_s, stood)
    found, walk_rad = _bias(time_s, rate, standing, None, averaged_s)
    if turning is not None and not standing.any():
        walk_rad = max(walk_rad, turning.walk_rad_per_sqrt_s)
    correction = np.interp(time_s, found.time_s, found.offset_rad)
    # Over a rest without rows nothing was read of the gyroscope.
    rested = long_gaps(time_s) & (motion["turn_rad"].to_numpy() == 0)
    biased = np.where(rested, 0.0, np.diff(correction, prepend=correction[0]))
    turn = motion["turn_rad"].to_numpy() + biased
    has_rate = bool(np.isfinite(rate).any())
    notes = unusable + _notes(found, stood, standing, has_rate=has_rate)
    # Which way it went meanwhile is as little known as over a gap.
    blind = has_rate & np.isnan(turn) & (np.abs(motion["step_m"].to_numpy()) > 0)
    if blind.any():
        blind_s = float(np.diff(time_s, prepend=time_s[0])[blind].sum())
        notes += (f"odometry: no yaw rate over {blind_s:.1f} s of driving: motion is not known",)
        motion = motion.assign(step_m=motion["step_m"].where(~blind))
    by_gyroscope = turning is None or turning.source != ORIENTATION
    notes += error_notes(walk_rad, of="yaw rate") if by_gyroscope else ()
    imu = _noise(found, walk_rad, speed_errors(rows))
    notes += gap_notes(time_s, speed, turn)
    if rested.any():
        longest_s = float(np.diff(time_s, prepend=time_s[0])[rested].max())
        words = number_of(int(rested.sum()), "pause")
        notes += (f"odometry: {words} (longest {longest_s:.1f} s) between rests, taken as rests",)
    return motion.assign(turn_rad=turn), imu, notes


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
    stood = _settled(time_s, speed < _GNSS_STANDING_MPS)
    standing = _enough(time_s, stood)
    driving = (speed > _COURSE_MPS) & np.isfinite(course)
    # Each rate is a mean over two intervals.
    course_offset = np.where(driving, course - yaw, np.nan)
    found, walk_rad = _bias(time_s, rate, standing, course_offset, 2 * usual_s(time_s))
    heading = yaw + np.interp(time_s, found.time_s, found.offset_rad)
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
    notes = (*_notes(found, stood, standing, has_rate=True), *error_notes(walk_rad))
    return motion, _noise(found, walk_rad, speed_errors(rows[["time_s"]])), notes


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


def _settled(time_s: Floats, standing: Bools) -> Bools:
    """Return where a vehicle has stood for 0.4 s and still stands: its body has come to rest."""
    moving_s = np.where(standing, -np.inf, time_s)
    settled: Bools = standing & (time_s - np.maximum.accumulate(moving_s) > _SETTLING_S)
    settled[:-1] &= standing[1:]
    return settled


def _enough(time_s: Floats, stood: Bools) -> Bools:
    """Return the rows at standstill, none where they are too few to show how they scatter."""
    few = stood.sum() < _FEWEST_STANDING or stood.sum() * usual_s(time_s) < _LEAST_STANDING_S
    return np.zeros_like(stood) if few else stood


def _bias(
    time_s: Floats, rate: Floats, standing: Bools, course_offset: Floats | None, averaged_s: float
) -> tuple[YawOffset, float]:
    """Smooth the gyroscope's bias, and the offset between its yaw and the course.

    Returns also the random walk of the yaw (rad/√s), by the noise of rates at standstill, which are
    means over ``averaged_s``.
    """
    # Seconds with rows only, and longer spans of a long recording, bound the smoother's steps.
    elapsed_s = time_s - time_s[0]
    span_s = max(1.0, float(np.ceil(len(np.unique(np.floor(elapsed_s))) / _MOST_SPANS)))
    number, span = np.unique(np.floor(elapsed_s / span_s), return_inverse=True)
    rates, sds, north = (np.full(len(number), np.nan) for _ in range(3))
    usable, spread = standing & np.isfinite(rate), 0.0
    if usable.any():
        usual = float(np.median(rate[usable]))
        spread = MAD_TO_SD * float(np.median(np.abs(rate[usable] - usual)))
        near = np.abs(rate - usual) < max(_APART_RADPS, _DEVIATIONS * spread)
        usable &= near & (abs(usual) < MOST_BIAS_RADPS)
    bias = 0.0
    if usable.any():
        bias = float(shown_bias(rate[usable, None], spread)[0])
        still = pd.Series(rate[usable]).groupby(span[usable]).agg(["median", "size"])
        rates[still.index] = still["median"]
        sds[still.index] = np.maximum(spread / np.sqrt(still["size"]), _LEAST_RATE_SD_RADPS)
    walk_rad = float(np.hypot(WALK_RAD_PER_SQRT_S, spread * averaged_s**0.5))
    if course_offset is not None:
        known = np.isfinite(course_offset)
        north[span[known]] = np.pi / 2 - course_offset[known]
    missing = np.isnan(north)
    none = np.full(len(number), np.nan)
    centre_s = time_s[0] + (number + 0.5) * span_s
    compass = Compass(centre_s, np.nan_to_num(north), none, none, missing)
    found = yaw_offset(
        compass,
        rates,
        sds,
        use_compass=not missing.all(),
        walk_rad_per_sqrt_s=walk_rad,
        usual_radps=bias,
    )
    return found, walk_rad


def _notes(found: YawOffset, stood: Bools, standing: Bools, *, has_rate: bool) -> tuple[str, ...]:
    """Return what was learnt of the gyroscope's bias."""
    if not has_rate:
        return (
            "odometry: no yaw rates (a column such as Yaw rate [deg/s] or yaw_rate_radps): "
            f"{UNDIRECTED}; a phone's gyroscope and accelerometer show them, too",
        )
    bias = f"{np.degrees(found.rate_radps):+.3f} ± {np.degrees(found.rate_sd_radps):.3f} deg/s"
    if not stood.any():
        return ("yaw rate: the vehicle never stands, so that the bias could not be learnt",)
    some = number_of(int(stood.sum()), "row")
    if not standing.any():
        needed = f"{_FEWEST_STANDING} rows and {_LEAST_STANDING_S:g} s"
        return (f"yaw rate: {some} at standstill, too few to learn the bias (of {needed})",)
    return (f"yaw rate: bias {bias}, of {some} at standstill",)


def _noise(found: YawOffset, walk_rad: float, of_steps: ImuNoise) -> ImuNoise:
    walk = float(np.degrees(walk_rad))
    bias = float(np.hypot(np.degrees(found.rate_sd_radps), _UNSEEN_BIAS_DEG_PER_S))
    with_course = bool(found.sd_rad[0] < np.pi)
    lasting = float(np.degrees(np.sqrt(np.mean(found.sd_rad**2)))) if with_course else 0.0
    return replace(
        of_steps,
        sigma_orient_deg=1.0,
        bias_sd_deg=min(lasting + _COURSE_BIAS_DEG, 180.0) if with_course else 0.0,
        drift_deg_per_sqrt_s=walk if with_course else 0.0,
        turns="headings" if with_course else "gyro",
        gyro_noise_deg_per_sqrt_s=0.0 if with_course else walk,
        gyro_bias_deg_per_s=0.0 if with_course else bias,
    )
