"""Speeds of a vehicle by a counter of the way: one that wraps, begins anew, or counts coarsely."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mapfilter._types import Bools, Floats, Ints

_FASTEST_MPS, _BACK_MPS = 120.0, 10.0
"""Faster counts are no way ahead, or back."""
_WRAPPED_COUNTS = 3.0
"""Usual counts that a wrap goes on by at most, so that a counter that begins anew is none."""
_BITS, _DECIMALS = (8, 12, 15, 16, 20, 24, 31, 32), range(2, 10)
_UNITS = (1.0, 0.1, 0.01, 0.001)
"""Ends of counters: powers of two times the least count or a unit, and of ten."""
_STANDING_S, _STANDING_GAPS = 3.0, 4.0
"""Least time, and usual times from count to count, without one that are a rest."""
_COARSE_M = 2.0
"""Least count between two of which a vehicle may stand or creep: no rest is known."""
_LEAST_SD_MPS, _SPREAD_S = 0.05, 10.0
_LEAST_TURNS, _JITTER = 10.0, 1e-6


class CountedWay(NamedTuple):
    """What a counter of the way shows.

    Parameters
    ----------
    speed_mps : (N,) array
        Speeds whose integral is the way; NaN where unknown.
    speed_sd_mps : float
        Standard deviation of one by the least count; NaN where that is small.
    least_m : float
        Least count, in metres.
    wraps, resets : int
        How often the counter passed its end, and began anew or jumped.
    """

    speed_mps: Floats
    speed_sd_mps: float
    least_m: float
    wraps: int = 0
    resets: int = 0


def counted_way(time_s: Floats, count: Floats, unit_m: float = 1.0) -> CountedWay:
    """Return the speeds by which a counter grows.

    What is counted coarsely is spread over the time from one count to the next, but for rests. A
    counter that falls from its end goes on; one that begins anew, or jumps, is unknown there.

    Parameters
    ----------
    time_s, count : (N,) arrays
        In any order; NaN where missing.
    unit_m : float
        Length of one unit of the counter.

    Examples
    --------
    >>> time_s = np.arange(6.0)
    >>> counted_way(time_s, np.array([65516.0, 65526.0, 0.0, 10.0, 20.0, 30.0])).speed_mps.tolist()
    [10.0, 10.0, 10.0, 10.0, 10.0, 10.0]
    """
    speed = np.full(len(count), np.nan)
    known = np.flatnonzero(np.isfinite(time_s) & np.isfinite(count))
    known = known[np.argsort(time_s[known], kind="stable")]
    known = known[np.diff(time_s[known], prepend=-np.inf) > 0]
    at_s, counted = time_s[known], count[known]
    change = np.diff(counted)
    grown = change[change > _JITTER]
    if not grown.size:
        speed[known] = 0.0 if known.size > 1 else np.nan
        return CountedWay(speed, float("nan"), 0.0)
    least, usual = float(grown.min()), float(np.median(grown))
    lasted_s = np.diff(at_s)
    fallen = np.flatnonzero(_is_fall(counted, change, lasted_s, usual, unit_m))
    ends = np.array([_end_of(counted[k], counted[k + 1], least, usual) for k in fallen])
    wraps = fallen[np.isfinite(ends)] if fallen.size else fallen
    total = counted.copy()
    for k, end in zip(fallen, ends, strict=True):
        total[k + 1 :] += end if np.isfinite(end) else 0.0
    change = np.diff(total)
    broken = change * unit_m > np.maximum(_FASTEST_MPS * lasted_s, 1.5 * least * unit_m)
    broken[np.setdiff1d(fallen, wraps)] = True
    gap_s = _usual_gap(at_s, change)
    for part in np.split(np.arange(known.size), np.flatnonzero(broken) + 1):
        coarse = unit_m * least > _COARSE_M
        speed[known[part]] = _speeds(at_s[part], unit_m * total[part], gap_s, coarse=coarse)
    # Errors of a count do not add up: those of its time are as if drawn anew in each 10 s.
    period_s = float(np.median(lasted_s))
    sd = unit_m * least / 6**0.5 / (max(gap_s, _SPREAD_S) * period_s) ** 0.5
    sd = sd if sd > _LEAST_SD_MPS else float("nan")
    return CountedWay(speed, sd, unit_m * least, wraps.size, int(broken.sum()))


def _is_fall(
    counted: Floats, change: Floats, lasted_s: Floats, usual: float, unit_m: float
) -> Bools:
    """Return after which rows a counter falls, and its vehicle does not just back up."""
    fast = -change * unit_m > _BACK_MPS * lasted_s
    return np.asarray((change < -_JITTER) & (fast | (np.abs(counted[1:]) <= usual)))


def _end_of(before: float, after: float, least: float, usual: float) -> float:
    """Return the end of a counter that goes on from one value to a smaller one; NaN for none."""
    ends = [10.0**k for k in _DECIMALS]
    ends += [2.0**bits * unit for bits in _BITS for unit in (least, *_UNITS)]
    most = _WRAPPED_COUNTS * usual + least
    found = [end for end in ends if before <= end + _JITTER and 0 <= after - before + end <= most]
    # A small counter that is set to zero seems to wrap, too.
    found = [end for end in found if end > _LEAST_TURNS * most]
    return min(found, default=float("nan"))


def _usual_gap(time_s: Floats, change: Floats) -> float:
    """Return the usual time from one count to the next."""
    counts_s = time_s[1:][np.abs(change) > _JITTER]
    return float(np.median(np.diff(counts_s))) if counts_s.size > 1 else 0.0


def _speeds(time_s: Floats, way_m: Floats, gap_s: float, *, coarse: bool) -> Floats:
    """Return the speed at each row by the way between its neighbours; NaN for a single row.

    Before the first and after the last coarse count nothing is known.
    """
    if time_s.size < 2:
        return np.full(time_s.size, np.nan)
    smooth = _spread(time_s, way_m, gap_s, coarse=coarse)
    first = np.maximum(np.arange(time_s.size) - 1, 0)
    last: Ints = np.minimum(np.arange(time_s.size) + 1, time_s.size - 1)
    return np.asarray((smooth[last] - smooth[first]) / (time_s[last] - time_s[first]))


def _spread(time_s: Floats, way_m: Floats, gap_s: float, *, coarse: bool) -> Floats:
    """Return a way that grows evenly from one count to the next, and rests over long pauses."""
    counts = np.flatnonzero(np.diff(way_m, prepend=np.nan) != 0)
    at_s, counted = time_s[counts], way_m[counts]
    if coarse:
        if counts.size < 3:
            return np.full(time_s.size, np.nan)
        # A first row that is counted on at once is as good as others.
        first = 0 if counts[1] == 1 else 1
        return np.interp(time_s, at_s[first:], counted[first:], np.nan, np.nan)
    rest_s = max(_STANDING_S, _STANDING_GAPS * gap_s)
    rests = np.flatnonzero(np.diff(at_s) > rest_s)
    ends_s = at_s[rests + 1] - max(gap_s, time_s[1] - time_s[0])
    at_s = np.insert(at_s, rests + 1, np.maximum(ends_s, at_s[rests]))
    counted = np.insert(counted, rests + 1, counted[rests])
    return np.interp(time_s, at_s, counted)
