"""Errors of an estimate against the truth, and how often its claims hold.

Success and errors after convergence are those of Khalaf-Allah 2007, section 6.2 and Table 4.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import ceil, inf, nan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate import TrackEstimate

if TYPE_CHECKING:
    import pandas as pd

SUCCESS_RADIUS_M = 50.0
"""An error of at most this at the switch counts as success (section 6.2)."""

RADII = (50, 67, 95, 99)
"""Per cent of the belief that the radii of an estimate hold."""

_CLAIMS = (Status.CONVERGED, Status.TRACKING)
_WINDOW_M = 100.0


@dataclass(frozen=True, slots=True)
class Truth:
    """True positions of a journey.

    Parameters
    ----------
    time_s, east_m, north_m : (T,) arrays
        True positions, in ascending time, in the CRS of the estimate.
    """

    time_s: Floats
    east_m: Floats
    north_m: Floats

    @classmethod
    def of_table(cls, table: pd.DataFrame) -> Truth | None:
        """Return the ground truth in a log's table ``truth``; None below two positions."""
        if len(table) < 2:
            return None
        return cls(*(table[name].to_numpy(np.float64) for name in ("time_s", "east_m", "north_m")))

    def at(self, time_s: ArrayLike) -> tuple[Floats, Floats]:
        """Return true positions at other times by linear interpolation; NaN outside the record."""
        at_s = np.asarray(time_s, dtype=np.float64)
        inside = (at_s >= self.time_s[0]) & (at_s <= self.time_s[-1])
        east_m = np.interp(at_s, self.time_s, self.east_m)
        north_m = np.interp(at_s, self.time_s, self.north_m)
        return np.where(inside, east_m, np.nan), np.where(inside, north_m, np.nan)

    def distance_at(self, time_s: ArrayLike) -> Floats:
        """Return the true distance travelled since the start, interpolated to other times."""
        legs_m = np.hypot(np.diff(self.east_m), np.diff(self.north_m))
        travelled_m = np.concatenate([[0.0], np.cumsum(legs_m)])
        return np.asarray(np.interp(np.asarray(time_s, dtype=np.float64), self.time_s, travelled_m))


@dataclass(frozen=True, slots=True)
class Accuracy:
    """One track, scored.

    Parameters
    ----------
    switched : bool
        Whether the filter ever switched to tracking.
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


@dataclass(frozen=True, slots=True)
class Outcome:
    """One located track.

    Parameters
    ----------
    final_status : str
        Status at the last epoch; empty without any epoch.
    switched : bool
        Whether the filter ever switched to tracking.
    switch_time_s : float
        When, in seconds since the start of the log; NaN if it never did.
    epochs : int
        How many there are.
    epochs_by_status : dict
        How many of each status that occurs.
    last_lon_deg, last_lat_deg : float
        The last position, WGS 84; NaN where there is none.
    last_time_s : float
        When that was.
    unused : dict
        How many readings were not used, by reason.
    unknown_cells : dict
        How many readings name each cell that is not in the database, the most frequent first.
    """

    final_status: str
    switched: bool
    switch_time_s: float
    epochs: int
    epochs_by_status: dict[str, int]
    last_lon_deg: float
    last_lat_deg: float
    last_time_s: float
    unused: dict[str, int]
    unknown_cells: dict[str, int]


def outcome(estimate: TrackEstimate) -> Outcome:
    """Summarise a located track."""
    switch = estimate.converged_at
    statuses = Counter(estimate.status)
    located = np.flatnonzero(np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m))[-1:]
    lon, lat = unproject(estimate.crs, estimate.east_m[located], estimate.north_m[located])
    unused: Counter[str] = Counter()
    unknown: Counter[str] = Counter()
    for reading in estimate.unused:
        unused[str(reading.reason)] += reading.readings
        if reading.reason is Reason.UNKNOWN_CELL:
            unknown[reading.what] += reading.readings
    return Outcome(
        str(estimate.status[-1]) if len(estimate) else "",
        switch is not None,
        float(estimate.time_s[switch]) if switch is not None else nan,
        len(estimate),
        {str(status): statuses[status] for status in Status if statuses[status]},
        float(lon[0]) if located.size else nan,
        float(lat[0]) if located.size else nan,
        float(estimate.time_s[located[0]]) if located.size else nan,
        dict(sorted(unused.items())),
        dict(sorted(unknown.items(), key=lambda one: (-one[1], one[0]))),
    )


@dataclass(frozen=True, slots=True)
class Claims:
    """The claims of one track, counted.

    Parameters
    ----------
    epochs : int
        All epochs at which the truth is known.
    km : float
        Really travelled.
    claimed : int
        Epochs at which a position was claimed: CONVERGED or TRACKING.
    within_50m : int
        Claimed epochs that were at most 50 m off.
    covered : tuple of int
        Claimed epochs whose radius held the truth, for 50, 67, 95 and 99 %.
    converged, wrong_converged : int
        How often CONVERGED was reported, the first time and after LOST, and how often of these more
        than 50 m off.
    false_starts : int
        How often a claim began more than 50 m off, after an epoch at which no position was
        followed.
    lost : int
        How often LOST began.
    false_lost : int
        How often it began right after a position that was at most 50 m off, claimed or
        UNCERTAIN.
    worst_100m_m : float
        The largest mean error over 100 m travelled, from the first claim on; over what was
        travelled, where that is less; NaN without a claim.
    """

    epochs: int
    km: float
    claimed: int
    within_50m: int
    covered: tuple[int, ...]
    converged: int
    wrong_converged: int
    false_starts: int
    lost: int
    false_lost: int
    worst_100m_m: float


def score_claims(estimate: TrackEstimate, truth: Truth, *, until_s: float = inf) -> Claims:
    """Count what a filter claimed along one track.

    Parameters
    ----------
    until_s : float
        Later epochs do not count.
    """
    errors_m = position_errors_m(estimate, truth)
    inside = (estimate.time_s >= truth.time_s[0]) & (estimate.time_s <= truth.time_s[-1])
    counted = inside & (estimate.time_s <= until_s)
    claimed = counted & claims_of(estimate)
    known = counted & np.array([status.is_followed for status in estimate.status], dtype=bool)
    converged = counted & np.array([s is Status.CONVERGED for s in estimate.status], dtype=bool)
    lost = counted & np.array([status is Status.LOST for status in estimate.status], dtype=bool)
    near = errors_m <= SUCCESS_RADIUS_M
    radii_m = np.column_stack([estimate.radii_m, estimate.radius_99_m])
    held = errors_m[:, np.newaxis] <= radii_m
    followed = counted & np.logical_or.accumulate(claimed) & np.isfinite(errors_m)
    began_claim, began_lost = claimed & ~_before(known), lost & ~_before(lost)
    return Claims(
        epochs=int(counted.sum()),
        km=float(truth.distance_at(min(until_s, float(truth.time_s[-1]))) / 1000),
        claimed=int(claimed.sum()),
        within_50m=int((claimed & near).sum()),
        covered=tuple(int(count) for count in held[claimed].sum(axis=0)),
        converged=int(converged.sum()),
        wrong_converged=int((converged & ~near).sum()),
        false_starts=int((began_claim & ~near).sum()),
        lost=int(began_lost.sum()),
        false_lost=int((began_lost & _before(known & near)).sum()),
        worst_100m_m=_worst_100m(errors_m[followed], truth.distance_at(estimate.time_s[followed])),
    )


def claims_of(estimate: TrackEstimate) -> Bools:
    """Return at which epochs a position is claimed: CONVERGED or TRACKING, shape (N,)."""
    return np.array([status in _CLAIMS for status in estimate.status], dtype=bool)


def _before(happened: Bools) -> Bools:
    """Return whether something held at the epoch before."""
    return np.concatenate([[False], happened[:-1]])


def _worst_100m(errors_m: Floats, travelled_m: Floats) -> float:
    """Return the largest mean error over windows of 100 m that end at an epoch."""
    if not errors_m.size:
        return nan
    full = travelled_m - travelled_m[0] >= _WINDOW_M
    if not full.any():
        return float(errors_m.mean())
    total_m = np.concatenate([[0.0], np.cumsum(errors_m)])
    ends = np.arange(1, errors_m.size + 1)
    begins = np.searchsorted(travelled_m, travelled_m - _WINDOW_M)
    return float(((total_m[ends] - total_m[begins]) / (ends - begins))[full].max())
