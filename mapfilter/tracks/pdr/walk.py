"""From the sensors of a phone to the motion of its walker, with the errors of that motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats, Ints
from mapfilter.angles import wrap_rad
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.pdr.attitude import Attitude, attitude
from mapfilter.tracks.pdr.carried_bias import CarriedBias, bias_while_carried
from mapfilter.tracks.pdr.direction import (
    DEVICE_SD_RAD,
    Forward,
    direction_by_acceleration,
    direction_by_device,
    forward_accelerations,
    walking_direction,
)
from mapfilter.tracks.pdr.gyroscope import RATE_SD_RADPS, Gyroscope, gyroscope_at_rest
from mapfilter.tracks.pdr.heading import YawOffset, compass_samples, yaw_offset
from mapfilter.tracks.pdr.height import Climb, climbs
from mapfilter.tracks.pdr.options import Pose, WalkOptions
from mapfilter.tracks.pdr.remounts import (
    HELD_SWING_RAD,
    drifts,
    parted_where_remounted,
    swings_rad,
)
from mapfilter.tracks.pdr.rows import climbed_rows, course_over_strides, row_events
from mapfilter.tracks.pdr.signals import RATE_HZ, Signals, inertial_signals
from mapfilter.tracks.pdr.steps import find_steps, step_lengths, still
from mapfilter.tracks.pdr.walk_noise import walk_noise, walk_notes

_AROUND_S = 0.75
DECLINATION_SD_RAD = np.radians(8.0)
"""Error of headings by a compass whose magnetic declination is not known."""
_DRIVING_MPS, _SPEED_LASTS_S = 4.0, 3.0


@dataclass(frozen=True, eq=False)
class Reckoned:
    """Motion made of raw sensors.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m, heading_rad, turn_rad: a row at each step, and one a second at rest.
    imu : ImuNoise
        Errors of the motion.
    reckoning : pandas.DataFrame
        A row for each row of motion: time_s, heading_sd_rad, disturbed (1 where the compass was
        not used), climb (1 on stairs, 2 in a lift, else 0) and height_m above the start (NaN
        without a barometer).
    steps : int
        Number of steps.
    climbs : tuple of Climb
    notes : tuple of str
    """

    motion: pd.DataFrame
    imu: ImuNoise
    reckoning: pd.DataFrame
    steps: int
    climbs: tuple[Climb, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Part:
    """Rows of one stretch without gaps."""

    rows: pd.DataFrame
    offset: YawOffset
    direction_sd_rad: float
    sway_rad: float


def reckon_walk(
    sensors: Mapping[str, pd.DataFrame],
    options: WalkOptions | None = None,
    convergence_rad: float = 0.0,
) -> tuple[Reckoned | None, tuple[str, ...]]:
    """Make the motion of a walk from the sensor tables of a phone.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        Tables of :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.
    options : WalkOptions, optional
    convergence_rad : float
        Clockwise angle from true north to grid north.

    Returns
    -------
    reckoned : Reckoned or None
        None where there are no steps.
    notes : tuple of str
        Why there are none.
    """
    options = options or WalkOptions()
    stretches, notes = inertial_signals(sensors)
    speed = sensors.get("velocity")
    rests = [still(signals.force_mps2) for signals in stretches]
    gyroscope = gyroscope_at_rest(sensors, stretches, rests)
    carried = bias_while_carried(gyroscope.without_bias(part) for part in stretches)
    # With a compass the smoother finds what is small.
    alone = all(part.field_ut is None for part in stretches)
    more = carried.bias_radps if alone else carried.shown_radps
    gyroscope = replace(gyroscope, bias_radps=gyroscope.bias_radps + more)
    parts = [
        _reckon(gyroscope.without_bias(signals), gyroscope, carried, quiet, options, speed)
        for signals, quiet in zip(stretches, rests, strict=True)
    ]
    counts = [int((part.rows["step_m"] > 0).sum()) for part in parts]
    if not sum(counts):
        return None, (*notes, *(["no steps found"] if parts else []))
    north_rad = convergence_rad - np.radians(options.declination_deg or 0.0)
    compass = any(np.isfinite(part.rows["heading_rad"]).any() for part in parts)
    rows = pd.concat([_begun(part.rows, k) for k, part in enumerate(parts)], ignore_index=True)
    rows["heading_rad"] = wrap_rad(rows["heading_rad"].to_numpy() + north_rad)
    if options.step_m is not None:
        rows["step_m"] *= options.step_m / rows.loc[rows["step_m"] > 0, "step_m"].mean()
    found: tuple[Climb, ...] = ()
    if (barometer := sensors.get("barometer")) is not None:
        steps_s = rows.loc[rows["step_m"] > 0, "time_s"].to_numpy()
        found = climbs(barometer, steps_s)
        rows = climbed_rows(rows, barometer, found)
    main = parts[int(np.argmax(counts))]
    reckoning = rows[["time_s", "heading_sd_rad", "disturbed", "climb", "height_m"]]
    motion = rows[["time_s", "step_m", "heading_rad", "turn_rad"]]
    has_gyroscope = stretches[0].rate_radps is not None
    north_sd_rad = DECLINATION_SD_RAD if options.declination_deg is None else 0.0
    imu = walk_noise(
        rows,
        main.offset,
        float(np.hypot(main.direction_sd_rad, north_sd_rad)),
        main.sway_rad,
        compass=compass,
        gyroscope=gyroscope if has_gyroscope else None,
    )
    words = (*notes, *gyroscope.notes, *walk_notes(rows, len(parts) - 1, found, compass=compass))
    if compass and options.declination_deg is None:
        words += ("no magnetic declination given: magnetic north taken for true north",)
    return Reckoned(motion, imu, reckoning, sum(counts), found, words), notes


def _begun(rows: pd.DataFrame, number: int) -> pd.DataFrame:
    """Return rows of which the first has no motion, or an unknown one after a gap."""
    rows = rows.copy()
    rows.loc[rows.index[0], "step_m"] = np.nan if number else 0.0
    rows.loc[rows.index[0], "turn_rad"] = np.nan
    return rows


def _reckon(
    signals: Signals,
    gyroscope: Gyroscope,
    carried: CarriedBias,
    quiet: Bools,
    options: WalkOptions,
    speed: pd.DataFrame | None,
) -> _Part:
    turned = attitude(signals)
    level = turned.to_level.apply(signals.force_mps2)
    steps = find_steps(level[:, 2])
    index, swing = steps.index, steps.swing_mps2
    if speed is not None and len(speed):
        walked = _speed_at(signals.time_s[index], speed) < _DRIVING_MPS
        index, swing = index[walked], swing[walked]
    offset = _offset(signals, gyroscope, carried, turned, quiet, options)
    walking = _walking(len(level), index)
    forward = forward_accelerations(level, turned.yaw_rad)
    turned = parted_where_remounted(turned, forward, walking)
    directions, sds = _directions(turned, forward, walking, options.pose)
    compass = offset.sd_rad[0] < np.pi
    yaw = turned.yaw_rad + np.interp(signals.time_s, offset.time_s, offset.offset_rad)
    # One that a hand points forward does not drift.
    by_acceleration = (sds > DEVICE_SD_RAD)[turned.section]
    drift = np.where(by_acceleration, drifts(turned, forward, walking), 0.0)
    heading = yaw + directions[turned.section] + drift
    time_s, step_m, at = row_events(signals.time_s, index, step_lengths(swing, options.step_factor))
    course_at, sway = course_over_strides(heading, at, step_m > 0)
    nearest = np.clip(np.searchsorted(offset.time_s, time_s), 0, len(offset.time_s) - 1)
    spread = np.hypot(offset.sd_rad[nearest], sds[turned.section[at]])
    rows = pd.DataFrame(
        {
            "time_s": time_s,
            "step_m": step_m,
            "heading_rad": course_at if compass else np.nan,
            "turn_rad": wrap_rad(np.diff(course_at, prepend=np.nan)),
            "heading_sd_rad": np.minimum(spread, np.pi),
            "disturbed": offset.disturbed[nearest].astype(np.float64),
            "climb": 0.0,
            "height_m": np.nan,
        }
    )
    used = np.bincount(turned.section[index], minlength=len(sds)) if index.size else np.ones(1)
    known = np.average(sds[: len(used)] ** 2, weights=used)
    return _Part(rows, offset, float(np.sqrt(known)), sway)


def _speed_at(time_s: Floats, speed: pd.DataFrame) -> Floats:
    """Return the speed of a receiver at some times; 0 farther than 3 s from any."""
    rows = speed.dropna(subset=["speed_mps"]).sort_values("time_s")
    known_s = rows["time_s"].to_numpy(dtype=np.float64)
    if not len(known_s):
        return np.zeros(len(time_s))
    values = np.interp(time_s, known_s, rows["speed_mps"].to_numpy(dtype=np.float64))
    near = _to_nearest(time_s, known_s)
    return np.where(near < _SPEED_LASTS_S, values, 0.0)


def _to_nearest(values: Floats, known: Floats) -> Floats:
    """Return the distances of values to the nearest of some that grow, of which there is one."""
    after = np.searchsorted(known, values)
    above = known[np.minimum(after, len(known) - 1)]
    below = known[np.maximum(after - 1, 0)]
    nearest: Floats = np.minimum(np.abs(above - values), np.abs(values - below))
    return nearest


def _offset(
    signals: Signals,
    gyroscope: Gyroscope,
    carried: CarriedBias,
    turned: Attitude,
    quiet: Bools,
    options: WalkOptions,
) -> YawOffset:
    """Return what the compass and the times of standing still say of the gyroscope's yaw."""
    field = signals.field_ut
    level = np.full((len(signals.time_s), 3), np.nan)
    if field is not None:
        known = np.isfinite(field[:, 0])
        level[known] = turned.to_level[known].apply(field[known])
    compass = compass_samples(signals.time_s, level, options.field_ut)
    count = len(compass.time_s)
    rates, sds = np.full(count, np.nan), np.full(count, np.nan)
    if signals.rate_radps is not None:
        up_radps = turned.to_level.apply(signals.rate_radps)[:, 2]
        rates, sds = gyroscope.rates_at_rest(signals.rate_radps, up_radps, quiet, count)
    up = turned.to_level.inv().apply([0.0, 0.0, 1.0])
    return yaw_offset(
        compass,
        rates,
        sds,
        walk_rad_per_sqrt_s=gyroscope.walk_rad_per_sqrt_s,
        alone_sd_radps=float(np.hypot(carried.sd_about_radps(up), RATE_SD_RADPS)),
    )


def _walking(count: int, index: Ints) -> Bools:
    """Return which of some samples are near a step."""
    if not index.size:
        return np.zeros(count, dtype=np.bool_)
    away = _to_nearest(np.arange(count, dtype=np.float64), index.astype(np.float64))
    near: Bools = away < _AROUND_S * RATE_HZ
    return near


def _directions(
    turned: Attitude, forward: Forward, walking: Bools, pose: Pose
) -> tuple[Floats, Floats]:
    """Return the direction of walking at yaw 0 in each posture, and its standard deviation."""
    found, sds = [], []
    swings = swings_rad(turned, walking)
    for k in range(len(turned.reference)):
        inside = walking & (turned.section == k)
        by_acceleration = direction_by_acceleration(forward, inside)
        by_device = direction_by_device(turned.reference[k])
        if pose == "auto" and swings[k] > HELD_SWING_RAD:
            # Nobody looks at it, so it may point anywhere.
            by_device = np.nan
        one, sd = walking_direction(by_device, by_acceleration, pose)
        found.append(one)
        sds.append(sd)
    directions, spread = np.array(found), np.array(sds)
    for k in np.flatnonzero(np.isnan(directions)).tolist():
        # The walker is taken to go on as before.
        known = np.flatnonzero(~np.isnan(directions))
        if known.size:
            nearest = int(np.argmin(np.abs(known - k)))
            directions[k] = directions[known[nearest]]
    return np.nan_to_num(directions), spread
