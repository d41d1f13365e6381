"""What a filter reports of a located track, without any ground truth."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import nan

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate import TrackEstimate

_PAUSE_S, _PAUSE_TIMES = 30.0, 10.0
"""Time between two epochs from which on nothing is located in between, also in times of the usual
one."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One located track.

    Parameters
    ----------
    final_status : str
        Status at the last epoch; empty without any epoch.
    switched : bool
        Whether the filter ever switched to tracking.
    switch_time_s : float
        When, in seconds since the start of the log; NaN if it never did.
    epochs : int
        How many there are.
    epochs_by_status : dict
        How many of each status that occurs.
    last_lon_deg, last_lat_deg : float
        The last position, WGS 84; NaN where there is none.
    last_time_s : float
        When that was.
    radius_95_median_m : float
        Radius that holds 95 % of the belief, the median over located epochs; NaN without any.
    radius_95_last_m : float
        That of the last position; NaN where the filter claims none: it is ``LOST`` or ``OUTSIDE``.
    seconds_by_status : dict
        How long each status lasted that occurs, from its epochs to the next ones, without pauses.
    seconds_without_epochs : float
        How long all pauses lasted (:func:`pauses_s`).
    unused : dict
        How many readings were not used, by reason.
    unknown_cells : dict
        How many readings name each cell that is not in the database, the most frequent first.
    """

    final_status: str
    switched: bool
    switch_time_s: float
    epochs: int
    epochs_by_status: dict[str, int]
    last_lon_deg: float
    last_lat_deg: float
    last_time_s: float
    radius_95_median_m: float
    radius_95_last_m: float
    seconds_by_status: dict[str, float]
    seconds_without_epochs: float
    unused: dict[str, int]
    unknown_cells: dict[str, int]


def outcome(estimate: TrackEstimate) -> Outcome:
    """Summarise a located track."""
    switch = estimate.converged_at
    statuses = Counter(estimate.status)
    located = np.flatnonzero(np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m))[-1:]
    lon, lat = unproject(estimate.crs, estimate.east_m[located], estimate.north_m[located])
    claimed = located.size and estimate.status[located[0]] not in (Status.LOST, Status.OUTSIDE)
    followed = np.array([status.is_followed for status in estimate.status], dtype=bool)
    radius_m = estimate.radii_m[followed, -1] if len(estimate) else np.zeros(0)
    radius_m = radius_m[np.isfinite(radius_m)]
    unused: Counter[str] = Counter()
    unknown: Counter[str] = Counter()
    for reading in estimate.unused:
        unused[str(reading.reason)] += reading.readings
        if reading.reason is Reason.UNKNOWN_CELL:
            unknown[reading.what] += reading.readings
    return Outcome(
        str(estimate.status[-1]) if len(estimate) else "",
        switch is not None,
        float(estimate.time_s[switch]) if switch is not None else nan,
        len(estimate),
        {str(status): statuses[status] for status in Status if statuses[status]},
        float(lon[0]) if located.size else nan,
        float(lat[0]) if located.size else nan,
        float(estimate.time_s[located[0]]) if located.size else nan,
        float(np.median(radius_m)) if radius_m.size else nan,
        float(estimate.radii_m[located[0], -1]) if claimed else nan,
        _seconds_by_status(estimate),
        float(np.diff(pauses_s(estimate)).sum()),
        dict(sorted(unused.items())),
        dict(sorted(unknown.items(), key=lambda one: (-one[1], one[0]))),
    )


def pauses_s(estimate: TrackEstimate) -> Floats:
    """Return begins and ends of pauses without an epoch, shape (P, 2).

    There was neither motion nor anything measured. One is longer than 30 s and than ten times the
    usual time between two epochs, their median.
    """
    lasted_s = np.diff(estimate.time_s)
    usual_s = float(np.median(lasted_s)) if lasted_s.size else 0.0
    begin = np.flatnonzero(lasted_s > max(_PAUSE_S, _PAUSE_TIMES * usual_s))
    return np.stack([estimate.time_s[begin], estimate.time_s[begin + 1]], axis=1)


def _seconds_by_status(estimate: TrackEstimate) -> dict[str, float]:
    lasted_s = np.diff(estimate.time_s, append=estimate.time_s[-1:])
    lasted_s[np.isin(estimate.time_s, pauses_s(estimate)[:, 0])] = 0.0
    statuses = np.array([str(status) for status in estimate.status])
    return {
        str(status): float(lasted_s[statuses == str(status)].sum())
        for status in Status
        if status in estimate.status
    }
