"""Turns while a vehicle stands: the noise and the bias of its gyroscope."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter.tracks.pdr.gyroscope import WALK_RAD_PER_SQRT_S

_LEAST_ROWS, _LEAST_S, _LONGEST_S = 20, 20.0, 5.0
"""Rows at standstill that show it, and their time; longer rows are pauses."""


class StandingTurns(NamedTuple):
    """What turns at standstill show.

    Parameters
    ----------
    bias_radps : float
        Lasting error of the rate of turns.
    walk_rad_per_sqrt_s : float
        Random walk of their sum, with that of a usual gyroscope on the way.
    """

    bias_radps: float
    walk_rad_per_sqrt_s: float


def turns_at_standstill(motion: pd.DataFrame) -> StandingTurns | None:
    """Return what turns of a vehicle that stands show; None where they are too few.

    So it is where half of them are zero or more: they are held at standstill, or rounded.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m and turn_rad.

    Examples
    --------
    >>> turn_rad = 0.01 + 0.002 * np.resize([1.0, 0.0, -1.0], 40)
    >>> motion = pd.DataFrame({"time_s": np.arange(40.0), "step_m": 0.0, "turn_rad": turn_rad})
    >>> found = turns_at_standstill(motion)
    >>> round(found.bias_radps, 4), round(float(np.degrees(found.walk_rad_per_sqrt_s)), 2)
    (0.01, 0.23)
    >>> turns_at_standstill(motion.assign(turn_rad=0.0)) is None
    True
    """
    step_m, turn_rad = (motion[name].to_numpy(dtype=np.float64) for name in ("step_m", "turn_rad"))
    lasted_s = np.diff(motion["time_s"].to_numpy(dtype=np.float64), prepend=np.nan)
    stands = (step_m == 0) & np.isfinite(turn_rad) & (lasted_s > 0) & (lasted_s <= _LONGEST_S)
    turned, lasted_s = turn_rad[stands], lasted_s[stands]
    if len(turned) < _LEAST_ROWS or lasted_s.sum() < _LEAST_S or np.mean(turned == 0) >= 0.5:
        return None
    bias_radps = float(np.median(turned / lasted_s))
    off = (turned - bias_radps * lasted_s) / np.sqrt(lasted_s)
    noise = MAD_TO_SD * float(np.median(np.abs(off)))
    if noise == 0:
        return None
    return StandingTurns(bias_radps, float(np.hypot(WALK_RAD_PER_SQRT_S, noise)))
