"""What a cell plan adds to predicted levels: their errors, distances to sites, and layers.

A plan of a public list lacks heights, powers or azimuths, and usual values stand for them
(:attr:`mapfilter.radio.cells.Cell.assumed`). Levels predicted with these err by more than those of
a planner, and in part alike for all cells of an operator. The deviations here follow from the
spread of what is built: antennas 15 to 50 m high, 43 ± 3 dBm into antennas of 17 ± 2 dBi, carriers
of 10 to 20 MHz, phones in pockets and beside walls, and patterns whose back is filled by scattered
waves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats, Ints, Ints32
from mapfilter.angles import azimuth_from_heading_deg
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import TIMING_STEP_M
from mapfilter.radio.layers import layers_of

OWN_DB: Mapping[str, float] = {"eirp_dbm": 4.0, "height_m": 4.0, "azimuth_deg": 9.0}
"""Deviation of a cell's level by each of its fields that is assumed; 9 dB is that of a sector's
pattern over all directions."""
COMMON_DB: Mapping[str, float] = {"eirp_dbm": 5.0, "height_m": 3.0, "azimuth_deg": 0.0}
"""The same, of the error that is common to all cells."""
PATTERN_SHARE = 0.4
"""Deviation off an assumed cell's boresight, as a share of the attenuation that was predicted."""
TIMING_SD_M, TIMING_CLIP_SD = 200.0, 3.0
"""Of a timing advance against the distance; those of the Bayes map filter."""


@dataclass(frozen=True, eq=False)
class Planned:
    """Cells of a plan, by their ids in the order of a database's.

    Parameters
    ----------
    site_m : ndarray, shape (C, 2)
    step_m : ndarray, shape (C,)
        Of timing advance; NaN where the technology is unknown, or has no one step.
    layer : ndarray of int64, shape (C,)
        Number of each cell's layer (:mod:`mapfilter.radio.layers`). Phones measure few cells of
        others than the serving one's.
    common_db : float
        Deviation of the error that all levels of a report share, besides that of the phone.
    """

    site_m: Floats
    step_m: Floats
    layer: Ints
    common_db: float

    @classmethod
    def of(cls, plan: CellPlan, cell_ids: tuple[str, ...]) -> Planned:
        """Return what a plan states of some of its cells."""
        cells = [plan[cell_id] for cell_id in cell_ids]
        common = [_deviation_db(cell, COMMON_DB) for cell in cells]
        return cls(
            np.array([(cell.east_m, cell.north_m) for cell in cells]).reshape(-1, 2),
            np.array([TIMING_STEP_M.get(cell.technology or "", np.nan) for cell in cells]),
            np.array(layers_of(plan, cell_ids), dtype=np.int64),
            float(np.mean(common)) if common else 0.0,
        )

    def some(self, kept: Ints) -> Planned:
        """Return some of the cells, by their indices."""
        return Planned(self.site_m[kept], self.step_m[kept], self.layer[kept], self.common_db)

    def measured_with(self, cell: Ints32) -> Bools:
        """Return which cells would have been reported with those of a report, shape (C,)."""
        return np.asarray(np.isin(self.layer, np.unique(self.layer[cell])))

    def log_timing(self, places: Floats, serving: int, steps: float) -> Floats:
        """Return the log-likelihood of a timing advance at places, (R,); 0 without a known step."""
        step_m = float(self.step_m[serving]) if serving >= 0 else np.nan
        if np.isnan(step_m) or np.isnan(steps):
            return np.zeros(len(places))
        away_m = np.hypot(*(places - self.site_m[serving]).T)
        sd_m = np.hypot(TIMING_SD_M, step_m / 12**0.5)
        off = np.abs(away_m - (steps + 0.5) * step_m) / sd_m
        return np.asarray(-0.5 * np.minimum(off, TIMING_CLIP_SD) ** 2)

    def drawn_timing(self, places: Floats, serving: Ints32, rng: np.random.Generator) -> Floats:
        """Return a timing advance for the serving cell of each place, (R,); NaN without a step."""
        away_m = np.hypot(*(places - self.site_m[serving]).T)
        measured_m = away_m + TIMING_SD_M * rng.standard_normal(len(places))
        return np.asarray(np.floor(np.maximum(measured_m, 0.0) / self.step_m[serving]))


def level_deviations_db(cell: Cell, crs: str, places: Floats, level_error_db: float) -> Floats:
    """Return the deviation of a cell's predicted level at places, shape (R,).

    Parameters
    ----------
    places : ndarray, shape (R, 2)
    level_error_db : float
        With a plan that lacks nothing.
    """
    own_db = np.hypot(level_error_db, _deviation_db(cell, OWN_DB))
    if not cell.assumes or cell.azimuth_deg is None or not len(places):
        return np.full(len(places), own_db)
    lon, lat = unproject(crs, cell.east_m, cell.north_m)
    east_m, north_m = (places - [cell.east_m, cell.north_m]).T
    convergence = grid_convergence_rad(crs, float(lon), float(lat))
    azimuth_deg = azimuth_from_heading_deg(np.arctan2(north_m, east_m), convergence)
    offset_rad = np.radians(azimuth_deg - cell.azimuth_deg)
    beamwidth_rad = float(np.radians(cell.beamwidth_deg))
    lost_db = sector_gain_db(offset_rad, beamwidth_rad, cell.max_attenuation_db)
    return np.asarray(np.hypot(own_db, PATTERN_SHARE * lost_db))


def _deviation_db(cell: Cell, of: Mapping[str, float]) -> float:
    return float(np.sqrt(sum(of[name] ** 2 for name in cell.assumes)))
