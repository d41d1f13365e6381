"""Levels that cells would have with another azimuth, or in another place.

A database holds levels, not the path loss beneath them. The loss from a mast to a place is known
from that sector of the mast and the band which points there best; with another azimuth a cell has
the same loss and another gain. Elsewhere than planned a cell is expected as the database's own
levels fall off with distance.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.learning.calibration import NEAREST_M
from mapfilter.radio.antenna import sector_gain_db
from mapfilter.radio.cells import Cell, CellPlan

_SAME_MAST_M = 1.0
_SAME_BAND = 1.05
"""Largest ratio of two frequencies of a band: their losses differ by less than a decibel."""
_LEAST_POINTS = 30


@dataclass(frozen=True, eq=False)
class Patterns:
    """Predicted levels in M places, and what they would be otherwise.

    Parameters
    ----------
    plan : CellPlan
    east_m, north_m : (M,) arrays
    level_dbm : (M, cells) array
        As predicted.
    floor_dbm : float
        Levels of the database are above it; lower ones stand for "below".
    """

    plan: CellPlan
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    floor_dbm: float

    def turned(self, cell: int, azimuth_deg: float) -> Floats:
        """Return the levels of a cell with another azimuth, shape (M,)."""
        one = self.plan.cells[cell]
        loss = self._loss_db[cell]
        level = one.eirp_dbm - loss + self.gain_db(one, azimuth_deg)
        return np.where(np.isnan(loss), self.level_dbm[:, cell], level)

    def elsewhere(self, cell: int, east_m: float, north_m: float) -> Floats:
        """Return the levels of a cell that stands in another place, shape (M,)."""
        one = self.plan.cells[cell]
        distance = np.hypot(self.east_m - east_m, self.north_m - north_m)
        at_100_m, slope = self._fall_off[one.indoor]
        level = one.eirp_dbm + at_100_m - slope * np.log10(np.maximum(distance, NEAREST_M) / 100)
        if one.azimuth_deg is not None:
            level = level + self.gain_db(one, one.azimuth_deg, (east_m, north_m))
        return np.asarray(np.maximum(level, self.floor_dbm - 20.0))

    def gain_db(
        self, cell: Cell, azimuth_deg: float, mast_m: tuple[float, float] | None = None
    ) -> Floats:
        """Return the horizontal gain of a cell with an azimuth, shape (M,)."""
        if cell.antenna == "omni" or cell.azimuth_deg is None:
            return np.zeros(self.east_m.shape)
        mast = mast_m or (cell.east_m, cell.north_m)
        boresight = heading_from_azimuth_rad(azimuth_deg % 360.0, self._convergence_rad)
        bearing = np.arctan2(self.north_m - mast[1], self.east_m - mast[0])
        width = np.radians(cell.beamwidth_deg)
        return sector_gain_db(bearing - boresight, float(width), cell.max_attenuation_db)

    @cached_property
    def masts(self) -> tuple[tuple[int, ...], ...]:
        """Cells that share a mast, as indices."""
        found: dict[tuple[str, int, int], list[int]] = {}
        for i, cell in enumerate(self.plan.cells):
            place = round(cell.east_m / _SAME_MAST_M), round(cell.north_m / _SAME_MAST_M)
            found.setdefault((cell.site, *place), []).append(i)
        return tuple(tuple(cells) for cells in found.values())

    @cached_property
    def _convergence_rad(self) -> float:
        cell = self.plan.cells[0]
        lon_deg, lat_deg = unproject(self.plan.crs, cell.east_m, cell.north_m)
        return grid_convergence_rad(self.plan.crs, float(lon_deg), float(lat_deg))

    @cached_property
    def _loss_db(self) -> dict[int, Floats]:
        """Loss of each cell's band from its mast to the places; NaN where no sector has a level."""
        found: dict[int, Floats] = {}
        for band in (band for mast in self.masts for band in self._bands(mast)):
            loss = np.full((len(band), self.east_m.size), np.nan)
            gain = np.full(loss.shape, -np.inf)
            for i, c in enumerate(band):
                cell, level = self.plan.cells[c], self.level_dbm[:, c]
                known = level >= self.floor_dbm
                pattern = self.gain_db(cell, cell.azimuth_deg or 0.0)
                loss[i, known] = (cell.eirp_dbm + pattern - level)[known]
                gain[i, known] = pattern[known]
            best = gain.argmax(axis=0)
            found |= dict.fromkeys(band, loss[best, np.arange(self.east_m.size)])
        return found

    def _bands(self, mast: Sequence[int]) -> list[list[int]]:
        """Return the cells of a mast by band, in which sectors may have carriers of their own."""
        frequency_mhz = {cell: self.plan.cells[cell].frequency_mhz for cell in mast}
        ordered = sorted(mast, key=lambda cell: frequency_mhz[cell])
        bands = [ordered[:1]]
        for last, cell in itertools.pairwise(ordered):
            if frequency_mhz[cell] > _SAME_BAND * frequency_mhz[last]:
                bands.append([])
            bands[-1].append(cell)
        return [sorted(band) for band in bands]

    @cached_property
    def _fall_off(self) -> dict[bool, tuple[float, float]]:
        """Level above the EIRP at 100 m, and its fall per decade, of outdoor and indoor cells."""
        return {
            indoor: self._fitted([i for i, c in enumerate(self.plan.cells) if c.indoor == indoor])
            for indoor in (False, True)
        }

    def _fitted(self, cells: Sequence[int]) -> tuple[float, float]:
        logs, losses = [np.empty(0)], [np.empty(0)]
        for c in cells:
            cell, level = self.plan.cells[c], self.level_dbm[:, c]
            known = level >= self.floor_dbm
            distance = np.hypot(self.east_m - cell.east_m, self.north_m - cell.north_m)
            logs.append(np.log10(np.maximum(distance, NEAREST_M) / 100)[known])
            gain = self.gain_db(cell, cell.azimuth_deg or 0.0)
            losses.append((level - cell.eirp_dbm - gain)[known])
        x, y = np.concatenate(logs), np.concatenate(losses)
        if x.size < _LEAST_POINTS or np.ptp(x) < 0.1:
            return -100.0, 35.0
        slope, at = np.polyfit(x, y, 1)
        return float(at), float(-slope)


def bearing_places(patterns: Patterns, step_m: float, reach_m: float, cell: int) -> Ints | Floats:
    """Return candidate places (n, 2) of a cell within reach of its planned one."""
    one = patterns.plan.cells[cell]
    steps = np.arange(-reach_m, reach_m + step_m / 2, step_m)
    right, up = (axis.ravel() for axis in np.meshgrid(steps, steps))
    near = np.hypot(right, up) <= reach_m
    return np.column_stack([one.east_m + right[near], one.north_m + up[near]])
