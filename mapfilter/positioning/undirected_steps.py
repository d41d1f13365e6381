"""Motion of which no direction is known at all: speeds or step counts alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.moved import long_gaps

_APART_SD, _APART_M, _FIX_SD_M = 2.5, 25.0, 10.0
"""Way between positions that are used, in deviations of these, at most, and the deviation of those
that state none: fixes nearer to each other are all ahead of a belief that spreads to all sides from
each of them, and contradict it in the end."""
_NEAR_M = 30.0
"""So far from a position a way to all sides is as good as any: that is what radii are then."""


def with_joined_steps(log: TrackLog, options: Any) -> tuple[TrackLog, tuple[str, ...]]:
    """Return the log that a filter is to be given, and a note where that is another one.

    The map filters spread a step without a heading to all sides, each on its own. Of one that is
    right; of many, which go the same way mostly, the sum would be a rest with a small radius. So
    where no row has a direction, the rows from each position to the next are made one, and from
    30 m after a position on lengths are unknown: filters then spread by the usual speed, and the
    position is lost. Positions that are too near to each other for that are left out, where the way
    between them is known. Other filters leave such steps out themselves. Without positions nothing
    is claimed by such steps, and the log stays as it is.

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
    way_m = np.cumsum(np.abs(np.nan_to_num(step_m)))
    apart_m = min(_APART_SD * _usual_sd_m(log), _APART_M)
    kept_s = _apart(known_s, _way_at(known_s, time_s, step_m), apart_m)
    left_out = len(known_s) - len(kept_s)
    known_s = kept_s
    # A row at the time of a position ends the way to it.
    passed = np.searchsorted(known_s, time_s, side="left")
    first = np.searchsorted(passed, passed, side="left")
    gone_m = np.append(0.0, way_m)
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
    given = replace(log, motion=rows.reset_index(drop=True))
    if not left_out:
        return given, (note,)
    placed = {
        name: table[table["time_s"].isin(kept_s)].reset_index(drop=True)
        for name, table in (("gnss", log.gnss), ("pseudoranges", log.pseudoranges))
    }
    left = (
        f"gnss: positions of {number_of(left_out, 'time')} left out, less than {apart_m:.0f} m of "
        "way after another one: without directions they would be taken for errors that last"
    )
    return replace(given, **placed), (note, left)


def _usual_sd_m(log: TrackLog) -> float:
    """Return the median deviation of fixes along one axis."""
    variance_m2 = log.gnss[["var_east_m2", "var_north_m2"]].mean(axis=1).to_numpy(dtype=np.float64)
    stated = np.where(variance_m2 > 0, variance_m2, _FIX_SD_M**2)
    return float(np.sqrt(np.median(stated))) if stated.size else _FIX_SD_M


def _way_at(known_s: Floats, time_s: Floats, step_m: Floats) -> Floats:
    """Return the way by each position; over steps and times without any it is taken for far."""
    way_m = np.cumsum(np.abs(np.nan_to_num(step_m, nan=_NEAR_M)))
    # By the next row: after the last one, and in a gap. Before the first one nothing moves.
    unknown = np.append(long_gaps(time_s), True)
    far_m = _NEAR_M * np.cumsum(unknown[np.searchsorted(time_s, known_s)])
    return np.asarray(np.interp(known_s, time_s, way_m) + far_m)


def _apart(known_s: Floats, way_m: Floats, apart_m: float) -> Floats:
    """Return times of positions that are some way apart, the first of them among them."""
    kept = [0]
    while (at := int(np.searchsorted(way_m, way_m[kept[-1]] + apart_m))) < len(way_m):
        # Beyond the way that is known the one before it is the better one.
        at -= way_m[at] - way_m[kept[-1]] > _NEAR_M and at - 1 > kept[-1]
        kept.append(at)
    return known_s[kept]
