"""The sky over a place: local east, north and up, elevation and azimuth.

Local coordinates have their origin on or over the ellipsoid WGS 84; up is its normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from pyproj import Transformer

from mapfilter._types import Bools, Floats
from mapfilter.errors import Faults, InputError, fail


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


def lonlat_from_ecef(ecef_m: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Return longitude and latitude in degrees and height over the ellipsoid in metres.

    Examples
    --------
    >>> [round(v.item(), 6) for v in lonlat_from_ecef(ecef_from_lonlat(4.86, 43.52, 20.0))]
    [4.86, 43.52, 20.0]
    """
    given = np.asarray(ecef_m, dtype=np.float64)
    x, y, z = (np.array(given[..., axis]) for axis in range(3))
    lon, lat, height = _geocentric().transform(x, y, z, direction="INVERSE")
    return np.asarray(lon), np.asarray(lat), np.asarray(height)


@dataclass(frozen=True)
class LocalFrame:
    """East, north and up at a place.

    Parameters
    ----------
    lon_deg, lat_deg : float
    height_m : float
        Over the ellipsoid.

    Examples
    --------
    >>> frame = LocalFrame(4.86, 43.52, 20.0)
    >>> frame.to_local(frame.to_ecef([100.0, -20.0, 3.0])).round(6).tolist()
    [100.0, -20.0, 3.0]
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
        return np.array([
            [-np.sin(lon), np.cos(lon), 0.0],
            [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)],
            [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)],
        ])  # fmt: skip

    def to_local(self, ecef_m: ArrayLike) -> Floats:
        """Turn earth-centred coordinates (..., 3) into east, north and up."""
        return np.asarray((np.asarray(ecef_m, dtype=np.float64) - self.origin_m) @ self.axes.T)

    def to_ecef(self, local_m: ArrayLike) -> Floats:
        """Turn east, north and up (..., 3) into earth-centred coordinates."""
        return np.asarray(np.asarray(local_m, dtype=np.float64) @ self.axes + self.origin_m)


@dataclass(frozen=True, eq=False)
class Directions:
    """Where satellites are seen from a place; both arrays have the same shape.

    Parameters
    ----------
    elevation_rad : array
        Above the horizon.
    azimuth_rad : array
        Clockwise from north, in [0, 2π).
    """

    elevation_rad: Floats
    azimuth_rad: Floats

    def above(self, mask_deg: float) -> Bools:
        """Tell which are higher than a mask; satellites below the horizon never are.

        Raises
        ------
        InputError
            The mask is not within 0..90 degrees.
        """
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
