"""The buildings around the cells of a prediction, and the level of a cell among them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapfilter.geodesy import (
    Lattice,
    grid_convergence_rad,
    heading_from_azimuth_rad,
    unproject,
)
from mapfilter.radio._models import PredictionModel
from mapfilter.radio.antenna import omni_gain_db, sector_gain_db, vertical_gain_db
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.los import check_heights, line_of_sight, mean_roof_height, own_building
from mapfilter.radio.pathloss import (
    SHORTEST_DISTANCE_M,
    cost231_hata_db,
    cost231_walfisch_ikegami_db,
)

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Bools = NDArray[np.bool_]

_ROOF_RADIUS_M = 100.0
_SLOPE_REFERENCE_M = 100.0


@dataclass(frozen=True)
class Surroundings:
    """The buildings of an area, and what the model makes of them."""

    lattice: Lattice
    heights_m: Floats32 | None
    roof_height_m: Floats32
    model: PredictionModel

    @classmethod
    def of(
        cls, lattice: Lattice, heights_m: Floats32 | None, model: PredictionModel
    ) -> Surroundings:
        """Check the heights, and see how high the roofs are around every pixel."""
        default_m = model.default_roof_height_m
        if heights_m is None:
            roofs = np.full((lattice.rows, lattice.cols), default_m, dtype=np.float32)
            return cls(lattice, None, roofs, model)
        heights = check_heights(heights_m, lattice)
        roofs = mean_roof_height(heights, lattice, _ROOF_RADIUS_M, default_m)
        return cls(lattice, heights, roofs, model)

    def seen(self, cell: Cell) -> Bools:
        """Tell from which pixels a cell is seen."""
        if self.heights_m is None:
            return np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.bool_)
        antenna = (cell.east_m, cell.north_m, cell.height_m)
        return line_of_sight(self.heights_m, self.lattice, antenna, self.model.mobile_height_m)

    def median_level_dbm(self, cell: Cell, seen: Bools, slope_factor: float) -> Floats:
        """Return the level without shadowing; ``cell`` may be a perturbed one."""
        lattice = self.lattice
        east_m, _ = lattice.east_north(0, np.arange(lattice.cols))
        _, north_m = lattice.east_north(np.arange(lattice.rows), 0)
        right_m, up_m = (east_m - cell.east_m)[None, :], (north_m - cell.north_m)[:, None]
        distance_m = np.maximum(np.hypot(right_m, up_m), SHORTEST_DISTANCE_M)
        # Both models are linear in lg d, so stretching lg(d / 100 m) stretches the slope alone.
        stretched_m = _SLOPE_REFERENCE_M * (distance_m / _SLOPE_REFERENCE_M) ** slope_factor
        level_dbm = cell.eirp_dbm - self._loss_db(cell, stretched_m, seen)
        if cell.antenna == "sector" and cell.azimuth_deg is not None:
            level_dbm += self._gain_db(cell, cell.azimuth_deg, right_m, up_m)
        else:
            level_dbm += omni_gain_db(distance_m)
        if cell.indoor:
            level_dbm -= np.where(self._inside(cell), 0.0, cell.penetration_loss_db)
        return np.asarray(level_dbm)

    def _loss_db(self, cell: Cell, distance_m: Floats, seen: Bools) -> Floats:
        model = self.model
        if model.model == "cost231_hata":
            return cost231_hata_db(
                distance_m, cell.frequency_mhz, cell.height_m, model.mobile_height_m,
                model.metropolitan,
            )  # fmt: skip
        return cost231_walfisch_ikegami_db(
            distance_m, cell.frequency_mhz, cell.height_m, model.mobile_height_m,
            self.roof_height_m, model.street_width_m, model.building_separation_m,
            model.street_orientation_deg, model.metropolitan, seen,
        )  # fmt: skip

    def _gain_db(self, cell: Cell, azimuth_deg: float, right_m: Floats, up_m: Floats) -> Floats:
        lon_deg, lat_deg = unproject(self.lattice.crs, cell.east_m, cell.north_m)
        convergence = grid_convergence_rad(self.lattice.crs, float(lon_deg), float(lat_deg))
        offset_rad = np.arctan2(up_m, right_m) - heading_from_azimuth_rad(azimuth_deg, convergence)
        gain_db = sector_gain_db(
            offset_rad, np.radians(cell.beamwidth_deg), cell.max_attenuation_db
        )
        if cell.vertical_beamwidth_deg is None:
            return gain_db
        below_m = cell.height_m - self.model.mobile_height_m
        gain_db += vertical_gain_db(
            np.arctan2(below_m, np.hypot(right_m, up_m)),
            np.radians(cell.downtilt_deg),
            np.radians(cell.vertical_beamwidth_deg),
        )
        return np.maximum(gain_db, -cell.max_attenuation_db)

    def _inside(self, cell: Cell) -> Bools:
        if self.heights_m is None:
            return np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.bool_)
        return own_building(self.heights_m, self.lattice, cell.east_m, cell.north_m)


def views_of(plan: CellPlan, surroundings: Surroundings) -> Iterator[Bools]:
    """Yield who sees each cell, worked out once for all cells of a mast."""

    def mast(cell: Cell) -> tuple[float, float, float]:
        return cell.east_m, cell.north_m, cell.height_m

    waiting = Counter(mast(cell) for cell in plan.cells)
    known: dict[tuple[float, float, float], Bools] = {}
    for cell in plan.cells:
        key = mast(cell)
        if key not in known:
            known[key] = surroundings.seen(cell)
        waiting[key] -= 1
        yield known[key] if waiting[key] else known.pop(key)
