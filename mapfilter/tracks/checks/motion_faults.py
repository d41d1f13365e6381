"""Checks of steps and turns by positions: their units, and the sense of rotation.

Errors of sensors are not meant: only what differs from the positions by a factor that is far from
1, and the same nearly everywhere, or by the sense or the unit of its turns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from mapfilter._constants import FOOT_M, KMH_MPS, KNOT_MPS, MPH_MPS
from mapfilter._types import Bools, Complexes, Floats
from mapfilter.angles import wrap_rad
from mapfilter.tracks.checks.headings import heading_fault
from mapfilter.tracks.checks.motion_fault import MotionFault
from mapfilter.tracks.checks.second_deliveries import once_each
from mapfilter.tracks.checks.stretches import (
    FEWEST_PLACES,
    Stretches,
    known_places,
    motion_values,
    rows_apart_s,
    steady_values,
    stretches,
)
from mapfilter.tracks.checks.turn_faults import turn_fault

_FEWEST = 6
_SHORTER, _LONGER = 0.6, 1.6
_ALIKE, _MOSTLY = 1.2, 0.75
_MOSTLY_UNKNOWN = 0.5
_LEAST_STRAIGHT = 0.25
"""Least share of pairs that are straight: of lines that are noise, one in ten or fewer."""
_NAMED, _MOST_NAMED = 1.1, 2
_REST_S, _REST_SHARE = 5.0, 0.1
_STRAIGHT_RAD, _AGREED_RAD = np.deg2rad(30.0), np.deg2rad(30.0)
_A_SECOND = 1.2

_LONG_STEPS = "steps are {} times as long as the way between positions"

_UNITS: Mapping[str, float] = {
    "feet for metres": 1 / FOOT_M,
    "metres taken for feet": FOOT_M,
    "km/h for m/s": 1 / KMH_MPS,
    "m/s taken for km/h": KMH_MPS,
    "mph for m/s": 1 / MPH_MPS,
    "knots for m/s": 1 / KNOT_MPS,
    "inches for metres": 1 / 0.0254,
    "centimetres for metres": 100.0,
    "millimetres for metres": 1000.0,
    "kilometres for metres": 0.001,
    "each counted twice": 2.0,
}
"""How many times too long steps are, by the mistake."""
_SPEEDS: Mapping[str, float] = {
    "m/s": 1.0,
    "km/h": 3.6,
    "mph": 1 / MPH_MPS,
    "knots": 1 / KNOT_MPS,
}


def motion_faults(motion: pd.DataFrame, places: pd.DataFrame) -> dict[str, MotionFault]:
    """Return what is wrong with a log's motion, by its positions, for each such column.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m, heading_rad and turn_rad.
    places : pandas.DataFrame
        time_s, east_m and north_m: ground truth, or fixes by GNSS.
    """
    checks: tuple[Callable[[pd.DataFrame, pd.DataFrame], MotionFault | None], ...]
    checks = (heading_fault, turn_fault, step_fault)
    # What was delivered twice is used once: twice as long steps are no fault then.
    motion = once_each(motion)
    found = (check(motion, places) for check in checks)
    return {fault.column: fault for fault in found if fault is not None}


def compared_places(truth: pd.DataFrame, gnss: pd.DataFrame) -> pd.DataFrame:
    """Return the positions that motion is compared with: fixes where ground truth has hardly any.

    Parameters
    ----------
    truth, gnss : pandas.DataFrame
        time_s, east_m and north_m.
    """
    few = len(known_places(truth)[0]) <= FEWEST_PLACES
    return gnss if few and len(gnss) > len(truth) else truth


def step_fault(
    motion: pd.DataFrame, places: pd.DataFrame, found: str = _LONG_STEPS
) -> MotionFault | None:
    """Return what is wrong with the lengths of steps; None for nothing.

    Dead reckoning by the steps, and by headings or turns, is compared with the distances of
    positions some 100 m apart; where directions are not known or wrong, it is the length of steps
    along straight ways. Steps are wrong where they are less than 0.6 or more than 1.6 times as
    long, and by the same factor, within 20 %, on three quarters of these ways. Ways on which steps
    are 0 or unknown for a while are left out: a sensor that was dead, or a rest.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m, heading_rad and turn_rad.
    places : pandas.DataFrame
        time_s, east_m and north_m.
    found : str
        What is said of the factor, which stands for ``{}``.

    Examples
    --------
    >>> time_s = np.arange(101.0)
    >>> truth = pd.DataFrame({"time_s": time_s, "east_m": 10 * time_s, "north_m": 0.0})
    >>> motion = pd.DataFrame({"time_s": time_s, "step_m": 11.0})
    >>> motion = motion.assign(heading_rad=0.0, turn_rad=np.nan)
    >>> print(step_fault(motion.assign(step_m=400.0), truth))
    steps are 40 times as long as the way between positions (inches for metres?); expected metres \
(--factor step_m=0.0254 mends it)
    >>> step_fault(motion, truth) is None
    True
    """
    compared = _compared(motion, places)
    if compared is None:
        return None
    ways, moved_m, distance_m, factor = compared
    time_s = motion_values(motion, "time_s")
    typical = float(np.median(factor)) if factor.size >= _FEWEST else 1.0
    if _SHORTER <= typical <= _LONGER or typical <= 0:
        return None
    lasted_s = np.diff(time_s, prepend=time_s[:1])
    # As long as they were if the steps were speeds.
    of_speeds = np.abs(ways.grown(time_s, np.cumsum(moved_m * lasted_s))) / distance_m
    off = _matching(_UNITS, factor)
    speeds = _matching(_SPEEDS, of_speeds)
    times = dict(_UNITS)
    apart_s = rows_apart_s(time_s)
    if not 1 / _A_SECOND <= apart_s <= _A_SECOND:
        named = {unit: f"speeds in {unit}, rows {apart_s:.2g} s apart" for unit in speeds}
        off |= {named[unit]: by for unit, by in speeds.items()}
        times |= {named[unit]: _SPEEDS[unit] / apart_s for unit in speeds}
    if not (is_constant(factor) or (speeds and is_constant(of_speeds))):
        return None
    causes = sorted(off, key=off.__getitem__)[:_MOST_NAMED]
    found = found.format(f"{typical:.3g}")
    if not causes:
        return MotionFault("step_m", found, "metres")
    likely = " or ".join(causes)
    return MotionFault("step_m", f"{found} ({likely}?)", "metres", 1 / times[causes[0]])


def step_factors(motion: pd.DataFrame, places: pd.DataFrame) -> Floats:
    """Return how many times as long steps are as the ways between positions, some 100 m apart.

    Parameters
    ----------
    motion, places : pandas.DataFrame
        As of :func:`step_fault`.
    """
    compared = _compared(motion, places)
    return np.zeros(0) if compared is None else compared[-1]


def _compared(
    motion: pd.DataFrame, places: pd.DataFrame
) -> tuple[Stretches, Complexes, Floats, Floats] | None:
    """Return ways, moves, the ways' distances, and how many times as long steps are; or None."""
    time_s, step_m = motion_values(motion, "time_s"), steady_values(motion, "step_m")
    ways = stretches(places, time_s, np.cumsum(np.abs(step_m)))
    if ways is None:
        return None
    ways = ways.where(ways.grown(*_rests(time_s, step_m)).real <= _REST_SHARE * ways.lasted_s)
    ways, moved_m = _comparable(ways, motion)
    distance_m = np.abs(ways.before_m + ways.after_m)
    factor = np.abs(ways.grown(time_s, np.cumsum(moved_m))) / distance_m
    return ways, moved_m, distance_m, factor


def _comparable(ways: Stretches, motion: pd.DataFrame) -> tuple[Stretches, Complexes]:
    """Return pairs whose distance motion tells, and its moves.

    Moves have directions where most pairs bend by them as the positions do, or as a mirror image,
    which has the same distances. Else they are lengths, and pairs are straight; there are none
    where few are, as the lines are noise of positions then.
    """
    time_s, step_m = motion_values(motion, "time_s"), steady_values(motion, "step_m")
    heading_rad, unknown = _directions(motion)
    moved_m = step_m * np.exp(1j * heading_rad)
    turned_rad = ways.turned_by(time_s, np.cumsum(moved_m))
    off_rad = [np.abs(wrap_rad(turned_rad - sign * ways.turned_rad)) for sign in (1, -1)]
    known = ways.without(time_s, np.cumsum(unknown, dtype=np.float64))
    alike = known & (np.minimum(*off_rad) <= _AGREED_RAD)
    if alike.sum() >= max(_FEWEST, len(ways) / 2):
        return ways.where(alike), moved_m
    straight = np.abs(ways.turned_rad) <= _STRAIGHT_RAD
    straight &= straight.sum() >= _LEAST_STRAIGHT * len(ways)
    return ways.where(straight), step_m.astype(np.complex128)


def _directions(motion: pd.DataFrame) -> tuple[Floats, Bools]:
    """Return headings, those since the start by turns where most are unknown, and unknown rows."""
    heading_rad, turn_rad = motion_values(motion, "heading_rad"), motion_values(motion, "turn_rad")
    unknown = np.isnan(heading_rad)
    if unknown.mean() > _MOSTLY_UNKNOWN:
        unknown, turned_rad = np.isnan(turn_rad), np.nan_to_num(turn_rad)
        heading_rad = np.cumsum(turned_rad) - turned_rad / 2
    return np.nan_to_num(heading_rad), unknown


def _rests(time_s: Floats, step_m: Floats) -> tuple[Floats, Floats]:
    """Return times, and the sum of pauses of more than 5 s without steps until each."""
    moving = step_m != 0
    begin_s = np.append(time_s[np.flatnonzero(moving) - 1], time_s[-1])
    end_s = np.append(time_s[0], time_s[moving])
    paused_s = begin_s - end_s
    rest_s = np.cumsum(np.where(paused_s > _REST_S, paused_s, 0.0))
    # Nothing is added while there are steps.
    at_s = np.column_stack([end_s, begin_s]).ravel()
    return at_s, np.column_stack([np.append(0.0, rest_s[:-1]), rest_s]).ravel()


def _matching(units: Mapping[str, float], factor: Floats) -> dict[str, float]:
    """Return the mistakes that explain a factor within 10 %, and how far off each is."""
    typical = max(float(np.median(factor)), 1e-9)
    off = {word: abs(float(np.log(typical / unit))) for word, unit in units.items()}
    return {word: by for word, by in off.items() if by <= np.log(_NAMED)}


def is_constant(factor: Floats) -> bool:
    """Return whether most factors are within 20 % of the median."""
    near = np.abs(np.log(np.maximum(factor, 1e-9) / np.median(factor))) <= np.log(_ALIKE)
    return bool(np.mean(near) >= _MOSTLY)
