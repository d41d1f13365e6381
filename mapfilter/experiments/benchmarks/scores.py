"""What came of the benchmark's runs: one row for each, and one figure for each case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapfilter.evaluation.accuracy import (
    SUCCESS_RADIUS_M,
    Truth,
    accuracy,
    percentile_m,
    position_errors_m,
)
from mapfilter.evaluation.success import wilson_interval
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.journeys import Walk
from mapfilter.filters.contract import Status
from mapfilter.positioning.global_positioning import PositionedTrack

_STAY_S = 10.0
_WINDOW_S = 120.0
Row = dict[str, Any]


@dataclass(frozen=True)
class CaseResult:
    """One row of the table.

    Parameters
    ----------
    name, filter : str
    runs : int
    success, success_low, success_high : float
        Share and its 95 % Wilson interval: at most 50 m off when converged; in the cases of a
        displacement, within 50 m again, and for 10 s, soon enough.
    wrong : float
        Share of the runs that converged more than 50 m off; after a displacement, that still were
        so at the end.
    switch_mean_m, switch_p90_m : float
        Metres travelled until converged; after a displacement, until found again.
    error_mean_m, error_67_m, error_95_m : float
        Means over the successful runs of each run's figure, from then on; of the whole track where
        it is smoothed.
    coverage_95 : float
        Share of the runs whose 95 % radius held the truth at one random epoch after converging.
    seconds_per_track : float
        Processor time of the filter, median.
    lost_per_km : float
        How often LOST was said where nothing had happened.
    window_median_m : float
        In the cases with satellites, mean over the runs of the median error in the two minutes
        from when a spoofer begins, or would.
    """

    name: str
    filter: str
    runs: int
    success: float
    success_low: float
    success_high: float
    wrong: float
    switch_mean_m: float
    switch_p90_m: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float
    coverage_95: float
    seconds_per_track: float
    lost_per_km: float
    window_median_m: float = float("nan")


def score(case: Case, walked: Walk, found: PositionedTrack, rng: np.random.Generator) -> Row:
    """Score one run; figures that are undefined are None."""
    estimate, truth = found.estimate, _truth(walked)
    errors_m = position_errors_m(estimate, truth)
    row: Row = {"case": case.name, "seconds": found.filter_s}
    lost = np.array([status is Status.LOST for status in estimate.status], dtype=bool)
    began_lost = lost & ~np.concatenate([[False], lost[:-1]])
    before = estimate.time_s <= walked.displaced_at_s
    row["lost"] = int(np.sum(began_lost & before))
    row["km"] = float(truth.distance_at(min(walked.displaced_at_s, truth.time_s[-1])) / 1000)
    if case.recovery_within_m > 0:
        return row | _recovered(case, walked, truth, estimate.time_s, errors_m)
    scored = accuracy(estimate, truth)
    row |= {
        "success": scored.success,
        "wrong": bool(scored.error_at_switch_m > SUCCESS_RADIUS_M),
        "switch_m": _told(scored.switch_distance_m),
        "error_mean_m": _told(scored.error_mean_m),
        "error_67_m": _told(scored.error_67_m),
        "error_95_m": _told(scored.error_95_m),
        "covered": None,
    }
    if case.smooth:
        row |= _errors(errors_m[np.isfinite(errors_m)])
    switch = estimate.converged_at
    if switch is not None:
        at = int(rng.integers(switch, len(estimate)))
        row["covered"] = bool(errors_m[at] <= estimate.radii_m[at, 2])
    return row


def summarise(case: Case, filter_name: str, rows: Sequence[Mapping[str, Any]]) -> CaseResult:
    """Put the runs of a case together."""
    runs, good = len(rows), [row for row in rows if row["success"]]
    low, high = wilson_interval(len(good), runs)
    switch_m = [row["switch_m"] for row in rows if row["switch_m"] is not None]
    km = sum(row["km"] for row in rows)
    return CaseResult(
        name=case.name,
        filter=filter_name,
        runs=runs,
        success=len(good) / runs if runs else float("nan"),
        success_low=low,
        success_high=high,
        wrong=_mean([row["wrong"] for row in rows]),
        switch_mean_m=_mean(switch_m),
        switch_p90_m=percentile_m(np.array(switch_m, dtype=np.float64), 0.9),
        error_mean_m=_mean([row["error_mean_m"] for row in good]),
        error_67_m=_mean([row["error_67_m"] for row in good]),
        error_95_m=_mean([row["error_95_m"] for row in good]),
        coverage_95=_mean([row["covered"] for row in rows]),
        seconds_per_track=float(np.median([row["seconds"] for row in rows])) if runs else 0.0,
        lost_per_km=sum(row["lost"] for row in rows) / km if km else float("nan"),
        window_median_m=_mean([row.get("window_median_m") for row in rows]),
    )


def score_window(walked: Walk, found: PositionedTrack, from_s: float) -> Row:
    """Score the two minutes from a time on, where the filter says that it knows its place."""
    estimate = found.estimate
    errors_m = position_errors_m(estimate, _truth(walked))
    known = np.array([status is not Status.SEARCHING for status in estimate.status], dtype=bool)
    at = (estimate.time_s >= from_s) & (estimate.time_s < from_s + _WINDOW_S) & known
    inside = errors_m[at]
    inside = inside[np.isfinite(inside)]
    return {"window_median_m": _told(float(np.median(inside))) if inside.size else None}


def _truth(walked: Walk) -> Truth:
    names = ("time_s", "east_m", "north_m")
    return Truth(*(np.asarray(walked.truth[name], dtype=np.float64) for name in names))


def _recovered(
    case: Case,
    walked: Walk,
    truth: Truth,
    time_s: np.ndarray[Any, np.dtype[np.float64]],
    errors_m: np.ndarray[Any, np.dtype[np.float64]],
) -> Row:
    """Score how soon a displaced track is found again: within 50 m, for 10 s."""
    after = np.flatnonzero(time_s > walked.displaced_at_s)
    near = errors_m[after] <= SUCCESS_RADIUS_M
    carried_s = np.array([walked.displaced_at_s, time_s[after[0]]])
    carried_m = float(np.ptp(truth.distance_at(carried_s)))
    gone_m = truth.distance_at(time_s[after]) - truth.distance_at(walked.displaced_at_s)
    far = np.flatnonzero(~near)
    row: Row = {"success": False, "wrong": bool(not near[-1]), "switch_m": None, "covered": None}
    for begin in np.concatenate([[0], far + 1]).tolist():
        ends = far[far >= begin]
        end = int(ends[0]) if ends.size else len(near)
        if end > begin and time_s[after[end - 1]] - time_s[after[begin]] >= _STAY_S:
            row["switch_m"] = float(gone_m[begin] - carried_m)
            row["success"] = row["switch_m"] <= case.recovery_within_m
            return row | _errors(errors_m[after[begin:]])
    return row | {f"error_{name}_m": None for name in ("mean", "67", "95")}


def _errors(errors_m: np.ndarray[Any, np.dtype[np.float64]]) -> Row:
    return {
        "error_mean_m": _told(float(np.mean(errors_m))) if errors_m.size else None,
        "error_67_m": _told(percentile_m(errors_m, 0.67)),
        "error_95_m": _told(percentile_m(errors_m, 0.95)),
    }


def _told(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _mean(values: Sequence[float | bool | None]) -> float:
    known = [float(value) for value in values if value is not None]
    return float(np.mean(known)) if known else float("nan")
