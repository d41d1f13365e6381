"""Checks of headings: sense of rotation and reference by positions, and the unit of a compass."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.tracks.checks.motion_fault import MotionFault
from mapfilter.tracks.checks.stretches import known_places
from mapfilter.tracks.joining.moved import long_gaps

_EXPECTED, _COMPASS = "counter-clockwise from east", "--column compass_deg=COLUMN"
_LEAST_M = 2.0
_FEWEST = 20
_CONSTANT = 0.9
_LEAST_GAIN, _MIRRORED = 0.3, 0.85
_OFF_RAD = np.deg2rad(45.0)
_WALKED_M = 100.0
_TURNED = np.pi / 2
_ROUNDED = 0.005
_LASTING = 0.25


def heading_fault(motion: pd.DataFrame, places: pd.DataFrame) -> MotionFault | None:
    """Return what is wrong with a log's headings, by its positions; None for nothing.

    The course of the positions minus the heading is 0 where headings are as they should be. Where
    headings run clockwise, it is the sum of both that stays the same: π/2 if they count from north.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m and heading_rad.
    places : pandas.DataFrame
        time_s, east_m and north_m: ground truth, or fixes by GNSS.

    Examples
    --------
    >>> time_s = np.arange(101.0)
    >>> course = np.deg2rad(3.6) * np.arange(1, 101)
    >>> east, north = (np.cumsum(np.append(0.0, 3 * f(course))) for f in (np.cos, np.sin))
    >>> truth = pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north})
    >>> wrong = np.pi / 2 - course
    >>> steps = pd.DataFrame({"time_s": time_s[1:], "step_m": 3.0, "heading_rad": wrong})
    >>> print(heading_fault(steps, truth))
    headings run clockwise from north (compass degrees?); expected counter-clockwise from east \
(--column compass_deg=COLUMN mends it)
    >>> heading_fault(steps.assign(heading_rad=course), truth) is None
    True
    """
    heading, course = headings_and_courses(motion, places)
    if heading.size < _FEWEST:
        return None
    same, other = (np.mean(np.exp(1j * (course + sign * heading))) for sign in (-1, 1))
    if abs(other) >= _CONSTANT and abs(other) - abs(same) >= _LEAST_GAIN:
        reference_deg = np.rad2deg(np.angle(other))
        from_north = abs(reference_deg - 90) <= 45
        origin = "north (compass degrees?)" if from_north else "another axis"
        found, remedy = f"headings run clockwise from {origin}", _COMPASS if from_north else ""
        return MotionFault("heading_rad", found, _EXPECTED, remedy=remedy)
    off_rad = float(np.angle(same))
    # A straight way has one course, which any sense of rotation fits.
    varied = abs(np.mean(np.exp(1j * course))) < _CONSTANT
    if varied and abs(same) >= _CONSTANT and abs(off_rad) >= _OFF_RAD:
        off_deg = np.rad2deg(off_rad)
        origin = " (counted from north?)" if abs(off_deg - 90) <= 20 else ""
        found = f"headings are {off_deg:.0f} degrees off the course of the positions{origin}"
        return MotionFault("heading_rad", found, _EXPECTED)
    return None


def are_mirrored(motion: pd.DataFrame, places: pd.DataFrame) -> bool:
    """Return whether headings are surely a mirror image of the course of the positions.

    About any axis; a phone that is turned once, as at the only corner of a walk, does not explain
    it.

    Parameters
    ----------
    motion, places : pandas.DataFrame
        As of :func:`heading_fault`.

    Examples
    --------
    >>> course = np.repeat([0.0, 1.6, 0.0, -1.6], 50)
    >>> east, north = (np.cumsum(np.append(0.0, 3 * f(course))) for f in (np.cos, np.sin))
    >>> truth = pd.DataFrame({"time_s": np.arange(201.0), "east_m": east, "north_m": north})
    >>> steps = pd.DataFrame({"time_s": np.arange(1.0, 201.0), "step_m": 3.0})
    >>> are_mirrored(steps.assign(heading_rad=np.pi - course), truth)
    True
    >>> are_mirrored(steps.assign(heading_rad=course), truth)
    False
    """
    heading, course = headings_and_courses(motion, places)
    if heading.size < _FEWEST:
        return False
    sums = np.cumsum(np.exp(1j * (course - heading)))
    turned_once = float((np.abs(sums) + np.abs(sums[-1] - sums)).max()) / heading.size
    mirrored = float(abs(np.mean(np.exp(1j * (course + heading)))))
    return mirrored >= _MIRRORED and mirrored - turned_once >= _LEAST_GAIN


def compass_fault(azimuth_deg: Floats, walked_m: float) -> str:
    """Return what is wrong with the unit of azimuths; an empty text for nothing.

    Radians read as degrees all lie within one turn, 0 to 2π or -π to π, however the walk turns: in
    degrees that is a walk straight to the north, whose compass scatters by degrees from row to row.
    Azimuths are taken for radians where they lie so over 100 m, differ by π/2 or more, and keep
    their value from one row to the next. Whole numbers are degrees.

    Parameters
    ----------
    azimuth_deg : (N,) array
        Azimuths of rows with steps, a second or more apart; NaN where unknown.
    walked_m : float
        Length of the way.

    Examples
    --------
    >>> way = np.repeat([0.1, 1.6, 3.2, 1.6], 40)
    >>> compass_fault(way, 110.0)
    'compass_deg: all azimuths lie within 0.1..3.2 over 110 m: radians for degrees?'
    >>> compass_fault(np.degrees(way), 110.0)
    ''
    """
    known = azimuth_deg[np.isfinite(azimuth_deg)]
    if known.size < _FEWEST or walked_m < _WALKED_M:
        return ""
    low, high = float(known.min()), float(known.max())
    begin = 0.0 if low >= -_ROUNDED else -np.pi
    within = low >= begin - _ROUNDED and high <= begin + 2 * np.pi + _ROUNDED
    if not within or high - low < _TURNED or (known == np.round(known)).all():
        return ""
    # The median is that of straight ways: corners do not count.
    if np.median(np.abs(wrap_rad(np.diff(known)))) > _LASTING * np.std(known):
        return ""
    span = f"{low:.1f}..{high:.1f} over {walked_m:.0f} m"
    return f"compass_deg: all azimuths lie within {span}: radians for degrees?"


def compass_notes(azimuth_deg: pd.Series, step_m: pd.Series) -> tuple[str, ...]:
    """Return a note where the azimuths of rows with steps are in another unit; none else."""
    stepped = (step_m > 0).to_numpy()
    fault = compass_fault(
        azimuth_deg.to_numpy(dtype=np.float64)[stepped], float(step_m[stepped].sum())
    )
    return (fault,) if fault else ()


def headings_and_courses(motion: pd.DataFrame, places: pd.DataFrame) -> tuple[Floats, Floats]:
    """Return headings, and the courses of the positions within the same intervals.

    A gap between positions is left out: it has one course, whatever the way in it.

    Parameters
    ----------
    motion, places : pandas.DataFrame
        As of :func:`heading_fault`.
    """
    nothing = np.empty(0)
    time_s, *along = known_places(places)
    if len(motion) < _FEWEST or len(time_s) < 2:
        return nothing, nothing
    end_s = motion["time_s"].to_numpy(dtype=np.float64)
    heading = motion["heading_rad"].to_numpy(dtype=np.float64)
    step_m = motion["step_m"].to_numpy(dtype=np.float64)
    begin_s = np.concatenate([[np.nan], end_s[:-1]])
    gap_s = np.cumsum(np.diff(time_s, prepend=time_s[0]) * long_gaps(time_s))
    with np.errstate(invalid="ignore"):
        known = (step_m > 0) & np.isfinite(heading) & (begin_s >= time_s[0]) & (end_s <= time_s[-1])
        known &= np.interp(end_s, time_s, gap_s) == np.interp(begin_s, time_s, gap_s)
    begin_s, end_s, heading = begin_s[known], end_s[known], heading[known]
    moved = []
    for axis_m in along:
        moved.append(np.interp(end_s, time_s, axis_m) - np.interp(begin_s, time_s, axis_m))
    # Of short steps only a few together have a course.
    group = np.floor(np.cumsum(np.hypot(*moved)) / _LEAST_M).astype(np.int64)
    if not group.size:
        return nothing, nothing
    _, at = np.unique(group, return_inverse=True)
    count = int(at.max()) + 1
    east, north, cos, sin = (
        np.bincount(at, values, minlength=count)
        for values in (*moved, np.cos(heading), np.sin(heading))
    )
    far = np.hypot(east, north) >= _LEAST_M / 2
    return np.arctan2(sin, cos)[far], np.arctan2(north, east)[far]
