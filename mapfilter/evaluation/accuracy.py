"""Errors of an estimate against the truth (Khalaf-Allah 2007, section 6.2 and Table 4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.positioning.estimate import TrackEstimate

SUCCESS_RADIUS_M = 50.0
"""An error of at most this at the switch counts as success (section 6.2)."""


@dataclass(frozen=True, slots=True)
class Truth:
    """Where the journey really went.

    Parameters
    ----------
    time_s, east_m, north_m : (T,) arrays
        True positions, in ascending time, in the CRS of the estimate.
    """

    time_s: Floats
    east_m: Floats
    north_m: Floats

    def at(self, time_s: ArrayLike) -> tuple[Floats, Floats]:
        """Return true positions at other times by linear interpolation; NaN outside the record."""
        at_s = np.asarray(time_s, dtype=np.float64)
        inside = (at_s >= self.time_s[0]) & (at_s <= self.time_s[-1])
        east_m = np.interp(at_s, self.time_s, self.east_m)
        north_m = np.interp(at_s, self.time_s, self.north_m)
        return np.where(inside, east_m, np.nan), np.where(inside, north_m, np.nan)

    def distance_at(self, time_s: ArrayLike) -> Floats:
        """Return metres really travelled since the start, at other times."""
        legs_m = np.hypot(np.diff(self.east_m), np.diff(self.north_m))
        travelled_m = np.concatenate([[0.0], np.cumsum(legs_m)])
        return np.asarray(np.interp(np.asarray(time_s, dtype=np.float64), self.time_s, travelled_m))


@dataclass(frozen=True, slots=True)
class Accuracy:
    """One track, scored.

    Parameters
    ----------
    switched : bool
        Whether the filter ever went over to tracking.
    success : bool
        It did, and was at most 50 m off then; never switching is a failure.
    switch_time_s, switch_distance_m, error_at_switch_m : float
        When, after how many true metres, and how far off; NaN if it never switched.
    error_mean_m, error_67_m, error_95_m : float
        Mean and percentiles of the error over all located epochs from the switch on.
    scored_epochs : int
        How many those are.
    """

    switched: bool
    success: bool
    switch_time_s: float
    switch_distance_m: float
    error_at_switch_m: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float
    scored_epochs: int


def position_errors_m(estimate: TrackEstimate, truth: Truth) -> Floats:
    """Return the horizontal error at every epoch, shape (N,); NaN where there is no position."""
    east_m, north_m = truth.at(estimate.time_s)
    return np.asarray(np.hypot(estimate.east_m - east_m, estimate.north_m - north_m))


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
    nan = float("nan")
    switch = estimate.converged_at
    if switch is None:
        return Accuracy(False, False, nan, nan, nan, nan, nan, nan, 0)
    errors_m = position_errors_m(estimate, truth)
    time_s = float(estimate.time_s[switch])
    after_m = errors_m[switch:]
    after_m = after_m[np.isfinite(after_m)]
    return Accuracy(
        True,
        bool(errors_m[switch] <= SUCCESS_RADIUS_M),
        time_s,
        float(truth.distance_at(time_s)),
        float(errors_m[switch]),
        float(after_m.mean()) if after_m.size else nan,
        percentile_m(after_m, 0.67),
        percentile_m(after_m, 0.95),
        int(after_m.size),
    )
