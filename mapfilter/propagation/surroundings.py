"""The level at which a cell is received among the buildings of an area, without shadowing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from mapfilter._types import Bools, Floats, Floats32
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.lattice import Lattice
from mapfilter.propagation.line_of_sight import (
    check_heights,
    line_of_sight,
    mean_roof_height,
    own_building,
)
from mapfilter.propagation.models import (
    PredictionModel,
    needs_sight,
    path_loss_db,
    probability_of_sight,
    shortest_distance_m,
)
from mapfilter.radio.antenna import (
    MeasuredAntenna,
    combined_gain_db,
    leaning,
    sector_gain_db,
    vertical_gain_db,
)
from mapfilter.radio.cells import Cell, CellPlan

Antennas = Mapping[str, MeasuredAntenna]

_ROOF_RADIUS_M = 100.0
_SLOPE_REFERENCE_M = 100.0
_VERTICAL_BEAMWIDTH_DEG = 10.0


@dataclass(frozen=True)
class Surroundings:
    """The buildings of an area, and the model by which cells are received there."""

    lattice: Lattice
    heights_m: Floats32 | None
    roof_height_m: Floats32
    model: PredictionModel
    antennas: Antennas = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        lattice: Lattice,
        heights_m: Floats32 | None,
        model: PredictionModel,
        antennas: Antennas | None = None,
    ) -> Surroundings:
        """Check the heights, and average the roofs around every pixel."""
        default_m = model.default_roof_height_m
        if heights_m is None:
            roofs = np.full((lattice.rows, lattice.cols), default_m, dtype=np.float32)
            return cls(lattice, None, roofs, model, antennas or {})
        heights = check_heights(heights_m, lattice)
        roofs = mean_roof_height(heights, lattice, _ROOF_RADIUS_M, default_m)
        return cls(lattice, heights, roofs, model, antennas or {})

    def sights(self, plan: CellPlan) -> Iterator[Floats32]:
        """Yield the line of sight of each cell, computed once for all cells of a mast."""
        masts = [(cell.east_m, cell.north_m, cell.height_m) for cell in plan.cells]
        waiting = Counter(masts)
        known: dict[tuple[float, float, float], Floats32] = {}
        for mast in masts:
            if mast not in known:
                known[mast] = self.sight(mast)
            waiting[mast] -= 1
            yield known[mast] if waiting[mast] else known.pop(mast)

    def sight(self, mast: tuple[float, float, float]) -> Floats32:
        """Return 1 where there is line of sight to a mast, 0 elsewhere, or its probability."""
        if not needs_sight(self.model):
            return np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.float32)
        if self.heights_m is None or self.model.line_of_sight == "probability":
            probability = probability_of_sight(self.model, self._distances_m(*mast[:2]))
            return np.asarray(probability, dtype=np.float32)
        seen = line_of_sight(self.heights_m, self.lattice, mast, self.model.mobile_height_m)
        return seen.astype(np.float32)

    def median_level_dbm(self, cell: Cell, slope_factor: float, sight: Floats32) -> Floats:
        """Return the level without shadowing.

        Parameters
        ----------
        slope_factor : float
            Multiplies the path loss per decade of distance; the loss at 100 m stays.
        sight : ndarray of float32, shape (rows, cols)
            From :meth:`sight`.
        """
        ground_m = self._distances_m(cell.east_m, cell.north_m)
        distance_m = np.maximum(ground_m, shortest_distance_m(self.model))
        # The loss goes by lg d, so stretching lg(d / 100 m) stretches its slope alone.
        stretched_m = _SLOPE_REFERENCE_M * (distance_m / _SLOPE_REFERENCE_M) ** slope_factor
        loss_db = path_loss_db(
            self.model, stretched_m, cell.frequency_mhz, cell.height_m, self.roof_height_m, sight
        )
        place_m, phone_m = pixels_m(self.lattice), self.model.mobile_height_m
        gain_db = antenna_gain_db(cell, self.lattice.crs, *place_m, phone_m, self.antennas)
        level_dbm = cell.eirp_dbm - loss_db + gain_db
        if cell.indoor:
            inside: Bools = np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.bool_)
            if self.heights_m is not None:
                inside = own_building(self.heights_m, self.lattice, cell.east_m, cell.north_m)
            level_dbm -= np.where(inside, 0.0, cell.penetration_loss_db)
        return np.asarray(level_dbm)

    def _distances_m(self, east_m: float, north_m: float) -> Floats:
        column_m, row_m = pixels_m(self.lattice)
        return np.hypot(column_m - east_m, row_m - north_m)


def antenna_gain_db(
    cell: Cell,
    crs: str,
    east_m: Floats,
    north_m: Floats,
    mobile_height_m: float,
    antennas: Antennas,
) -> Floats:
    """Return the gain of a cell's antenna against its boresight at places.

    Parameters
    ----------
    crs : str
        Of the cell and the places.
    east_m, north_m : ndarray
        The places; they broadcast.
    mobile_height_m : float
        Height of the phone above ground.
    antennas : mapping of str to MeasuredAntenna
        By the name that cells have for them; others are by formula.

    Returns
    -------
    ndarray, shape of the places, or () for an omnidirectional antenna
        In dB, 0 or less.
    """
    if cell.antenna == "omni":
        return np.zeros(())
    right_m, up_m = east_m - cell.east_m, north_m - cell.north_m
    lon_deg, lat_deg = unproject(crs, cell.east_m, cell.north_m)
    convergence = grid_convergence_rad(crs, float(lon_deg), float(lat_deg))
    # Without an azimuth the antenna is round, and any boresight will do.
    heading_rad = heading_from_azimuth_rad(cell.azimuth_deg or 0.0, convergence)
    offset_rad = np.arctan2(up_m, right_m) - heading_rad
    depression_rad = np.arctan2(cell.height_m - mobile_height_m, np.hypot(right_m, up_m))
    own = leaning(offset_rad, depression_rad, np.radians(cell.mechanical_downtilt_deg))
    measured = antennas.get(cell.antenna)
    if measured is not None:
        return measured.gain_db(*own, cell.downtilt_deg or None)
    beamwidth_rad = np.radians(cell.beamwidth_deg)
    vertical_deg = cell.vertical_beamwidth_deg
    if vertical_deg is None and cell.antenna == "3gpp":
        vertical_deg = _VERTICAL_BEAMWIDTH_DEG
    if vertical_deg is None:
        return sector_gain_db(offset_rad, beamwidth_rad, cell.max_attenuation_db)
    tilt_rad, vertical_rad = np.radians(cell.downtilt_deg), np.radians(vertical_deg)
    return combined_gain_db(
        sector_gain_db(own[0], beamwidth_rad, cell.max_attenuation_db),
        vertical_gain_db(own[1], tilt_rad, vertical_rad, cell.side_lobe_db),
        cell.max_attenuation_db,
    )


def pixels_m(lattice: Lattice) -> tuple[Floats, Floats]:
    """Return east of the columns, shape (1, cols), and north of the rows, shape (rows, 1)."""
    column_m, _ = lattice.east_north(0, np.arange(lattice.cols))
    _, row_m = lattice.east_north(np.arange(lattice.rows), 0)
    return column_m[None, :], row_m[:, None]
