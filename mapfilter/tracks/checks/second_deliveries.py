"""Rows of motion that were delivered twice, as the filters find them while they go on."""

from __future__ import annotations

import numpy as np
import pandas as pd

_LEAST_PAIRS, _MOSTLY, _SOONER = 8, 0.8, 0.8
"""Pairs, share of the moving rows that are in pairs, and the interval within a pair relative to the
one before it."""
_VALUES = ("step_m", "heading_rad", "turn_rad")


def once_each(motion: pd.DataFrame) -> pd.DataFrame:
    """Return motion without second deliveries, where nearly all of its rows come twice.

    Filters use one row of each pair, so that speeds and lengths are those of half of the rows.
    Pairs are two equal rows, one after the other, sooner than the row before them; rows at regular
    times are those of a sensor that is read more often than it measures.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s and step_m, and heading_rad and turn_rad where they are known; sorted by time.

    Examples
    --------
    >>> step_m = np.repeat(np.linspace(1.3, 1.5, 20), 2)
    >>> time_s = np.repeat(np.arange(20.0), 2) + np.tile([0.0, 0.1], 20)
    >>> len(once_each(pd.DataFrame({"time_s": time_s, "step_m": step_m})))
    20
    >>> len(once_each(pd.DataFrame({"time_s": np.arange(40.0), "step_m": step_m})))
    40
    """
    if len(motion) < 2 * _LEAST_PAIRS:
        return motion
    columns = [motion[name].to_numpy(dtype=np.float64) for name in _VALUES if name in motion]
    values = np.column_stack(columns)
    same = (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    step_m = motion["step_m"].to_numpy(dtype=np.float64)
    moving = np.isfinite(step_m) & (step_m != 0)
    equal = same.all(axis=1) & moving[1:]
    lasted_s = np.diff(motion["time_s"].to_numpy(dtype=np.float64))
    alone = ~np.concatenate([[False], equal[:-1]])
    sooner = lasted_s < _SOONER * np.concatenate([[np.inf], lasted_s[:-1]])
    second = np.concatenate([[False], equal & alone & sooner])
    pairs = int(second.sum())
    if pairs < _LEAST_PAIRS or 2 * pairs < _MOSTLY * moving.sum():
        return motion
    return motion[~second]
