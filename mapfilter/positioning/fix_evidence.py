"""Fixes of GNSS as evidence of places."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.models.street_motion import EAST, NORTH
from mapfilter.positioning.epochs import GnssFix

_F = np.float32
_FIX_SD_M = 10.0
_FIX_CLIP = 5.0


@dataclass(frozen=True)
class FixEvidence:
    """What a fix says of places.

    Parameters
    ----------
    fix : GnssFix
    origin_m : (float, float)
        Of the frame of the hypotheses.
    """

    fix: GnssFix
    origin_m: tuple[float, float]

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return it for each hypothesis; an outlier counts no more than one at five deviations."""
        fix, (west, south) = self.fix, self.origin_m
        dx = state[EAST] - _F(fix.east_m - west)
        dy = state[NORTH] - _F(fix.north_m - south)
        known = isfinite(fix.var_east_m2) and isfinite(fix.var_north_m2)
        var_x = max(fix.var_east_m2, 1.0) if known else _FIX_SD_M**2
        var_y = max(fix.var_north_m2, 1.0) if known else _FIX_SD_M**2
        cross = fix.cov_east_north_m2 if known and isfinite(fix.cov_east_north_m2) else 0.0
        cross = float(np.clip(cross, -0.99 * sqrt(var_x * var_y), 0.99 * sqrt(var_x * var_y)))
        det = var_x * var_y - cross**2
        square = (var_y * dx**2 - 2 * cross * dx * dy + var_x * dy**2) / det
        return np.asarray(-0.5 * np.minimum(square, _FIX_CLIP**2), dtype=np.float64)


def widened(fix: GnssFix, times: float) -> GnssFix:
    """Return a fix with so many times its variance; a usual one where it tells none."""
    known = isfinite(fix.var_east_m2) and isfinite(fix.var_north_m2)
    east_m2, north_m2 = (fix.var_east_m2, fix.var_north_m2) if known else (_FIX_SD_M**2,) * 2
    cross_m2 = fix.cov_east_north_m2 if known else 0.0
    return GnssFix(fix.east_m, fix.north_m, times * east_m2, times * north_m2, times * cross_m2)
