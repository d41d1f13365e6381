"""What the numbers of rasters most likely are: levels, losses, or something else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from mapfilter._types import Floats32
from mapfilter.check.plan_gain import PHONE_M
from mapfilter.check.samples import RasterSample
from mapfilter.radio.cells import Cell, CellPlan

Kind = Literal["level", "loss", "rxlev", "empty", "unclear"]

_HIGHEST_RXLEV = 63
_LEAST_LOSS_DB = 20.0
_NO_LEVEL_BELOW = -300.0
_MOST_SHARE = 0.5
_NEAREST_RING_M = 64.0
_LEAST_IN_RING = 50
_FALLS = 0.3


def kind_of(values: Floats32) -> Kind:
    """Return what numbers most likely are; NaN is ignored.

    Levels (dBm) are mostly below 0, path losses (dB) mostly above 20, and raw RXLEV are whole
    numbers in 0..63 (3GPP TS 45.008, 8.1.4).

    Examples
    --------
    >>> kind_of(np.float32([-60.5, -101.2])), kind_of(np.float32([88.1, 120.4]))
    ('level', 'loss')
    >>> kind_of(np.float32([0, 17, 63])), kind_of(np.float32([np.nan]))
    ('rxlev', 'empty')
    """
    known = values[np.isfinite(values)]
    known = known[(known >= _NO_LEVEL_BELOW) & (known <= -_NO_LEVEL_BELOW)]
    if not known.size:
        return "empty"
    if (known < 0).mean() > _MOST_SHARE:
        return "level"
    whole = bool((known == np.round(known)).all())
    if whole and known.min() >= 0 and known.max() <= _HIGHEST_RXLEV:
        return "rxlev"
    return "loss" if np.median(known) > _LEAST_LOSS_DB else "unclear"


def falls_with_distance(sample: RasterSample, east_m: float, north_m: float) -> float:
    """Return the correlation of levels with minus the logarithm of the distance from a place.

    1 is a raster that falls off evenly around it; 0 where nothing is known.
    """
    rows, cols = np.ogrid[: sample.lattice.rows, : sample.lattice.cols]
    east, north = sample.lattice.east_north(rows, cols)
    known = ~np.isnan(sample.values)
    value = sample.values[known].astype(np.float64)
    squared_m2 = ((east - east_m) ** 2 + (north - north_m) ** 2)[known]
    # Twice the logarithm, which correlates alike.
    near = -np.log10(np.maximum(squared_m2, sample.lattice.resolution_m**2))
    if value.size < 2 or np.ptp(value) == 0 or np.ptp(near) == 0:
        return 0.0
    value -= value.mean()
    near -= near.mean()
    return float((value @ near) / np.sqrt((value @ value) * (near @ near)))


def above_free_space_db(sample: RasterSample, cell: Cell) -> float:
    """Return by how much levels in the main lobe exceed those of free space.

    Levels of ``EIRP - 32.44 - 20 log10(d / km) - 20 log10(f / MHz)`` (Friis 1946; ITU-R P.525) are
    exceeded here and there by reflections and shadowing, but by the median of a whole ring about
    the site only where the EIRP is another. Rings are octaves of the distance from 64 m on, as
    obstacles cost the less the nearer they are; the one that exceeds most counts. Minus infinity
    where too few pixels are to be seen.
    """
    ground_m, azimuth_deg = sample.seen_from(cell.east_m, cell.north_m)
    used = ~np.isnan(sample.values) & (ground_m >= _NEAREST_RING_M)
    if cell.azimuth_deg is not None:
        off_deg = (azimuth_deg - cell.azimuth_deg + 180.0) % 360.0 - 180.0
        used &= np.abs(off_deg) <= cell.beamwidth_deg / 2
    ground_m = ground_m[used]
    distance_km = np.hypot(ground_m, cell.height_m - PHONE_M) / 1000
    loss_db = 32.44 + 20 * np.log10(distance_km) + 20 * np.log10(cell.frequency_mhz)
    above_db = sample.values[used] - cell.eirp_dbm + loss_db
    ring = np.log2(ground_m).astype(np.int64)
    rings = (above_db[ring == number] for number in np.unique(ring))
    medians_db = [float(np.median(some)) for some in rings if some.size >= _LEAST_IN_RING]
    return max(medians_db, default=-np.inf)


def below_free_space_db(samples: Sequence[RasterSample], plan: CellPlan | None) -> float:
    """Return by how much numbers, if they are losses, are less than those of free space.

    That of the middle one of the cells; no obstacle makes a loss less. Minus infinity where it is
    not known.
    """
    known = [(s, plan[s.cell_id]) for s in samples if plan is not None and s.cell_id in plan]
    below_db = [
        above_free_space_db(replace(s, values=-s.values), replace(cell, eirp_dbm=0.0))
        for s, cell in known
        if not cell.indoor
    ]
    return float(np.median(below_db)) if below_db else -np.inf


def falls_away(samples: Sequence[RasterSample], plan: CellPlan | None) -> bool:
    """Return whether numbers above 0 fall with the distance, as no path loss does."""
    if plan is None:
        return False
    known = [(s, plan[s.cell_id]) for s in samples if s.cell_id in plan]
    falls = [falls_with_distance(s, cell.east_m, cell.north_m) for s, cell in known]
    return bool(falls) and float(np.median(falls)) > _FALLS
