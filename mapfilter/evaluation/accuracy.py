"""Errors of an estimate against the truth, and how often its claims hold.

Success and errors after convergence are those of Khalaf-Allah 2007, section 6.2 and Table 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, nan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate

if TYPE_CHECKING:
    import pandas as pd

SUCCESS_RADIUS_M = 50.0
"""An error of at most this at the switch counts as success (section 6.2)."""

RADII = (50, 67, 95, 99)
"""Per cent of the belief that the radii of an estimate hold."""

GAP_S, GAP_M = 30.0, 50.0
"""Between true positions that are farther apart than both, nobody knows the way."""

_COLUMNS = ("time_s", "east_m", "north_m")
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
        """Return the ground truth in a log's table ``truth``; None below two positions.

        Rows are sorted by time and repeated ones dropped, as in a log.
        """
        table = table[list(_COLUMNS)]
        if not (np.diff(table["time_s"].to_numpy(np.float64)) > 0).all():
            table = table.drop_duplicates().sort_values("time_s", kind="stable")
        if len(table) < 2:
            return None
        return cls(*(table[name].to_numpy(np.float64) for name in _COLUMNS))

    def at(self, time_s: ArrayLike) -> tuple[Floats, Floats]:
        """Return true positions at other times by linear interpolation; NaN outside the record."""
        at_s = np.asarray(time_s, dtype=np.float64)
        inside = (at_s >= self.time_s[0]) & (at_s <= self.time_s[-1])
        east_m = np.interp(at_s, self.time_s, self.east_m)
        north_m = np.interp(at_s, self.time_s, self.north_m)
        return np.where(inside, east_m, np.nan), np.where(inside, north_m, np.nan)

    def tells(self, time_s: ArrayLike) -> Bools:
        """Return whether the true position is known at other times: within the record, in no gap.

        A gap is between neighbours more than 30 s and 50 m apart.

        Examples
        --------
        >>> truth = Truth(*np.array([[0.0, 10.0, 60.0, 99.0], [0.0, 9.0, 99.0, 130.0], [0.0] * 4]))
        >>> truth.tells([-1.0, 5.0, 10.0, 20.0, 70.0, 100.0]).tolist()
        [False, True, True, False, True, False]
        """
        at_s = np.asarray(time_s, dtype=np.float64)
        legs_m = np.hypot(np.diff(self.east_m), np.diff(self.north_m))
        # No gap follows the last one.
        is_gap = np.append((np.diff(self.time_s) > GAP_S) & (legs_m > GAP_M), False)
        before = np.clip(np.searchsorted(self.time_s, at_s, side="right") - 1, 0, None)
        measured = np.isin(at_s, self.time_s)
        return np.asarray(np.isfinite(self.at(at_s)).all(axis=0) & (measured | ~is_gap[before]))

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
    success : bool or None
        It did, and was at most 50 m off then; never switching is a failure. None where the ground
        truth does not tell: it begins later or ends earlier, or has a gap there.
    switch_time_s, switch_distance_m, error_at_switch_m : float
        When, after how many true metres, and how far off; NaN if it never switched, the latter two
        also where the ground truth does not tell.
    error_mean_m, error_67_m, error_95_m : float
        Mean and percentiles of the error over all located epochs from the switch on at which the
        truth is known.
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
    >>> held_by_radius_95(TrackEstimate.of_fixes("EPSG:32635", "none", []), Truth(*np.eye(3, 2)))
    array([], dtype=bool)
    """
    switch = estimate.converged_at
    if switch is None:
        return np.zeros(0, dtype=np.bool_)
    errors_m = position_errors_m(estimate, truth)[switch:]
    radius_m = estimate.radii_m[switch:, -1]
    scored = np.isfinite(errors_m) & np.isfinite(radius_m)
    return np.asarray(errors_m[scored] <= radius_m[scored])


def share_of(held: Bools) -> float:
    """Return the share of what holds; NaN without any."""
    return float(held.mean()) if held.size else nan


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
        float(after_m.mean()) if after_m.size else nan,
        percentile_m(after_m, 0.67),
        percentile_m(after_m, 0.95),
        int(after_m.size),
    )


def truth_notes(estimate: TrackEstimate, truth: Truth) -> tuple[str, ...]:
    """Return what a ground truth does not tell of a track that was located.

    Epochs before it begins and after it ends are no reason for a note, as many records are shorter
    than the log, but for the switch.
    """
    inside = (estimate.time_s >= truth.time_s[0]) & (estimate.time_s <= truth.time_s[-1])
    if len(estimate) and not inside.any():
        own, its = (f"{one.time_s[0]:.0f} to {one.time_s[-1]:.0f} s" for one in (estimate, truth))
        return (
            f"the ground truth ({its}) covers no epoch of the log ({own}): another "
            "clock or time zone?",
        )
    notes = []
    switch, told = estimate.converged_at, truth.tells(estimate.time_s)
    if switch is not None and not told[switch]:
        at_s = estimate.time_s[switch]
        notes.append(
            f"the ground truth has no position at the switch ({at_s:.0f} s): whether that was "
            "right is not known, and counts neither as right nor as wrong"
        )
    unknown = int((inside & ~told).sum())
    if unknown:
        some = number_of(unknown, "epoch lies", "epochs lie")
        notes.append(
            f"{some} in gaps of the ground truth (over {GAP_S:g} s and {GAP_M:g} m), and "
            f"{'is' if unknown == 1 else 'are'} not scored"
        )
    return tuple(notes)


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
    counted = truth.tells(estimate.time_s) & (estimate.time_s <= until_s)
    claimed = counted & claims_of(estimate)
    known = np.array([status.is_followed for status in estimate.status], dtype=bool)
    converged = counted & np.array([s is Status.CONVERGED for s in estimate.status], dtype=bool)
    lost = np.array([status is Status.LOST for status in estimate.status], dtype=bool)
    near = errors_m <= SUCCESS_RADIUS_M
    radii_m = np.column_stack([estimate.radii_m, estimate.radius_99_m])
    held = errors_m[:, np.newaxis] <= radii_m
    followed = counted & np.logical_or.accumulate(claimed) & np.isfinite(errors_m)
    # What began before the truth, or in a gap of it, does not begin with it.
    began_claim, began_lost = claimed & ~_before(known), counted & lost & ~_before(lost)
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
        false_lost=int((began_lost & _before(counted & known & near)).sum()),
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
