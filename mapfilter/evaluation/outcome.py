"""What came of locating a track, as far as that can be told without its truth."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate import TrackEstimate


@dataclass(frozen=True, slots=True)
class Outcome:
    """One located track.

    Parameters
    ----------
    final_status : str
        Status at the last epoch; empty without any epoch.
    switched : bool
        Whether the filter ever went over to tracking.
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
    unused : dict
        How many readings were not used, by reason.
    unknown_cells : dict
        How many readings name each serving cell that the database does not know.
    """

    final_status: str
    switched: bool
    switch_time_s: float
    epochs: int
    epochs_by_status: dict[str, int]
    last_lon_deg: float
    last_lat_deg: float
    last_time_s: float
    unused: dict[str, int]
    unknown_cells: dict[str, int]


def outcome(estimate: TrackEstimate) -> Outcome:
    """Return what came of locating a track."""
    nan = float("nan")
    switch = estimate.converged_at
    statuses = Counter(estimate.status)
    located = np.flatnonzero(np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m))[-1:]
    lon, lat = unproject(estimate.crs, estimate.east_m[located], estimate.north_m[located])
    unknown = (u.what for u in estimate.unused if u.reason is Reason.UNKNOWN_CELL)
    return Outcome(
        str(estimate.status[-1]) if len(estimate) else "",
        switch is not None,
        float(estimate.time_s[switch]) if switch is not None else nan,
        len(estimate),
        {str(status): statuses[status] for status in Status if statuses[status]},
        float(lon[0]) if located.size else nan,
        float(lat[0]) if located.size else nan,
        float(estimate.time_s[located[0]]) if located.size else nan,
        dict(sorted(Counter(str(reading.reason) for reading in estimate.unused).items())),
        dict(sorted(Counter(unknown).items())),
    )
