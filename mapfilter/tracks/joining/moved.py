"""Steps and turns of a log from odometry, poses, or the velocity or positions of a receiver."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Bools, Floats
from mapfilter.angles import heading_from_azimuth_rad, wrap_rad
from mapfilter.tracks.imu_noise import ImuNoise

_LONGEST_S = 5.0
_USUAL_INTERVALS = 3
_LEAST_GAP_S, _ROWS_OF_A_GAP = 3.0, 5.0
_STANDING_MPS = 0.3
"""Least time and usual intervals without rows that are a gap, if it moved at an end of it."""
LEAST_STEP_SD_M, _LEAST_HEADING_SD_DEG, _MOST_HEADING_SD_DEG = 0.05, 1.0, 90.0
_COURSE_BIAS_DEG = 1.0
UNDIRECTED = "directions are unknown, so that uncertainty grows by the way gone"
"""What follows for steps without headings and turns."""
MOVING_SD = 2.0


def by_compass(rows: pd.DataFrame, convergence_rad: float) -> pd.DataFrame:
    """Return motion with headings of its compass where it has none.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, step_m, heading_rad, turn_rad and compass_deg, clockwise from true north.
    convergence_rad : float
        Clockwise angle from true north to grid north.

    Examples
    --------
    >>> rows = pd.DataFrame({"time_s": [0.0, 1.0], "heading_rad": [0.5, np.nan],
    ...     "compass_deg": [90.0, 0.0]})
    >>> by_compass(rows, 0.0)["heading_rad"].round(3).tolist()
    [0.5, 1.571]
    """
    if "compass_deg" not in rows:
        return rows
    heading = heading_from_azimuth_rad(rows["compass_deg"].to_numpy(), convergence_rad)
    given = rows["heading_rad"].to_numpy(dtype=np.float64)
    kept = rows.drop(columns="compass_deg")
    return kept.assign(heading_rad=np.where(np.isnan(given), heading, given))


def motion_from_odometry(rows: pd.DataFrame) -> pd.DataFrame:
    """Integrate speed and yaw rate over each interval, by the mean of its ends.

    What a vehicle did while rows are missing is not known: neither step nor turn. Where speeds
    alone are missing its turns are.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, speed_mps, yaw_rate_radps (counter-clockwise positive); NaN where unknown.

    Returns
    -------
    pandas.DataFrame
        time_s, step_m, heading_rad (NaN), turn_rad; NaN over gaps.

    Examples
    --------
    >>> motion_from_odometry(pd.DataFrame({"time_s": [0.0, 1.0], "speed_mps": [1.0, 3.0],
    ...     "yaw_rate_radps": [0.0, 0.2]})).round(3).to_dict("list")
    {'time_s': [0.0, 1.0], 'step_m': [0.0, 2.0], 'heading_rad': [nan, nan], 'turn_rad': [0.0, 0.1]}
    """
    rows = rows.drop_duplicates("time_s")
    time = rows["time_s"].to_numpy(dtype=np.float64)
    speed = rows["speed_mps"].to_numpy(dtype=np.float64)
    turn = _integrated(time, rows["yaw_rate_radps"].to_numpy(dtype=np.float64))
    gap = odometry_gaps(time, speed)
    # Whoever stands does not turn: one reading of a gyroscope would be that of the whole gap.
    turn[long_gaps(time) & ~gap] = 0.0
    return pd.DataFrame(
        {
            "time_s": time,
            "step_m": np.where(gap, np.nan, _integrated(time, speed)),
            "heading_rad": np.nan,
            "turn_rad": np.where(gap, np.nan, turn),
        }
    )


def odometry_gaps(time_s: Floats, speed_mps: Floats) -> Bools:
    """Return which rows end a gap: rows of a vehicle that moves are missing before them.

    Parameters
    ----------
    time_s, speed_mps : (N,) arrays
        Where a speed is NaN it may move.

    Examples
    --------
    >>> time_s = np.array([0.0, 0.1, 0.2, 30.0, 30.1])
    >>> odometry_gaps(time_s, np.full(5, 10.0)).tolist()
    [False, False, False, True, False]
    >>> odometry_gaps(time_s, np.zeros(5)).any()
    np.False_
    """
    gap = long_gaps(time_s)
    moves = ~(np.abs(speed_mps) <= _STANDING_MPS)
    gap[1:] &= moves[1:] | moves[:-1]
    return gap


def long_gaps(time_s: Floats) -> Bools:
    """Return which rows come long after the ones before, at rest, too."""
    gap = np.zeros(time_s.size, dtype=np.bool_)
    if time_s.size > 2:
        lasted_s = np.diff(time_s)
        gap[1:] = lasted_s > max(_LEAST_GAP_S, _ROWS_OF_A_GAP * float(np.median(lasted_s)))
    return gap


def _integrated(time_s: Floats, rate: Floats) -> Floats:
    return np.concatenate([[0.0], np.diff(time_s) * (rate[1:] + rate[:-1]) / 2])


def motion_from_poses(rows: pd.DataFrame) -> pd.DataFrame:
    """Turn poses in a frame of their own into steps and turns seen from above.

    Forward is the axis of the body along which it moves most: z for a camera, whose y axis then
    points down, else one of a body whose z axis points up.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, x_m, y_m, z_m and the quaternion qx, qy, qz, qw from body to frame.
    """
    rows = rows.drop_duplicates("time_s")
    place = rows[["x_m", "y_m", "z_m"]].to_numpy(dtype=np.float64)
    turned = rotation_matrices(rows[["qx", "qy", "qz", "qw"]].to_numpy(dtype=np.float64))
    moved = np.diff(place, axis=0)
    in_body = np.einsum("nji,nj->ni", turned[:-1], moved)
    along = int(np.argmax(np.abs(in_body.sum(axis=0))))
    sign = 1.0 if in_body[:, along].sum() >= 0 else -1.0
    up = _up_axis(along)
    across = np.cross(up, sign * np.eye(3)[along])
    relative = np.einsum("nji,njk->nik", turned[:-1], turned[1:])
    forward = relative @ (sign * np.eye(3)[along])
    turn = np.arctan2(forward @ across, forward @ (sign * np.eye(3)[along]))
    step = in_body @ (sign * np.eye(3)[along])
    flat = np.hypot(step, in_body @ across)
    step = np.where(step < 0, -flat, flat)
    return pd.DataFrame(
        {
            "time_s": rows["time_s"].to_numpy(),
            "step_m": np.concatenate([[0.0], step]),
            "heading_rad": np.nan,
            "turn_rad": np.concatenate([[0.0], wrap_rad(turn)]),
        }
    )


def _up_axis(along: int) -> Floats:
    """Return the body's upward axis: z up, or (a camera, which moves along z) y down."""
    if along == 2:
        return np.array([0.0, -1.0, 0.0])
    return np.array([0.0, 0.0, 1.0])


def places_of_poses(rows: pd.DataFrame) -> pd.DataFrame:
    """Return poses seen from above, as metres east and north of a frame of their own."""
    place = rows[["x_m", "y_m", "z_m"]].to_numpy(dtype=np.float64)
    turned = rotation_matrices(rows[["qx", "qy", "qz", "qw"]].to_numpy(dtype=np.float64))
    in_body = np.einsum("nji,nj->ni", turned[:-1], np.diff(place, axis=0))
    camera = bool(len(in_body)) and int(np.argmax(np.abs(in_body.sum(axis=0)))) == 2
    north = place[:, 2] if camera else place[:, 1]
    return pd.DataFrame({"time_s": rows["time_s"], "east_m": place[:, 0], "north_m": north})


def rotation_matrices(quaternions: Floats) -> Floats:
    """Return (N, 3, 3) rotations of quaternions x, y, z, w, which need not be of unit length."""
    norm = np.linalg.norm(quaternions, axis=1, keepdims=True)
    x, y, z, w = (quaternions / np.where(norm > 0, norm, 1.0)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def motion_from_course(rows: pd.DataFrame, convergence_rad: float) -> pd.DataFrame:
    """Integrate the velocity of a receiver over each interval, by the mean of its ends.

    Intervals of more than 5 s and of three usual ones have no step; where neither end has a course
    the heading is unknown.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, speed_mps and course_deg (clockwise from true north; NaN where unknown).
    convergence_rad : float
        Clockwise angle from true north to grid north.

    Examples
    --------
    >>> turn = pd.DataFrame({"time_s": [0.0, 2.0], "speed_mps": 5.0, "course_deg": [0.0, 90.0]})
    >>> motion_from_course(turn, 0.0).iloc[1].round(4).tolist()
    [2.0, 7.0711, 0.7854, nan]
    """
    rows = rows.drop_duplicates("time_s")
    time = rows["time_s"].to_numpy(dtype=np.float64)
    speed = rows["speed_mps"].to_numpy(dtype=np.float64)
    heading = heading_from_azimuth_rad(rows["course_deg"].to_numpy(), convergence_rad)
    # Where one end has no course, the other one's is taken.
    first, last = heading[:-1], heading[1:]
    first, last = np.where(np.isnan(first), last, first), np.where(np.isnan(last), first, last)
    east = (speed[:-1] * np.cos(first) + speed[1:] * np.cos(last)) / 2
    north = (speed[:-1] * np.sin(first) + speed[1:] * np.sin(last)) / 2
    lasted_s = np.diff(time)
    known = np.isfinite(east)
    step = lasted_s * np.where(known, np.hypot(east, north), (speed[:-1] + speed[1:]) / 2)
    step[_long(lasted_s)] = np.nan
    moved = np.where(known & (step > 0), np.arctan2(north, east), np.nan)
    columns = {"step_m": np.concatenate([[0.0], step]), "turn_rad": np.nan}
    columns["heading_rad"] = np.concatenate([heading[:1], moved])
    table = pd.DataFrame({"time_s": time, **columns})
    return table[["time_s", "step_m", "heading_rad", "turn_rad"]]


def course_errors(motion: pd.DataFrame, east_m: Floats, north_m: Floats) -> ImuNoise | None:
    """Return the errors of motion by speed and course, as it differs from positions of its rows.

    Errors of the positions count, too; those that both share do not show.

    Parameters
    ----------
    motion : pandas.DataFrame
        As of :func:`motion_from_course`.
    east_m, north_m : (N,) array
        Positions at its times.
    """
    step_m, heading = chords(east_m, north_m)
    more_m = motion["step_m"].to_numpy()[1:] - step_m
    turned = wrap_rad(motion["heading_rad"].to_numpy()[1:] - heading)
    known = np.isfinite(more_m) & np.isfinite(turned)
    if not known.any():
        return None
    step_sd_m = max(MAD_TO_SD * float(np.median(np.abs(more_m[known]))), LEAST_STEP_SD_M)
    moving = known & (step_m > MOVING_SD * step_sd_m)
    if not moving.any():
        return None
    heading_sd = MAD_TO_SD * float(np.degrees(np.median(np.abs(turned[moving]))))
    time_s = motion["time_s"].to_numpy()
    return receiver_noise(time_s, step_sd_m, heading_sd, bias_sd_deg=_COURSE_BIAS_DEG)


def chords(east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
    """Return lengths and headings from each position to the next."""
    east, north = np.diff(east_m), np.diff(north_m)
    return np.hypot(east, north), np.arctan2(north, east)


def _long(lasted_s: Floats) -> Bools:
    """Return which intervals are too long for the mean of their ends."""
    if not lasted_s.size:
        return np.zeros(0, dtype=bool)
    usual_s = float(np.median(lasted_s))
    return np.asarray(lasted_s > max(_LONGEST_S, _USUAL_INTERVALS * usual_s))


def receiver_noise(
    time_s: Floats,
    step_sd_m: float,
    heading_sd_deg: float,
    *,
    bias_sd_deg: float = 0.0,
    scale: float = 0.0,
) -> ImuNoise:
    """Return errors of motion by a receiver, with headings' between 1 and 90 degrees."""
    period_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0
    return ImuNoise(
        period_s=period_s,
        sigma_trans_m=float(step_sd_m),
        sigma_orient_deg=float(
            np.clip(heading_sd_deg, _LEAST_HEADING_SD_DEG, _MOST_HEADING_SD_DEG)
        ),
        bias_sd_deg=bias_sd_deg,
        scale=scale,
    )
