"""A projected grid about a place, and the true east, north and up of satellites there.

A map's grid is neither true to scale nor turned to the north: metres on it are up to 0.1 % too long
or short, and grid north is off by up to a few degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.geodesy import unproject
from mapfilter.gnss.sky import LocalFrame, ecef_from_lonlat

_ARM_M = 100.0


@dataclass(frozen=True)
class GridFrame:
    """The surroundings of a place of a projected CRS.

    Good for some kilometres: after 5 km the ellipsoid has fallen away by 2 m.

    Parameters
    ----------
    crs : str
    east_m, north_m : float
        Of the place.
    height_m : float
        Of its origin over the ellipsoid.

    Examples
    --------
    >>> frame = GridFrame("EPSG:32635", 386000.0, 6672000.0)
    >>> frame.true_from_grid.round(5).tolist()
    [[0.99976, -0.03111], [0.03111, 0.99976]]
    """

    crs: str
    east_m: float
    north_m: float
    height_m: float = 0.0

    @cached_property
    def _lonlat(self) -> tuple[Floats, Floats]:
        east = self.east_m + _ARM_M * np.array([0.0, 1.0, 0.0])
        north = self.north_m + _ARM_M * np.array([0.0, 0.0, 1.0])
        return unproject(self.crs, east, north)

    @cached_property
    def local(self) -> LocalFrame:
        """True east, north and up at the place."""
        lon, lat = self._lonlat
        return LocalFrame(float(lon[0]), float(lat[0]), self.height_m)

    @cached_property
    def true_from_grid(self) -> Floats:
        """Displacements on the grid to true ones, east and north, shape (2, 2)."""
        lon, lat = self._lonlat
        there = self.local.to_local(ecef_from_lonlat(lon, lat, self.height_m))
        return np.asarray((there[1:, :2] - there[0, :2]).T / _ARM_M)

    def satellites_m(self, ecef_m: ArrayLike) -> Floats:
        """Return true east, north and up of earth-centred places, shape (..., 3)."""
        return self.local.to_local(ecef_m)
