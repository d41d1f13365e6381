"""Main lobes of rasters, and the mistakes of azimuths that do not agree with them.

A level is explained by ``a + b log10(distance) + c gain(direction - azimuth)``, fitted to the means
of rings and directions about a place; the correlation of fit and levels is the measure.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats, Floats32, Ints
from mapfilter.check.samples import RasterSample
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.cells import Cell

STEP_DEG = 5.0
_DIRECTIONS = round(360 / STEP_DEG)
_RINGS = 24
_LEAST_BINS = 60
_LEAST_DIRECTIONS = 0.6
_MOST_PER_BIN = 20
_FRONT_TO_BACK_DB = 20.0


@dataclass(frozen=True, slots=True, eq=False)
class Lobe:
    """Scores of all boresights for one raster.

    Parameters
    ----------
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
        boresights_deg = np.arange(_DIRECTIONS) * STEP_DEG
        return float(np.interp(azimuth_deg, boresights_deg, self.scores, period=360.0))

    def offset_deg(self, azimuth_deg: float) -> float:
        """Return how far the best boresight is from another, clockwise, in -180..180."""
        return (self.azimuth_deg - azimuth_deg + 180.0) % 360.0 - 180.0


def find_lobe(
    sample: RasterSample, east_m: float, north_m: float, beamwidth_deg: float
) -> Lobe | None:
    """Find the direction in which a raster of levels is strong about a site.

    ``beamwidth_deg`` is the full width at half power of the lobe looked for. Too few directions or
    pixels, as for a site at the raster's edge, give None.
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


def best_labels(lobes: Mapping[str, Lobe], azimuths_deg: Mapping[str, float]) -> dict[str, str]:
    """Return the cell of a site that each cell's raster fits best, every cell taken once."""
    from scipy.optimize import linear_sum_assignment

    ids = list(lobes)
    score = np.array([[lobes[a].score(azimuths_deg[b]) for b in ids] for a in ids])
    rows, cols = linear_sum_assignment(-score)
    return {ids[row]: ids[col] for row, col in zip(rows, cols, strict=True)}


def _binned(
    log_m: Floats, azimuth_deg: Floats, value: Floats32
) -> tuple[Floats, Floats, Ints, Floats]:
    """Return mean value, mean log distance, direction and weight of rings by directions."""
    low, high = log_m.min(), log_m.max()
    ring = ((log_m - low) / max(high - low, 1e-9) * _RINGS).astype(np.int64).clip(0, _RINGS - 1)
    direction = (azimuth_deg // STEP_DEG).astype(np.int64) % _DIRECTIONS
    place, size = ring * _DIRECTIONS + direction, _RINGS * _DIRECTIONS
    count = np.bincount(place, minlength=size)
    full = np.flatnonzero(count)
    mean = np.bincount(place, weights=value, minlength=size)[full] / count[full]
    far = np.bincount(place, weights=log_m, minlength=size)[full] / count[full]
    weight = np.minimum(count[full], _MOST_PER_BIN).astype(np.float64)
    return mean, far, full % _DIRECTIONS, weight


_FAR_OFF_DEG = 45.0
_WORSE = 0.4
_CLEAR_SCORE = 0.25
_CLEAR_CONTRAST_DB = 6.0
_BETTER = 0.3
_STRAY_SHARE = 0.1
_DEG_PER_GON = 0.9
_LEAST_SECTORS = 6
_GONS_BETTER, _THAN_ROTATED, _ERRORS_BETTER = 0.03, 0.01, 1.5
_ALIKE_BELOW_DEG = 90.0

_READINGS: tuple[tuple[str, str, Callable[[float], float]], ...] = (
    ("azimuth-counter-clockwise", "counter-clockwise from north", lambda a: -a),
    ("azimuth-counter-clockwise", "counter-clockwise from east", lambda a: 90 - a),
    ("azimuth-off-by-180", "to be 180° more", lambda a: a + 180),
    ("azimuth-off-by-90", "to be 90° more", lambda a: a + 90),
    ("azimuth-off-by-90", "to be 90° less", lambda a: a - 90),
    ("azimuth-radians", "radians", lambda a: float(np.degrees(a))),
)
"""Likely conventions of wrong azimuths, each with its conversion to degrees from north."""


class AzimuthMistake(NamedTuple):
    """Azimuths that go against the lobes, and what explains it.

    Parameters
    ----------
    mistake : str
        Code of the finding.
    cells : tuple of str
        Whose azimuths or rasters are concerned.
    reading : str
        What the azimuths seem to be, in words; for swapped labels which raster is whose.
    offset_deg : float
        Median angle between azimuths and lobes of those cells, 0..180.
    offset_read_deg : float
        The same after the mistake is mended.
    """

    mistake: str
    cells: tuple[str, ...]
    reading: str
    offset_deg: float
    offset_read_deg: float


def azimuth_mistakes(
    cells: Sequence[Cell], lobes: Mapping[str, Lobe]
) -> tuple[AzimuthMistake, ...]:
    """Compare the azimuth of each sector with the lobe of its raster.

    A sector counts as wrong where its azimuth is more than 45° from the lobe and explains the
    raster clearly worse. A mistake of the whole plan is preferred where it explains two sites or
    more, then labels exchanged within a site, then single azimuths. Gons are at most 40° from
    degrees, and are told by all sectors together. Cells without a lobe are skipped.
    """
    usable = [cell for cell in cells if _is_clear(cell, lobes)]
    azimuth = {cell.id: float(cell.azimuth_deg or 0.0) for cell in usable}
    if (gons := _gons(usable, lobes, azimuth)) is not None:
        return (gons,)
    wrong = [cell for cell in usable if _is_off(lobes[cell.id], azimuth[cell.id])]
    if not wrong:
        return ()
    by_site: dict[str, list[Cell]] = {}
    for cell in usable:
        by_site.setdefault(cell.site, []).append(cell)
    touched = {cell.site for cell in wrong}
    swaps = [swap for site in sorted(touched) if (swap := _swapped(by_site[site], lobes, azimuth))]
    explained = {cell_id for swap in swaps for cell_id in swap.cells}
    one_site_explained = len(touched) == 1 and explained >= {cell.id for cell in wrong}
    whole = None if one_site_explained else _whole_plan(usable, wrong, lobes, azimuth)
    if whole is not None:
        return (whole,)
    rest = tuple(cell.id for cell in wrong if cell.id not in explained)
    if not rest:
        return tuple(swaps)
    reading = ", ".join(f"{i} {azimuth[i]:g}° for {lobes[i].azimuth_deg:g}°" for i in rest[:5])
    off_deg = _median_off(rest, lobes, azimuth)
    return (*swaps, AzimuthMistake("azimuth-off-lobe", rest, reading, off_deg, 0.0))


def _is_clear(cell: Cell, lobes: Mapping[str, Lobe]) -> bool:
    lobe = lobes.get(cell.id)
    if lobe is None or cell.azimuth_deg is None or cell.antenna == "omni" or cell.indoor:
        return False
    return lobe.contrast_db >= _CLEAR_CONTRAST_DB and float(lobe.scores.max()) >= _CLEAR_SCORE


def _is_off(lobe: Lobe, azimuth_deg: float) -> bool:
    far = abs(lobe.offset_deg(azimuth_deg)) > _FAR_OFF_DEG
    return far and float(lobe.scores.max()) - lobe.score(azimuth_deg) > _WORSE


def _median_off(
    ids: Sequence[str], lobes: Mapping[str, Lobe], azimuth: Mapping[str, float]
) -> float:
    return float(np.median([abs(lobes[i].offset_deg(azimuth[i])) for i in ids]))


def _whole_plan(
    usable: Sequence[Cell],
    wrong: Sequence[Cell],
    lobes: Mapping[str, Lobe],
    azimuth: Mapping[str, float],
) -> AzimuthMistake | None:
    """Return the mistake that explains the azimuths of all sectors, if one does."""
    if len(usable) < 2 or 2 * len(wrong) < len(usable):
        return None
    ids = [cell.id for cell in usable]

    def mean_score(azimuths: Mapping[str, float]) -> float:
        return float(np.mean([lobes[i].score(azimuths[i]) for i in ids]))

    as_given = mean_score(azimuth)
    found: list[tuple[float, str, str, dict[str, float]]] = []
    for mistake, reading, read in _READINGS:
        meant = {i: read(azimuth[i]) % 360 for i in ids}
        score = mean_score(meant)
        stray = sum(_is_off(lobes[i], meant[i]) for i in ids)
        if score - as_given > _BETTER and stray <= _STRAY_SHARE * len(ids):
            found.append((score, mistake, reading, meant))
    if not found:
        return None
    _, mistake, reading, meant = max(found, key=itemgetter(0))
    concerned = tuple(cell.id for cell in wrong)
    off_deg, read_deg = (_median_off(concerned, lobes, some) for some in (azimuth, meant))
    return AzimuthMistake(mistake, concerned, reading, off_deg, read_deg)


def _gons(
    usable: Sequence[Cell], lobes: Mapping[str, Lobe], azimuth: Mapping[str, float]
) -> AzimuthMistake | None:
    """Return the mistake of azimuths in gons, where they explain more than any rotation.

    Nearly all have to fit then: azimuths that are wrong in another way come closer by chance.
    """
    count = len(usable)
    if count < _LEAST_SECTORS or len({cell.site for cell in usable}) < 2:
        return None
    as_deg = {i: _DEG_PER_GON * a for i, a in azimuth.items()}
    scores = np.array([lobes[i].score(a) for i, a in as_deg.items()])
    gain = scores - [lobes[i].score(a) for i, a in azimuth.items()]
    rotated = max(
        np.mean([lobes[i].score(a + by) for i, a in azimuth.items()])
        for by in np.arange(-30.0, 31.0, STEP_DEG)
    )
    least = max(_GONS_BETTER, _ERRORS_BETTER * float(gain.std(ddof=1)) / count**0.5)
    if gain.mean() < least or scores.mean() - rotated < _THAN_ROTATED:
        return None
    if sum(_is_off(lobes[i], a) for i, a in as_deg.items()) > _STRAY_SHARE * count:
        return None
    # Near north both are alike.
    ids = tuple(i for i, a in azimuth.items() if a > _ALIKE_BELOW_DEG)
    meant = {i: as_deg[i] for i in ids}
    off_deg, read_deg = (_median_off(ids, lobes, some) for some in (azimuth, meant))
    return AzimuthMistake("azimuth-gons", ids, "gons", off_deg, read_deg)


def _swapped(
    cells: Sequence[Cell], lobes: Mapping[str, Lobe], azimuth: Mapping[str, float]
) -> AzimuthMistake | None:
    """Return the exchange of labels that explains a site's lobes, if one does."""
    ids = [cell.id for cell in cells]
    if len(ids) < 2:
        return None
    label = best_labels({i: lobes[i] for i in ids}, {i: azimuth[i] for i in ids})
    moved = tuple(i for i in ids if label[i] != i)
    meant = {i: azimuth[label[i]] for i in ids}
    if not moved or any(_is_off(lobes[i], meant[i]) for i in ids):
        return None
    reading = ", ".join(f"{i} is of {label[i]}" for i in moved)
    off_deg, read_deg = (_median_off(moved, lobes, some) for some in (azimuth, meant))
    return AzimuthMistake("sector-labels-swapped", moved, reading, off_deg, read_deg)
