"""Heights by a barometer, and whether a change of height was climbed or ridden."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats

_WINDOW_S = 4.0
_RATE_MPS = 0.15
_LEAST_S = 3.0
_LEAST_M = 1.5
_JOIN_S = 6.0
_CLIMB_STEPS_PER_S = 0.7
_TICK_S = 0.5
_SCALE_M, _EXPONENT = 44_330.77, 0.190263
TREAD_M = 0.30
"""Horizontal length of a step on stairs."""


@dataclass(frozen=True, slots=True)
class Climb:
    """One change of height.

    Parameters
    ----------
    begin_s, end_s : float
    rise_m : float
        Negative downward.
    kind : {"stairs", "lift"}
        Whether there were steps meanwhile; an escalator on which one stands is a lift, too.
    """

    begin_s: float
    end_s: float
    rise_m: float
    kind: Literal["stairs", "lift"]


def height_m(pressure_hpa: Floats) -> Floats:
    """Return heights above the first sample in the standard atmosphere.

    Examples
    --------
    >>> height_m(np.array([1013.25, 1012.05])).round(2).tolist()
    [0.0, 9.99]
    """
    ratio = pressure_hpa / 1013.25
    heights: Floats = _SCALE_M * (ratio[0] ** _EXPONENT - ratio**_EXPONENT)
    return heights


def climbs(barometer: pd.DataFrame, step_s: Floats) -> tuple[Climb, ...]:
    """Return changes of height by 1.5 m or more, faster than 0.15 m/s.

    The weather changes pressure by less than 0.01 m/s, a door or a gust for less than 3 s.

    Parameters
    ----------
    barometer : pandas.DataFrame
        time_s, pressure_hpa.
    step_s : (K,) array
        Times of steps: more than 0.7 a second make stairs, fewer a lift.
    """
    rows = barometer.dropna().drop_duplicates("time_s").sort_values("time_s")
    known_s = rows["time_s"].to_numpy(dtype=np.float64)
    if len(known_s) < 3 or np.ptp(known_s) < 2 * _WINDOW_S:
        return ()
    known_m = height_m(rows["pressure_hpa"].to_numpy(dtype=np.float64))
    time_s = np.arange(known_s[0], known_s[-1], _TICK_S)
    height = _smoothed(time_s, known_s, known_m)
    half = int(_WINDOW_S / 2 / _TICK_S)
    rate = np.zeros_like(height)
    rate[half:-half] = (height[2 * half :] - height[: -2 * half]) / _WINDOW_S
    found = []
    for sign in (1.0, -1.0):
        for begin, end in _spells(time_s, sign * rate > _RATE_MPS):
            rise = float(np.interp(end, time_s, height) - np.interp(begin, time_s, height))
            if sign * rise < _LEAST_M:
                continue
            steps = int(np.sum((step_s >= begin) & (step_s <= end)))
            climbed = steps > _CLIMB_STEPS_PER_S * (end - begin)
            found.append(Climb(begin, end, rise, "stairs" if climbed else "lift"))
    return tuple(sorted(found, key=lambda climb: climb.begin_s))


def _smoothed(time_s: Floats, known_s: Floats, known_m: Floats) -> Floats:
    """Return medians over a second, or the value between samples that are rarer."""
    first = np.searchsorted(known_s, time_s - 0.5)
    last = np.searchsorted(known_s, time_s + 0.5)
    between = np.interp(time_s, known_s, known_m)
    several = zip(first, last, between, strict=True)
    return np.array([np.median(known_m[i:j]) if j - i > 2 else value for i, j, value in several])


def _spells(time_s: Floats, changing: Bools) -> list[tuple[float, float]]:
    """Return begin and end of the times of change: landings are part of stairs."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], changing.astype(np.int8), [0]])))
    spells: list[tuple[float, float]] = []
    for i, j in zip(edges[::2], edges[1::2], strict=True):
        begin, end = float(time_s[i]), float(time_s[j - 1])
        if spells and begin - spells[-1][1] <= _JOIN_S:
            spells[-1] = (spells[-1][0], end)
        else:
            spells.append((begin, end))
    return [(begin, end) for begin, end in spells if end - begin >= _LEAST_S]
