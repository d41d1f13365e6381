"""Building footprints and heights of a map, and the height raster made of them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rasterio.features import rasterize
from rasterio.transform import Affine

from mapfilter._constants import FOOT_M
from mapfilter._types import Floats, Floats32
from mapfilter.errors import Faults, InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.defaults import DEFAULT_HEIGHT_M, STOREY_HEIGHT_M
from mapfilter.roads.elements import Query
from mapfilter.roads.maps import read_elements
from mapfilter.roads.ways import Bounds, Buildings, Geometries, polygons_inside

_HIGHEST_M = 1000.0

# A roof on posts stops neither walkers nor waves; the others are no buildings any more.
_NOT_BUILDINGS = frozenset(("no", "roof", "razed", "demolished"))
_UNITS_M = {"cm": 0.01, **dict.fromkeys(("ft", "feet", "foot", "'", "′"), FOOT_M)}
_NUMBER = re.compile(
    rf"\s{{0,9}}([0-9]{{1,9}}(?:[.,][0-9]{{1,30}})?)\s{{0,9}}({'|'.join(_UNITS_M)})?", re.I
)
_BUILDINGS = Query({"building": ()}, ("building", "height", "building:levels", "location"))


def read_buildings(
    path: str | Path,
    crs: str,
    bounds_m: Bounds,
    *,
    default_height_m: float = DEFAULT_HEIGHT_M,
    storey_height_m: float = STOREY_HEIGHT_M,
) -> Buildings:
    """Read the buildings that touch an area; there may be none.

    A height is the map's own, else the number of storeys times ``storey_height_m``, else
    ``default_height_m``; the result counts which was used how often.

    Parameters
    ----------
    path, crs, bounds_m
        As for :func:`mapfilter.roads.osm.read_ways`; footprints are not cut at the area's edge.
    default_height_m, storey_height_m : float
        Heights (m) of buildings without their own.

    Raises
    ------
    InputError
        The map is missing or damaged, or a height is not > 0.
    """
    check_heights(default_height_m, storey_height_m)
    found = read_elements(path, crs, bounds_m, _BUILDINGS)
    kept = ~found["building"].isin(_NOT_BUILDINGS) & (found["location"] != "underground")
    found = found[kept]
    return made_buildings(
        crs,
        found.geometry.to_numpy(),
        bounds_m,
        found["height"].to_numpy(dtype=object),
        found["building:levels"].to_numpy(dtype=object),
        default_height_m=default_height_m,
        storey_height_m=storey_height_m,
    )


def check_heights(default_height_m: float, storey_height_m: float) -> None:
    """Check that the heights of buildings without their own are > 0."""
    faults = Faults()
    heights_m = {"default_height_m": default_height_m, "storey_height_m": storey_height_m}
    faults.check_positive("", "metres", **heights_m)
    faults.raise_if_any(InputError)


def made_buildings(
    crs: str,
    geometry: Geometries,
    bounds_m: Bounds,
    heights: NDArray[np.object_] | None,
    levels: NDArray[np.object_] | None,
    *,
    default_height_m: float,
    storey_height_m: float,
) -> Buildings:
    """Return the polygons that touch an area, uncut, as buildings.

    ``heights`` and ``levels`` are as in maps: texts such as ``12``, ``12.5 m`` or ``40 ft``,
    numbers, or None. The default heights are checked by :func:`check_heights`.
    """
    footprints, origin = polygons_inside(geometry, bounds_m, cut=False)
    by_height = _numbers(heights, len(geometry))[origin]
    by_levels = _numbers(levels, len(geometry))[origin] * storey_height_m
    height = np.where(np.isfinite(by_height), by_height, by_levels)
    known = np.isfinite(height)
    from_height = int(np.isfinite(by_height).sum())
    return Buildings(
        crs,
        footprints,
        np.where(known, height, default_height_m),
        from_height,
        int(known.sum()) - from_height,
        int((~known).sum()),
    )


def rasterise_heights(buildings: Buildings, lattice: Lattice) -> Floats32:
    """Return the roof height above ground at each lattice point, 0 where there is no building.

    Of buildings that overlap the highest counts.

    Returns
    -------
    numpy.ndarray of float32, shape (lattice.rows, lattice.cols)
        Heights in metres; row 0 is in the north.

    Examples
    --------
    >>> import shapely
    >>> house = np.array([shapely.box(0, 0, 10, 5)])
    >>> buildings = Buildings("EPSG:32629", house, np.array([9.0]), 1, 0, 0)
    >>> rasterise_heights(buildings, Lattice("EPSG:32629", 0.0, 10.0, 5.0, 2, 3)).tolist()
    [[0.0, 0.0, 0.0], [9.0, 9.0, 0.0]]
    """
    order = np.argsort(buildings.height_m, kind="stable")
    shapes = zip(buildings.footprints[order], buildings.height_m[order], strict=True)
    return burn(shapes, lattice, "float32")


def burn(shapes: Iterable[tuple[Any, float]], lattice: Lattice, dtype: str) -> NDArray[Any]:
    """Return a raster of ``(polygon, value)`` pairs; the last pair wins, 0 where there is none.

    A pixel is in a polygon when its centre is.
    """
    size = (lattice.rows, lattice.cols)
    pairs = list(shapes)
    if not pairs:
        return np.zeros(size, dtype=dtype)
    transform = Affine.from_gdal(*lattice.gdal_transform)
    raster: NDArray[Any] = rasterize(pairs, size, fill=0, transform=transform, dtype=dtype)
    return raster


def _numbers(text: NDArray[np.object_] | None, count: int) -> Floats:
    values = np.full(count, np.nan)
    for i, entry in enumerate(text if text is not None else ()):
        number = np.nan
        if isinstance(entry, int | float | np.number):
            number = float(entry)
        elif entry is not None and (match := _NUMBER.match(str(entry))):
            number = float(match[1].replace(",", "."))
            number *= _UNITS_M.get((match[2] or "").lower(), 1.0)
        if 0 < number < _HIGHEST_M:
            values[i] = number
    return values
