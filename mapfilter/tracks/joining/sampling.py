"""Errors of steps that are made of velocities sampled seconds apart.

When the velocity changed between two samples is not known. Had it changed at once, at any moment of
the interval, the displacement by the mean of both would have the deviation ``T |Δv| / √12``. Real
velocities change gradually, over some seconds, so short intervals err by a small part of that and
long ones by most of it.
"""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats

_LASTS_S = 5.0
"""How long changes of velocity last: errors are T / (T + 5 s) of those of sudden changes."""


def sampling_sd_m(time_s: Floats, east_mps: Floats, north_mps: Floats) -> Floats:
    """Return the deviations of displacements by the mean velocity of both ends of each interval.

    A change back and forth between two samples does not show in them, but in a journey that has
    such changes neighbouring intervals have others: half of the squared change is that of the
    interval itself, half that of its neighbours.

    Parameters
    ----------
    time_s, east_mps, north_mps : (N,) array
        Samples; NaN where the velocity is not known.

    Returns
    -------
    (N - 1,) array
        To the east as to the north; 0 where a velocity is not known at either end. Such an interval
        adds nothing to its neighbours.

    Examples
    --------
    >>> time_s, east_mps = np.array([0.0, 6.0, 12.0, 18.0]), np.array([9.0, 9.0, 0.0, 0.0])
    >>> sampling_sd_m(time_s, east_mps, np.zeros(4)).round(1).tolist()
    [4.3, 6.0, 4.3]
    """
    lasted_s = np.diff(np.asarray(time_s, dtype=np.float64))
    square = np.diff(east_mps) ** 2 + np.diff(north_mps) ** 2
    if not square.size:
        return np.empty(0)
    known = np.isfinite(square)
    square = np.where(known, square, 0.0)
    beside = np.pad(square, 1, mode="edge")
    usual = square / 2 + (beside[:-2] + beside[2:]) / 4
    share = lasted_s / (lasted_s + _LASTS_S)
    return np.where(known, share * lasted_s * np.sqrt(usual / 12), 0.0)
