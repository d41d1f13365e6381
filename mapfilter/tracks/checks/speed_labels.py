"""Speeds whose column states another unit than theirs: km/h, mph and knots, told by positions.

They differ by less than most faults of motion, and by a known factor.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from mapfilter._constants import KMH_MPS, KNOT_MPS, MPH_MPS
from mapfilter.tracks.checks.motion_fault import MotionFault
from mapfilter.tracks.checks.motion_faults import is_constant, step_factors

_LABELS: Mapping[str, float] = {
    "mph in a column of km/h": KMH_MPS / MPH_MPS,
    "km/h in a column of mph": MPH_MPS / KMH_MPS,
    "knots in a column of km/h": KMH_MPS / KNOT_MPS,
    "km/h in a column of knots": KNOT_MPS / KMH_MPS,
}
"""How many times as fast speeds seem, by the mistake."""
_NEAR = 1.06
"""Wheels that are worn, or of another size, are off by some per cent."""
_FEWEST = 6


def speed_label_fault(
    time_s: pd.Series, speed_mps: pd.Series, places: pd.DataFrame
) -> MotionFault | None:
    """Return the fault of speeds that positions show to be of another unit; None for others.

    Parameters
    ----------
    time_s, speed_mps : (N,) series
        In order.
    places : pandas.DataFrame
        time_s, east_m and north_m.

    Examples
    --------
    >>> time_s = pd.Series(np.arange(101.0))
    >>> places = pd.DataFrame({"time_s": time_s, "east_m": 10 * time_s, "north_m": 0.0})
    >>> print(speed_label_fault(time_s, time_s * 0 + 6.2, places))
    speeds are 0.62 times those between positions (mph in a column of km/h?); expected m/s \
(--factor step_m=1.609 mends it)
    >>> speed_label_fault(time_s, time_s * 0 + 8.0, places) is None
    True
    """
    motion = pd.DataFrame({"time_s": time_s, "step_m": speed_mps * time_s.diff()})
    factor = step_factors(motion.assign(heading_rad=np.nan, turn_rad=np.nan), places)
    if factor.size < _FEWEST or not is_constant(factor):
        return None
    typical = max(float(np.median(factor)), 1e-9)
    off = {label: abs(float(np.log(typical / ratio))) for label, ratio in _LABELS.items()}
    nearest = min(off, key=off.__getitem__)
    if off[nearest] > np.log(_NEAR):
        return None
    found = f"speeds are {typical:.3g} times those between positions ({nearest}?)"
    return MotionFault("step_m", found, "m/s", 1 / _LABELS[nearest])
