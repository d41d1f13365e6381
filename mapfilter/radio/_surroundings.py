"""The buildings around the cells of a prediction, and the level of a cell among them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from mapfilter._types import Bools, Floats, Floats32
from mapfilter.geodesy import (
    Lattice,
    grid_convergence_rad,
    heading_from_azimuth_rad,
    unproject,
)
from mapfilter.radio._models import PredictionModel
from mapfilter.radio.antenna import (
    MeasuredAntenna,
    combined_gain_db,
    leaning,
    sector_gain_db,
    vertical_gain_db,
)
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.los import check_heights, line_of_sight, mean_roof_height, own_building
from mapfilter.radio.pathloss import (
    needs_sight,
    path_loss_db,
    probability_of_sight,
    shortest_distance_m,
)

_ROOF_RADIUS_M = 100.0
_SLOPE_REFERENCE_M = 100.0
_VERTICAL_BEAMWIDTH_DEG = 10.0


@dataclass(frozen=True)
class Surroundings:
    """The buildings of an area, and what the model makes of them."""

    lattice: Lattice
    heights_m: Floats32 | None
    roof_height_m: Floats32
    model: PredictionModel
    antennas: Mapping[str, MeasuredAntenna] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        lattice: Lattice,
        heights_m: Floats32 | None,
        model: PredictionModel,
        antennas: Mapping[str, MeasuredAntenna] | None = None,
    ) -> Surroundings:
        """Check the heights, and see how high the roofs are around every pixel."""
        antennas = {} if antennas is None else antennas
        default_m = model.default_roof_height_m
        if heights_m is None:
            roofs = np.full((lattice.rows, lattice.cols), default_m, dtype=np.float32)
            return cls(lattice, None, roofs, model, antennas)
        heights = check_heights(heights_m, lattice)
        roofs = mean_roof_height(heights, lattice, _ROOF_RADIUS_M, default_m)
        return cls(lattice, heights, roofs, model, antennas)

    def sight(self, cell: Cell) -> Floats32:
        """Tell from which pixels a cell is seen: 0 or 1, or how probably it is."""
        shape = (self.lattice.rows, self.lattice.cols)
        if not needs_sight(self.model):
            return np.zeros(shape, dtype=np.float32)
        if self.heights_m is None or self.model.line_of_sight == "probability":
            right_m, up_m = self._offsets_m(cell)
            probability = probability_of_sight(self.model, np.hypot(right_m, up_m))
            return np.asarray(probability, dtype=np.float32)
        antenna = (cell.east_m, cell.north_m, cell.height_m)
        seen = line_of_sight(self.heights_m, self.lattice, antenna, self.model.mobile_height_m)
        return seen.astype(np.float32)

    def median_level_dbm(self, cell: Cell, sight: Floats32, slope_factor: float) -> Floats:
        """Return the level without shadowing; ``cell`` may be a perturbed one."""
        right_m, up_m = self._offsets_m(cell)
        distance_m = np.maximum(np.hypot(right_m, up_m), shortest_distance_m(self.model))
        # The loss goes by lg d, so stretching lg(d / 100 m) stretches its slope alone.
        stretched_m = _SLOPE_REFERENCE_M * (distance_m / _SLOPE_REFERENCE_M) ** slope_factor
        loss_db = path_loss_db(
            self.model, stretched_m, cell.frequency_mhz, cell.height_m, self.roof_height_m, sight
        )
        level_dbm = cell.eirp_dbm - loss_db + self._gain_db(cell, right_m, up_m)
        if cell.indoor:
            level_dbm -= np.where(self._inside(cell), 0.0, cell.penetration_loss_db)
        return np.asarray(level_dbm)

    def _offsets_m(self, cell: Cell) -> tuple[Floats, Floats]:
        """Return how far east and north of a cell the columns and rows are."""
        lattice = self.lattice
        east_m, _ = lattice.east_north(0, np.arange(lattice.cols))
        _, north_m = lattice.east_north(np.arange(lattice.rows), 0)
        return (east_m - cell.east_m)[None, :], (north_m - cell.north_m)[:, None]

    def _gain_db(self, cell: Cell, right_m: Floats, up_m: Floats) -> Floats:
        """Return the antenna's gain against its boresight."""
        if cell.antenna == "omni":
            return np.zeros(())
        measured = self.antennas.get(cell.antenna)
        offset_rad = np.arctan2(up_m, right_m) - self._heading_rad(cell)
        below_m = cell.height_m - self.model.mobile_height_m
        depression_rad = np.arctan2(below_m, np.hypot(right_m, up_m))
        own = leaning(offset_rad, depression_rad, np.radians(cell.mechanical_downtilt_deg))
        if measured is not None:
            return measured.gain_db(*own, cell.downtilt_deg or None)
        beamwidth_rad = np.radians(cell.beamwidth_deg)
        vertical_deg = cell.vertical_beamwidth_deg
        if vertical_deg is None and cell.antenna == "3gpp":
            vertical_deg = _VERTICAL_BEAMWIDTH_DEG
        if vertical_deg is None:
            return sector_gain_db(offset_rad, beamwidth_rad, cell.max_attenuation_db)
        return combined_gain_db(
            sector_gain_db(own[0], beamwidth_rad, cell.max_attenuation_db),
            vertical_gain_db(
                own[1], np.radians(cell.downtilt_deg), np.radians(vertical_deg), cell.side_lobe_db
            ),
            cell.max_attenuation_db,
        )

    def _heading_rad(self, cell: Cell) -> Floats:
        """Return the boresight from grid east; without an azimuth any will do."""
        lon_deg, lat_deg = unproject(self.lattice.crs, cell.east_m, cell.north_m)
        convergence = grid_convergence_rad(self.lattice.crs, float(lon_deg), float(lat_deg))
        return heading_from_azimuth_rad(cell.azimuth_deg or 0.0, convergence)

    def _inside(self, cell: Cell) -> Bools:
        if self.heights_m is None:
            return np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.bool_)
        return own_building(self.heights_m, self.lattice, cell.east_m, cell.north_m)


def views_of(plan: CellPlan, surroundings: Surroundings) -> Iterator[Floats32]:
    """Yield who sees each cell, worked out once for all cells of a mast."""

    def mast(cell: Cell) -> tuple[float, float, float]:
        return cell.east_m, cell.north_m, cell.height_m

    waiting = Counter(mast(cell) for cell in plan.cells)
    known: dict[tuple[float, float, float], Floats32] = {}
    for cell in plan.cells:
        key = mast(cell)
        if key not in known:
            known[key] = surroundings.sight(cell)
        waiting[key] -= 1
        yield known[key] if waiting[key] else known.pop(key)
