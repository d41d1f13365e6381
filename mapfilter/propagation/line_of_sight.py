"""Who sees the antenna: line of sight over a raster of building heights, on flat ground."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.ndimage import label, uniform_filter

from mapfilter._types import Bools, Floats, Floats32
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import (
    Lattice,
    grid_convergence_rad,
    heading_from_azimuth_rad,
    unproject,
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

_STEP_PX = 0.5
_SAME_ROOF_M = 0.5


def line_of_sight(
    heights_m: Floats32,
    lattice: Lattice,
    transmitter: tuple[float, float, float],
    receiver_height_m: float,
) -> Bools:
    """Tell from which pixels an antenna is seen.

    Each ray from the antenna to a pixel's centre is followed in steps of at most half a pixel; it
    is blocked where a building reaches higher than the ray. The roof that the antenna stands on (or
    the building that it hangs in) does not block: pixels of that height count from the antenna
    outwards until the ray first leaves them. A pixel under a roof other than that one sees
    nothing.

    Parameters
    ----------
    heights_m : ndarray of float32, shape (rows, cols)
        Heights of buildings above ground; 0 where there is none.
    lattice : Lattice
        Of the same shape.
    transmitter : (east_m, north_m, height_m)
        Height above ground; it may lie outside the lattice, where nothing blocks.
    receiver_height_m : float
        Above ground.

    Returns
    -------
    ndarray of bool, shape (rows, cols)

    Raises
    ------
    InputError
        The raster has another shape, or heights that are negative or not finite.
    """
    heights = check_heights(heights_m, lattice)
    east_m, north_m, height_m = transmitter
    row = (lattice.north_m - north_m) / lattice.resolution_m - 0.5
    col = (east_m - lattice.west_m) / lattice.resolution_m - 0.5
    result: Bools = _march(heights, row, col, height_m, receiver_height_m, float(heights.max()))
    return result


def own_building(heights_m: Floats32, lattice: Lattice, east_m: float, north_m: float) -> Bools:
    """Return the pixels of the connected buildings that a place lies in; none when it is outdoors.

    Parameters
    ----------
    heights_m : ndarray of float32, shape (rows, cols)
    lattice : Lattice
    east_m, north_m : float

    Returns
    -------
    ndarray of bool, shape (rows, cols)
    """
    row, col = lattice.row_col(east_m, north_m)
    if not lattice.contains(row, col) or heights_m[row, col] <= 0:
        return np.zeros(heights_m.shape, dtype=np.bool_)
    parts, _count = label(heights_m > 0)
    return np.asarray(parts == parts[row, col])


def mean_roof_height(
    heights_m: Floats32, lattice: Lattice, radius_m: float, default_m: float
) -> Floats32:
    """Return the mean height of the roofs within a square of ``radius_m`` around every pixel.

    Parameters
    ----------
    heights_m : ndarray of float32, shape (rows, cols)
        0 where there is no building; such pixels do not count.
    lattice : Lattice
    radius_m : float
        Half the side of the square.
    default_m : float
        The answer where no roof is near.

    Returns
    -------
    ndarray of float32, shape (rows, cols)
    """
    size = 2 * round(radius_m / lattice.resolution_m) + 1
    heights = heights_m.astype(np.float64)
    share = uniform_filter((heights > 0).astype(np.float64), size, mode="constant")
    total = uniform_filter(heights, size, mode="constant")
    # The running sums of the filter leave rounding noise where there is no roof at all.
    roofs = share > 0.5 / size**2
    mean = np.divide(total, share, out=np.full(heights.shape, float(default_m)), where=roofs)
    return np.asarray(mean, dtype=np.float32)


def check_heights(heights_m: Floats32, lattice: Lattice) -> Floats32:
    """Return heights as contiguous float32 after checking shape and values.

    Raises
    ------
    InputError
        The raster has another shape than the lattice, or heights negative or not finite.
    """
    heights = np.ascontiguousarray(heights_m, dtype=np.float32)
    if heights.shape != (lattice.rows, lattice.cols):
        expected = f"{lattice.rows} x {lattice.cols} pixels"
        raise fail(InputError, "building heights", expected, heights.shape)
    if not (np.isfinite(heights).all() and heights.min() >= 0):
        raise fail(
            InputError, "building heights", "finite metres ≥ 0", "NaN, infinity or negative",
            "nodata not replaced by 0",
        )  # fmt: skip
    return heights


@njit(cache=True, nogil=True)
def _march(
    heights: Floats32,
    row: float,
    col: float,
    height_m: float,
    receiver_height_m: float,
    highest_m: float,
) -> Bools:
    rows, cols = heights.shape
    seen = np.ones((rows, cols), dtype=np.bool_)
    own_m = 0.0
    own_row, own_col = int(np.floor(row + 0.5)), int(np.floor(col + 0.5))
    if 0 <= own_row < rows and 0 <= own_col < cols:
        own_m = heights[own_row, own_col]
    for to_row in range(rows):
        for to_col in range(cols):
            down, right = to_row - row, to_col - col
            steps = int(np.ceil(max(abs(down), abs(right)) / _STEP_PX))
            on_own_roof = own_m > 0
            for k in range(steps + 1):
                part = k / steps if steps > 0 else 1.0
                ray_m = height_m + part * (receiver_height_m - height_m)
                if ray_m >= highest_m and not on_own_roof:
                    continue
                at_row = int(np.floor(row + part * down + 0.5))
                at_col = int(np.floor(col + part * right + 0.5))
                if at_row < 0 or at_row >= rows or at_col < 0 or at_col >= cols:
                    on_own_roof = False
                    continue
                roof_m = heights[at_row, at_col]
                if on_own_roof and abs(roof_m - own_m) <= _SAME_ROOF_M:
                    continue
                on_own_roof = False
                if roof_m > ray_m:
                    seen[to_row, to_col] = False
                    break
    return seen


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
