"""Ways whose direction, or length, too, was not measured: steps to all sides.

One goes on, and forgets the direction by and by: the mean cosine of the angle to the first
direction is 1/e after a minute, or after the way of a minute's walk.
"""

from __future__ import annotations

from math import exp, nan, sqrt

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.sensors.rest import Rest

_STRAIGHT_S, _STRAIGHT_M = 60.0, 84.0
"""Time, and way, after which the direction is forgotten by 1/e."""


def spread_m2(speed_mps: float, time_s: float) -> float:
    """Return the mean square of the distance of such a way, by its time."""
    return _mean_square(speed_mps, time_s, _STRAIGHT_S)


def way_spread_m2(way_m: float) -> float:
    """Return the mean square of the distance of such a way, by its length."""
    return _mean_square(1.0, way_m, _STRAIGHT_M)


def unmeasured_step(speed_mps: float, from_s: float, to_s: float) -> MotionStep:
    """Return the step between two times since the last measured one."""
    more_m2 = spread_m2(speed_mps, to_s) - spread_m2(speed_mps, from_s)
    # That cosine is of a direction that changes by a random walk.
    turned_sd_rad = sqrt(2 * max(to_s - from_s, 0.0) / _STRAIGHT_S)
    return MotionStep(
        speed_mps * (to_s - from_s), nan, nan, sqrt(max(more_m2, 0.0)), turned_sd_rad=turned_sd_rad
    )


def headless_step(step_m: float, from_m: float) -> MotionStep:
    """Return a step of a known length after a way without headings."""
    more_m2 = way_spread_m2(from_m + abs(step_m)) - way_spread_m2(from_m)
    return MotionStep(step_m, nan, nan, sqrt(max(more_m2, 0.0)))


def common_way_m2(since_m: float, before_m: float) -> float:
    """Return the variance along one axis that ways before and after a fix have in common.

    Both go much the same way, whichever that is: so much is missing where the spreads of both are
    added up as if one did not depend on the other.

    Examples
    --------
    >>> common_way_m2(10.0, 0.0), round(common_way_m2(10.0, 1000.0))
    (0.0, 792)
    """
    apart_m2 = way_spread_m2(since_m) + way_spread_m2(before_m)
    return max(way_spread_m2(since_m + before_m) - apart_m2, 0.0) / 2


def missed_step(rest: Rest, time_s: float) -> MotionStep:
    """Return the step of a rest that levels left in doubt, once steps are counted again.

    It is that of a way at the pace before, less what was measured, by its probability.
    """
    gone_s = time_s - rest.since_s
    missed_mps, share = rest.missed_mps(gone_s), rest.left_probability
    spread_m = sqrt(share * spread_m2(missed_mps, gone_s))
    return MotionStep(share * missed_mps * gone_s, nan, nan, spread_m)


def _mean_square(speed: float, gone: float, lasts: float) -> float:
    return 2 * speed**2 * lasts * (gone - lasts * (1 - exp(-gone / lasts)))
