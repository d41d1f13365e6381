"""The sky over a place: local frames, elevation and azimuth, and what buildings hide.

Local coordinates have their origin on or over the ellipsoid WGS 84; up is its normal. A map's grid
is neither true to scale nor aligned with the north: metres on it are up to 0.1 % too long or short,
and grid north is off by up to a few degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely
from numba import njit
from numpy.typing import ArrayLike, NDArray
from pyproj import Transformer

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import unproject

_ARM_M = 100.0
_MOST_PAIRS = 2_000_000


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


class Skyline:
    """Buildings as prisms with flat roofs, in east and north metres.

    Parameters
    ----------
    footprints : sequence of shapely geometries
        Polygons or multipolygons; courtyards are open to the sky.
    heights_m : (B,) array_like
        Of the roofs, above the ground that positions are counted from.

    Raises
    ------
    InputError
        There are not as many heights as footprints, or heights are not finite or below 0.

    Examples
    --------
    >>> wall = Skyline([shapely.box(10.0, -50.0, 20.0, 50.0)], [20.0])
    >>> low, high = np.radians(60.0), np.radians(65.0)
    >>> wall.seen([[0.0, 0.0, 0.0]], Directions(np.array([low, high]), np.radians([90.0, 90.0])))
    array([[False,  True]])
    """

    def __init__(self, footprints: Sequence[shapely.Geometry], heights_m: ArrayLike) -> None:
        heights = np.asarray(heights_m, dtype=np.float64)
        shapes = np.array(footprints, dtype=object)
        faults = Faults()
        if heights.shape != (len(shapes),):
            faults.add("skyline, heights_m", f"shape ({len(shapes)},)", heights.shape)
        elif not (np.isfinite(heights) & (heights >= 0)).all():
            faults.add("skyline, heights_m", "finite metres >= 0", "NaN, infinity or negative")
        faults.raise_if_any(InputError)
        self._shapes, self._heights = shapes, heights
        self._tree = shapely.STRtree(shapes)
        self._walls, self._first = _walls(shapes)
        self._boxes = shapely.bounds(shapes).reshape(-1, 4)

    def seen(self, places_m: ArrayLike, toward: Directions) -> Bools:
        """Return which directions are open to the sky.

        Parameters
        ----------
        places_m : (K, 3) array_like
            East, north and height of the receiver.
        toward : Directions
            Of shape (S,), or (K, S) for each place its own.

        Returns
        -------
        (K, S) array of bool
            Nothing is seen below the horizon, nor from within a building.
        """
        places = np.atleast_2d(np.asarray(places_m, dtype=np.float64))
        shape = (len(places), np.shape(toward.elevation_rad)[-1])
        elevation = np.ascontiguousarray(np.broadcast_to(toward.elevation_rad, shape))
        azimuth = np.ascontiguousarray(np.broadcast_to(toward.azimuth_rad, shape))
        open_sky = elevation > 0
        if not self._shapes.size or not open_sky.any():
            return open_sky
        lowest = np.where(open_sky, elevation, np.pi / 2).min(axis=1)
        place, near, away_m = self._near(places, np.tan(lowest))
        begin = np.searchsorted(place, np.arange(len(places) + 1))
        pairs = begin.astype(np.int64), near.astype(np.int64), away_m
        buildings = self._walls, self._first, self._heights
        _block(places, elevation, azimuth, pairs, buildings, open_sky)
        points = shapely.points(places[:, 0], places[:, 1])
        inside, own = self._tree.query(points, predicate="within")
        under = inside[self._heights[own] > places[inside, 2]]
        open_sky[under] = False
        return open_sky

    def _near(self, places: Floats, rise: Floats) -> tuple[Ints, Ints, Floats]:
        """Return pairs of places and buildings that may hide something, and how far they are."""
        west, south, east, north = self._boxes.T
        found = []
        some = max(_MOST_PAIRS // len(west), 1)
        for first in range(0, len(places), some):
            x, y, up = (places[first : first + some, axis, None] for axis in range(3))
            aside = np.maximum(np.maximum(west - x, x - east), 0.0)
            along = np.maximum(np.maximum(south - y, y - north), 0.0)
            away_m = np.hypot(aside, along)
            matters = away_m * rise[first : first + some, None] < self._heights - up
            place, near = np.nonzero(matters)
            found.append((place + first, near, away_m[place, near]))
        place, near, far = (np.concatenate(column) for column in zip(*found, strict=True))
        return place, near, far


def _walls(shapes: NDArray[np.object_]) -> tuple[Floats, Ints]:
    """Return all walls as (e, n, e, n), building by building, and where each begins."""
    parts, part_owner = shapely.get_parts(shapes, return_index=True)
    rings, owner = shapely.get_rings(np.asarray(parts), return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    joins = ring[1:] == ring[:-1]
    walls = np.hstack([points[:-1][joins], points[1:][joins]])
    building = part_owner[owner[ring[:-1][joins]]] if len(points) else np.zeros(0, dtype=np.int64)
    order = np.argsort(building, kind="stable")
    first = np.searchsorted(building[order], np.arange(len(shapes) + 1))
    return np.ascontiguousarray(walls[order]), first.astype(np.int64)


@njit(cache=True, nogil=True, error_model="numpy")
def _block(
    places: Floats,
    elevation: Floats,
    azimuth: Floats,
    pairs: tuple[Ints, Ints, Floats],
    buildings: tuple[Floats, Ints, Floats],
    open_sky: Bools,
) -> None:  # pragma: no cover
    """Close directions whose ray meets a wall lower than the building's roof."""
    begin, near, away_m = pairs
    walls, first, heights = buildings
    for k in range(places.shape[0]):
        east, north, up = places[k, 0], places[k, 1], places[k, 2]
        for s in range(elevation.shape[1]):
            if not open_sky[k, s]:
                continue
            ahead_e, ahead_n = np.sin(azimuth[k, s]), np.cos(azimuth[k, s])
            rise = np.tan(elevation[k, s])
            closed = False
            for i in range(begin[k], begin[k + 1]):
                building = near[i]
                over = heights[building] - up
                if away_m[i] * rise >= over:
                    continue
                for w in range(first[building], first[building + 1]):
                    a_e, a_n = walls[w, 0] - east, walls[w, 1] - north
                    d_e, d_n = walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
                    cross = ahead_e * d_n - ahead_n * d_e
                    if cross == 0.0:
                        continue
                    away = (a_e * d_n - a_n * d_e) / cross
                    along = (a_e * ahead_n - a_n * ahead_e) / cross
                    if away > 0.0 and 0.0 <= along <= 1.0 and away * rise < over:
                        closed = True
                        break
                if closed:
                    break
            open_sky[k, s] = not closed
