"""From counted steps with a compass or turns to motion: for phones that keep no raw data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.angles import heading_from_azimuth_rad, wrap_rad
from mapfilter.tracks.checks.headings import compass_fault
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.pdr.batches import parted, spread
from mapfilter.tracks.pdr.gyroscope import RATE_SD_RADPS
from mapfilter.tracks.pdr.mean_direction import NEAR_S, mean_direction
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.orientation import compass_of_orientation, turning_of_orientation
from mapfilter.tracks.pdr.step_counts import PAUSE_S, STEPS_PER_S, counted_steps
from mapfilter.tracks.pdr.turns import turning_of
from mapfilter.tracks.pdr.walk import DECLINATION_SD_RAD
from mapfilter.tracks.pdr.walk_noise import SCALE, STEP_SHARE

_COUNTED_LATE = 0.5
_LEAST_HEADING_DEG, _MOST_HEADING_DEG = 3.0, 45.0
_CARRIED_SD_DEG = 15.0
_CORRELATION_S = 6.0
_NO_COURSE = (
    "steps are counted, but no compass and no turns are beside them (a column compass_deg, "
    "turn_rad or yaw_rate_radps, a gyroscope, or qx, qy, qz, qw): which way they went is unknown, "
    "so there is no motion; between positions the track stands still"
)
_POINTED = (
    "orientation: turns only; the pose device (--pose, track.walk.pose) takes its headings, where "
    "its north is that of a compass and the phone points where one walks"
)


@dataclass(frozen=True, eq=False)
class _Course:
    """Headings or turns of the rows of a step counter.

    ``chord`` is the length of the way from row to row by the steps in it, and ``walk_rad`` the
    random walk of turns in rad/√s (0 with headings).
    """

    heading_rad: Floats
    turn_rad: Floats
    chord: Floats
    walk_rad: float
    source: str
    unknown: str
    notes: tuple[str, ...]


def reckon_counted(
    sensors: Mapping[str, pd.DataFrame],
    options: WalkOptions | None = None,
    convergence_rad: float = 0.0,
) -> tuple[pd.DataFrame | None, ImuNoise | None, tuple[str, ...]]:
    """Make the motion of a walk from counted steps of one length, and a compass, else turns.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        ``steps`` (time_s, count: since some start, or in each row, see
        :func:`mapfilter.tracks.pdr.step_counts.are_own_counts`) and ``compass`` (time_s,
        magnetic_deg, clockwise from magnetic north); without a compass ``turns``, ``gyroscope``
        with ``gravity`` or ``accelerometer``, see :func:`mapfilter.tracks.pdr.turns.turning_of`, or
        ``orientation``, which with the pose "device" is a compass, too.
    options : WalkOptions, optional
        Of which the length of a step and the magnetic declination are used, and the pose.
    convergence_rad : float
        Clockwise angle from true north to grid north.

    Returns
    -------
    motion : pandas.DataFrame or None
        time_s, step_m, and heading_rad (with a compass) or turn_rad, the other one NaN; None where
        no step was counted. A step is unknown (NaN) where the counter began anew, grew faster than
        anybody walks, or after more than 30 s without a row.
    imu : ImuNoise or None
        Its errors.
    notes : tuple of str
        What it was made of, or why there is none.

    Examples
    --------
    >>> steps = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "count": [7.0, 9.0, 10.0]})
    >>> compass = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "magnetic_deg": 90.0})
    >>> motion, _, _ = reckon_counted({"steps": steps, "compass": compass})
    >>> motion["step_m"].round(2).tolist(), motion["heading_rad"].tolist()
    ([0.0, 1.4, 0.7], [0.0, 0.0, 0.0])
    """
    options = options or WalkOptions()
    if "steps" not in sensors:
        return None, None, ()
    rows = sensors["steps"].sort_values("time_s", kind="stable")
    columns = (rows[name].to_numpy(dtype=np.float64) for name in ("time_s", "count"))
    time_s, counted, how = counted_steps(*columns)
    counted, batches = spread(time_s, counted)
    time_s, counted = parted(time_s, counted, _times_of_directions(sensors))
    unknown = int(np.isnan(counted).sum())
    if not np.nansum(counted) > 0:
        return None, None, (_without_steps(time_s, counted),)
    pointed = options.pose == "device" and "compass" not in sensors
    compass = compass_of_orientation(sensors) if pointed else None
    if compass is not None:
        sensors = {**sensors, "compass": compass}
    if "compass" in sensors:
        course, reason = _by_compass(time_s, counted, sensors, options, convergence_rad)
    else:
        course, reason = _by_turns(time_s, sensors)
    if course is None:
        return None, None, (reason,)
    motion = pd.DataFrame(
        {
            "time_s": time_s,
            "step_m": options.counted_m * counted * course.chord,
            "heading_rad": course.heading_rad,
            "turn_rad": course.turn_rad,
        }
    )
    source = course.source if compass is None else "with the phone's orientation as a compass"
    notes = [f"motion: {np.nansum(counted):.0f} steps of {options.counted_m:g} m {how}, {source}"]
    if unknown:
        some = number_of(unknown, "row")
        notes.append(f"motion unknown in {some}: the counter jumped, or paused for 30 s")
    if batches:
        some = number_of(batches, "batch", "batches")
        notes.append(f"steps came late, in {some}: spread over the time since the step before")
    aimless = motion["heading_rad"].isna() & motion["turn_rad"].isna() & (motion["step_m"] > 0)
    # Before the first row there is no turn.
    without = int(aimless.iloc[0 if "compass" in sensors else 1 :].sum())
    if without:
        notes.append(f"{course.unknown} {number_of(without, 'row')} with steps")
    return motion, _errors(motion, options, course.walk_rad), (*notes, *course.notes)


def _times_of_directions(sensors: Mapping[str, pd.DataFrame]) -> Floats:
    """Return the times at which a compass, else turns or a gyroscope, were read."""
    for name in ("compass", "turns", "gyroscope", "orientation"):
        if name in sensors:
            known = sensors[name].set_index("time_s").notna().any(axis=1)
            return np.unique(known.index[known].to_numpy(dtype=np.float64))
    return np.zeros(0)


def _without_steps(time_s: Floats, counted: Floats) -> str:
    """Return why there is no motion where no row has a step: all stand still, or are unknown."""
    reason, unknown = "stands still in", np.isnan(counted[1:])
    if unknown.any():
        apart_s = float(np.median(np.diff(time_s)[unknown]))
        if apart_s > PAUSE_S:
            used = f"and used in rows up to {PAUSE_S:g} s apart"
            return f"steps are counted in rows {apart_s:.3g} s apart, {used}: no motion"
        reason = (
            f"begins anew, or grows by more than {STEPS_PER_S:g} steps/s, in {unknown.sum()} of"
        )
    rows = number_of(len(counted), "row")
    return (
        f"the step counter {reason} {rows}: no motion (steps of each row alone are given as step_m)"
    )


def _by_compass(
    time_s: Floats,
    counted: Floats,
    sensors: Mapping[str, pd.DataFrame],
    options: WalkOptions,
    convergence_rad: float,
) -> tuple[_Course | None, str]:
    """Return headings, or why there are none."""
    compass = sensors["compass"]
    magnetic_deg, chord = mean_direction(
        time_s, *(compass[name].to_numpy(np.float64) for name in ("time_s", "magnetic_deg"))
    )
    if np.isnan(magnetic_deg).all():
        return None, "compass and step counter have no time in common: no motion"
    notes = []
    stepped = counted > 0
    if fault := compass_fault(magnetic_deg[stepped], options.counted_m * float(np.nansum(counted))):
        notes.append(fault)
    if options.declination_deg is None:
        notes.append("no magnetic declination given: magnetic north taken for true north")
    if "turns" in sensors:
        notes.append("turns are not used beside the compass")
    azimuth_deg = magnetic_deg + (options.declination_deg or 0.0)
    heading = heading_from_azimuth_rad(azimuth_deg, convergence_rad)
    nothing = np.full(len(time_s), np.nan)
    unknown = f"no compass within {NEAR_S:g} s of"
    return _Course(heading, nothing, chord, 0.0, "with a compass", unknown, tuple(notes)), ""


def _by_turns(time_s: Floats, sensors: Mapping[str, pd.DataFrame]) -> tuple[_Course | None, str]:
    """Return turns, or why there are none; the heading at the start stays unknown."""
    turning, reason = turning_of(sensors)
    notes: tuple[str, ...] = (
        "no compass (a column compass_deg): turns only, the heading at the start is unknown until "
        "positions or a map tell it",
    )
    if turning is None and (turning := turning_of_orientation(sensors)) is not None:
        notes = (*notes, _POINTED)
    if turning is None:
        return None, f"no motion: {reason}" if reason else _NO_COURSE
    turn = turning.between(time_s)
    if np.isnan(turn).all():
        return None, (
            f"{turning.source} and the step counter have no time in common, or rates lie more than "
            "2 s apart: no motion"
        )
    nothing, whole = np.full(len(time_s), np.nan), np.ones(len(time_s))
    source, walk_rad = f"with {turning.source}", turning.walk_rad_per_sqrt_s
    return _Course(nothing, turn, whole, walk_rad, source, "no turn known in", notes), ""


def _errors(motion: pd.DataFrame, options: WalkOptions, walk_rad: float) -> ImuNoise:
    """Return the errors of the motion: what scatters from row to row, and what lasts."""
    stepped = motion[motion["step_m"] > 0]
    between_s = np.diff(stepped["time_s"])
    # A step is counted in the row in which it ends, or in the next one.
    late_m = _COUNTED_LATE * options.counted_m
    steps = ImuNoise(
        period_s=float(np.median(between_s)) if between_s.size else 1.0,
        sigma_trans_m=float(np.hypot(STEP_SHARE * float(stepped["step_m"].median()), late_m)),
        scale=SCALE,
    )
    if walk_rad:
        return replace(
            steps,
            turns="gyro",
            gyro_noise_deg_per_sqrt_s=float(np.degrees(walk_rad)),
            gyro_bias_deg_per_s=float(np.degrees(RATE_SD_RADPS)),
        )
    turned = wrap_rad(np.diff(stepped["heading_rad"]))
    known = np.abs(turned[np.isfinite(turned)])
    # Of two rows along a straight line the difference scatters by two errors.
    white_deg = MAD_TO_SD * float(np.degrees(np.median(known))) / 2**0.5 if known.size else 0.0
    north_sd_deg = 0.0 if options.declination_deg is not None else np.degrees(DECLINATION_SD_RAD)
    return replace(
        steps,
        sigma_orient_deg=float(np.clip(white_deg, _LEAST_HEADING_DEG, _MOST_HEADING_DEG)),
        bias_sd_deg=float(np.hypot(_CARRIED_SD_DEG, north_sd_deg)),
        heading_correlation_s=_CORRELATION_S,
    )
