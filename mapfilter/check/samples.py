"""Samples of rasters: what the checks of values and of sites look at."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.angles import azimuth_from_heading_deg
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.rasters.resampling import read_on
from mapfilter.rasters.undeclared import nodata_taken_as_level

MOST_PX = 1 << 22
"""Larger rasters are looked at in a square of so many pixels about the site."""
_SAMPLED_SIDE_PX = 600
MANY_PX = 1 << 16
"""As many pixels tell statistics of a raster as well as all of them."""


@dataclass(frozen=True, slots=True, eq=False)
class RasterSample:
    """Sample of one cell's raster, in equal steps over the raster or about the site.

    Parameters
    ----------
    lattice : Lattice
        Where the sampled pixels lie; its pixels are the sampled ones grown to the step.
    values : ndarray of float32, shape (rows, cols) of the lattice
        As stored, times the declared factor; NaN without data.
    checksum : str
        Of all pixels looked at, before sampling.
    nodata : (float, float) or None
        A number that means no data though the file does not state it, and its share of all pixels
        looked at (:func:`~mapfilter.rasters.undeclared.nodata_taken_as_level`).
    """

    cell_id: str
    lattice: Lattice
    values: Floats32
    checksum: str
    nodata: tuple[float, float] | None = None

    @property
    def known(self) -> Floats32:
        """The values that are not NaN."""
        return self.values[~np.isnan(self.values)]

    def positions_m(self) -> tuple[Floats, Floats]:
        """Return east and north of every sampled pixel, shape (rows, cols) each."""
        rows, cols = np.mgrid[: self.lattice.rows, : self.lattice.cols]
        east_m, north_m = self.lattice.east_north(rows, cols)
        return east_m, north_m

    def seen_from(self, east_m: float, north_m: float) -> tuple[Floats, Floats]:
        """Return distance (m) and azimuth (degrees from true north) of every sampled pixel."""
        rows, cols = np.ogrid[: self.lattice.rows, : self.lattice.cols]
        east, north = self.lattice.east_north(rows, cols)
        lon, lat = unproject(self.lattice.crs, east_m, north_m)
        convergence_rad = grid_convergence_rad(self.lattice.crs, float(lon), float(lat))
        heading_rad = np.arctan2(north - north_m, east - east_m)
        distance_m = np.hypot(east - east_m, north - north_m)
        return distance_m, azimuth_from_heading_deg(heading_rad, convergence_rad)


def sample_raster(rasters: RxLevRasters, cell_id: str, cell: Cell | None) -> RasterSample:
    """Read a sample of one cell's raster, of a large one about its site or else its middle.

    Numbers are those of the nearest pixels, whatever resampling the rasters have.
    """
    file = next(file for file in rasters.files if cell_id in file.cell_ids)
    band = file.cell_ids.index(cell_id)
    window = _window(rasters.lattice, cell)
    values = read_on(file, [band], rasters.lattice, window, "nearest")[0]
    checksum = hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()
    values = values * np.float32(rasters.factor)
    nodata = nodata_taken_as_level(values, rasters.factor)
    step = max(1, -(-max(values.shape) // _SAMPLED_SIDE_PX))
    first = step // 2
    values = values[first::step, first::step] if min(values.shape) > first else values
    part = rasters.lattice.window(*window)
    side_m = part.resolution_m
    # Sampled pixels keep their centres.
    shift_m = (first + 0.5 - step / 2) * side_m
    lattice = Lattice(
        part.crs, part.west_m + shift_m, part.north_m - shift_m, side_m * step, *values.shape
    )
    return RasterSample(cell_id, lattice, values, checksum, nodata)


def thinned(sample: RasterSample) -> RasterSample:
    """Return every second, third... pixel each way of a sample of many."""
    step = math.ceil(math.sqrt(max(sample.values.size, 1) / MANY_PX))
    values, grid = sample.values[::step, ::step], sample.lattice
    side_m = grid.resolution_m
    shift_m = (0.5 - step / 2) * side_m
    west_m, north_m = grid.west_m + shift_m, grid.north_m - shift_m
    lattice = Lattice(grid.crs, west_m, north_m, side_m * step, *values.shape)
    return replace(sample, values=values, lattice=lattice)


def _window(lattice: Lattice, cell: Cell | None) -> tuple[int, int, int, int]:
    """Return the whole lattice, or a square about a cell where it is too large."""
    rows, cols = lattice.rows, lattice.cols
    if rows * cols <= MOST_PX:
        return 0, 0, rows, cols
    side = int(np.sqrt(MOST_PX))
    row, col = rows // 2, cols // 2
    if cell is not None:
        there = lattice.row_col(cell.east_m, cell.north_m)
        row, col = there if lattice.contains(*there) else (row, col)
    high, wide = min(side, rows), min(side, cols)
    top = int(np.clip(row - high // 2, 0, rows - high))
    left = int(np.clip(col - wide // 2, 0, cols - wide))
    return top, left, high, wide
