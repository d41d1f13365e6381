"""A walker who hears no cell for long and hardly steps: in a train underground, or in a basement.

Which of the two, the next report tells: by then a train is where other cells are received.
"""

from __future__ import annotations

from itertools import product

from mapfilter.positioning.epochs import ReportRow
from mapfilter.positioning.sensors.pace import WALKERS_MPS, Pace
from mapfilter.positioning.sensors.pauses import RowTimes
from mapfilter.tracks.schema import SERVING

_DOUBT_S, _RIDE_S, _INTERVALS = 60.0, 90.0, 5.0
"""Silence in s after which a place is in doubt, and that of a ride; usual intervals of reports that
either lasts at least."""
_STEPPED = 0.5
"""Share of the usual way in that time that the steps of a station are."""


def is_in_doubt(pace: Pace, times: RowTimes, stepped_m: float, step_unit_m: float) -> bool:
    """Return whether at the last epoch nothing has been heard for so long that it may be a ride.

    Parameters
    ----------
    pace, times : Pace, RowTimes
        With the epoch.
    stepped_m : float
        Length of all steps since the last report, in the log's unit.
    step_unit_m : float
        That unit.
    """
    silent_s = _silent_s(times, times.epoch_s)
    return silent_s >= _DOUBT_S and _hardly_steps(pace, silent_s, stepped_m, step_unit_m)


def was_ride(
    pace: Pace,
    times: RowTimes,
    time_s: float,
    stepped_m: float,
    reports: tuple[tuple[ReportRow, ...], tuple[ReportRow, ...]],
    step_unit_m: float,
) -> bool:
    """Return whether a walker rode from where the report before was heard to that of now.

    Parameters
    ----------
    pace, times : Pace, RowTimes
        Of the epochs before.
    time_s : float
        Time of the second report.
    stepped_m : float
        Length of all steps in between, in the log's unit.
    reports : pair of tuple of ReportRow
        The report before, and that of now. Only those of two cells or more are compared, all of
        which have names, or carriers and codes.
    step_unit_m : float
        That unit.
    """
    silent_s = _silent_s(times, time_s)
    if silent_s < _RIDE_S or not _hardly_steps(pace, silent_s, stepped_m, step_unit_m):
        return False
    if min(len({_name(row) for row in rows}) for rows in reports) < 2:
        # Another cell may serve where the phone stayed, and nothing else is told.
        return False
    before, now = reports
    served, serves = ([row for row in rows if row.role == SERVING] for rows in reports)
    if not (served and serves):
        return False
    pairs = [*product(served, now), *product(serves, before)]
    return all(_differ(one, other) for one, other in pairs)


def _hardly_steps(pace: Pace, silent_s: float, stepped_m: float, step_unit_m: float) -> bool:
    """Return whether a walker has gone by far less than the usual way."""
    walks = pace.is_known and step_unit_m * pace.speed_mps <= WALKERS_MPS
    return walks and stepped_m < _STEPPED * pace.speed_mps * silent_s


def _silent_s(times: RowTimes, time_s: float) -> float:
    """Return how long no report has come; 0 where that is as usual, or nothing is."""
    silent_s = time_s - times.report_s if times.is_known else 0.0
    return silent_s if silent_s >= _INTERVALS * times.interval_s else 0.0


def _name(row: ReportRow) -> object:
    return row.cell if row.cell is not None else _code(row)


def _code(row: ReportRow) -> tuple[int, int] | None:
    return None if row.arfcn is None or row.bsic is None else (row.arfcn, row.bsic)


def _differ(one: ReportRow, other: ReportRow) -> bool:
    """Return whether two rows are certainly of two cells, by their names or by their codes."""
    pairs = [(one.cell, other.cell), (_code(one), _code(other))]
    told = [left != right for left, right in pairs if left is not None and right is not None]
    return bool(told) and all(told)
