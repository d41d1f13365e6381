"""Sectors whose readings lie where another sector of their site points.

Readings are explained by the levels of their own sector and by those of the others, offset and
slope fitted as in a calibration. The likelihoods know that errors of neighbouring readings are
alike, so that a long drive counts as no more evidence than it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.survey.level_trend import (
    CALIBRATION_SLOPE,
    EXPONENT,
    Covariate,
    DistanceLoss,
    Prior,
    fit_trend,
)
from mapfilter.survey.measured_points import Points
from mapfilter.survey.residual_field import Shadowing

_CLEAR, _EACH, _FEWEST = 12.0, 3.0, 2
"""Log odds of a site, and of each of the cells that are exchanged: one alone is never."""
_APART_DEG = 45.0
_LEAST_POINTS, _MOST_POINTS = 10, 300
_BEHIND_DB = 20.0
"""Streets reflect: no more than this is lost behind an antenna."""


@dataclass(frozen=True, slots=True)
class Exchange:
    """Sectors of a site whose readings lie as those of others would.

    Parameters
    ----------
    points_as : mapping of str to str
        For each of these cells the one that points where its readings are.
    turns_deg : tuple of float
        How much more the azimuths of the latter are, in -180..180.
    log_odds : tuple of float
        By how much more likely the readings of each are then.
    """

    site: str
    points_as: Mapping[str, str]
    turns_deg: tuple[float, ...]
    log_odds: tuple[float, ...]


def exchanged_sectors(
    points: Mapping[str, Points],
    plan: CellPlan,
    shadowing: Shadowing,
    predicted: Mapping[str, Covariate] | None = None,
) -> tuple[Exchange, ...]:
    """Find the sites whose sectors are exchanged between measurements and plan.

    A site is reported where some assignment of its readings to its sectors is likelier than the
    plan's by log odds of 12 or more, of which two of its cells have 3 or more each. Exchanges of
    sectors less than 45° apart are not looked for.

    Parameters
    ----------
    points : mapping of str to Points
        Of the cells that were received, in the plan's CRS.
    predicted : mapping of str to callable, optional
        Levels of cells by place; by distance and azimuth alone where this is not given.
    """
    sites: dict[str, list[Cell]] = {}
    for cell in plan.cells:
        if _is_sector(cell) and (predicted is None or cell.id in predicted):
            sites.setdefault(cell.site, []).append(cell)
    found = (
        _exchange(site, cells, points, shadowing, predicted)
        for site, cells in sites.items()
        if len(cells) > 1
    )
    return tuple(exchange for exchange in found if exchange is not None)


def sector_level(cell: Cell) -> Covariate:
    """Return the level of a sector by distance and azimuth alone, as a function of place.

    Grid north is taken for true north: they differ by some two degrees at most.
    """
    loss = DistanceLoss.of_cell(cell)
    azimuth_rad, width_rad = np.radians(float(cell.azimuth_deg or 0.0)), float(cell.beamwidth_deg)

    def level_db(east_m: Floats, north_m: Floats) -> Floats:
        seen_rad = np.arctan2(east_m - cell.east_m, north_m - cell.north_m)
        off_rad = wrap_rad(seen_rad - azimuth_rad)
        gain_db = sector_gain_db(off_rad, np.radians(width_rad), _BEHIND_DB)
        return np.asarray(EXPONENT * loss(east_m, north_m) + gain_db)

    return level_db


def _is_sector(cell: Cell) -> bool:
    known = cell.azimuth_deg is not None and "azimuth_deg" not in cell.assumes
    return known and cell.antenna != "omni" and not cell.indoor


def _exchange(
    site: str,
    cells: Sequence[Cell],
    points: Mapping[str, Points],
    shadowing: Shadowing,
    predicted: Mapping[str, Covariate] | None,
) -> Exchange | None:
    """Return the likeliest assignment of a site's readings, if it is clearly not the plan's."""
    from scipy.optimize import linear_sum_assignment

    levels = [predicted[c.id] if predicted is not None else sector_level(c) for c in cells]
    azimuth_deg = np.array([float(cell.azimuth_deg or 0.0) for cell in cells])
    own, gains = [], []
    for number, cell in enumerate(cells):
        if cell.id not in points:
            continue
        likelihood = _likelihoods(points[cell.id].thinned(_MOST_POINTS), levels, shadowing)
        if likelihood is not None:
            gain = likelihood - likelihood[number]
            near = np.abs(_turned_deg(azimuth_deg - azimuth_deg[number])) < _APART_DEG
            own.append(number)
            gains.append(np.where(near, 0.0, gain))
    if not own:
        return None
    table = np.array(gains)
    rows, cols = linear_sum_assignment(-table)
    gain = table[rows, cols]
    moved = gain >= _EACH
    if gain.sum() < _CLEAR or moved.sum() < _FEWEST:
        return None
    have, points_as = np.array(own)[rows[moved]], cols[moved]
    turns_deg = _turned_deg(azimuth_deg[points_as] - azimuth_deg[have])
    pairs = zip(have.tolist(), points_as.tolist(), strict=True)
    found = {cells[one].id: cells[other].id for one, other in pairs}
    return Exchange(site, found, tuple(turns_deg.tolist()), tuple(gain[moved].tolist()))


def _likelihoods(
    points: Points, levels: Sequence[Covariate], shadowing: Shadowing
) -> Floats | None:
    """Return the log likelihood of readings by the levels of each sector, shape (sectors,)."""
    values = np.array([level(points.east_m, points.north_m) for level in levels])
    known = np.isfinite(values).all(axis=0)
    if known.sum() < _LEAST_POINTS:
        return None
    some = points.some(known)
    covariance = shadowing.covariance_db2(some)
    prior = Prior(float(some.level_dbm.mean()), *CALIBRATION_SLOPE)
    return np.array([-_cost(given, some, covariance, prior) / 2 for given in values[:, known]])


def _cost(level_db: Floats, points: Points, covariance_db2: Floats, prior: Prior) -> float:
    return fit_trend(lambda _east_m, _north_m: level_db, points, covariance_db2, prior).cost


def _turned_deg(angle_deg: Floats) -> Floats:
    return np.asarray((angle_deg + 180.0) % 360.0 - 180.0)
