"""How well the levels of a raster fit an antenna at a place."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.check.plan_gain import gain_by_plan_db
from mapfilter.check.samples import RasterSample
from mapfilter.radio.cells import Cell

_SIDE = 40
_LEAST_SQUARES = 60
_PLACES = 10
_AT_ONCE = 1 << 18


class MeanLevels(NamedTuple):
    """Mean levels of a raster in coarse squares with data, and the squares' middles, (n,) each."""

    east_m: Floats
    north_m: Floats
    level_db: Floats
    side_m: float


def in_squares(sample: RasterSample) -> MeanLevels | None:
    """Average a raster in at most 40 x 40 squares; None where there is too little data."""
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


def place_fits(squares: MeanLevels, places_m: Floats) -> Floats:
    """Return how well places explain levels: the multiple correlations, 0..1, shape (P,).

    Levels that become stronger with the distance count as not depending on it.

    Parameters
    ----------
    places_m : ndarray, shape (P, 2)
        East and north of each place.
    """
    level_db = squares.level_db - squares.level_db.mean()
    parts = np.array_split(places_m, max(1, -(-len(places_m) * len(level_db) // _AT_ONCE)))
    return np.concatenate([_fits_of(squares, level_db, part) for part in parts])


def _fits_of(squares: MeanLevels, level_db: Floats, places_m: Floats) -> Floats:
    east = squares.east_m - places_m[:, :1]
    north = squares.north_m - places_m[:, 1:]
    distance_m = np.hypot(east, north)
    # What lies in the place's own square has no direction.
    reach_m = np.maximum(distance_m, squares.side_m)
    cos, sin = east / reach_m, north / reach_m
    beside = np.minimum(distance_m / squares.side_m, 1.0)
    beside[beside == 0] = 1.0
    causes = np.stack(
        [
            np.log10(np.maximum(distance_m, squares.side_m / 2)),
            cos,
            sin,
            # Of the doubled direction, as long as those.
            (cos**2 - sin**2) / beside,
            2 * cos * sin / beside,
        ],
        axis=1,
    )
    causes -= causes.mean(axis=2, keepdims=True)
    products, with_levels = causes @ causes.transpose(0, 2, 1), causes @ level_db
    factors, explained = _solved(products, with_levels)
    grows = factors[:, 0] > 0
    if grows.any():
        rest = products[grows, 1:, 1:], with_levels[grows, 1:]
        explained[grows] = _solved(*rest)[1]
    return np.sqrt(np.maximum(explained, 0.0) / (level_db @ level_db))


def _solved(products: Floats, with_levels: Floats) -> tuple[Floats, Floats]:
    """Return the factors of causes by least squares, and the sum of squares that they explain."""
    inverse = np.linalg.pinv(products, hermitian=True)
    factors = np.einsum("pij,pj->pi", inverse, with_levels)
    return factors, np.einsum("pi,pi->p", factors, with_levels)


def fits_with_antenna(
    squares: MeanLevels, crs: str, cell: Cell, places_m: Floats
) -> tuple[float, ...]:
    """Return how well a cell explains levels at its own place and at others, 0..1 each.

    Two harmonics of the direction do not draw a narrow beam below the horizon, whose levels grow
    with the distance up to hundreds of metres; so the gain of the plan's antenna is taken off
    before. 0 where that is a pattern file.
    """
    fits = []
    for east_m, north_m in ((cell.east_m, cell.north_m), *places_m.tolist()):
        there = replace(cell, east_m=east_m, north_m=north_m)
        gain_db = gain_by_plan_db(there, crs, squares.east_m, squares.north_m)
        if gain_db is None:
            return (0.0,) * (1 + len(places_m))
        rest = squares._replace(level_db=squares.level_db - gain_db)
        explained = place_fits(rest, np.array([(east_m, north_m)]))[0] ** 2
        unexplained = (1.0 - explained) * rest.level_db.var() / squares.level_db.var()
        fits.append(float(np.sqrt(max(1.0 - unexplained, 0.0))))
    return tuple(fits)


def peak_m(sample: RasterSample) -> tuple[float, float]:
    """Return east and north of the strongest pixels' middle (the strongest 0.2 %, at least 9)."""
    value = np.where(np.isnan(sample.values), -np.inf, sample.values).ravel()
    count = min(max(9, value.size // 500), int(np.isfinite(value).sum()))
    strongest = np.argpartition(value, -count)[-count:]
    east, north = sample.positions_m()
    return float(np.median(east.ravel()[strongest])), float(np.median(north.ravel()[strongest]))


def places_to_try(sample: RasterSample) -> Floats:
    """Return a grid of places over a raster, and its peak, shape (101, 2)."""
    west, south, east, north = sample.lattice.bounds_m
    along = (np.arange(_PLACES) + 0.5) / _PLACES
    places = [
        (float(x), float(y))
        for x in west + along * (east - west)
        for y in south + along * (north - south)
    ]
    places.append(peak_m(sample))
    return np.array(places)
