"""The lattice: a regular grid of square pixels in a projected CRS.

Row 0 is the northern edge; a lattice point is a pixel's centre, the lattice's corner is a pixel's
corner, as in GDAL.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan
from numbers import Real
from typing import Any

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import projected_crs, same_crs, short_crs, unproject


@dataclass(frozen=True, slots=True)
class Lattice:
    """A regular grid of square pixels in a projected CRS.

    Parameters
    ----------
    crs : str
        Projected, in metres, in any form that pyproj knows; kept as
        :func:`mapfilter.geodesy.projected_crs` returns it.
    west_m, north_m : float
        Outer corner of pixel (0, 0).
    resolution_m : float
        Side of a pixel.
    rows, cols : int
        Size; row 0 is the northern edge.

    Raises
    ------
    InputError
        The CRS is not projected, a length is no finite number, or the size no whole one.

    Examples
    --------
    >>> lattice = Lattice("EPSG:32629", 500000.0, 4500010.0, 5.0, 2, 3)
    >>> lattice.east_north(0, 0)
    (500002.5, 4500007.5)
    >>> lattice.row_col(500002.5, 4500007.5)
    (0, 0)
    >>> print(lattice)
    2 x 3 pixels of 5 m (0.015 x 0.01 km), EPSG:32629
    """

    crs: str
    west_m: float
    north_m: float
    resolution_m: float
    rows: int
    cols: int

    def __post_init__(self) -> None:
        for name in ("west_m", "north_m", "resolution_m", "rows", "cols"):
            value: Any = getattr(self, name)
            # As `project` returns the coordinates of a place; an array has no hash, and files of a
            # database know no numbers of NumPy.
            if isinstance(value, np.ndarray | np.generic) and value.ndim == 0:
                object.__setattr__(self, name, value.item())
        faults = Faults()
        try:
            object.__setattr__(self, "crs", projected_crs(self.crs, "lattice crs"))
        except InputError as error:
            faults.found.extend(error.faults)
        if not (_is_finite(self.west_m) and _is_finite(self.north_m)):
            faults.add("lattice corner", "finite metres", (self.west_m, self.north_m))
        if not (_is_finite(self.resolution_m) and self.resolution_m > 0):
            faults.add("lattice resolution", "metres > 0", self.resolution_m)
        size = f"{self.rows} x {self.cols}"
        if not (hasattr(self.rows, "__index__") and hasattr(self.cols, "__index__")):
            faults.add("lattice size", "whole numbers of rows and columns", size)
        elif self.rows < 1 or self.cols < 1:
            faults.add("lattice size", "at least one pixel", size)
        faults.raise_if_any(InputError)

    def __str__(self) -> str:
        """Return size, resolution and CRS in a few words."""
        width_km, height_km = (n * self.resolution_m / 1000 for n in (self.cols, self.rows))
        size = f"{self.rows} x {self.cols} pixels of {self.resolution_m:g} m"
        return f"{size} ({width_km:.3g} x {height_km:.3g} km), {short_crs(self.crs)}"

    @classmethod
    def covering(
        cls, crs: str, bounds_m: tuple[float, float, float, float], resolution_m: float
    ) -> Lattice:
        """Return the lattice over west, south, east, north (m), snapped out to the resolution."""
        west, south, east, north = checked_bounds(bounds_m, "lattice")
        if not (_is_finite(resolution_m) and resolution_m > 0):
            got = f"{bounds_m} m at {resolution_m} m"
            raise fail(InputError, "lattice", "finite bounds and a resolution > 0", got)
        first_col, last_col = np.floor(west / resolution_m), np.ceil(east / resolution_m)
        first_row, last_row = np.floor(south / resolution_m), np.ceil(north / resolution_m)
        return cls(
            crs,
            float(first_col * resolution_m),
            float(last_row * resolution_m),
            float(resolution_m),
            int(last_row - first_row),
            int(last_col - first_col),
        )

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """West, south, east, north of the outer edges."""
        return (
            self.west_m,
            self.north_m - self.rows * self.resolution_m,
            self.west_m + self.cols * self.resolution_m,
            self.north_m,
        )

    @property
    def gdal_transform(self) -> tuple[float, float, float, float, float, float]:
        """Six numbers in GDAL's order: west, pixel width, 0, north, 0, -pixel height."""
        return (self.west_m, self.resolution_m, 0.0, self.north_m, 0.0, -self.resolution_m)

    @property
    def middle_deg(self) -> tuple[float, float]:
        """Latitude and longitude of the middle, WGS 84."""
        west, south, east, north = self.bounds_m
        lon_deg, lat_deg = unproject(self.crs, (west + east) / 2, (south + north) / 2)
        return float(lat_deg), float(lon_deg)

    def east_north(self, row: Any, col: Any) -> Any:
        """Return the centres of pixels as (east_m, north_m), scalars or arrays."""
        row, col = (np.asarray(one) if isinstance(one, list | tuple) else one for one in (row, col))
        return (
            self.west_m + (col + 0.5) * self.resolution_m,
            self.north_m - (row + 0.5) * self.resolution_m,
        )

    def row_col(self, east_m: Any, north_m: Any) -> Any:
        """Return the pixels that hold positions as integer (row, col); they may lie outside.

        A position that is not finite lies in row and column -1.
        """
        row = _whole((self.north_m - np.asarray(north_m)) / self.resolution_m)
        col = _whole((np.asarray(east_m) - self.west_m) / self.resolution_m)
        return (int(row), int(col)) if row.ndim == 0 else (row, col)

    def contains(self, row: Any, col: Any) -> Any:
        """Return which pixels lie on the lattice."""
        row, col = (np.asarray(one) if isinstance(one, list | tuple) else one for one in (row, col))
        return (row >= 0) & (row < self.rows) & (col >= 0) & (col < self.cols)

    def window(self, row: int, col: int, rows: int, cols: int) -> Lattice:
        """Return the part of this lattice that starts at (row, col), clipped to it on all sides.

        Examples
        --------
        >>> lattice = Lattice("EPSG:32629", 500000.0, 4500010.0, 5.0, 4, 3)
        >>> part = lattice.window(-1, 1, 3, 9)
        >>> part.rows, part.cols, lattice.row_col(*part.east_north(0, 0))
        (2, 2, (0, 1))
        """
        top, left = max(row, 0), max(col, 0)
        rows, cols = min(row + rows, self.rows) - top, min(col + cols, self.cols) - left
        west = self.west_m + left * self.resolution_m
        north = self.north_m - top * self.resolution_m
        return Lattice(self.crs, west, north, self.resolution_m, rows, cols)

    def tiles(self, size_px: int) -> list[tuple[int, int, int, int]]:
        """Return (row, col, rows, cols) of square tiles that cover the lattice, row by row."""
        return [
            (row, col, min(size_px, self.rows - row), min(size_px, self.cols - col))
            for row in range(0, self.rows, size_px)
            for col in range(0, self.cols, size_px)
        ]

    def aligned_with(self, other: Lattice) -> bool:
        """Return whether both are the same lattice to within a thousandth of a pixel."""
        tolerance_m = 1e-3 * self.resolution_m
        return (
            (self.rows, self.cols) == (other.rows, other.cols)
            and abs(self.resolution_m - other.resolution_m) * max(self.rows, self.cols)
            <= tolerance_m
            and abs(self.west_m - other.west_m) <= tolerance_m
            and abs(self.north_m - other.north_m) <= tolerance_m
            and same_crs(self.crs, other.crs)
        )


def checked_bounds(bounds_m: Any, where: str) -> tuple[float, float, float, float]:
    """Return west, south, east and north as numbers.

    Raises
    ------
    InputError
        They are not four finite numbers.
    """
    try:
        west, south, east, north = (float(one) for one in bounds_m)
    except (TypeError, ValueError):
        west = south = east = north = nan
    if not all(map(isfinite, (west, south, east, north))):
        raise fail(InputError, where, "west, south, east, north in metres", bounds_m)
    return west, south, east, north


def outside_m(east_m: Floats, north_m: Floats, lattice: Lattice) -> Floats:
    """Return how far outside a lattice positions lie; 0 inside."""
    west, south, east, north = lattice.bounds_m
    off_east_m = np.maximum(np.maximum(west - east_m, east_m - east), 0.0)
    off_north_m = np.maximum(np.maximum(south - north_m, north_m - north), 0.0)
    return np.asarray(np.hypot(off_east_m, off_north_m))


def _is_finite(value: Any) -> bool:
    return isinstance(value, Real) and isfinite(value)


def _whole(number: Floats) -> Ints:
    """Return the largest whole numbers below; -1 where there is none."""
    below = np.floor(number)
    known = np.isfinite(below)
    return (below if known.all() else np.where(known, below, -1.0)).astype(np.int64)
