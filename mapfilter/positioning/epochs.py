"""A log's tables merged into epochs: what moved, what was heard and where GNSS said one is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

import pandas as pd

from mapfilter.filters.contract import MotionStep
from mapfilter.tracks.log import TrackLog


@dataclass(frozen=True, slots=True)
class Heard:
    """One row of a radio report.

    Parameters
    ----------
    role : str
        ``serving`` or ``neighbour``.
    cell : str or None
    arfcn, bsic : int or None
    level_dbm : float
        NaN where it was not reported.
    censored : int
        -1: below; 1: above what is told; 0: this.
    timing_advance : float
        Steps; NaN where it was not reported.
    """

    role: str
    cell: str | None
    arfcn: int | None
    bsic: int | None
    level_dbm: float
    censored: int
    timing_advance: float = nan


@dataclass(frozen=True, slots=True)
class GnssFix:
    """A position by GNSS in the CRS of the database.

    Parameters
    ----------
    east_m, north_m : float
    var_east_m2, var_north_m2, cov_east_north_m2 : float
        NaN where unknown.
    """

    east_m: float
    north_m: float
    var_east_m2: float = nan
    var_north_m2: float = nan
    cov_east_north_m2: float = nan


@dataclass(frozen=True, slots=True)
class Epoch:
    """What is known at one moment; first one moves, then one measures.

    Parameters
    ----------
    time_s : float
    motion : tuple of MotionStep
        Intervals that end now.
    heard : tuple of Heard
        The report, of all its rows.
    fix : GnssFix or None
    """

    time_s: float
    motion: tuple[MotionStep, ...] = ()
    heard: tuple[Heard, ...] = ()
    fix: GnssFix | None = None


def epochs(log: TrackLog) -> list[Epoch]:
    """Merge a log's tables by time."""
    motion: dict[float, list[MotionStep]] = {}
    for time_s, *step in _rows(log.motion, ("time_s", "step_m", "heading_rad", "turn_rad")):
        motion.setdefault(time_s, []).append(MotionStep(*step))
    heard: dict[float, list[Heard]] = {}
    names = ("time_s", "role", "cell", "arfcn", "bsic", "level_dbm", "censored", "timing_advance")
    for time_s, role, cell, arfcn, bsic, level_dbm, censored, steps in _rows(log.radio, names):
        level = float(level_dbm) if level_dbm is not None else nan
        advance = float(steps) if steps is not None else nan
        row = Heard(role, cell, arfcn, bsic, level, censored or 0, advance)
        heard.setdefault(time_s, []).append(row)
    fixes = {
        time_s: GnssFix(*place)
        for time_s, *place in _rows(
            log.gnss,
            ("time_s", "east_m", "north_m", "var_east_m2", "var_north_m2", "cov_east_north_m2"),
        )
    }
    return [
        Epoch(
            time_s, tuple(motion.get(time_s, ())), tuple(heard.get(time_s, ())), fixes.get(time_s)
        )
        for time_s in sorted(motion.keys() | heard.keys() | fixes.keys())
    ]


def _rows(table: pd.DataFrame, names: Sequence[str]) -> Iterator[tuple[Any, ...]]:
    columns = []
    for name in names:
        column = table[name]
        values = column.tolist()
        if str(column.dtype) in ("Int64", "Int8", "object", "str", "string"):
            values = [None if value is pd.NA or value != value else value for value in values]
        columns.append(values)
    return zip(*columns, strict=True)


def headed(step: MotionStep, heading_rad: float) -> tuple[MotionStep, float]:
    """Give a step without a compass the heading that its turns add up to.

    Parameters
    ----------
    step : MotionStep
    heading_rad : float
        After the last step; NaN before the first.

    Returns
    -------
    step : MotionStep
        With a heading; without one where it has neither heading nor turn and none was known.
    heading_rad : float
    """
    if isfinite(step.heading_rad):
        return step, step.heading_rad
    if isfinite(step.turn_rad):
        heading_rad = (heading_rad if isfinite(heading_rad) else 0.0) + step.turn_rad
    elif not isfinite(heading_rad):
        # A first step has no turn: the headings that follow are counted from it.
        heading_rad = 0.0
    else:
        return step, heading_rad
    return MotionStep(step.step_m, heading_rad, step.turn_rad), heading_rad
