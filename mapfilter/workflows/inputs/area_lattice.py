"""The lattice of a configuration's area."""

from __future__ import annotations

import numpy as np

from mapfilter._area_scale import check_scale
from mapfilter.config.inputs import Area
from mapfilter.config.sections import Config
from mapfilter.degrees import check_bbox
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.geodesy import project, projected_crs, utm_crs
from mapfilter.lattice import Lattice
from mapfilter.roads.maps import check_on_map, map_bounds_deg
from mapfilter.roads.raster import raster_lattice

LARGEST_AREA_PX = 400_000_000


def area_lattice(area: Area, *, on_map: bool = True) -> Lattice:
    """Return the lattice over an area; without ``on_map`` the map need not cover it.

    Raises
    ------
    InputError, ConfigError
        There is neither box nor map, the box or the CRS is wrong, the map is missing or of
        another place, or the lattice would be absurdly large.
    """
    if not area.has_extent:
        expected = "bbox, or southwest with size_m, where map is none"
        raise fail(ConfigError, "area", expected, "neither")
    if area.southwest is not None and area.size_m is not None:
        lon, lat = area.southwest
        check_bbox((lon, lat, lon + 1e-6, lat + 1e-6), "area.southwest")
        crs = projected_crs(area.crs, "area.crs") if area.crs else utm_crs(lon, lat)
        # Snapped first, so that the size asked for is the size of the lattice.
        corner = np.concatenate(project(crs, [lon], [lat])) // area.resolution_m * area.resolution_m
        bounds_m = (*corner, *(corner + area.size_m))
        if max(area.size_m) < area.resolution_m:
            expected = f"metres, at least {area.resolution_m:g}"
            raise fail(InputError, "area.size_m", expected, area.size_m, "degrees given for metres")
    else:
        box = area.bbox or map_bounds_deg(area.map)
        check_bbox(box, "area.bbox")
        west, south, east, north = box
        centre = (west + east) / 2, (south + north) / 2
        crs = projected_crs(area.crs, "area.crs") if area.crs else utm_crs(*centre)
        edges = project(crs, [west, east, east, west], [south, south, north, north])
        bounds_m = (*np.min(edges, axis=1), *np.max(edges, axis=1))
    if not np.all(np.isfinite(bounds_m)):
        expected = f"a box that {crs} can show"
        raise fail(InputError, "area", expected, bounds_m, "a CRS of another region")
    faults = Faults()
    width_m, height_m = bounds_m[2] - bounds_m[0], bounds_m[3] - bounds_m[1]
    if max(width_m, height_m) < area.resolution_m:
        expected = f"metres, at most the area's {max(width_m, height_m):.0f}"
        faults.add("area.resolution_m", expected, area.resolution_m, "a resolution in another unit")
    pixels = width_m * height_m / area.resolution_m**2
    if pixels > LARGEST_AREA_PX:
        expected, got = f"at most {LARGEST_AREA_PX:.0e} pixels", f"{pixels:.1e}"
        hint = "a box or a resolution in the wrong unit"
        faults.add("area", expected, f"{got} at {area.resolution_m:g} m", hint)
    faults.raise_if_any(ConfigError)
    if on_map and area.map_is_a_file:
        check_on_map(area.map, crs, bounds_m)
    check_scale(crs, bounds_m, "area.crs")
    return Lattice.covering(crs, bounds_m, area.resolution_m)


def roads_lattice(config: Config) -> Lattice:
    """Return the lattice of a configuration's area; without box and map, that of a road raster.

    Errors are those of :func:`area_lattice` and of the raster.
    """
    area, raster = config.area, config.roads.raster
    if area.has_extent or raster is None:
        return area_lattice(area)
    lattice = raster_lattice(raster, area.resolution_m)
    if lattice.rows * lattice.cols > LARGEST_AREA_PX:
        expected = f"at most {LARGEST_AREA_PX:.0e} pixels"
        got = f"{lattice.rows * lattice.cols:.1e} at {area.resolution_m:g} m"
        raise fail(ConfigError, f"{raster}, area.resolution_m", expected, got, "a large raster")
    return lattice
