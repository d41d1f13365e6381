"""Where a raster is strong: how well a place and a boresight explain its levels.

A level is explained by ``a + b log10(distance) + c gain(direction - azimuth)``, fitted to the means
of rings and directions about a place; the correlation of fit and levels is the measure. Shadowing
and buildings are noise to it, so that it takes a raster's pixels together, and none alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from mapfilter._types import Floats, Floats32, Ints
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.plausibility import RasterSample

STEP_DEG = 5.0
_DIRECTIONS = round(360 / STEP_DEG)
_RINGS = 24
_LEAST_PER_BIN = 1
_LEAST_BINS = 60
_LEAST_DIRECTIONS = 0.6
_MOST_PER_BIN = 20
_FRONT_TO_BACK_DB = 20.0


@dataclass(frozen=True, slots=True, eq=False)
class Lobe:
    """How well each boresight explains a raster.

    Parameters
    ----------
    cell_id : str
    azimuth_deg : float
        The boresight that explains it best, in steps of 5°, clockwise from true north.
    contrast_db : float
        How much stronger the front is than the back, at that boresight.
    scores : ndarray, shape (72,)
        Partial correlation of levels and gain for boresights at 0°, 5°, …, distance left out.
    """

    cell_id: str
    azimuth_deg: float
    contrast_db: float
    scores: Floats

    def score(self, azimuth_deg: float) -> float:
        """Return the score of a boresight, interpolated between the steps."""
        place = (azimuth_deg % 360.0) / STEP_DEG
        low = int(place) % _DIRECTIONS
        share = place - int(place)
        high = (low + 1) % _DIRECTIONS
        return float((1 - share) * self.scores[low] + share * self.scores[high])

    def offset_deg(self, azimuth_deg: float) -> float:
        """Return how far the best boresight is from another, clockwise, in -180..180."""
        return (self.azimuth_deg - azimuth_deg + 180.0) % 360.0 - 180.0


def find_lobe(
    sample: RasterSample, east_m: float, north_m: float, beamwidth_deg: float
) -> Lobe | None:
    """Find into which direction a raster is strong about a place.

    Parameters
    ----------
    sample : RasterSample
        Of levels; for losses give their negatives.
    east_m, north_m : float
        Of the site.
    beamwidth_deg : float
        Full width at half power of the lobe looked for.

    Returns
    -------
    Lobe or None
        None where too few directions or pixels are to be seen, as for a site at the raster's edge.
    """
    value = sample.values
    distance_m, azimuth_deg = sample.seen_from(east_m, north_m)
    used = ~np.isnan(value) & (distance_m > 2 * sample.lattice.resolution_m)
    if not used.any():
        return None
    far = np.log10(distance_m[used])
    mean, log_m, direction, weight = _binned(far, azimuth_deg[used], value[used])
    if mean.size < _LEAST_BINS or np.unique(direction).size < _LEAST_DIRECTIONS * _DIRECTIONS:
        return None
    middle_deg = (direction + 0.5) * STEP_DEG
    boresights_deg = np.arange(_DIRECTIONS) * STEP_DEG
    offsets_rad = np.radians(middle_deg[:, None] - boresights_deg[None, :])
    gains = sector_gain_db(offsets_rad, np.radians(beamwidth_deg), _FRONT_TO_BACK_DB)
    scale = np.sqrt(weight)
    base, _ = np.linalg.qr(np.column_stack([scale, scale * log_m]))
    left = scale * mean
    left -= base @ (base.T @ left)
    right = scale[:, None] * gains
    right -= base @ (base.T @ right)
    along = right.T @ left
    sizes = np.linalg.norm(right, axis=0), np.linalg.norm(left)
    if not (sizes[0] > 0).all() or sizes[1] <= 1e-9 * np.linalg.norm(scale * mean):
        return None
    scores = along / (sizes[0] * sizes[1])
    best = int(np.argmax(scores))
    slope = float(along[best] / sizes[0][best] ** 2)
    return Lobe(sample.cell_id, best * STEP_DEG, slope * _FRONT_TO_BACK_DB, scores)


def falls_with_distance(sample: RasterSample, east_m: float, north_m: float) -> float:
    """Return the correlation of levels with minus the logarithm of the distance from a place.

    1 is a raster that falls off evenly around it; 0 where nothing is known.
    """
    east, north = sample.positions_m()
    known = ~np.isnan(sample.values)
    value = sample.values[known].astype(np.float64)
    least_m = sample.lattice.resolution_m
    far = -np.log10(np.maximum(np.hypot(east - east_m, north - north_m)[known], least_m))
    if value.size < 2 or np.ptp(value) == 0 or np.ptp(far) == 0:
        return 0.0
    return float(np.corrcoef(value, far)[0, 1])


def peak_m(sample: RasterSample) -> tuple[float, float]:
    """Return east and north of the strongest pixels' middle (the strongest 0.2 %, at least 9)."""
    value = np.where(np.isnan(sample.values), -np.inf, sample.values).ravel()
    count = min(max(9, value.size // 500), int(np.isfinite(value).sum()))
    strongest = np.argpartition(value, -count)[-count:]
    east, north = sample.positions_m()
    return float(np.median(east.ravel()[strongest])), float(np.median(north.ravel()[strongest]))


def best_labels(lobes: Mapping[str, Lobe], azimuths_deg: Mapping[str, float]) -> dict[str, str]:
    """Return which cell of a site each raster fits best, every cell taken once.

    Parameters
    ----------
    lobes : mapping of cell id to Lobe
        Of the cells of one site.
    azimuths_deg : mapping of cell id to float
        Of the same cells.

    Returns
    -------
    dict
        Id of a raster -> id of the cell whose azimuth it goes with.
    """
    ids = list(lobes)
    score = np.array([[lobes[a].score(azimuths_deg[b]) for b in ids] for a in ids])
    rows, cols = linear_sum_assignment(-score)
    return {ids[row]: ids[col] for row, col in zip(rows, cols, strict=True)}


def mean_score(lobes: Sequence[Lobe], azimuths_deg: Sequence[float]) -> float:
    """Return the mean score of one boresight for each of several lobes."""
    pairs = zip(lobes, azimuths_deg, strict=True)
    return float(np.mean([lobe.score(azimuth) for lobe, azimuth in pairs]))


def _binned(
    log_m: Floats, azimuth_deg: Floats, value: Floats32
) -> tuple[Floats, Floats, Ints, Floats]:
    """Return mean value, mean log distance, direction and weight of rings by directions."""
    low, high = log_m.min(), log_m.max()
    ring = ((log_m - low) / max(high - low, 1e-9) * _RINGS).astype(np.int64).clip(0, _RINGS - 1)
    direction = (azimuth_deg // STEP_DEG).astype(np.int64) % _DIRECTIONS
    place, size = ring * _DIRECTIONS + direction, _RINGS * _DIRECTIONS
    count = np.bincount(place, minlength=size)
    full = np.flatnonzero(count >= _LEAST_PER_BIN)
    mean = np.bincount(place, weights=value, minlength=size)[full] / count[full]
    far = np.bincount(place, weights=log_m, minlength=size)[full] / count[full]
    weight = np.minimum(count[full], _MOST_PER_BIN).astype(np.float64)
    return mean, far, full % _DIRECTIONS, weight
