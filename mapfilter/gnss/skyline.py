"""What buildings hide of the sky."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numba import njit
from numpy.typing import ArrayLike, NDArray

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError
from mapfilter.gnss.sky import Directions

_MOST_PAIRS = 2_000_000


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
