"""Rows of a vehicle's odometry without a speed or yaw rate, or with what a bus sends for them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.moved import odometry_gaps

_JUMP_MPS, _JUMP_MPS2 = 15.0, 30.0
"""Three times what brakes reach."""
_FULL_SCALE_MPS = 55.0
"""Marks are the ends of scales (255 km/h, 65 m/s): other speeds between zeros are good ones."""
_NEAR_S = 1.0
_SPEED_SD_MPS, _SCALE = 0.05, 0.02
"""Errors of speeds of wheels: white, where a recording states none, and a lasting share."""
_CORNER_RAD = np.pi / 4
"""Turn of a vehicle between two rests that has moved in between."""


def usable_rows(rows: pd.DataFrame) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return odometry without speeds that come and go at once, and with yaw rates joined.

    A speed that stays the same to the last digit, far above those before and after it, is no
    motion, and missing. A missing yaw rate between rows that have one, each at most a second away,
    is theirs in proportion to time. Rows without a speed are dropped but for those with a yaw rate
    where speeds are missing for long while it moves: there they tell how it turned.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, rising; speed_mps, yaw_rate_radps.

    Returns
    -------
    rows : pandas.DataFrame
        Where nothing is missing the same table.
    notes : tuple of str

    Examples
    --------
    >>> rows = pd.DataFrame({"time_s": [0.0, 0.1, 0.2, 0.3], "speed_mps": [9.0, 71.1, 71.1, 9.1],
    ...     "yaw_rate_radps": [0.1, 0.1, 0.1, 0.1]})
    >>> kept, notes = usable_rows(rows)
    >>> kept["speed_mps"].tolist()
    [9.0, 9.1]
    >>> notes[0][:56]
    'odometry: 2 speeds that come and go at once, such as 71.'
    """
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    speed = rows["speed_mps"].to_numpy(dtype=np.float64)
    notes: tuple[str, ...] = ()
    marks = _sudden(time_s, np.abs(speed))
    if count := int(marks.sum()):
        first = float(speed[np.flatnonzero(marks)[0]])
        notes += (
            f"odometry: {number_of(count, 'speed')} that come and go at once, such as "
            f"{first:.1f} m/s ({3.6 * first:.0f} km/h), taken as missing (likely: what a bus sends "
            "where it has no value)",
        )
        rows = rows.assign(speed_mps=np.where(marks, np.nan, speed))
    rate = rows["yaw_rate_radps"].to_numpy(dtype=np.float64)
    joined = _between(time_s, rate)
    if count := int(np.isfinite(joined).sum() - np.isfinite(rate).sum()):
        notes += (f"odometry: {number_of(count, 'yaw rate')} taken from the rows around",)
        rows = rows.assign(yaw_rate_radps=joined)
    kept = _telling(time_s, rows["speed_mps"].to_numpy(dtype=np.float64), joined)
    return rows if kept.all() else rows[kept].reset_index(drop=True), notes


def gap_notes(time_s: Floats, speed: Floats, turn: Floats) -> tuple[str, ...]:
    """Return notes on gaps, by whether turns are known over them.

    Parameters
    ----------
    time_s, speed, turn : (N,) array
        Rising times, speeds and turns of each interval; NaN where unknown.
    """
    known = np.flatnonzero(np.isfinite(speed))
    # Rows without a speed are those of a gap.
    is_gap = odometry_gaps(time_s[known], speed[known])
    is_gap[1:] |= np.diff(known) > 1
    gaps = np.flatnonzero(is_gap)
    if not gaps.size:
        return ()
    first, last = known[gaps - 1], known[gaps]
    unknown = np.concatenate([[0], np.cumsum(np.isnan(turn))])
    turned = unknown[last + 1] == unknown[first + 1]
    notes: tuple[str, ...] = ()
    for of, what in ((~turned, "motion is not known"), (turned, "turns alone are known")):
        if of.any():
            longest_s = float((time_s[last] - time_s[first])[of].max())
            words = number_of(int(of.sum()), "gap")
            notes += (f"odometry: {words} (longest {longest_s:.1f} s), over which {what}",)
    return notes


def usual_s(time_s: Floats) -> float:
    """Return the median time between rows; a second for a single one."""
    return float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0


def speed_errors(rows: pd.DataFrame) -> ImuNoise:
    """Return the errors of steps by the speeds of rows; those of directions are any."""
    period_s = usual_s(rows["time_s"].to_numpy(dtype=np.float64))
    stated = float(rows["speed_sd_mps"].median()) if "speed_sd_mps" in rows else np.nan
    sd_mps = stated if np.isfinite(stated) else _SPEED_SD_MPS
    return ImuNoise(period_s=period_s, sigma_trans_m=sd_mps * period_s, scale=_SCALE)


def _telling(time_s: Floats, speed: Floats, rate: Floats) -> Bools:
    """Return the rows with speeds, and over gaps of these, also the last one, those with yaw rates.

    Between two rests there is a gap where the yaw rates of the time take a corner.
    """
    kept = np.isfinite(speed)
    if not kept.any():
        return ~kept
    known, others = np.flatnonzero(kept), np.flatnonzero(~kept & np.isfinite(rate))
    after = np.searchsorted(known, others)
    ends_s = np.append(time_s[known], time_s[-1])
    turned = np.zeros(ends_s.size)
    np.add.at(turned, after, np.diff(time_s, prepend=time_s[0])[others] * rate[others])
    moves = np.append(np.where(np.abs(turned[:-1]) >= _CORNER_RAD, np.nan, speed[known]), np.nan)
    gaps = odometry_gaps(ends_s, moves)
    gaps[0] = False
    kept[others[gaps[after]]] = True
    return kept


def _sudden(time_s: Floats, speed: Floats) -> Bools:
    """Return the rows of runs of one speed that is reached, and left, as no vehicle could."""
    given = np.isfinite(speed)
    if not given.all():
        found = np.zeros(speed.size, dtype=np.bool_)
        found[given] = _sudden(time_s[given], speed[given])
        return found
    if speed.size < 3:
        return np.zeros(speed.size, dtype=np.bool_)
    begin = np.flatnonzero(np.concatenate([[True], speed[1:] != speed[:-1]]))
    end = np.append(begin[1:], speed.size)
    number = np.repeat(np.arange(begin.size), end - begin)
    value, inner = speed[begin], slice(1, begin.size - 1)
    rise = np.diff(value)
    fast = np.abs(rise) > np.maximum(
        _JUMP_MPS, _JUMP_MPS2 * (time_s[begin[1:]] - time_s[end[:-1] - 1])
    )
    up, down = fast & (rise > 0), fast & (rise < 0)
    found = np.zeros(begin.size, dtype=np.bool_)
    found[inner] = up[:-1] & down[1:]
    if begin.size > 1:
        found[0], found[-1] = down[0], up[-1]
    return np.asarray((found & (value > _FULL_SCALE_MPS))[number])


def _between(time_s: Floats, rate: Floats) -> Floats:
    """Return rates with missing ones between those of rows at most a second away."""
    known = np.flatnonzero(np.isfinite(rate))
    missing = np.flatnonzero(~np.isfinite(rate))
    if not known.size or not missing.size:
        return rate
    after = np.searchsorted(known, missing)
    inside = (after > 0) & (after < known.size)
    missing, after = missing[inside], after[inside]
    early, late = known[after - 1], known[after]
    near = (time_s[missing] - time_s[early] <= _NEAR_S) & (
        time_s[late] - time_s[missing] <= _NEAR_S
    )
    joined = rate.copy()
    joined[missing[near]] = np.interp(time_s[missing[near]], time_s[known], rate[known])
    return joined
