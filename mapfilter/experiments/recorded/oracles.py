"""What filters are given that no receiver has: by how much a target is out of reach, and why.

An oracle that knows the start shows what finding it costs; one that knows the size of each error
shows what no weighing of the same readings can improve.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter.evaluation.truth import Truth
from mapfilter.geodesy import unproject
from mapfilter.gnss.sky import ecef_from_lonlat
from mapfilter.tracks.deadreckoning import steps_between
from mapfilter.tracks.log import TrackLog

START, NOISE, MOTION = "oracle-start", "oracle-noise", "oracle-motion"
"""Names of the methods."""
FIX_SD_M = 1.0
START_M = 30.0
"""The true positions over so much of the way show the direction, too."""
_STRETCH_M = 100.0
_HIGH_RAD = np.radians(40.0)
_LEAST_HIGH = 3
_HEIGHTS_M = np.arange(-100.0, 401.0, 10.0)
_LEAST_PERCENT, _LEAST_DEG = 0.1, 0.05


def with_true_fixes(log: TrackLog, truth: Truth, which: Bools) -> TrackLog:
    """Return a log with true positions as fixes of 1 m, at some of the times of the truth.

    The log's own fixes stay.

    Parameters
    ----------
    which : (T,) array of bool
        The times of the truth.
    """
    variance = np.full(int(which.sum()), FIX_SD_M**2)
    fixes = pd.DataFrame(
        {
            "time_s": truth.time_s[which],
            "east_m": truth.east_m[which],
            "north_m": truth.north_m[which],
            "var_east_m2": variance,
            "var_north_m2": variance,
            "cov_east_north_m2": np.zeros(len(variance)),
        }
    )
    gnss = pd.concat([part for part in (log.gnss, fixes) if len(part)], ignore_index=True)
    return replace(log, gnss=gnss.sort_values("time_s", kind="stable", ignore_index=True))


def with_start(log: TrackLog, truth: Truth) -> TrackLog:
    """Return a log with the true positions over the first metres of the way as fixes."""
    return with_true_fixes(log, truth, truth.distance_at(truth.time_s) <= START_M)


def with_true_motion(log: TrackLog, truth: Truth) -> TrackLog:
    """Return a log whose steps and headings are those of the true way, as chords row by row.

    Rows outside the record of the truth stay as measured. What the log states of errors stays.
    """
    motion = log.motion
    east, north = truth.at(motion["time_s"].to_numpy())
    step_m, heading = steps_between(east, north)
    step_m, heading = np.append(0.0, step_m), np.append(heading[:1], heading)
    known = np.isfinite(step_m) & np.isfinite(heading)
    columns = {
        "step_m": np.where(known, step_m, motion["step_m"]),
        "heading_rad": np.where(known, heading, motion["heading_rad"]),
        "turn_rad": np.where(known, np.nan, motion["turn_rad"]),
    }
    if "sampling_sd_m" in motion:
        columns["sampling_sd_m"] = np.where(known, 0.0, motion["sampling_sd_m"])
    return replace(log, motion=motion.assign(**columns))


def motion_errors(motion: pd.DataFrame, perfect: pd.DataFrame) -> tuple[float, float]:
    """Return the errors that steps and turns have over 100 m, as the filter's options state them.

    Parameters
    ----------
    motion, perfect : DataFrame
        ``step_m`` and ``turn_rad`` as measured and as they were, row by row.

    Returns
    -------
    scale, drift_deg_per_sqrt_m : float
        Root mean squares of the relative error of the length, and of the error of the turn by the
        root of the length.
    """
    step_m = np.abs(perfect["step_m"].to_numpy())
    stretch = np.floor(np.cumsum(step_m) / _STRETCH_M).astype(np.int64)

    def summed(table: pd.DataFrame, name: str) -> Floats:
        return np.asarray(np.bincount(stretch, weights=table[name].to_numpy()), dtype=np.float64)

    true_m = summed(perfect, "step_m")
    whole = np.abs(true_m) > _STRETCH_M / 2
    off = summed(motion, "step_m")[whole] / true_m[whole] - 1
    turned = (summed(motion, "turn_rad") - summed(perfect, "turn_rad"))[whole]
    root_m = np.sqrt(np.abs(true_m[whole]))
    scale = float(np.sqrt(np.mean(off**2))) if whole.any() else 0.0
    drift_deg = float(np.degrees(np.sqrt(np.mean((turned / root_m) ** 2)))) if whole.any() else 0.0
    return max(scale, _LEAST_PERCENT / 100), max(drift_deg, _LEAST_DEG)


def with_fix_errors(log: TrackLog, truth: Truth) -> TrackLog:
    """Return a log whose fixes state the error that they really have, 1 m or more."""
    gnss = log.gnss
    east, north = truth.at(gnss["time_s"].to_numpy())
    error_m = np.hypot(gnss["east_m"].to_numpy() - east, gnss["north_m"].to_numpy() - north)
    variance = np.maximum(error_m**2 / 2, FIX_SD_M**2)
    columns = {}
    for name in ("var_east_m2", "var_north_m2"):
        columns[name] = np.where(np.isfinite(variance), variance, gnss[name].to_numpy())
    return replace(log, gnss=gnss.assign(**columns))


def with_range_errors(log: TrackLog, truth: Truth) -> TrackLog:
    """Return a log whose pseudoranges state the error that they really have, 1 m or more."""
    rows = log.pseudoranges
    error_m = range_errors_m(rows, truth, log.crs)
    sigma_m = np.hypot(FIX_SD_M, error_m)
    stated = np.where(np.isfinite(sigma_m), sigma_m, rows["sigma_m"].to_numpy())
    return replace(log, pseudoranges=rows.assign(sigma_m=stated))


def range_errors_m(rows: pd.DataFrame, truth: Truth, crs: str) -> Floats:
    """Return the errors of pseudoranges at the true places; NaN where these are not known.

    The clock at each moment is that of the satellites above 40°, if there are three, else of all.
    The height is the one of all that makes the errors smallest (their median).

    Parameters
    ----------
    rows : DataFrame
        A log's table ``pseudoranges``, with the satellites' places.
    """
    east, north = truth.at(rows["time_s"].to_numpy())
    known = np.isfinite(east)
    lon, lat = unproject(crs, east[known], north[known])
    sat = rows[["x_m", "y_m", "z_m"]].to_numpy(dtype=np.float64)[known]
    range_m = rows["pseudorange_m"].to_numpy(dtype=np.float64)[known]
    moment = np.unique(rows["time_s"].to_numpy()[known], return_inverse=True)[1]
    found = np.full(len(rows), np.nan)
    if not known.any():
        return found
    best = np.inf
    for height_m in _HEIGHTS_M:
        place = ecef_from_lonlat(lon, lat, np.full(len(lon), height_m))
        away = sat - place
        plain_m = np.linalg.norm(away, axis=1)
        # Up to a fifth of a degree the direction from the earth's centre is up.
        up = place / np.linalg.norm(place, axis=1)[:, None]
        high = np.einsum("ij,ij->i", away, up) / plain_m > np.sin(_HIGH_RAD)
        off_m = range_m - plain_m
        error_m = off_m - _clock_m(off_m, moment, high)
        middle = float(np.nanmedian(np.abs(error_m)))
        if middle < best:
            best, found[known] = middle, error_m
    return found


def _clock_m(off_m: Floats, moment: np.ndarray, high: Bools) -> Floats:
    """Return the clock's error at each row: the median at its moment, of high satellites if any."""
    table = pd.DataFrame({"moment": moment, "off": off_m, "high": np.where(high, off_m, np.nan)})
    group = table.groupby("moment")
    enough = group["high"].transform("count") >= _LEAST_HIGH
    clock = np.where(enough, group["high"].transform("median"), group["off"].transform("median"))
    return np.asarray(clock, dtype=np.float64)
