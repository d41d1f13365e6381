"""Scores of a located journey, the same for all benchmarks."""

from __future__ import annotations

from collections.abc import Callable
from math import nan

import numpy as np

from mapfilter._types import Floats
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.worst_run import explain
from mapfilter.experiments.recorded.rows import Found
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate

_NO_ERRORS: Floats = np.empty(0)


def score_journey(
    part: str,
    method: str,
    unit: str,
    estimate: TrackEstimate,
    truth: Truth,
    *,
    baseline_m: Floats = _NO_ERRORS,
    seconds: float = nan,
    asked: Callable[[bool, bool], bool | None] | None = None,
) -> Found:
    """Score a journey from CONVERGED on.

    Parameters
    ----------
    baseline_m : ndarray
        Errors of the baseline on the same journey.
    seconds : float
        Processor time of the filter.
    asked : callable, optional
        From "claimed a position" and "first claim more than 50 m off" to success; by default a
        claim that is not wrong. Neither is known where the ground truth does not tell.
    """
    errors_m = position_errors_m(estimate, truth)
    switch = estimate.converged_at
    claimed = switch is not None
    first_m = float(errors_m[switch]) if switch is not None else nan
    time_s = float(estimate.time_s[switch]) if switch is not None else nan
    told = not claimed or bool(truth.tells(time_s))
    wrong = claimed and not first_m <= SUCCESS_RADIUS_M if told else None
    at = np.arange(len(estimate))
    since = len(estimate) if switch is None else switch
    scored = (at >= since) & np.isfinite(errors_m)
    success = None
    if wrong is not None:
        success = (claimed and not wrong) if asked is None else asked(claimed, wrong)
    story = explain(estimate, truth)
    return Found(
        part,
        method,
        unit,
        success,
        claimed,
        wrong,
        errors_m[scored],
        (errors_m <= estimate.radii_m[:, 2])[scored],
        baseline_m,
        float(truth.distance_at(time_s)) if claimed else nan,
        sum(status is Status.LOST for status in estimate.status),
        seconds,
        float(estimate.time_s[-1] - estimate.time_s[0]) if len(estimate) else nan,
        f"{story.what}. {story.reason}" if story is not None else "",
    )
