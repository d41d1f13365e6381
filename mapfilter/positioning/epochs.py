"""A log's tables merged into epochs: what moved, what was received and where GNSS said one is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

import pandas as pd

from mapfilter.filters.contract import MotionStep
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING


@dataclass(frozen=True, slots=True)
class ReportRow:
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
        -1: below the reported level, 1: above it, 0: the level itself.
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
class Pseudorange:
    """One satellite received.

    Parameters
    ----------
    satellite : str
    range_m : float
        With the receiver's clock in it; NaN where it was not measured.
    sigma_m : float
        NaN where unknown.
    place_m : tuple of float
        Of the satellite, earth-centred; NaN where unknown.
    """

    satellite: str
    range_m: float
    sigma_m: float
    place_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Difference:
    """How much farther away a cell is than another, by times of arrival.

    Parameters
    ----------
    cell, reference : str
    difference_m : float
        NaN where it was not measured.
    sigma_m, reference_sigma_m : float
        Of the two times, as distances; NaN where unknown.
    """

    cell: str
    reference: str
    difference_m: float
    sigma_m: float = nan
    reference_sigma_m: float = nan


@dataclass(frozen=True, slots=True)
class Epoch:
    """What is known at one moment; first one moves, then one measures.

    Parameters
    ----------
    time_s : float
    motion : tuple of MotionStep
        Intervals that end now.
    radio : tuple of ReportRow
        The report, of all its rows.
    fix : GnssFix or None
    ranges : tuple of Pseudorange
    differences : tuple of Difference
    """

    time_s: float
    motion: tuple[MotionStep, ...] = ()
    radio: tuple[ReportRow, ...] = ()
    fix: GnssFix | None = None
    ranges: tuple[Pseudorange, ...] = ()
    differences: tuple[Difference, ...] = ()


def epochs(log: TrackLog) -> list[Epoch]:
    """Merge a log's tables by time."""
    motion: dict[float, list[MotionStep]] = {}
    for time_s, *step in _rows(log.motion, ("time_s", "step_m", "heading_rad", "turn_rad")):
        motion.setdefault(time_s, []).append(MotionStep(*step))
    radio: dict[float, list[ReportRow]] = {}
    names = ("time_s", "role", "cell", "arfcn", "bsic", "level_dbm", "censored", "timing_advance")
    for time_s, role, cell, arfcn, bsic, level_dbm, censored, steps in _rows(log.radio, names):
        level = float(level_dbm) if level_dbm is not None else nan
        advance = float(steps) if steps is not None else nan
        row = ReportRow(role, cell, arfcn, bsic, level, censored or 0, advance)
        radio.setdefault(time_s, []).append(row)
    fixes = {
        time_s: GnssFix(*place)
        for time_s, *place in _rows(
            log.gnss,
            ("time_s", "east_m", "north_m", "var_east_m2", "var_north_m2", "cov_east_north_m2"),
        )
    }
    ranges: dict[float, list[Pseudorange]] = {}
    received = ("time_s", "satellite", "pseudorange_m", "sigma_m", "x_m", "y_m", "z_m")
    for time_s, name, range_m, sigma_m, *place_m in _rows(log.pseudoranges, received):
        row_m = Pseudorange(name, range_m, sigma_m, (place_m[0], place_m[1], place_m[2]))
        ranges.setdefault(time_s, []).append(row_m)
    differences: dict[float, list[Difference]] = {}
    compared = ("time_s", "cell", "reference", "difference_m", "sigma_m", "reference_sigma_m")
    for time_s, *told in _rows(log.tdoa, compared):
        differences.setdefault(time_s, []).append(Difference(*told))
    times = motion.keys() | radio.keys() | fixes.keys() | ranges.keys() | differences.keys()
    return [
        Epoch(
            time_s,
            tuple(motion.get(time_s, ())),
            tuple(radio.get(time_s, ())),
            fixes.get(time_s),
            tuple(ranges.get(time_s, ())),
            tuple(differences.get(time_s, ())),
        )
        for time_s in sorted(times)
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


def serving_cell(epoch: Epoch) -> str | None:
    """Return the first serving cell that a report names."""
    named = (row.cell for row in epoch.radio if row.role == SERVING and row.cell is not None)
    return next(named, None)
