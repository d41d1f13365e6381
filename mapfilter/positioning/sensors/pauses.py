"""Pauses of a recording: times of which no row tells, and after which a row tells of its end alone.

A logger that is suspended writes neither steps nor reports, and the first step after it is that of
one interval. A row that covers the pause, as of an odometer that counts on, is farther than any
before, or as far as the usual speed.
"""

from __future__ import annotations

from math import isfinite, nan
from typing import NamedTuple

from mapfilter.positioning.sensors.pace import GAP_INTERVALS, WALKERS_MPS, Going, Pace

GAP_S = 5.0
"""After so long motion rows are missing, if they come at rest, too."""
_REST_INTERVALS, _LONGEST_REST_S = 1.5, 30.0
"""Intervals of a walker's rows at rest, which may be longer than on the way, after which the next
one is missing; the longest time of that: on the way, one walks some 40 m in it."""
_SILENT_S, _KNOWN_REPORTS = 10.0, 10
"""After so long without a row of any kind a recording has paused; reports by which it is known how
often they come."""
_RECENT_REPORTS = 20


class RowTimes(NamedTuple):
    """When rows came.

    Parameters
    ----------
    epoch_s, report_s : float
        Time of the last epoch, and of the last one with a report; NaN before the first.
    interval_s : float
        Mean interval of reports.
    reports : int
        Number of epochs with a report.
    """

    epoch_s: float = nan
    report_s: float = nan
    interval_s: float = 0.0
    reports: int = 0

    def read(self, time_s: float, *, has_report: bool) -> RowTimes:
        """Return the times after an epoch."""
        if not has_report:
            return self._replace(epoch_s=time_s)
        since_s, interval_s = time_s - self.report_s, self.interval_s
        if isfinite(since_s) and since_s > 0:
            # What a pause says of the usual interval is bounded, also of one soon after the start.
            lasted_s = min(since_s, max(5 * interval_s, _SILENT_S))
            interval_s += (lasted_s - interval_s) / min(self.reports, _RECENT_REPORTS)
        return RowTimes(time_s, time_s, interval_s, self.reports + 1)

    @property
    def is_known(self) -> bool:
        """Whether enough reports have come to know how often they do."""
        return self.reports >= _KNOWN_REPORTS

    def silent_s(self, time_s: float) -> float:
        """Return how long nothing was recorded before an epoch; 0 where that is as usual."""
        if not self.is_known:
            return 0.0
        silent_s = time_s - self.epoch_s
        return silent_s if silent_s > max(_SILENT_S, GAP_INTERVALS * self.interval_s) else 0.0


def longest_s(pace: Pace) -> float:
    """Return the time after which motion rows are missing, where they come at rest, too."""
    usual_s = max(GAP_S, GAP_INTERVALS * pace.interval_s)
    if pace.speed_mps > WALKERS_MPS:
        return usual_s
    return max(usual_s, min(_REST_INTERVALS * pace.at_rest_s, _LONGEST_REST_S))


def unrecorded_s(
    pace: Pace, times: RowTimes, time_s: float, going: Going, known_s: float, *, rested: bool
) -> float:
    """Return the time before an epoch of which its motion rows do not tell; 0 if they do.

    Parameters
    ----------
    pace, times : Pace, RowTimes
        Of the epochs before.
    time_s : float
        Time of the epoch.
    going : Going
        Of its motion rows.
    known_s : float
        Time until which the way is in the belief: rows without steps may have told of a part.
    rested : bool
        Whether the rows before were those of a rest.
    """
    silent_s = times.silent_s(time_s)
    if pace.reports_always:
        if rested and not going.moves:
            # Whoever stands before and after a pause has stood, as with the ignition off.
            return 0.0
        since_s = time_s - pace.motion_s
        if going.measured and since_s > longest_s(pace):
            silent_s = since_s
    if silent_s == 0:
        return 0.0
    lacking_s = min(silent_s, time_s - known_s)
    if not going.measured:
        return max(lacking_s, 0.0)
    is_one_row = going.gone_m <= pace.fastest_mps * max(pace.interval_s, 1.0)
    missing_s = silent_s - going.gone_m / pace.speed_mps if pace.speed_mps > 0 else silent_s
    if not is_one_row or missing_s <= longest_s(pace):
        return 0.0
    return max(lacking_s - pace.interval_s, 0.0)
