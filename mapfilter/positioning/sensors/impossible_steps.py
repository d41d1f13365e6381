"""Steps that nothing can have gone: a sensor that jumps, or a length in the wrong field.

One such row would put all hypotheses where nobody is. It is read as a row that lacks its length.
What flies, and passes the limit after it was below, has no length from there on.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, nan

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.sensors.pace import Pace

_FASTEST_MPS, _AT_ONCE_M = 150.0, 50.0
"""Speed of the fastest trains, and the way of rows that come late together, or at jittering times;
a row beyond both has no length."""


def without_impossible(
    pace: Pace, time_s: float, motion: tuple[MotionStep, ...], step_unit_m: float
) -> tuple[MotionStep, ...]:
    """Return the motion rows of an epoch without lengths that nothing can have gone.

    Parameters
    ----------
    pace : Pace
        Of the rows before. While it is not known, or is itself no speed of a vehicle, as of steps
        in millimetres, lengths are left as they are.
    time_s : float
        Time of the epoch.
    motion : tuple of MotionStep
        Lengths are in the unit of the log.
    step_unit_m : float
        That unit.

    Returns
    -------
    tuple of MotionStep
        The same tuple where nothing is left out; a length that is left out is NaN.
    """
    if not pace.is_known or step_unit_m * pace.speed_mps > _FASTEST_MPS:
        return motion
    # A step may cover the time of rows without one before it, as of a coarse odometer.
    since_s = time_s - pace.stepped_s
    if not isfinite(since_s):
        return motion
    farthest_m = _AT_ONCE_M + _FASTEST_MPS * max(since_s, 0.0)
    too_far = [step_unit_m * abs(step.step_m) > farthest_m for step in motion]
    if not any(too_far):
        return motion
    return tuple(
        replace(step, step_m=nan, spread_m=nan) if far else step
        for step, far in zip(motion, too_far, strict=True)
    )
