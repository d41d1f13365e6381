"""Whether cells, rasters and maps are where the area is, and how much of it they cover."""

from __future__ import annotations

import numpy as np
import shapely

from mapfilter._types import Floats
from mapfilter.config.sections import Area
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice, unproject
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.maps import map_bounds_deg
from mapfilter.workflows.world import World, area_lattice

FARTHEST_M = 50_000.0
"""No cell is heard from farther away."""

_ENOUGH = 0.95
_ABOUT_WAYS_M = 100.0
_SAMPLES = 64
_NAMED = 3


def check_cells_near(plan: CellPlan, lattice: Lattice, where: str) -> None:
    """See that no cell lies more than 50 km outside an area.

    Parameters
    ----------
    plan : CellPlan
        In the CRS of the lattice.
    lattice : Lattice
    where : str
        What messages call the plan.

    Raises
    ------
    InputError
        Some do; one fault for all of them.
    """
    east_m = np.array([cell.east_m for cell in plan.cells])
    north_m = np.array([cell.north_m for cell in plan.cells])
    away_m = outside_m(east_m, north_m, lattice)
    far = np.flatnonzero(away_m > FARTHEST_M)
    if not far.size:
        return
    named = ", ".join(plan.ids[index] for index in far[:_NAMED])
    more = f" and {far.size - _NAMED} more" if far.size > _NAMED else ""
    got = f"{far.size} of {len(plan)} up to {away_m.max() / 1000:.0f} km off ({named}{more})"
    swapped = outside_m(north_m[far], east_m[far], lattice).min() <= FARTHEST_M
    hint = "east and north swapped" if swapped else "a CRS of another zone, or swapped coordinates"
    expected = f"cells within {FARTHEST_M / 1000:.0f} km of the area"
    raise fail(InputError, where, expected, got, hint)


def outside_m(east_m: Floats, north_m: Floats, lattice: Lattice) -> Floats:
    """Return how far outside a lattice positions lie; 0 inside."""
    west, south, east, north = lattice.bounds_m
    off_east_m = np.maximum(np.maximum(west - east_m, east_m - east), 0.0)
    off_north_m = np.maximum(np.maximum(south - north_m, north_m - north), 0.0)
    return np.asarray(np.hypot(off_east_m, off_north_m))


def map_cover(world: World) -> tuple[str, ...]:
    """Return a note when the ways of a map extend over but a part of the area that is asked for.

    What a map's header says is only taken as a reason to look: maps often hold more, as whole ways
    are kept. The share is that of the ways' convex hull, 100 m about it included.
    """
    config, lattice = world.config, world.lattice
    area, roads = config.area, config.roads
    replaced = roads.layer is not None or roads.tracks.files
    if not _has_box(area) or not area.map_is_a_file or replaced:
        return ()
    if _told_share(area, lattice) >= _ENOUGH:
        return ()
    box = shapely.box(*lattice.bounds_m)
    try:
        hull = shapely.convex_hull(shapely.geometrycollections(world.ways.geometry))
    except InputError:
        return _note(f"the map {area.map}", 0.0)
    near = shapely.intersection(shapely.buffer(hull, _ABOUT_WAYS_M), box)
    return _note(f"the map {area.map}", float(near.area / box.area))


def _told_share(area: Area, lattice: Lattice) -> float:
    along = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    rows, cols = np.meshgrid(along * lattice.rows - 0.5, along * lattice.cols - 0.5, indexing="ij")
    lon, lat = unproject(lattice.crs, *lattice.east_north(rows.ravel(), cols.ravel()))
    west, south, east, north = map_bounds_deg(area.map)
    inside = (lon >= west) & (lon <= east) & (lat >= south) & (lat <= north)
    return float(inside.mean())


def raster_cover(area: Area, lattice: Lattice) -> tuple[str, ...]:
    """Return a note when rasters, cut to ``lattice``, cover but a part of the area asked for."""
    if not _has_box(area):
        return ()
    wanted = area_lattice(area.model_copy(update={"crs": lattice.crs}))
    covered_m2 = lattice.rows * lattice.cols * lattice.resolution_m**2
    wanted_m2 = wanted.rows * wanted.cols * wanted.resolution_m**2
    return _note("the set of rasters", covered_m2 / wanted_m2)


def _has_box(area: Area) -> bool:
    return area.bbox is not None or area.southwest is not None


def _note(what: str, share: float) -> tuple[str, ...]:
    return () if share >= _ENOUGH else (f"{what} covers {share:.0%} of the area",)
