"""What a ground truth cannot judge of a track: gaps in it, and times of another clock."""

from __future__ import annotations

import numpy as np

from mapfilter._constants import HOUR_S
from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.evaluation.truth import GAP_M, GAP_S, Truth
from mapfilter.positioning.estimate import TrackEstimate

_MOST_S, _LEAST_S = 60, 3
_MOST_HOURS = 14
_MOST_EPOCHS, _FEWEST_EPOCHS = 600, 40
_LEAST_COMMON = 0.5
_PARTS, _FEWEST_TELLING = 8, 4
_BETTER = 0.5
_OF_SPREAD = 0.25
_LEAP_S = 18
"""By which GPS time is ahead of UTC since 2017."""


def truth_notes(estimate: TrackEstimate, truth: Truth) -> tuple[str, ...]:
    """Return notes on what a ground truth cannot judge of a located track.

    Epochs before it begins and after it ends are no reason for a note, as many records are shorter
    than the log, but for the switch.
    """
    inside = (estimate.time_s >= truth.time_s[0]) & (estimate.time_s <= truth.time_s[-1])
    if len(estimate) and not inside.any():
        own, its = (f"{one.time_s[0]:.0f} to {one.time_s[-1]:.0f} s" for one in (estimate, truth))
        none = f"the ground truth ({its}) covers no epoch of the log ({own})"
        return (f"{none}: another clock or time zone?", *_clock_notes(estimate, truth))
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
    return (*notes, *_clock_notes(estimate, truth))


def _clock_notes(estimate: TrackEstimate, truth: Truth) -> tuple[str, ...]:
    """Return a note where a ground truth fits far better with all its times moved.

    Errors of a filter may lie along the way, too, but not for long: the median error has to fall
    below its half in nearly every part of the track, and below half of what one constant
    displacement leaves, as the errors of a map or another datum have. Times are moved by up to a
    minute, and by half hours, as time zones are. Positions from the switch on are compared.
    """
    switch = estimate.converged_at
    if switch is None:
        return ()
    places = np.column_stack([estimate.time_s, estimate.east_m, estimate.north_m])[switch:]
    places = places[np.isfinite(places).all(axis=1)]
    places = places[:: -(-len(places) // _MOST_EPOCHS) or 1]
    if len(places) < _FEWEST_EPOCHS:
        return ()
    seconds = np.arange(-_MOST_S, _MOST_S + 1.0)
    half_hours = np.arange(-2 * _MOST_HOURS, 2 * _MOST_HOURS + 1) * (HOUR_S / 2)
    shifts_s = np.concatenate([seconds, half_hours[half_hours != 0]])
    offsets_m = [_offsets_m(places, truth, shift) for shift in shifts_s]
    medians_m = np.array([_median_m(one) for one in offsets_m])
    if np.isnan(medians_m).all():
        return ()
    best = int(np.nanargmin(medians_m))
    shift_s, median_m = float(shifts_s[best]), float(medians_m[best])
    if abs(shift_s) < _LEAST_S:
        return ()
    now_m = offsets_m[_MOST_S]
    if np.isnan(_median_m(now_m)):
        spread_m = float(np.median(np.hypot(*(places[:, 1:] - np.median(places[:, 1:], axis=0)).T)))
        fits = median_m < _OF_SPREAD * spread_m
        before = "none is known with them as they are"
    else:
        fits = _is_better(now_m, offsets_m[best])
        before = f"{_median_m(now_m):.0f} m with them as they are"
    if not fits:
        return ()
    note = (
        f"with the times of the ground truth {_in_words(shift_s)}, the median error is "
        f"{median_m:.0f} m, and {before} (likely: {_likely(shift_s)}); scored as they are"
    )
    return (note,)


def _offsets_m(places: Floats, truth: Truth, shift_s: float) -> Floats:
    """Return the errors by axis, (N, 2), of a truth that is ``shift_s`` late; NaN where unknown."""
    east_m, north_m = truth.at(places[:, 0] + shift_s)
    return np.column_stack([places[:, 1] - east_m, places[:, 2] - north_m])


def _median_m(offsets_m: Floats) -> float:
    """Return the median error; NaN where too few are known."""
    known = _known(offsets_m)
    if known.mean() < _LEAST_COMMON:
        return float("nan")
    return float(np.median(np.hypot(*offsets_m[known].T)))


def _is_better(now_m: Floats, moved_m: Floats) -> bool:
    both = _known(now_m) & _known(moved_m)
    if both.mean() < _LEAST_COMMON or both.sum() < _FEWEST_EPOCHS:
        return False
    now_m, moved_m = now_m[both], moved_m[both]
    displaced_m = now_m - np.median(now_m, axis=0)
    if _median_m(moved_m) >= _BETTER * min(_median_m(now_m), _median_m(displaced_m)):
        return False
    # Who stands is at the same place at all times.
    least_m = _BETTER * _median_m(now_m)
    parts = zip(np.array_split(now_m, _PARTS), np.array_split(moved_m, _PARTS), strict=True)
    telling = [one for one in parts if _median_m(one[0] - one[1]) > least_m]
    better = sum(_median_m(moved) < _BETTER * _median_m(now) for now, moved in telling)
    return len(telling) >= _FEWEST_TELLING and better >= len(telling) - 1


def _known(offsets_m: Floats) -> Bools:
    return np.asarray(np.isfinite(offsets_m).all(axis=1))


def _in_words(shift_s: float) -> str:
    way = "earlier" if shift_s > 0 else "later"
    if abs(shift_s) <= _MOST_S:
        return f"{abs(shift_s):.0f} s {way}"
    return f"{abs(shift_s) / HOUR_S:g} h {way}"


def _likely(shift_s: float) -> str:
    if abs(shift_s) > _MOST_S:
        return "another time zone"
    if abs(abs(shift_s) - _LEAP_S) <= 1:
        return "GPS time beside UTC, or another clock"
    return "another clock"
