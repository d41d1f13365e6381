"""Scores of the benchmark: one row for each run."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from mapfilter._types import Floats
from mapfilter.evaluation.accuracy import (
    RADII,
    SUCCESS_RADIUS_M,
    accuracy,
    mean_of,
    percentile_m,
    position_errors_m,
)
from mapfilter.evaluation.claims import claims_of, score_claims
from mapfilter.evaluation.stanford import REGIONS, IntegrityOptions, stanford_bins, stanford_counts
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.journeys import WINDOW_S, Walk
from mapfilter.experiments.sweep.journeys import truth_of
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import PositionedTrack

_STAY_S = 10.0
ERRORS = ("error_mean_m", "error_67_m", "error_95_m")
Row = dict[str, Any]


def score(
    case: Case,
    walked: Walk,
    found: PositionedTrack,
    integrity: IntegrityOptions | None = None,
) -> Row:
    """Score one run; figures that are undefined are None.

    After a displacement nothing is claimed fairly until it has been noticed: claims are scored up
    to it.

    Parameters
    ----------
    integrity : IntegrityOptions, optional
        Alert limit of the Stanford diagram; 50 m by default.
    """
    estimate, truth = found.estimate, truth_of(walked.truth)
    errors_m = position_errors_m(estimate, truth)
    claims = score_claims(estimate, truth, until_s=walked.displaced_at_s)
    row: Row = {
        "case": case.name,
        "seconds": found.filter_s,
        **{name: getattr(claims, name) for name in ("km", "epochs", "claimed", "within_50m")},
        **{f"covered_{share}": held for share, held in zip(RADII, claims.covered, strict=True)},
        "converged": claims.converged,
        "wrong_converged": claims.wrong_converged,
        "false_converged": claims.false_starts,
        "false_lost": claims.false_lost,
        "lost": claims.lost,
        "worst_100m_m": _finite(claims.worst_100m_m),
    }
    row |= _integrity(estimate, errors_m, walked, integrity or IntegrityOptions())
    if np.isfinite(walked.fault_at_s):
        row |= _since_fault(estimate, errors_m, walked.fault_at_s)
        row |= {"fault_at_s": walked.fault_at_s, "fault_until_s": _finite(walked.fault_until_s)}
    if case.recovery_within_m > 0:
        return row | _recovered(case, walked, truth, estimate.time_s, errors_m)
    scored = accuracy(estimate, truth)
    row |= {
        "success": scored.success is True,
        "wrong": bool(scored.error_at_switch_m > SUCCESS_RADIUS_M),
        "switch_m": _finite(scored.switch_distance_m),
        **{name: _finite(getattr(scored, name)) for name in ERRORS},
    }
    if case.smooth:
        row |= _errors(errors_m[np.isfinite(errors_m)])
    return row


def score_window(walked: Walk, found: PositionedTrack, from_s: float) -> Row:
    """Score the two minutes from a time on, where a position is known."""
    estimate = found.estimate
    errors_m = position_errors_m(estimate, truth_of(walked.truth))
    known = np.array([status is not Status.SEARCHING for status in estimate.status], dtype=bool)
    at = (estimate.time_s >= from_s) & (estimate.time_s < from_s + WINDOW_S) & known
    inside = errors_m[at]
    inside = inside[np.isfinite(inside)]
    return {"window_median_m": _finite(float(np.median(inside))) if inside.size else None}


def _integrity(
    estimate: TrackEstimate, errors_m: Floats, walked: Walk, options: IntegrityOptions
) -> Row:
    """Score the protection levels of the claimed epochs; None of filters without any."""
    claimed = claims_of(estimate) & (estimate.time_s <= walked.displaced_at_s)
    errors, levels = errors_m[claimed], estimate.protection_m[claimed]
    limit_m = options.alert_limit_m
    row: Row = asdict(stanford_counts(errors, levels, limit_m))
    row["stanford"] = stanford_bins(errors, levels, limit_m).tolist()
    known = levels[~np.isnan(levels)]
    # Of infinite levels the median may be one.
    row["protection_m"] = _finite(float(np.median(known))) if known.size else None
    if not known.size:
        row |= {**dict.fromkeys(REGIONS), "stanford": []}
    if not np.isfinite(estimate.radius_99_m[claimed]).any():
        row["covered_99"] = None
    return row


def _since_fault(estimate: TrackEstimate, errors_m: Floats, fault_at_s: float) -> Row:
    """Score what is claimed more than 50 m off since a fault of the sensors began.

    ``fault_wrong_s`` is the time from the fault's begin to the first such claim, and
    ``fault_noticed_s`` that to the first epoch after it at which nothing wrong is claimed:
    UNCERTAIN, LOST, OUTSIDE, or within 50 m again. Where there is none, it is the time to the last
    epoch, and
    ``fault_unnoticed`` is true. Both are None where nothing wrong is claimed.
    """
    since = (estimate.time_s >= fault_at_s) & np.isfinite(errors_m)
    wrong = (claims_of(estimate) & (errors_m > SUCCESS_RADIUS_M))[since]
    after_s = estimate.time_s[since] - fault_at_s
    if not wrong.any():
        return {"fault_wrong_s": None, "fault_noticed_s": None, "fault_unnoticed": False}
    first = int(np.argmax(wrong))
    honest = np.flatnonzero(~wrong[first:])
    end = first + int(honest[0]) if honest.size else -1
    return {
        "fault_wrong_s": float(after_s[first]),
        "fault_noticed_s": float(after_s[end]),
        "fault_unnoticed": not honest.size,
    }


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
    return row | dict.fromkeys(ERRORS)


def _errors(errors_m: Floats) -> Row:
    values = mean_of(errors_m), percentile_m(errors_m, 0.67), percentile_m(errors_m, 0.95)
    return dict(zip(ERRORS, map(_finite, values), strict=True))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
