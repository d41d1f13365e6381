"""Errors of an estimate against the truth.

Success and errors after convergence are those of Khalaf-Allah 2007, section 6.2 and Table 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, nan

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.estimate import TrackEstimate

SUCCESS_RADIUS_M = 50.0
"""An error of at most this at the switch counts as success (section 6.2)."""

RADII = (50, 67, 95, 99)
"""Per cent of the belief that the radii of an estimate hold."""


@dataclass(frozen=True, slots=True)
class Accuracy:
    """One track, scored.

    Parameters
    ----------
    switched : bool
        Whether the filter ever switched to tracking.
    success : bool or None
        It did, and was at most 50 m off then; never switching is a failure. None where the ground
        truth does not tell: it begins later or ends earlier, or has a gap there.
    switch_time_s, switch_distance_m, error_at_switch_m : float
        When, after how many true metres, and how far off; NaN if it never switched, the latter two
        also where the ground truth does not tell.
    error_mean_m, error_67_m, error_95_m : float
        Mean and percentiles of the error over all epochs with a position from the switch on, lost
        ones too, at which the truth is known.
    scored_epochs : int
        How many those are.
    """

    switched: bool
    success: bool | None
    switch_time_s: float
    switch_distance_m: float
    error_at_switch_m: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float
    scored_epochs: int


def position_errors_m(estimate: TrackEstimate, truth: Truth) -> Floats:
    """Return the horizontal error at every epoch, shape (N,).

    NaN where there is no position, or the ground truth does not tell.
    """
    east_m, north_m = truth.at(estimate.time_s)
    errors_m = np.hypot(estimate.east_m - east_m, estimate.north_m - north_m)
    return np.where(truth.tells(estimate.time_s), errors_m, np.nan)


def held_by_radius_95(estimate: TrackEstimate, truth: Truth) -> Bools:
    """Return whether the 95 % radius holds the true position, of each scored epoch with a radius.

    Examples
    --------
    >>> nowhere = TrackEstimate.of_fixes("EPSG:32635", "none", [])
    >>> held_by_radius_95(nowhere, Truth(*np.zeros((3, 2))))
    array([], dtype=bool)
    """
    switch = estimate.converged_at
    if switch is None:
        return np.zeros(0, dtype=np.bool_)
    errors_m = position_errors_m(estimate, truth)[switch:]
    radius_m = estimate.radii_m[switch:, -1]
    scored = np.isfinite(errors_m) & np.isfinite(radius_m)
    return np.asarray(errors_m[scored] <= radius_m[scored])


def mean_of(values: Sequence[float] | Floats | Bools) -> float:
    """Return the mean of numbers, or the share of what holds; NaN without any."""
    return float(np.mean(values)) if len(values) else nan


def percentile_m(errors_m: Floats, share: float) -> float:
    """Return the smallest error that ``share`` of the errors do not exceed; NaN without any.

    Examples
    --------
    >>> percentile_m(np.array([1.0, 2.0, 3.0, 4.0]), 0.67)
    3.0
    """
    if errors_m.size == 0:
        return float("nan")
    # 0.67 · 1500 is a hair above 1005 in floating point.
    rank = ceil(share * errors_m.size - 1e-9)
    return float(np.sort(errors_m)[max(rank, 1) - 1])


def accuracy(estimate: TrackEstimate, truth: Truth) -> Accuracy:
    """Score one track."""
    switch = estimate.converged_at
    if switch is None:
        return Accuracy(False, False, nan, nan, nan, nan, nan, nan, 0)
    errors_m = position_errors_m(estimate, truth)
    time_s = float(estimate.time_s[switch])
    after_m = errors_m[switch:]
    after_m = after_m[np.isfinite(after_m)]
    error_m, told = float(errors_m[switch]), bool(truth.tells(time_s))
    return Accuracy(
        True,
        error_m <= SUCCESS_RADIUS_M if told else None,
        time_s,
        float(truth.distance_at(time_s)) if told else nan,
        error_m,
        mean_of(after_m),
        percentile_m(after_m, 0.67),
        percentile_m(after_m, 0.95),
        int(after_m.size),
    )
