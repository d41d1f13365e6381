"""The claims of a track, counted against the truth: how often it is followed, wrong and lost."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate

_CLAIMS = (Status.CONVERGED, Status.TRACKING)
_WINDOW_M = 100.0


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


@dataclass(frozen=True, slots=True)
class ClaimedRadii:
    """The 95 % radius of one track, where a position was claimed.

    Parameters
    ----------
    epochs, claimed_epochs : int
        As ``epochs`` and ``claimed`` of :class:`Claims`.
    held_95_epochs : int or None
        Claimed epochs whose 95 % radius held the true position; None where none of them has a
        radius, as with the candidate filter.
    radius_95_median_m : float
        Median of that radius over the claimed epochs that have one; NaN without any.
    """

    epochs: int
    claimed_epochs: int
    held_95_epochs: int | None
    radius_95_median_m: float


def claimed_radii(estimate: TrackEstimate, truth: Truth) -> ClaimedRadii:
    """Count how often the 95 % radius of claimed positions held the truth along one track.

    Examples
    --------
    >>> claimed_radii(TrackEstimate.of_fixes("EPSG:32635", "none", []), Truth(*np.zeros((3, 2))))
    ClaimedRadii(epochs=0, claimed_epochs=0, held_95_epochs=None, radius_95_median_m=nan)
    """
    counted = truth.tells(estimate.time_s)
    claimed = counted & claims_of(estimate)
    radius_m = estimate.radii_m[claimed, -1] if len(estimate) else np.zeros(0)
    known_m = radius_m[~np.isnan(radius_m)]
    held = None
    if known_m.size:
        held = int((position_errors_m(estimate, truth)[claimed] <= radius_m).sum())
    median_m = float(np.median(known_m)) if known_m.size else nan
    return ClaimedRadii(int(counted.sum()), int(claimed.sum()), held, median_m)


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
