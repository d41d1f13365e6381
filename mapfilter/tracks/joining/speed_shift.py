"""Seconds by which the clocks of two recordings differ, by their speeds."""

from __future__ import annotations

from math import isfinite

import numpy as np

from mapfilter._types import Bools, Floats

_WITHIN_S, _PERIOD_S = 60.0, 0.5
_FEWEST_S, _LEAST, _TIMES, _GAIN, _PEAK_S = 180.0, 0.7, 3.0, 0.05, 8.0
"""What is left unexplained has to be three times as much without the shift."""
_REMARKABLE_S, _HALF_S, _LONGEST_S = 1.5, 2.5, 7200.0
_STEADY = 1e-3
"""Speeds that differ by no more than this share are one speed and the rounding of positions."""
_GAP_S, _GAPS = 10.0, 5.0
"""Gaps as long as this, and so many times as long as usual, are those of a receiver."""
_LEAP_S = (17.0, 19.0)
"""GPS time is 18 s ahead of UTC since 2017."""

Speeds = tuple[Floats, Floats]
"""Times and speeds."""


def shift_note(first: str, one: Speeds | None, other: Speeds | None) -> str:
    """Return a note where speeds of two recordings agree far better some seconds apart; else "".

    Parameters
    ----------
    first : str
        Name of the recording of ``one``.
    one, other : (times, speeds) or None
        In order, on clocks that should be the same.

    Examples
    --------
    >>> time_s = np.arange(600.0)
    >>> speed = 10 + 5 * np.sin(time_s / 20) + 3 * np.sin(time_s / 7)
    >>> shift_note("gps.csv", (time_s, speed), (time_s + 18, speed))
    'speeds agree with those of gps.csv best -18.0 s shifted (correlation 1.00, not 0.26); not \
applied, see --offset (likely: GPS time for UTC)'
    >>> shift_note("gps.csv", (time_s, speed), (time_s, speed))
    ''
    """
    if one is None or other is None:
        return ""
    shifts = np.arange(-_WITHIN_S, _WITHIN_S + _PERIOD_S / 2, _PERIOD_S)
    agreed = np.array([_correlation(one, other, shift) for shift in shifts])
    now = float(agreed[len(shifts) // 2])
    if not isfinite(now):
        return ""
    # Of short recordings a shift to one side leaves too little in common.
    shifts, agreed = shifts[np.isfinite(agreed)], agreed[np.isfinite(agreed)]
    at = int(np.argmax(agreed))
    if at in (0, len(shifts) - 1):
        return ""
    shift_s, best = float(shifts[at]), float(agreed[at])
    # A speed that repeats itself, as between lights, agrees at several shifts.
    peak = np.r_[False, (agreed[1:-1] >= agreed[:-2]) & (agreed[1:-1] >= agreed[2:]), False]
    peak &= np.abs(shifts - shift_s) > _PEAK_S
    other_best = float(agreed[peak].max(initial=-1.0))
    if not _is_clear(best, max(now, other_best)) or abs(shift_s) < _REMARKABLE_S:
        return ""
    low, high = _LEAP_S
    leap = " (likely: GPS time for UTC)" if low <= abs(shift_s) <= high else ""
    return (
        f"speeds agree with those of {first} best {shift_s:+.1f} s shifted (correlation "
        f"{best:.2f}, not {now:.2f}); not applied, see --offset{leap}"
    )


def speed_agreement(one: Speeds | None, other: Speeds | None, shift_s: float) -> float:
    """Return the correlation of speeds of which the second are shifted; NaN where nothing tells."""
    return float("nan") if one is None or other is None else _correlation(one, other, shift_s)


def best_shift(shifts: Floats, one: Speeds | None, other: Speeds | None) -> float | None:
    """Return the shift of some at which speeds agree far better than at others, or None."""
    if one is None or other is None:
        return None
    agreed = np.array([_correlation(one, other, shift) for shift in shifts.tolist()])
    agreed = np.where(np.isfinite(agreed), agreed, -1.0)
    order = np.argsort(-agreed)
    best, second = [*agreed[order[:2]].tolist(), -1.0][:2]
    return float(shifts[order[0]]) if _is_clear(best, second) else None


def speeds_of_places(time_s: Floats, east_m: Floats, north_m: Floats) -> Speeds:
    """Return speeds over five seconds, or a way from one position to the next if that lasts longer.

    Parameters
    ----------
    time_s, east_m, north_m : (N,) array
        Of each time one position, in order.
    """
    half_s = max(_HALF_S, float(np.median(np.diff(time_s))) / 2)
    begin_s, end_s = np.maximum(time_s - half_s, time_s[0]), np.minimum(time_s + half_s, time_s[-1])
    moved = (
        np.interp(end_s, time_s, axis_m) - np.interp(begin_s, time_s, axis_m)
        for axis_m in (east_m, north_m)
    )
    return time_s, np.hypot(*moved) / (end_s - begin_s)


def _is_clear(best: float, other: float) -> bool:
    """Return whether speeds that agree so well leave no doubt about another shift."""
    return best >= _LEAST and 1 - other >= _TIMES * (1 - best) + _GAIN


def _correlation(one: Speeds, other: Speeds, shift_s: float) -> float:
    """Return the correlation of speeds of which the second are shifted; NaN for a short time."""
    begin_s = max(one[0][0], other[0][0] + shift_s)
    end_s = min(one[0][-1], other[0][-1] + shift_s, begin_s + _LONGEST_S)
    if end_s - begin_s < _FEWEST_S:
        return float("nan")
    # Means beside an end would fall there in both.
    at_s = np.arange(begin_s + _HALF_S, end_s - _HALF_S, _PERIOD_S)
    # While a receiver is jammed its speeds are not those of the ends of its gap.
    at_s = at_s[measured(one, at_s) & measured(other, at_s - shift_s)]
    if _PERIOD_S * at_s.size < _FEWEST_S - 2 * _HALF_S:
        return float("nan")
    first, second = _smoothed(one, at_s), _smoothed(other, at_s - shift_s)
    spread = float(first.std() * second.std())
    if spread <= _STEADY**2 * float(first.mean() * second.mean()):
        return float("nan")
    return float(np.mean((first - first.mean()) * (second - second.mean()))) / spread


def measured(speeds: Speeds, at_s: Floats) -> Bools:
    """Return at which moments, with half the time of a mean about them, speeds have no long gap."""
    time_s = speeds[0]
    gap_s = np.diff(time_s)
    long_s = max(_GAP_S, _GAPS * float(np.median(gap_s)))
    ends = np.flatnonzero(gap_s > long_s)
    begin_s, end_s = time_s[ends] - _HALF_S, time_s[ends + 1] + _HALF_S
    # Gaps are in order, and do not overlap.
    before = np.searchsorted(begin_s, at_s, side="right") - 1
    within = (before >= 0) & (at_s < np.append(end_s, -np.inf)[before])
    return np.asarray(~within, dtype=np.bool_)


def _smoothed(speeds: Speeds, at_s: Floats) -> Floats:
    """Return means over five seconds, in which the noise of positions is small."""
    time_s, speed = speeds
    way_m = np.concatenate([[0.0], np.cumsum(np.diff(time_s) * (speed[1:] + speed[:-1]) / 2)])
    after, before = (np.interp(at_s + half, time_s, way_m) for half in (_HALF_S, -_HALF_S))
    return np.asarray(after - before)
