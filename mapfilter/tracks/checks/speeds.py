"""Speeds of a log's motion, compared with those of walkers."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._constants import FOOT_M
from mapfilter.tracks.checks.second_deliveries import once_each

SLOWEST_MPS, FASTEST_MPS, MOTOR_MPS = 0.6, 2.6, 8.0
"""Bounds of the mean speed of a walker that moves; speed from which on it is not a walker's even if
lengths are in feet."""

_STANDING_MPS, _LEAST_ROWS, _LONGEST_S = 0.1, 30, 10.0


def walkers_unit_m(speed_mps: float) -> float:
    """Return the unit of steps in which a mean speed may be a walker's; 1 if there is none.

    Parameters
    ----------
    speed_mps : float
        With steps taken for metres.

    Examples
    --------
    >>> [round(walkers_unit_m(speed_mps), 4) for speed_mps in (0.4, 1.3, 4.4, 8.2)]
    [3.2808, 1.0, 0.3048, 1.0]
    """
    if speed_mps < SLOWEST_MPS:
        return 1 / FOOT_M
    return FOOT_M if FASTEST_MPS < speed_mps < MOTOR_MPS else 1.0


def speed_fault(motion: pd.DataFrame) -> str:
    """Return what is wrong with the speed of steps with headings, if they are those of a walker.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m and heading_rad.

    Returns
    -------
    str
        Speed found and expected, and the likely mistake; empty where the speed is a walker's, or
        there are fewer than 30 steps with headings.

    Examples
    --------
    >>> rows = pd.DataFrame({"time_s": np.arange(60.0), "step_m": 4.4, "heading_rad": 0.0})
    >>> speed_fault(rows)
    'steps of 4.4 m/s, expected 0.6 to 2.6 m/s of a walker (lengths in feet?)'
    >>> speed_fault(rows.assign(step_m=1.3))
    ''
    """
    if not motion["heading_rad"].notna().any():
        return ""
    motion = once_each(motion)
    time_s, step_m = (motion[name].to_numpy(dtype=np.float64) for name in ("time_s", "step_m"))
    lasted_s, length_m = np.diff(time_s), np.abs(step_m[1:])
    known = np.isfinite(length_m) & (lasted_s > 0) & (lasted_s <= _LONGEST_S)
    moving = known & (length_m > _STANDING_MPS * lasted_s)
    if moving.sum() < _LEAST_ROWS:
        return ""
    speed_mps = float(length_m[moving].sum() / lasted_s[moving].sum())
    if SLOWEST_MPS <= speed_mps <= FASTEST_MPS:
        return ""
    found = f"steps of {speed_mps:.1f} m/s, expected {SLOWEST_MPS:g} to {FASTEST_MPS:g} m/s of a "
    unit_m = walkers_unit_m(speed_mps)
    if unit_m == 1.0:
        return f"{found}walker"
    return f"{found}walker ({'lengths in feet' if unit_m < 1 else 'metres taken for feet'}?)"
