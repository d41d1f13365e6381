"""The truth that a log holds, as evaluation takes it."""

from __future__ import annotations

from mapfilter.evaluation.accuracy import Truth
from mapfilter.tracks.log import TrackLog


def truth_of(log: TrackLog) -> Truth | None:
    """Return the truth of a log, or None when it has fewer than two true positions."""
    if len(log.truth) < 2:
        return None
    return Truth(*(log.truth[name].to_numpy() for name in ("time_s", "east_m", "north_m")))
