"""A walker who hears no cell for long and hardly steps: in a train underground, or in a basement.

Which of the two, the next report tells: by then a train is where other cells are received.
"""

from __future__ import annotations

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
        The report before, and that of now. Only those of two cells or more are compared.
    step_unit_m : float
        That unit.
    """
    silent_s = _silent_s(times, time_s)
    if silent_s < _RIDE_S or not _hardly_steps(pace, silent_s, stepped_m, step_unit_m):
        return False
    before, now = reports
    if min(len(before), len(now)) < 2:
        # Another cell may serve where the phone stayed, and nothing else is told.
        return False
    served, serves = _cells(before, SERVING), _cells(now, SERVING)
    if not (served and serves):
        return False
    return not (served & _cells(now) or serves & _cells(before))


def _hardly_steps(pace: Pace, silent_s: float, stepped_m: float, step_unit_m: float) -> bool:
    """Return whether a walker has gone by far less than the usual way."""
    walks = pace.is_known and step_unit_m * pace.speed_mps <= WALKERS_MPS
    return walks and stepped_m < _STEPPED * pace.speed_mps * silent_s


def _silent_s(times: RowTimes, time_s: float) -> float:
    """Return how long no report has come; 0 where that is as usual, or nothing is."""
    silent_s = time_s - times.report_s if times.is_known else 0.0
    return silent_s if silent_s >= _INTERVALS * times.interval_s else 0.0


def _cells(rows: tuple[ReportRow, ...], role: str = "") -> set[object]:
    """Return the names of cells, and their carriers with codes, by which others tell them."""
    some = [row for row in rows if role in ("", row.role)]
    names: set[object] = {row.cell for row in some if row.cell is not None}
    return names | {(row.arfcn, row.bsic) for row in some if None not in (row.arfcn, row.bsic)}
