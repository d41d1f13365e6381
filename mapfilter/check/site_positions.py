"""Where a raster's antenna stands: how well each place explains its levels.

A level is explained by a constant, the logarithm of the distance from the place, and two harmonics
of the direction, which draw any lobe: no azimuth has to be right. The share of the levels' variance
that is explained so tells one place from another, as long as both see the same pixels.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.check.lobes import peak_m
from mapfilter.check.plausibility import RasterSample

_SIDE = 40
_LEAST_SQUARES = 60
_HARMONICS = 2
_PLACES = 10


@dataclass(frozen=True, slots=True, eq=False)
class MeanLevels:
    """Mean levels of a raster in coarse squares.

    Parameters
    ----------
    east_m, north_m, level_db : ndarray, shape (n,)
        Middles of the squares that have data, and their means.
    side_m : float
    """

    east_m: Floats
    north_m: Floats
    level_db: Floats
    side_m: float


def in_squares(sample: RasterSample) -> MeanLevels | None:
    """Average a raster in at most 40 x 40 squares; None where there is too little to judge by."""
    values = sample.values.astype(np.float64)
    step = max(1, -(-max(values.shape) // _SIDE))
    rows, cols = values.shape[0] // step, values.shape[1] // step
    whole = values[: rows * step, : cols * step].reshape(rows, step, cols, step)
    count = (~np.isnan(whole)).sum(axis=(1, 3))
    known = count > 0
    if known.sum() < _LEAST_SQUARES:
        return None
    level_db = np.nansum(whole, axis=(1, 3))[known] / count[known]
    if np.ptp(level_db) == 0:
        return None
    middle = np.arange(max(rows, cols)) * step + (step - 1) / 2
    row, col = np.nonzero(known)
    east_m, north_m = sample.lattice.east_north(middle[row], middle[col])
    return MeanLevels(east_m, north_m, level_db, step * sample.lattice.resolution_m)


def place_fit(squares: MeanLevels, east_m: float, north_m: float) -> float:
    """Return how well a place explains levels: the multiple correlation, 0..1.

    Levels that become stronger with the distance count as not depending on it.
    """
    east, north = squares.east_m - east_m, squares.north_m - north_m
    distance_m = np.hypot(east, north)
    direction_rad = np.arctan2(north, east)
    # What lies in the place's own square has no direction.
    near = np.minimum(distance_m / squares.side_m, 1.0)
    columns = [np.log10(np.maximum(distance_m, squares.side_m / 2))]
    for order in range(1, _HARMONICS + 1):
        columns += [near * np.cos(order * direction_rad), near * np.sin(order * direction_rad)]
    causes = np.column_stack(columns)
    causes -= causes.mean(axis=0)
    level_db = squares.level_db - squares.level_db.mean()
    factors = np.linalg.lstsq(causes, level_db, rcond=None)[0]
    if factors[0] > 0:
        causes = causes[:, 1:]
        factors = np.linalg.lstsq(causes, level_db, rcond=None)[0]
    explained = causes @ factors
    return float(np.sqrt((explained @ explained) / (level_db @ level_db)))


def best_place(
    squares: MeanLevels, sample: RasterSample, others: Iterable[tuple[float, float]] = ()
) -> tuple[float, tuple[float, float]]:
    """Return the best fit and its place, among a grid over the raster, its peak, and others."""
    west, south, east, north = sample.lattice.bounds_m
    along = (np.arange(_PLACES) + 0.5) / _PLACES
    places = [
        (float(x), float(y))
        for x in west + along * (east - west)
        for y in south + along * (north - south)
    ]
    places += [peak_m(sample), *others]
    fits = [place_fit(squares, *place) for place in places]
    best = int(np.argmax(fits))
    return fits[best], places[best]
