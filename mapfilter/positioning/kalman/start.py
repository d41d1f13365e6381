"""The first belief of a Kalman-type filter over sites."""

from __future__ import annotations

from math import ceil, pi, sqrt

import numpy as np

from mapfilter._types import Floats
from mapfilter.models.state import StateLayout
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.readings import SiteReadings, fix_covariance_m2
from mapfilter.positioning.kalman.reckoning import ERRORS, RECKONED, first_deviations

_MOST_PARTS = 64
_WIDER = 10.0
"""Deviation of a belief that the first fix is yet to decide, in deviations of that fix."""
_REACH = 3.0
"""Deviations of a vague fix over which the parts of such a belief lie."""
_APART = 1.6
"""Their distance in deviations of a part: a flat sum, of parts that are not yet merged."""


def first_belief(
    sites: SiteModels, layout: StateLayout, fix: GnssFix | None, given: SiteReadings
) -> SumBelief:
    """Return the first belief: at a fix, on a timing advance's circle, or about a site.

    It is that before its readings, which then decide. About a fix it is wide, and where ranges to
    sites are bent within a deviation of the fix, as within a network's circle of kilometres, it has
    parts that are narrow beside them.

    Parameters
    ----------
    layout : StateLayout
        Without errors of fixes and of levels.
    fix : GnssFix or None
    given : SiteReadings
        Of the first epoch; of a cell at least where there is no fix.
    """
    options, east, north = sites.options, layout.east, layout.north
    where = [east, north]
    mean, deviation = np.zeros(layout.size), np.full(layout.size, options.speed_sd_mps)
    if layout is RECKONED:
        deviation[ERRORS] = first_deviations(options)
    if fix is not None:
        mean[where] = fix.east_m, fix.north_m
        fix_sd_m = sqrt(float(np.trace(fix_covariance_m2(fix, options.fix_sd_m))) / 2)
        across = _parts(fix_sd_m, options) if sites.cells else 1
        if across > 1:
            off_m = np.linspace(-_REACH * fix_sd_m, _REACH * fix_sd_m, across)
            deviation[where] = (off_m[1] - off_m[0]) / _APART
            return SumBelief.around(mean, np.diag(deviation**2), _squared(where, mean, off_m))
        deviation[where] = max(options.start_sd_m, _WIDER * fix_sd_m)
        return SumBelief.start(mean, np.diag(deviation**2))
    cell = sites.cells[(given.timed or given.cells)[0]]
    mean[where] = cell.east_m, cell.north_m
    if not given.timed:
        deviation[where] = options.start_sd_m
        parts = {east: options.start_parts, north: options.start_parts}
        return SumBelief.start(mean, np.diag(deviation**2), parts)
    radius_m = (given.steps[0] + 0.5) * options.timing_step_m
    count = min(max(round(2 * pi * radius_m / options.start_spacing_m), 8), _MOST_PARTS)
    deviation[where] = max(options.start_spacing_m, 0.7 * 2 * pi * radius_m / count)
    angle = 2 * pi * np.arange(count) / count
    places = {
        east: cell.east_m + radius_m * np.cos(angle),
        north: cell.north_m + radius_m * np.sin(angle),
    }
    return SumBelief.around(mean, np.diag(deviation**2), places)


def _parts(fix_sd_m: float, options: KalmanOptions) -> int:
    """Return the parts along each axis of a start at a fix: one where no range is bent over it."""
    if fix_sd_m <= options.start_spacing_m:
        return 1
    return min(options.start_parts, 1 + ceil(2 * _REACH * fix_sd_m / options.start_spacing_m))


def _squared(where: list[int], mean: Floats, off_m: Floats) -> dict[int, Floats]:
    """Return components of equal parts in a square about a mean."""
    grid_m = np.meshgrid(off_m, off_m)
    return {
        index: mean[index] + axis_m.ravel() for index, axis_m in zip(where, grid_m, strict=True)
    }
