"""From a step counter and a compass to the motion of a walker: for phones that keep no raw data."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.geodesy import heading_from_azimuth_rad, wrap_rad
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.walk import DECLINATION_SD_RAD
from mapfilter.tracks.pdr.walk_noise import SCALE, STEP_SHARE

_NEAR_S = 2.0
_MOST_FALLS = 0.01
_COUNTED_LATE = 0.5
_LEAST_HEADING_DEG, _MOST_HEADING_DEG = 3.0, 45.0
_MAD_TO_SD = 1.4826
_CARRIED_SD_DEG = 15.0
_CORRELATION_S = 6.0


def reckon_counted(
    sensors: Mapping[str, pd.DataFrame],
    options: WalkOptions | None = None,
    convergence_rad: float = 0.0,
) -> tuple[pd.DataFrame | None, ImuNoise | None, tuple[str, ...]]:
    """Make the motion of a walk from counted steps of one length, and the azimuths of a compass.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        ``steps`` (time_s, count: since some start, or in each row) and ``compass`` (time_s,
        azimuth_deg, clockwise from magnetic north).
    options : WalkOptions, optional
        Of which the length of a step and the magnetic declination are used.
    convergence_rad : float
        Clockwise angle from true north to grid north.

    Returns
    -------
    motion : pandas.DataFrame or None
        time_s, step_m, heading_rad, turn_rad (NaN); None where no step was counted.
    imu : ImuNoise or None
        Its errors.
    notes : tuple of str
        What it was made of, or why there is none.

    Examples
    --------
    >>> steps = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "count": [7.0, 9.0, 10.0]})
    >>> compass = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "azimuth_deg": 90.0})
    >>> motion, _, _ = reckon_counted({"steps": steps, "compass": compass})
    >>> motion["step_m"].round(2).tolist(), motion["heading_rad"].tolist()
    ([0.0, 1.4, 0.7], [0.0, 0.0, 0.0])
    """
    options = options or WalkOptions()
    if "steps" not in sensors:
        return None, None, ()
    if "compass" not in sensors:
        return None, None, ("steps are counted, but no compass gives their headings: no motion",)
    rows = sensors["steps"].sort_values("time_s", kind="stable").drop_duplicates("time_s")
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    counted = _counted(rows["count"].to_numpy(dtype=np.float64))
    if not np.nansum(counted) > 0:
        return None, None, (f"the step counter counts no step in {len(rows)} rows",)
    compass = sensors["compass"].sort_values("time_s", kind="stable")
    azimuth_deg = _mean_azimuth_deg(time_s, compass) + (options.declination_deg or 0.0)
    heading = heading_from_azimuth_rad(azimuth_deg, convergence_rad)
    motion = pd.DataFrame(
        {
            "time_s": time_s,
            "step_m": options.step_m * counted,
            "heading_rad": heading,
            "turn_rad": np.nan,
        }
    )
    note = (
        f"motion: {np.nansum(counted):.0f} counted steps of {options.step_m:g} m, headings of the "
        "compass"
    )
    notes = [note]
    if options.declination_deg is None:
        notes.append("no magnetic declination given: magnetic north taken for true north")
    return motion, _errors(motion, options), tuple(notes)


def _counted(count: Floats) -> Floats:
    """Return the steps of each row: of a counter that grows, or of rows that count their own.

    A counter begins anew when a phone is started: the steps between are not known.
    """
    change = np.diff(count)
    if (change < 0).sum() > max(_MOST_FALLS * change.size, 1.0):
        return count
    return np.concatenate([[0.0], np.where(change < 0, np.nan, change)])


def _mean_azimuth_deg(time_s: Floats, compass: pd.DataFrame) -> Floats:
    """Return the mean azimuth since the row before, or that of the nearest time within 2 s."""
    known = compass.dropna(subset=["azimuth_deg"])
    at_s = known["time_s"].to_numpy(dtype=np.float64)
    if not at_s.size:
        return np.full(len(time_s), np.nan)
    turn = np.radians(known["azimuth_deg"].to_numpy(dtype=np.float64))
    sums = np.concatenate([np.zeros((1, 2)), np.cumsum([np.cos(turn), np.sin(turn)], axis=1).T])
    last = np.searchsorted(at_s, time_s, side="right")
    first = np.concatenate([[0], last[:-1]])
    first[0] = max(int(last[0]) - 1, 0)
    inside = sums[last] - sums[first]
    mean = np.degrees(np.arctan2(inside[:, 1], inside[:, 0]))
    nearest = np.clip(last, 1, at_s.size - 1) if at_s.size > 1 else np.zeros(len(time_s), np.int64)
    before = np.maximum(nearest - 1, 0)
    is_nearer = np.abs(at_s[before] - time_s) <= np.abs(at_s[nearest] - time_s)
    nearest = np.where(is_nearer, before, nearest)
    near = np.abs(at_s[nearest] - time_s) <= _NEAR_S
    alone = np.where(near, np.degrees(turn[nearest]), np.nan)
    result: Floats = np.where(last > first, mean, alone)
    return result


def _errors(motion: pd.DataFrame, options: WalkOptions) -> ImuNoise:
    """Return the errors of the motion: what scatters from row to row, and what lasts."""
    stepped = motion[motion["step_m"] > 0]
    between_s = np.diff(stepped["time_s"])
    turned = wrap_rad(np.diff(stepped["heading_rad"]))
    known = np.abs(turned[np.isfinite(turned)])
    # Of two rows along a straight line the difference scatters by two errors.
    white_deg = _MAD_TO_SD * float(np.degrees(np.median(known))) / 2**0.5 if known.size else 0.0
    north_sd_deg = 0.0 if options.declination_deg is not None else np.degrees(DECLINATION_SD_RAD)
    # A step is counted in the row in which it ends, or in the next one.
    late_m = _COUNTED_LATE * options.step_m
    return ImuNoise(
        period_s=float(np.median(between_s)) if between_s.size else 1.0,
        sigma_trans_m=float(np.hypot(STEP_SHARE * float(stepped["step_m"].mean()), late_m)),
        sigma_orient_deg=float(np.clip(white_deg, _LEAST_HEADING_DEG, _MOST_HEADING_DEG)),
        bias_sd_deg=float(np.hypot(_CARRIED_SD_DEG, north_sd_deg)),
        scale=SCALE,
        heading_correlation_s=_CORRELATION_S,
    )
