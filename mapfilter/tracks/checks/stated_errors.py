"""Positions that state far smaller errors than others of the same moments show, such as HDOP."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.tracks.joining.position_units import RADIUS_68

_RADIUS_50 = 1.177
"""Radius of half of a two-dimensional normal distribution, in standard deviations."""
_SHIFTS_S = np.arange(-3.0, 3.25, 0.5)
_FEWEST = 20
_TIMES, _LEAST_M = 3.0, 3.0
_AS_HDOP = (0.4, 2.0)
"""Medians that dilutions of precision have."""


def stated_note(fixes: pd.DataFrame, other: pd.DataFrame, of: str) -> str:
    """Return a note where fixes lie several times as far from others as both state; "" else.

    Only statements that are as small as a horizontal dilution of precision (HDOP) are judged, and
    clocks may differ by up to 3 s.

    Parameters
    ----------
    fixes : pandas.DataFrame
        time_s, east_m, north_m and var_east_m2, in order.
    other : pandas.DataFrame
        The same of another receiver, or ground truth, which has no variance.
    of : str
        What the others are, for the note.

    Examples
    --------
    >>> time_s = np.arange(60.0)
    >>> off_m = 8.0 * (-1.0) ** time_s
    >>> true = pd.DataFrame({"time_s": time_s, "east_m": 5 * time_s, "north_m": 0.0})
    >>> fixes = true.assign(north_m=off_m, var_east_m2=0.3)
    >>> stated_note(fixes, true, "the truth")[:80]
    'positions lie 8.0 m (median) from those of the truth, 12 times as far as stated '
    >>> stated_note(fixes.assign(var_east_m2=30.0), true, "the truth")
    ''
    """
    stated_m2 = _variance(fixes)
    known = np.isfinite(stated_m2)
    if known.sum() < _FEWEST or len(other) < _FEWEST:
        return ""
    fixes, stated_m2 = fixes[known], stated_m2[known]
    radius_m = RADIUS_68 * float(np.median(np.sqrt(stated_m2)))
    if not _AS_HDOP[0] <= radius_m <= _AS_HDOP[1]:
        return ""
    if "var_east_m2" in other and not np.isfinite(_variance(other)).all():
        return ""
    found = [_apart(fixes, stated_m2, other, shift_s) for shift_s in _SHIFTS_S]
    if any(one is None for one in found):
        return ""
    apart_m, times = min(one for one in found if one is not None)
    if times < _TIMES or apart_m < _LEAST_M:
        return ""
    return (
        f"positions lie {apart_m:.1f} m (median) from those of {of}, {times:.0f} times as far as "
        f"stated (accuracy {radius_m:.2g}; likely: HDOP, which has no unit: --column hdop=COLUMN; "
        "or a receiver that states too little)"
    )


def _apart(
    fixes: pd.DataFrame, stated_m2: Floats, other: pd.DataFrame, shift_s: float
) -> tuple[float, float] | None:
    """Return the median distance, and how many times as large as stated it is; None for few."""
    time_s = fixes["time_s"].to_numpy(dtype=np.float64) + shift_s
    there_s = other["time_s"].to_numpy(dtype=np.float64)
    inside = (time_s >= there_s[0]) & (time_s <= there_s[-1])
    if inside.sum() < _FEWEST:
        return None
    off_m = np.hypot(
        *(
            np.interp(time_s, there_s, other[axis].to_numpy(dtype=np.float64))
            - fixes[axis].to_numpy(dtype=np.float64)
            for axis in ("east_m", "north_m")
        )
    )[inside]
    variance_m2 = stated_m2[inside]
    if "var_east_m2" in other:
        variance_m2 = variance_m2 + np.interp(time_s[inside], there_s, _variance(other))
    return float(np.median(off_m)), float(np.median(off_m / (_RADIUS_50 * np.sqrt(variance_m2))))


def _variance(rows: pd.DataFrame) -> Floats:
    return np.asarray(rows["var_east_m2"], dtype=np.float64)
