"""Motion of which no direction is known at all: speeds or step counts alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.log import TrackLog

_NEAR_M = 30.0
"""So far from a position a way to all sides is as good as any: that is what radii are then."""


def with_joined_steps(log: TrackLog, options: Any) -> tuple[TrackLog, tuple[str, ...]]:
    """Return the log that a filter is to be given, and a note where that is another one.

    The map filters spread a step without a heading to all sides, each on its own. Of one that is
    right; of many, which go the same way mostly, the sum would be a rest with a small radius. So
    where no row has a direction, the rows from each position to the next are made one, and from
    30 m after a position on lengths are unknown: filters then spread by the usual speed, and the
    position is lost. Other filters leave such steps out themselves. Without positions nothing is
    claimed by such steps, and the log stays as it is.

    Parameters
    ----------
    log : TrackLog
    options
        Of the filter.
    """
    motion = log.motion
    positions = (log.gnss["time_s"], log.pseudoranges["time_s"])
    known_s = np.unique(np.concatenate([times.to_numpy() for times in positions]))
    step_m = motion["step_m"].to_numpy(dtype=np.float64)
    moves = (np.nan_to_num(step_m) != 0).any()
    if not isinstance(options, BayesFilter) or not known_s.size or not moves:
        return log, ()
    # The first row turns by nothing.
    turned = motion["turn_rad"].notna().to_numpy()[1:].any()
    if turned or motion["heading_rad"].notna().any():
        return log, ()
    time_s = motion["time_s"].to_numpy(dtype=np.float64)
    # A row at the time of a position ends the way to it.
    passed = np.searchsorted(known_s, time_s, side="left")
    first = np.searchsorted(passed, passed, side="left")
    gone_m = np.append(0.0, np.cumsum(np.abs(np.nan_to_num(step_m))))
    since_m = gone_m[1:] - gone_m[first]
    blind = since_m > _NEAR_M
    joined = np.append((passed[1:] == passed[:-1]) & ~blind[1:], False)
    unknown_m = np.where(step_m == 0, 0.0, np.nan)
    rows = motion.assign(step_m=np.where(blind, unknown_m, since_m))[~joined]
    note = (
        "motion: no headings and no turns at all (a yaw rate, turns or a compass): steps are "
        f"joined from each position to the next, and where they lead after {_NEAR_M:g} m is not "
        "known"
    )
    return replace(log, motion=rows.reset_index(drop=True)), (note,)
