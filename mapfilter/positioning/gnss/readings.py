"""Pseudoranges of an epoch, made ready: which count, where satellites stand, how sure they are."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import Reason
from mapfilter.gnss.sky import GridFrame, directions
from mapfilter.models.street_motion import EAST, NORTH
from mapfilter.positioning.epochs import Epoch, GnssFix, Pseudorange
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import Sky

Told = tuple[str, str, Reason]
"""Kind and name of what was left alone, and why."""

LEAST_MOVED_M = 0.1


def sky_over(
    options: GnssOptions,
    crs: str,
    origin_m: tuple[float, float],
    epoch: Epoch,
    middle_m: tuple[float, float],
) -> tuple[Sky | None, tuple[Told, ...]]:
    """Return the satellites of an epoch over a place, and those that are left alone.

    Parameters
    ----------
    options : GnssOptions
    crs : str
        Of the map.
    origin_m : (float, float)
        Of the frame of the hypotheses.
    epoch : Epoch
    middle_m : (float, float)
        The place in that frame, in the middle of the hypotheses.
    """
    told = list[Told]()
    chosen: dict[str, Pseudorange] = {}
    for row in epoch.ranges:
        if not isfinite(row.range_m):
            continue
        if row.satellite in chosen:
            told.append(("pseudorange", row.satellite, Reason.SECOND_READING))
        elif not all(isfinite(value) for value in row.place_m):
            told.append(("pseudorange", row.satellite, Reason.UNKNOWN_SATELLITE))
        else:
            chosen[row.satellite] = row
    if not chosen:
        return None, tuple(told)
    east, north = middle_m[0] + origin_m[0], middle_m[1] + origin_m[1]
    frame = GridFrame(crs, east, north, options.height_m)
    local = frame.local.to_local(np.array([row.place_m for row in chosen.values()]))
    seen = directions(local)
    sky = Sky(
        tuple(chosen),
        local,
        seen.elevation_rad,
        np.array([row.range_m for row in chosen.values()]),
        np.array([row.sigma_m for row in chosen.values()]),
        middle_m,
        frame.true_from_grid,
    )
    up = seen.above(options.mask_deg)
    for name in np.array(sky.names)[~up].tolist():
        told.append(("pseudorange", name, Reason.BELOW_HORIZON))
    return (sky.only(up) if up.any() else None), tuple(told)


def range_sigma_m(
    options: GnssOptions, sky: Sky, gone_m: float, particle_spacing_m: float
) -> Floats:
    """Return deviations of pseudoranges that follow others after some metres.

    White noise is new each time. Echoes last for metres: readings in a row count as one in so
    many.

    Parameters
    ----------
    options : GnssOptions
    sky : Sky
    gone_m : float
        Since the last ones that were used.
    particle_spacing_m : float
        How far the hypotheses nearest to the truth may lie beside it.
    """
    by_elevation = options.zenith_m / np.sin(sky.elevation_rad)
    white = np.where(np.isfinite(sky.sigma_m), sky.sigma_m, by_elevation)
    lasts = max(options.echo_memory_m / max(gone_m, LEAST_MOVED_M), 1.0)
    beside = particle_spacing_m * np.cos(sky.elevation_rad)
    return np.asarray(np.sqrt(white**2 + options.echo_m**2 * lasts + beside**2))


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
