"""Scores of the benchmark: one row for each run, and one figure with its interval for each case."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapfilter._types import Floats
from mapfilter.evaluation.accuracy import (
    RADII,
    SUCCESS_RADIUS_M,
    Truth,
    accuracy,
    percentile_m,
    position_errors_m,
    score_claims,
)
from mapfilter.evaluation.success import wilson_interval_of_routes
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.journeys import WINDOW_S, Walk
from mapfilter.experiments.sweep.journeys import truth_of
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import PositionedTrack

_STAY_S = 10.0
_ERRORS = ("error_mean_m", "error_67_m", "error_95_m")
Row = dict[str, Any]


@dataclass(frozen=True)
class CaseResult:
    """One row of the table.

    All shares have 95 % intervals of the runs as clusters: each run has a route and a ground truth
    of its own, and its epochs are alike.

    Parameters
    ----------
    success, success_low, success_high : float
        Share of the runs that were at most 50 m off when they converged; in the cases of a
        displacement, within 50 m again, and for 10 s, soon enough.
    wrong, wrong_low, wrong_high : float
        Share of the runs that converged more than 50 m off; after a displacement, that still were
        so at the end.
    switch_mean_m, switch_p90_m : float
        Metres travelled until converged; after a displacement, until found again.
    error_mean_m, error_67_m, error_95_m : float
        Means over the successful runs of each run's figure, from then on; of the whole track where
        it is smoothed.
    worst_100m_mean_m, worst_100m_95_m : float
        Of each run that converged, the largest mean error over 100 m travelled after it: mean and
        95 % over the runs.
    claimed : float
        Share of all epochs at which a position was claimed (CONVERGED or TRACKING).
    within_50m, within_50m_low, within_50m_high : float
        Share of the claimed epochs that were at most 50 m off.
    coverage_50, coverage_67, coverage_95 : float
        Share of the claimed epochs whose radius held the truth.
    false_converged_per_journey, false_converged_per_km : float
        How often a claim began more than 50 m off, also after LOST.
    false_lost_per_journey, false_lost_per_km : float
        How often LOST was reported right after a claimed position that was at most 50 m off.
    lost_per_km : float
        How often LOST was reported at all, before any displacement.
    seconds_per_track : float
        Processor time of the filter, median.
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
    wrong_low: float
    wrong_high: float
    switch_mean_m: float
    switch_p90_m: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float
    worst_100m_mean_m: float
    worst_100m_95_m: float
    claimed: float
    within_50m: float
    within_50m_low: float
    within_50m_high: float
    coverage_50: float
    coverage_67: float
    coverage_95: float
    coverage_95_low: float
    coverage_95_high: float
    false_converged_per_journey: float
    false_converged_per_km: float
    false_lost_per_journey: float
    false_lost_per_km: float
    lost_per_km: float
    seconds_per_track: float
    window_median_m: float = float("nan")


def score(case: Case, walked: Walk, found: PositionedTrack) -> Row:
    """Score one run; figures that are undefined are None.

    After a displacement nothing is claimed fairly until it has been noticed: claims are scored up
    to it.
    """
    estimate, truth = found.estimate, truth_of(walked.truth)
    errors_m = position_errors_m(estimate, truth)
    claims = score_claims(estimate, truth, until_s=walked.displaced_at_s)
    row: Row = {
        "case": case.name,
        "seconds": found.filter_s,
        **{name: getattr(claims, name) for name in ("km", "epochs", "claimed", "within_50m")},
        **{f"covered_{share}": held for share, held in zip(RADII, claims.covered, strict=True)},
        "false_converged": claims.false_starts,
        "false_lost": claims.false_lost,
        "lost": claims.lost,
        "worst_100m_m": _finite(claims.worst_100m_m),
    }
    if case.recovery_within_m > 0:
        return row | _recovered(case, walked, truth, estimate.time_s, errors_m)
    scored = accuracy(estimate, truth)
    row |= {
        "success": scored.success,
        "wrong": bool(scored.error_at_switch_m > SUCCESS_RADIUS_M),
        "switch_m": _finite(scored.switch_distance_m),
        **{name: _finite(getattr(scored, name)) for name in _ERRORS},
    }
    if case.smooth:
        row |= _errors(errors_m[np.isfinite(errors_m)])
    return row


def summarise(case: Case, filter_name: str, rows: Sequence[Mapping[str, Any]]) -> CaseResult:
    """Put the runs of a case together."""
    runs, km = len(rows), _total(rows, "km")
    good = [row for row in rows if row["success"]]
    switch_m, worst_m = (_known(row[name] for row in rows) for name in ("switch_m", "worst_100m_m"))
    of_runs, of_claims = [1] * runs, [int(row["claimed"]) for row in rows]
    figures: dict[str, Any] = {}
    for figure, column, totals in (
        ("success", "success", of_runs),
        ("wrong", "wrong", of_runs),
        ("within_50m", "within_50m", of_claims),
        ("coverage_95", "covered_95", of_claims),
    ):
        low, high = _interval([int(row[column]) for row in rows], totals)
        share = _ratio(_total(rows, column), sum(totals))
        figures |= {figure: share, f"{figure}_low": low, f"{figure}_high": high}
    for name in _ERRORS:
        figures[name] = _mean(_known(row[name] for row in good))
    for name in ("false_converged", "false_lost"):
        figures[f"{name}_per_journey"] = _ratio(_total(rows, name), runs)
        figures[f"{name}_per_km"] = _ratio(_total(rows, name), km)
    return CaseResult(
        name=case.name,
        filter=filter_name,
        runs=runs,
        switch_mean_m=_mean(switch_m),
        switch_p90_m=percentile_m(switch_m, 0.9),
        worst_100m_mean_m=_mean(worst_m),
        worst_100m_95_m=percentile_m(worst_m, 0.95),
        claimed=_ratio(sum(of_claims), _total(rows, "epochs")),
        coverage_50=_ratio(_total(rows, "covered_50"), sum(of_claims)),
        coverage_67=_ratio(_total(rows, "covered_67"), sum(of_claims)),
        lost_per_km=_ratio(_total(rows, "lost"), km),
        seconds_per_track=float(np.median([row["seconds"] for row in rows])) if runs else 0.0,
        window_median_m=_mean(_known(row.get("window_median_m") for row in rows)),
        **figures,
    )


def score_window(walked: Walk, found: PositionedTrack, from_s: float) -> Row:
    """Score the two minutes from a time on, where a position is known."""
    estimate = found.estimate
    errors_m = position_errors_m(estimate, truth_of(walked.truth))
    known = np.array([status is not Status.SEARCHING for status in estimate.status], dtype=bool)
    at = (estimate.time_s >= from_s) & (estimate.time_s < from_s + WINDOW_S) & known
    inside = errors_m[at]
    inside = inside[np.isfinite(inside)]
    return {"window_median_m": _finite(float(np.median(inside))) if inside.size else None}


def _recovered(case: Case, walked: Walk, truth: Truth, time_s: Floats, errors_m: Floats) -> Row:
    """Score how soon a displaced track is found again: within 50 m, for 10 s."""
    after = np.flatnonzero(time_s > walked.displaced_at_s)
    near = errors_m[after] <= SUCCESS_RADIUS_M
    # The displacement itself is not travelled; epochs may fall into it.
    gone_m = truth.distance_at(time_s[after]) - truth.distance_at(walked.arrived_at_s)
    gone_m = np.maximum(gone_m, 0.0)
    far = np.flatnonzero(~near)
    row: Row = {
        "success": False,
        "wrong": bool(errors_m[after[-1]] > SUCCESS_RADIUS_M),
        "switch_m": None,
    }
    for begin in np.concatenate([[0], far + 1]).tolist():
        ends = far[far >= begin]
        end = int(ends[0]) if ends.size else len(near)
        if end > begin and time_s[after[end - 1]] - time_s[after[begin]] >= _STAY_S:
            row["switch_m"] = float(gone_m[begin])
            row["success"] = row["switch_m"] <= case.recovery_within_m
            return row | _errors(errors_m[after[begin:]])
    return row | dict.fromkeys(_ERRORS)


def _errors(errors_m: Floats) -> Row:
    values = _mean(errors_m), percentile_m(errors_m, 0.67), percentile_m(errors_m, 0.95)
    return dict(zip(_ERRORS, map(_finite, values), strict=True))


def _interval(counts: Sequence[int], totals: Sequence[int]) -> tuple[float, float]:
    """Return the interval of a share, each run being a cluster; runs without any are left out."""
    known = np.asarray(totals) > 0
    if not known.any():
        return 0.0, 1.0
    return wilson_interval_of_routes(np.asarray(counts)[known], np.asarray(totals)[known])


def _total(rows: Sequence[Mapping[str, Any]], name: str) -> float:
    return float(sum(row[name] for row in rows))


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _known(values: Iterable[float | None]) -> Floats:
    return np.array([value for value in values if value is not None], dtype=np.float64)


def _mean(values: Floats) -> float:
    return float(np.mean(values)) if values.size else float("nan")
