"""The sky over a place: local frames, elevation and azimuth.

Local coordinates have their origin on or over the ellipsoid WGS 84; up is its normal. A map's grid
is neither true to scale nor aligned with the north: metres on it are up to 0.1 % too long or short,
and grid north is off by up to a few degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from pyproj import Transformer

from mapfilter._types import Bools, Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import unproject

_ARM_M = 100.0


@lru_cache(maxsize=1)
def _geocentric() -> Transformer:
    return Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)


def ecef_from_lonlat(lon_deg: ArrayLike, lat_deg: ArrayLike, height_m: ArrayLike = 0.0) -> Floats:
    """Return earth-centred coordinates (WGS 84), shape (..., 3), of heights over the ellipsoid.

    Examples
    --------
    >>> ecef_from_lonlat(4.86, 43.52, 20.0).round(3).tolist()
    [4615722.141, 392461.103, 4369587.091]
    """
    lon, lat, height = np.broadcast_arrays(lon_deg, lat_deg, height_m)
    x, y, z = _geocentric().transform(np.array(lon), np.array(lat), np.array(height))
    return np.stack([x, y, z], axis=-1).astype(np.float64)


@dataclass(frozen=True)
class LocalFrame:
    """East, north and up at a place, at a height over the ellipsoid.

    Examples
    --------
    >>> above = ecef_from_lonlat(4.86, 43.52, 23.0)
    >>> LocalFrame(4.86, 43.52, 20.0).to_local(above)[2].round(6).item()
    3.0
    """

    lon_deg: float
    lat_deg: float
    height_m: float = 0.0

    def __post_init__(self) -> None:
        faults = Faults()
        if not abs(self.lon_deg) <= 180:
            faults.add("local frame, lon_deg", "degrees in -180..180", self.lon_deg)
        if not abs(self.lat_deg) <= 90:
            hint = "longitude and latitude swapped" if abs(self.lat_deg) <= 180 else ""
            faults.add("local frame, lat_deg", "degrees in -90..90", self.lat_deg, hint)
        if not np.isfinite(self.height_m):
            faults.add("local frame, height_m", "finite metres", self.height_m)
        faults.raise_if_any(InputError)

    @cached_property
    def origin_m(self) -> Floats:
        """Earth-centred coordinates of the origin."""
        return ecef_from_lonlat(self.lon_deg, self.lat_deg, self.height_m)

    @cached_property
    def axes(self) -> Floats:
        """Directions east, north and up as rows, in the earth-centred frame."""
        lon, lat = np.radians(self.lon_deg), np.radians(self.lat_deg)
        east = [-np.sin(lon), np.cos(lon), 0.0]
        north = [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)]
        up = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
        return np.array([east, north, up])

    def to_local(self, ecef_m: ArrayLike) -> Floats:
        """Turn earth-centred coordinates (..., 3) into east, north and up."""
        return np.asarray((np.asarray(ecef_m, dtype=np.float64) - self.origin_m) @ self.axes.T)


@dataclass(frozen=True, eq=False)
class Directions:
    """Elevation above the horizon, and azimuth clockwise from north, in [0, 2π), of satellites."""

    elevation_rad: Floats
    azimuth_rad: Floats

    def above(self, mask_deg: float) -> Bools:
        """Return which are higher than a mask of 0..90 degrees."""
        if not 0 <= mask_deg < 90:
            raise fail(InputError, "mask_deg", "degrees in 0..90", mask_deg)
        return np.asarray(self.elevation_rad > np.radians(mask_deg))


def directions(satellites_m: ArrayLike, receiver_m: ArrayLike = (0.0, 0.0, 0.0)) -> Directions:
    """Return elevation and azimuth of satellites.

    Parameters
    ----------
    satellites_m : (..., 3) array_like
        East, north and up.
    receiver_m : (3,) or broadcastable array_like
        In the same frame, near its origin: up is not turned.

    Examples
    --------
    >>> seen = directions([[0.0, 2e7, 2e7], [-1e7, 0.0, -1e6]])
    >>> np.degrees(seen.elevation_rad).round(2).tolist()
    [45.0, -5.71]
    >>> np.degrees(seen.azimuth_rad).tolist(), seen.above(10.0).tolist()
    ([0.0, 270.0], [True, False])
    """
    away = np.asarray(satellites_m, dtype=np.float64) - np.asarray(receiver_m, dtype=np.float64)
    flat = np.hypot(away[..., 0], away[..., 1])
    azimuth = np.mod(np.arctan2(away[..., 0], away[..., 1]), 2 * np.pi)
    return Directions(np.arctan2(away[..., 2], flat), np.where(azimuth >= 2 * np.pi, 0.0, azimuth))


@dataclass(frozen=True)
class GridFrame:
    """The surroundings of a place of a projected CRS, at a height over the ellipsoid.

    Good for some kilometres: after 5 km the ellipsoid has fallen away by 2 m.

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
