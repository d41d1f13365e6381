"""The first belief of a Kalman-type filter over sites."""

from __future__ import annotations

from math import pi

import numpy as np

from mapfilter.models.state import StateLayout
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.models import SiteModels
from mapfilter.positioning.kalman.readings import SiteReadings
from mapfilter.positioning.kalman.reckoning import ERRORS, RECKONED, first_deviations

_MOST_PARTS = 64


def first_belief(
    sites: SiteModels, layout: StateLayout, fix: GnssFix | None, given: SiteReadings
) -> SumBelief:
    """Return the first belief: at a fix, on a timing advance's circle, or about a site.

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
        deviation[where] = options.start_sd_m
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
