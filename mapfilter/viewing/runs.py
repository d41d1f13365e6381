"""One run as the page reads it: an estimate, its log, and what was recorded of the filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Any

import numpy as np

from mapfilter._types import Ints
from mapfilter.evaluation.accuracy import position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.filter import Filter
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.log import TrackLog
from mapfilter.viewing.arrays import cell_numbers, packed
from mapfilter.viewing.ground import ViewFrame
from mapfilter.viewing.readings import REASONS, ROLES, LevelAt, NumberedTexts, Readings
from mapfilter.viewing.recorded import belief_of, explained_of
from mapfilter.viewing.trace import TraceRecorder

STATUSES = tuple(Status)
KINDS = ("motion", "serving", "neighbour", "gnss", "pseudorange", "ta", "tdoa", "other")
MOST_EPOCHS = 100_000


@dataclass(frozen=True, slots=True)
class ViewedRun:
    """One run to be viewed.

    Parameters
    ----------
    name : str
        As it is shown.
    figures : mapping of str to str
        Label and text, as they are shown.
    trace : TraceRecorder or None
        None where nothing was recorded: then there is no belief and no explanation.
    """

    name: str
    estimate: TrackEstimate
    log: TrackLog | None = None
    log_name: str = ""
    trace: TraceRecorder | None = None
    figures: Mapping[str, str] | None = None
    smoothed: bool = False


def run_of(
    run: ViewedRun,
    frame: ViewFrame,
    plan: CellPlan,
    ways: Mapping[str, int],
    level_at: LevelAt,
) -> dict[str, Any]:
    """Return a run as the page reads it.

    Parameters
    ----------
    ways : mapping of str to int
        Numbers of the background's ways by their ids.
    """
    estimate, log = run.estimate, run.log
    count, every = len(estimate), 1
    while count > MOST_EPOCHS * every:
        every += 1
    kept = np.arange(0, count, every)
    truth = Truth.of_table(log.truth) if log is not None else None
    whats = NumberedTexts()
    rows = Readings(estimate, log, kept, plan)
    start = estimate.start_utc_s
    return {
        "name": run.name,
        "filter": estimate.filter,
        "log": run.log_name,
        "notes": list(log.notes) if log is not None else [],
        "figures": dict(run.figures or {}),
        "start_utc_s": start if isfinite(start) else None,
        "epochs": _epochs(run, kept, every, frame, ways, truth, rows.serving),
        "truth": None
        if truth is None
        else {
            "time": packed(truth.time_s, "f8"),
            "east": frame.east(truth.east_m),
            "north": frame.north(truth.north_m),
        },
        "thresholds": thresholds(run.trace.filter if run.trace is not None else None),
        "readings": rows.packed(whats, level_at),
        "roles": list(ROLES),
        "unused": _unused(estimate, kept, whats),
        "kinds": list(KINDS),
        "belief": belief_of(run.trace, every, frame),
        "explained": explained_of(run.trace, every, frame, plan, estimate),
        "whats": list(whats),
        "smoothed": run.smoothed,
    }


def _share(values: Any) -> dict[str, Any]:
    return packed(values, "u2", scale=1 / 50_000, none=65_535)


def _epochs(
    run: ViewedRun,
    kept: Ints,
    every: int,
    frame: ViewFrame,
    ways: Mapping[str, int],
    truth: Truth | None,
    serving: Ints,
) -> dict[str, Any]:
    estimate, evidence = run.estimate, run.estimate.evidence
    count = len(estimate)
    unknown = np.full(kept.size, nan)
    moments = np.full((count, 6), nan)
    if run.trace is not None and len(run.trace.moments) == count and count:
        moments = np.array(run.trace.moments, dtype=np.float64)
    travelled, doubt, other_east, other_north, lead, mass = moments[kept].T
    true_east = true_north = error = unknown
    if truth is not None:
        true_east, true_north = truth.at(estimate.time_s[kept])
        error = position_errors_m(estimate, truth)[kept]
    if run.trace is None and truth is not None:
        travelled = truth.distance_at(estimate.time_s[kept])
    status = np.array([STATUSES.index(one) for one in estimate.status], dtype=np.int64)
    reason = np.array([REASONS.index(one) for one in estimate.reason], dtype=np.int64)
    way = np.array([ways.get(str(one), -1) + 1 for one in estimate.way_id[kept].tolist()], np.int64)
    runner = (
        (evidence.runner_up_east_m, evidence.runner_up_north_m, evidence.runner_up_mass)
        if evidence is not None
        else (np.full(count, nan),) * 3
    )
    return {
        "count": int(kept.size),
        "every": every,
        "time": packed(estimate.time_s[kept], "f8"),
        "east": frame.east(estimate.east_m[kept]),
        "north": frame.north(estimate.north_m[kept]),
        "status": packed(status[kept], "u1"),
        "reason": packed(reason[kept], "u1"),
        "r50": packed(estimate.radii_m[kept, 0], "f4"),
        "r95": packed(estimate.radii_m[kept, 2], "f4"),
        "r99": packed(estimate.radius_99_m[kept], "f4"),
        "protection": packed(estimate.protection_m[kept], "f4"),
        "mass": _share(estimate.mass_50m[kept]),
        "entropy": packed(evidence.entropy_bits[kept] if evidence else unknown, "f4"),
        "log_evidence": packed(evidence.log_evidence[kept] if evidence else unknown, "f4"),
        "hypotheses": packed(estimate.hypotheses[kept], "u4"),
        "runner_east": frame.east(runner[0][kept]),
        "runner_north": frame.north(runner[1][kept]),
        "runner_mass": packed(runner[2][kept], "f4"),
        "way": packed(way, "u4"),
        "way_p": _share(estimate.way_probability[kept]),
        "doubt": packed(doubt, "f4"),
        "travelled": packed(travelled, "f4"),
        "alt_east": frame.east(other_east),
        "alt_north": frame.north(other_north),
        "alt_lead": packed(lead, "f4"),
        "alt_mass": _share(mass),
        "truth_east": frame.east(true_east),
        "truth_north": frame.north(true_north),
        "error": packed(error, "f4"),
        "serving": cell_numbers(serving),
    }


def _unused(estimate: TrackEstimate, kept: Ints, whats: NumberedTexts) -> dict[str, Any]:
    """Return what was not used apart from radio reports, by the epoch that it belongs to."""
    radio = {"serving", "neighbour"}
    some = [
        one
        for one in estimate.unused
        if one.kind not in radio or one.reason is Reason.NOT_USED_BY_FILTER
    ]
    time_s = np.array([one.time_s for one in some], dtype=np.float64)
    last = max(kept.size - 1, 0)
    epoch = np.minimum(np.searchsorted(estimate.time_s[kept], time_s), last)
    kinds = [KINDS.index(one.kind) if one.kind in KINDS else len(KINDS) - 1 for one in some]
    return {
        "epoch": packed(epoch, "u4"),
        "kind": packed(np.array(kinds, dtype=np.int64), "u1"),
        "what": packed(np.array([whats[one.what] for one in some], dtype=np.int64), "u4"),
        "reason": packed(np.array([REASONS.index(one.reason) for one in some], np.int64), "u1"),
        "count": packed(np.array([one.readings for one in some], dtype=np.int64), "u4"),
    }


def thresholds(filter_: Filter[Any] | None) -> dict[str, float]:
    """Return the limits of the Bayes map filter that charts show; none of other filters."""
    if not isinstance(filter_, BayesPositioner):
        return {}
    rules = filter_.rules
    return {
        "start_log_odds": rules.start_log_odds,
        "lost": rules.lost_threshold,
        "search": rules.search_threshold,
        "switch_mass": filter_.options.switch_mass,
    }


def tracks_bounds(
    runs: Sequence[ViewedRun], around_m: float
) -> tuple[float, float, float, float] | None:
    """Return west, south, east and north of all tracks and truths; None where there is nothing."""
    low, high = np.full(2, inf), np.full(2, -inf)
    for run in runs:
        parts = [(run.estimate.east_m, run.estimate.north_m)]
        if run.log is not None and len(run.log.truth):
            truth = run.log.truth
            parts.append((truth["east_m"].to_numpy(float), truth["north_m"].to_numpy(float)))
        for east_m, north_m in parts:
            known = np.isfinite(east_m) & np.isfinite(north_m)
            if known.any():
                place = np.stack([east_m[known], north_m[known]])
                low = np.minimum(low, place.min(axis=1))
                high = np.maximum(high, place.max(axis=1))
    if not np.isfinite(low).all():
        return None
    (west, south), (east, north) = (low - around_m).tolist(), (high + around_m).tolist()
    return west, south, east, north
