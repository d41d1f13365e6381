"""Whether fixes and steps agree on the way again, after they had contradicted each other.

Where fixes go on beside the steps a belief begins anew with them, as steps may have been wrong for
a while. Positions that a spoofer leads away slowly do the same. What follows distinguishes
them: from then on fixes lie where steps lead, turned by some angle, but not drawn out, or fixes
are led on. Until that is known a position is not claimed.
"""

from __future__ import annotations

from enum import IntEnum
from itertools import pairwise
from math import hypot, sqrt

import numpy as np

from mapfilter.positioning.gnss.wander import WanderFix
from mapfilter.positioning.kalman.lasting import LEAST_WHITE
from mapfilter.positioning.kalman.stretches import LEAST_FIX_SD_M, LEAST_ROWS, Stretches, WayFix
from mapfilter.positioning.sensors.pace import WALKERS_MPS

_WALKED, _DRIVEN, _DEVIATIONS = (0.15, 0.1), (0.04, 0.03), 1.5
"""Deviation of the length of the way by fixes, in lengths of that by steps, at which it is known,
and what steps or wheels may be too short or long by; times of that deviation beyond it."""


class Doubt(IntEnum):
    """Whether a position is claimed before fixes and steps have agreed on the way.

    ``IF_CONTRADICTED``: headings have jumped, and it is claimed until they disagree.
    ``UNTIL_PROVEN``: the belief has begun anew, and it is not claimed until they agree.
    """

    NONE = 0
    IF_CONTRADICTED = 1
    UNTIL_PROVEN = 2

    def after(self, agrees: bool | None) -> Doubt:
        """Return it once it is known whether they do; None where it is not."""
        if self is Doubt.NONE or agrees is None:
            return self
        return Doubt.NONE if agrees else Doubt.UNTIL_PROVEN


def way_agrees(rows: tuple[WanderFix, ...], understated: float, lasting_s: float) -> bool | None:
    """Return whether fixes lie where steps have led; None where that cannot be told.

    Parameters
    ----------
    rows : tuple of WanderFix
        Fixes, and where steps had led.
    understated : float
        Times that variances of fixes are taken for larger than stated.
    lasting_s : float
        Time after which the correlation of what lasts of their errors is 1/e.
    """
    if len(rows) < LEAST_ROWS:
        return None
    given = []
    for one in rows:
        variance_m2 = max(understated * one.sd_m**2, LEAST_FIX_SD_M**2)
        lasting_m = sqrt((1 - LEAST_WHITE) * variance_m2)
        place = one.way_east_m, one.way_north_m, one.east_m, one.north_m
        noise = LEAST_WHITE * variance_m2, 0.0, lasting_m
        given.append(WayFix(one.time_s, *place, *noise, 0.0, 0.0, one.sd_m))
    found = Stretches.of(np.array(given), lasting_s)
    sd = float(found.sd_rad[0])
    known, usual = _DRIVEN if usual_mps(rows) > WALKERS_MPS else _WALKED
    if sd > known:
        return None
    drawn_out = abs(float(np.abs(found.factor[0])) - 1)
    return bool(found.fits[0]) and drawn_out <= usual + _DEVIATIONS * sd


def usual_mps(rows: tuple[WanderFix, ...]) -> float:
    """Return the mean speed by steps over some fixes."""
    gone_m = sum(
        hypot(after.way_east_m - one.way_east_m, after.way_north_m - one.way_north_m)
        for one, after in pairwise(rows)
    )
    return gone_m / max(rows[-1].time_s - rows[0].time_s, 1.0)
