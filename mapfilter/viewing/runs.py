"""One run as the page reads it: an estimate, its log, and what was recorded of the filter."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Any

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.evaluation.accuracy import Truth, position_errors_m
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.epochs import ReportRow, epochs
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING
from mapfilter.viewing.arrays import packed, starts
from mapfilter.viewing.explain import TERMS
from mapfilter.viewing.ground import ViewFrame
from mapfilter.viewing.trace import TraceRecorder

STATUSES, REASONS = tuple(Status), tuple(Reason)
ROLES = ("serving", "neighbour")
KINDS = ("motion", "serving", "neighbour", "gnss", "pseudorange", "ta", "tdoa", "other")
MOST_EPOCHS = 100_000

LevelAt = Callable[[Floats, Floats, Sequence[str | None]], Floats]
"""Predicted levels of cells at places of the CRS, NaN where there are none."""


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


class _Numbers(dict[str, int]):
    """Numbers of texts in the order in which they come."""

    def __missing__(self, key: str) -> int:
        self[key] = len(self)
        return self[key]


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
    whats = _Numbers()
    rows = _Readings(estimate, log, kept, plan)
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
        "thresholds": _thresholds(run.trace),
        "readings": rows.packed(whats, level_at),
        "roles": list(ROLES),
        "unused": _unused(estimate, kept, whats),
        "kinds": list(KINDS),
        "belief": _belief(run.trace, every, frame),
        "explained": _explained(run.trace, every, frame, plan, estimate),
        "whats": list(whats),
        "smoothed": run.smoothed,
    }


def _share(values: Any) -> dict[str, Any]:
    return packed(values, "u1", scale=1 / 250, none=255)


def _dbm(values: Any) -> dict[str, Any]:
    return packed(values, "u1", scale=0.5, offset=-150.0, none=255)


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
        "serving": packed(serving, "i2"),
    }


class _Readings:
    """The rows of the radio reports of those epochs that are shown."""

    def __init__(
        self, estimate: TrackEstimate, log: TrackLog | None, kept: Ints, plan: CellPlan
    ) -> None:
        self.count = np.zeros(kept.size, dtype=np.int64)
        self.serving = np.full(kept.size, -1, dtype=np.int64)
        self.cell: list[int] = []
        self.names: list[str] = []
        self.known: list[str | None] = []
        self.role: list[int] = []
        self.level: list[float] = []
        self.use: list[int] = []
        self.east_m: list[float] = []
        self.north_m: list[float] = []
        if log is None or not len(log.radio):
            return
        index = {cell: number for number, cell in enumerate(plan.ids)}
        why = {(one.time_s, one.kind, one.what): one.reason for one in estimate.unused}
        never = {one.kind for one in estimate.unused if one.reason is Reason.NOT_USED_BY_FILTER}
        merged = epochs(log)
        place = np.searchsorted(estimate.time_s, [epoch.time_s for epoch in merged])
        of_epoch = dict(zip(place.tolist(), merged, strict=True))
        for number, at in enumerate(kept.tolist()):
            epoch = of_epoch.get(at)
            if epoch is None:
                continue
            late = estimate.reason[at] in (Reason.NOT_MOVED_ENOUGH, Reason.STALE_RADIO)
            self.count[number] = len(epoch.radio)
            for row in epoch.radio:
                name = _named(row.cell, row.arfcn, row.bsic)
                serving = plan.ids[self.serving[number]] if self.serving[number] >= 0 else None
                known = _cell_of(row, plan, serving)
                cell = index.get(known, -1) if known is not None else -1
                reason = why.get((epoch.time_s, row.role, name), Reason.USED)
                if row.role in never:
                    reason = Reason.NOT_USED_BY_FILTER
                elif late and reason is Reason.USED:
                    reason = estimate.reason[at]
                if row.role == SERVING and self.serving[number] < 0:
                    self.serving[number] = cell
                self.cell.append(cell)
                self.names.append(name)
                self.known.append(known)
                self.role.append(ROLES.index(row.role))
                self.level.append(row.level_dbm)
                self.use.append(REASONS.index(reason))
                self.east_m.append(float(estimate.east_m[at]))
                self.north_m.append(float(estimate.north_m[at]))

    def packed(self, whats: _Numbers, level_at: LevelAt) -> dict[str, Any]:
        """Return the rows as the page reads them."""
        east_m, north_m = np.array(self.east_m), np.array(self.north_m)
        predicted = level_at(east_m, north_m, self.known) if self.known else np.empty(0)
        return {
            "first": starts(self.count),
            "cell": packed(np.array(self.cell, dtype=np.int64), "i2"),
            "what": packed(np.array([whats[one] for one in self.names], np.int64), "u4"),
            "role": packed(np.array(self.role, dtype=np.int64), "u1"),
            "level": _dbm(np.array(self.level, dtype=np.float64)),
            "predicted": _dbm(predicted),
            "use": packed(np.array(self.use, dtype=np.int64), "u1"),
        }


def _cell_of(row: ReportRow, plan: CellPlan, serving: str | None) -> str | None:
    """Return the cell of a row: as it is named, or the only one of its carrier and code."""
    if row.cell is not None or row.arfcn is None:
        return row.cell
    alike = plan.ids_by_carrier.get((row.arfcn, -1 if row.bsic is None else row.bsic), ())
    others = [cell for cell in alike if cell != serving]
    return others[0] if len(others) == 1 else None


def _named(cell: str | None, arfcn: int | None, bsic: int | None) -> str:
    """Return a cell as the reasons of a filter name it."""
    if cell is not None:
        return cell
    code = "unknown" if bsic is None else bsic
    return "" if arfcn is None else f"ARFCN {arfcn}, BSIC {code}"


def _unused(estimate: TrackEstimate, kept: Ints, whats: _Numbers) -> dict[str, Any]:
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


def _thresholds(trace: TraceRecorder | None) -> dict[str, float]:
    if trace is None or not isinstance(trace.filter, BayesPositioner):
        return {}
    rules = trace.filter.rules
    return {
        "start_log_odds": rules.start_log_odds,
        "lost": rules.lost_threshold,
        "search": rules.search_threshold,
        "switch_mass": trace.filter.options.switch_mass,
    }


def _belief(trace: TraceRecorder | None, every: int, frame: ViewFrame) -> dict[str, Any] | None:
    frames = list(trace.frames.kept.values()) if trace is not None else []
    if not frames:
        return None
    step = np.array([one.step_m for one in frames])
    # The corner of a view lies on the lines between squares of any size.
    west, south = (np.rint(at_m / step) for at_m in (frame.west_m, frame.south_m))
    col = [one.col - int(first) for one, first in zip(frames, west, strict=True)]
    row = [one.row - int(first) for one, first in zip(frames, south, strict=True)]
    return {
        "epoch": packed(np.array([one.epoch // every for one in frames], np.int64), "u4"),
        "first": starts([one.col.size for one in frames]),
        "step": packed(step, "f4"),
        "col": packed(np.concatenate(col), "i4"),
        "row": packed(np.concatenate(row), "i4"),
        "mass": packed(np.concatenate([one.shade for one in frames]), "u1"),
        "peak": packed([one.peak for one in frames], "f4"),
        "which": "density",
    }


def _explained(
    trace: TraceRecorder | None,
    every: int,
    frame: ViewFrame,
    plan: CellPlan,
    estimate: TrackEstimate,
) -> dict[str, Any] | None:
    if trace is None or not isinstance(trace.filter, BayesPositioner) or not trace.explained.kept:
        return None
    area = trace.filter.area
    number = np.array([plan.index(cell) for cell in area.cell_ids] + [-1], dtype=np.int64)
    kept = sorted(trace.explained.kept.items())
    at = np.array([epoch for epoch, _ in kept], dtype=np.int64)
    rows = [row for _, one in kept for row in one.rows]
    found = np.array([row[2:] for row in rows], dtype=np.float64).reshape(-1, 6)
    sums = np.array([np.sum([row[5:] for row in one.rows], axis=0) for _, one in kept])
    evidence = estimate.evidence
    nowhere = np.full(len(estimate), nan)
    return {
        "epoch": packed(at // every, "u4"),
        "first": starts([len(one.rows) for _, one in kept]),
        "terms": list(TERMS),
        "what": packed(np.array([TERMS.index(row.what) for row in rows], np.int64), "u1"),
        "cell": packed(number[[row.cell for row in rows]], "i2"),
        "measured": _dbm(found[:, 0]),
        "lead_predicted": _dbm(found[:, 1]),
        "runner_predicted": _dbm(found[:, 2]),
        "lead": packed(found[:, 3], "f8"),
        "runner": packed(found[:, 4], "f8"),
        "alt": packed(found[:, 5], "f8"),
        "lead_sum": packed(sums[:, 0], "f8"),
        "runner_sum": packed(sums[:, 1], "f8"),
        "alt_sum": packed(sums[:, 2], "f8"),
        "runner_east": frame.east((evidence.runner_up_east_m if evidence else nowhere)[at]),
        "runner_north": frame.north((evidence.runner_up_north_m if evidence else nowhere)[at]),
        "runner_prior": packed([one.prior for _, one in kept], "f4"),
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
