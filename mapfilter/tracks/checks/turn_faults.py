"""Turns that contradict the corners of positions: their sense of rotation and their unit."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats, Ints
from mapfilter.angles import wrap_rad
from mapfilter.tracks.checks.motion_fault import MotionFault
from mapfilter.tracks.checks.stretches import (
    USUAL_M,
    Stretches,
    motion_values,
    reckoned_m,
    rows_apart_s,
    steady_values,
    stretches,
)

_FEWEST = 6
_CORNER_RAD, _LEAST_RAD = np.deg2rad(30.0), np.deg2rad(20.0)
"""Least turn of a corner by positions, and by dead reckoning."""
_AGREED_RAD, _STRAIGHT_RAD = np.deg2rad(30.0), np.deg2rad(20.0)
_FEWEST_CORNERS, _BOTH, _AGREED, _LEAST_GAIN = 3, 2 / 3, 0.85, 0.25
_A_SECOND = 1.2
_OF_CURVES_M = 120.0
"""Lines between which the curves of a fast road are corners."""
_UNITS = {
    "degrees": np.pi / 180,
    "radians taken for degrees (rad/s for deg/s)": 180 / np.pi,
    "counted twice": 0.5,
    "half as large as they should be": 2.0,
    "revolutions per minute": 2 * np.pi / 60,
}
"""Factors that mend turns, by the mistake."""


def turn_fault(motion: pd.DataFrame, places: pd.DataFrame) -> MotionFault | None:
    """Return what is wrong with turns, their sense or unit; None for nothing.

    Dead reckoning by the steps and turns has corners of its own, which are compared with those of
    the positions, between lines of some 50 m. Turns are wrong where corners of 30 to 150 degrees,
    three or more, contradict them and fit the same turns the other way round, or in another unit,
    with which straight ways are straight, too. Where curves are so wide that there are no such
    corners, lines are of 150 m and more, and only the sense of turns is judged.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m and turn_rad.
    places : pandas.DataFrame
        time_s, east_m and north_m.

    Examples
    --------
    >>> turn = np.where(np.arange(400) % 20 == 10, np.pi / 2, 0.0) * np.repeat([1, -1, 1, -1], 100)
    >>> heading = np.cumsum(turn)
    >>> east, north = (np.cumsum(10 * f(heading - turn / 2)) for f in (np.cos, np.sin))
    >>> motion = pd.DataFrame({"time_s": np.arange(400.0), "step_m": 10.0, "turn_rad": -turn})
    >>> truth = pd.DataFrame({"time_s": np.arange(400.0), "east_m": east, "north_m": north})
    >>> print(turn_fault(motion, truth))
    turns run clockwise by the course of the positions; expected radians counter-clockwise, \
or latitude and longitude of the positions are swapped (--factor turn_rad=-1 mends it)
    >>> turn_fault(motion.assign(turn_rad=turn), truth) is None
    True
    """
    turn_rad = motion_values(motion, "turn_rad")
    if np.isfinite(turn_rad[1:]).sum() < _FEWEST:
        return None
    time_s, step_m = motion_values(motion, "time_s"), steady_values(motion, "step_m")
    for usual_m in (USUAL_M, _OF_CURVES_M):
        ways = stretches(places, time_s, np.cumsum(np.abs(step_m)), usual_m)
        if ways is None:
            return None
        ways = ways.with_known(time_s, turn_rad)
        corners = ways.where(_is_corner(ways.turned_rad, _CORNER_RAD))
        if _number(corners.first) >= _FEWEST_CORNERS:
            break
    else:
        return None
    turn_rad = steady_values(motion, "turn_rad")
    lasted_s = np.diff(time_s, prepend=time_s[:1])
    apart_s = rows_apart_s(time_s)
    # By long lines noise of turns resembles another unit of them.
    units: dict[str, Floats | float] = {"": 1.0, **(_UNITS if usual_m == USUAL_M else {})}
    if usual_m == USUAL_M and not 1 / _A_SECOND <= apart_s <= _A_SECOND:
        units[f"rates (rad/s) in rows {apart_s:.2g} s apart"] = lasted_s
        units[f"rates (degrees/s) in rows {apart_s:.2g} s apart"] = lasted_s * np.pi / 180
    agreed = {
        (unit, sign): _agreement(corners, time_s, step_m, sign * factor * turn_rad)
        for unit, factor in units.items()
        for sign in (1, -1)
    }
    (unit, sign), most = max(agreed.items(), key=lambda one: one[1])
    if most < max(_AGREED, agreed["", 1] + _LEAST_GAIN):
        return None
    mended = _off_rad(ways, time_s, step_m, sign * units[unit] * turn_rad)
    if np.mean(mended <= _STRAIGHT_RAD) < _AGREED:
        return None
    alike = [other for other in units if other and agreed[other, sign] == most]
    words = [f"are {' or '.join(alike)}"] if unit else []
    words += ["run clockwise"] if sign < 0 else []
    found = f"turns {' and '.join(words)} by the course of the positions"
    mirrored = "" if unit or sign > 0 else "latitude and longitude of the positions are swapped"
    # Of rows that mostly have the time of another one, the median is 0.
    factor = sign * float(np.median(units[unit]) or np.mean(units[unit]))
    return MotionFault("turn_rad", found, "radians counter-clockwise", factor, otherwise=mirrored)


def _is_corner(turned_rad: Floats, least_rad: float) -> Bools:
    """Return which turns are neither straight on nor back, which look alike both ways round."""
    turned_rad = np.abs(turned_rad)
    return np.asarray((turned_rad >= least_rad) & (turned_rad <= np.pi - least_rad))


def _number(first: Ints) -> int:
    """Return how many corners pairs of lines show, as one corner lies in two pairs that overlap."""
    runs = np.bincount(np.cumsum(np.diff(first, prepend=first[:1]) != 1)) if first.size else first
    return int(((runs + 1) // 2).sum())


def _agreement(corners: Stretches, time_s: Floats, step_m: Floats, turn_rad: Floats) -> float:
    """Return the share of corners that dead reckoning by steps and turns has, too."""
    turned_rad = corners.turned_by(time_s, reckoned_m(step_m, turn_rad))
    both = _is_corner(turned_rad, _LEAST_RAD)
    if _number(corners.first[both]) < _FEWEST_CORNERS or both.mean() < _BOTH:
        return 0.0
    # Five times a right angle has the same course, and is a whole turn more.
    more_rad = corners.grown(time_s, np.cumsum(turn_rad)).real - corners.turned_rad
    near = np.abs(wrap_rad(turned_rad - corners.turned_rad)) <= _AGREED_RAD
    return float(np.mean((near & (np.abs(more_rad) <= np.pi))[both]))


def _off_rad(ways: Stretches, time_s: Floats, step_m: Floats, turn_rad: Floats) -> Floats:
    """Return how far off changes of course are by dead reckoning by steps and turns."""
    turned_rad = ways.turned_by(time_s, reckoned_m(step_m, turn_rad))
    return np.asarray(np.abs(wrap_rad(turned_rad - ways.turned_rad)))
