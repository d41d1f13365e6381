"""Turns that drift beside the course of positions, as of a gyroscope with a bias."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter.angles import wrap_rad
from mapfilter.tracks.checks.stretches import (
    motion_values,
    reckoned_m,
    steady_values,
    stretches,
)

_DEVIATIONS = 3.0
_LEAST_RADPS = float(np.radians(0.3))


def turn_drift_radps(motion: pd.DataFrame, places: pd.DataFrame) -> float:
    """Return how fast sums of turns drift beside the course of positions; 0 for a small drift.

    Corners between lines of some 50 m of the positions are compared with those of dead reckoning by
    the steps and turns. It is the median over all of them: more have its sign than chance has it by
    three deviations, and it is 0.3 deg/s or more.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m and turn_rad.
    places : pandas.DataFrame
        time_s, east_m and north_m.

    Examples
    --------
    >>> time_s = np.arange(201.0)
    >>> places = pd.DataFrame({"time_s": time_s, "east_m": 10 * time_s, "north_m": 0.0})
    >>> motion = pd.DataFrame({"time_s": time_s, "step_m": 10.0, "turn_rad": 0.01})
    >>> round(turn_drift_radps(motion, places), 4)
    0.01
    >>> turn_drift_radps(motion.assign(turn_rad=0.0), places)
    0.0
    """
    time_s, step_m = motion_values(motion, "time_s"), steady_values(motion, "step_m")
    corners = stretches(places, time_s, np.cumsum(np.abs(step_m)))
    if corners is None:
        return 0.0
    corners = corners.with_known(time_s, motion_values(motion, "turn_rad"))
    if not len(corners):
        return 0.0
    reckoned = reckoned_m(step_m, steady_values(motion, "turn_rad"))
    off_rad = wrap_rad(corners.turned_by(time_s, reckoned) - corners.turned_rad)
    # From the middle of one line to that of the next.
    rates_radps = off_rad / (corners.lasted_s / 2)
    usual_radps = float(np.median(rates_radps))
    # Of a coin, as many heads less tails have a variance of the number of throws.
    excess = abs(float(np.sign(rates_radps).sum()))
    is_shown = excess >= _DEVIATIONS * len(corners) ** 0.5 and abs(usual_radps) >= _LEAST_RADPS
    return usual_radps if is_shown else 0.0
