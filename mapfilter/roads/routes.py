"""Read roads from maps, vector layers and land use, and make the route lattice of an area."""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import shapely
from geopandas import GeoDataFrame

from mapfilter._annotations import Words
from mapfilter._arguments import PATH, Argument, Entries, Setting, check_arguments
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.index import HALF_WIDTH_M
from mapfilter.roads.landuse import read_landuse
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.layers import read_layer_buildings, read_layer_roads, read_layer_water
from mapfilter.roads.maps import OSM_ATTRIBUTION, is_map
from mapfilter.roads.osm import Profile, read_squares, read_water, read_ways
from mapfilter.roads.route_points import route_lattice, route_lattice_from_landuse
from mapfilter.roads.vector import Layer
from mapfilter.roads.ways import Bounds, Buildings, Squares, Water, Ways, clip_ways

_LANDUSE = Annotated[tuple[Path, Path] | None, Words("two paths: of a raster and of its table")]
ROADS_EXPECTED = "the path or name of a map, a GeoDataFrame, or ways"
_CUT_OUT = "a layer, or true or false"


def read_routes(
    roads: Layer | Ways | None,
    lattice: Lattice,
    *,
    profile: Profile = "walking",
    half_width_m: float = HALF_WIDTH_M,
    half_width_by_class_m: Mapping[str, float] | None = None,
    squares: bool = True,
    buildings: Layer | Buildings | bool = True,
    water: Layer | Water | bool = True,
    landuse: tuple[Path | str, Path | str] | None = None,
    layer_name: str | None = None,
    class_column: str | None = None,
    id_column: str | None = None,
) -> RouteLattice:
    """Read roads and return the accessible lattice points.

    Parameters
    ----------
    roads : path, GeoDataFrame, Ways or None
        OpenStreetMap file (``.osm.pbf``, ``.osm``, ``.osm.gz``) or embedded map ("helsinki");
        vector file of lines and polygons in any CRS, or such a table; or ways, for instance from
        :func:`mapfilter.roads.corridors.corridors`. None only together with ``landuse``. Of a map
        the points keep the attribution; of ways read from one, :func:`mapfilter.build` is given it.
    lattice : Lattice
        Area and resolution; normally ``rasters.lattice``.
    profile : {"walking", "driving"}
        Which ways of an OpenStreetMap file are used, see :mod:`mapfilter.roads.osm`.
    half_width_m : float
        Half the width of a way (m, > 0): points at most this far from its centre line belong to it.
    half_width_by_class_m : mapping of str to float, optional
        The same for some classes of way, such as ``{"residential": 8.0}``; 0 leaves a class out.
    squares : bool
        Include squares and pedestrian areas (of a layer: its polygons).
    buildings : path, GeoDataFrame, Buildings or bool
        Footprints to cut out. True takes those of an OpenStreetMap file, and none otherwise.
    water : path, GeoDataFrame, Water or bool
        Water to cut out except under bridges. True takes that of an OpenStreetMap file.
    landuse : (raster, table), optional
        Classified raster and its CSV table, see :func:`mapfilter.roads.landuse.read_landuse`. The
        walkable classes alone decide which points there are; roads then only name the ways.
    layer_name, class_column, id_column : str, optional
        Layer of a vector file, and its columns with the class and the number of each way.

    Raises
    ------
    InputError
        A file is missing, damaged or of another area, a half width is not a length, or no point is
        left.
    ConfigError
        An argument is of another type, or the profile is none.

    Examples
    --------
    >>> lattice = Lattice.covering("EPSG:32635", (385500.0, 6671500.0, 385700.0, 6671700.0), 10.0)
    >>> routes = read_routes("helsinki", lattice, half_width_m=8.0)
    >>> len(routes), routes.mask().shape
    (166, (20, 20))
    """
    check_arguments(
        "read_routes",
        Argument("roads", roads, Layer | PATH | Ways | None, ROADS_EXPECTED),
        Argument("lattice", lattice, Lattice, "a lattice such as rasters.lattice"),
        keywords=[
            Setting("profile", profile, Profile),
            Argument("half_width_m", half_width_m, Real, "metres"),
            Entries(
                "half_width_by_class_m",
                half_width_by_class_m,
                Real,
                "metres",
                "metres of each class of way",
            ),
            Setting("squares", squares, bool),
            Argument("buildings", buildings, Layer | PATH | Buildings | bool, _CUT_OUT),
            Argument("water", water, Layer | PATH | Water | bool, _CUT_OUT),
            Setting("landuse", landuse, _LANDUSE),
            Setting("layer_name", layer_name, str | None),
            Setting("class_column", class_column, str | None),
            Setting("id_column", id_column, str | None),
        ],
    )
    if roads is None and landuse is None:
        raise fail(InputError, "roads", "a map, a layer or ways; or landuse", "none")
    found = Roads(Ways.none(lattice.crs))
    roads = Path(roads) if isinstance(roads, os.PathLike) else roads
    if isinstance(roads, Ways):
        found = Roads(roads)
    elif roads is not None:
        found = read_roads(
            roads,
            lattice,
            profile=profile,
            half_width_m=half_width_m,
            half_width_by_class_m=half_width_by_class_m,
            squares=squares,
            layer_name=layer_name,
            class_column=class_column,
            id_column=id_column,
        )
    map_file = roads if isinstance(roads, Path | str) and is_map(roads) else None
    attribution = "" if map_file is None else OSM_ATTRIBUTION
    notes = *found.notes, *unused_classes(found.ways, half_width_by_class_m or {})
    if landuse is not None:
        used = read_landuse(*landuse, lattice)
        classified = route_lattice_from_landuse(
            used.walkable,
            lattice,
            clip_ways(found.ways, lattice.bounds_m),
            half_width_m,
            half_width_by_class_m=half_width_by_class_m,
        )
        return replace(classified, attribution=attribution, notes=(*notes, *used.notes))
    here = lattice.crs, lattice.bounds_m
    if isinstance(buildings, bool | np.bool_):
        buildings = read_buildings(map_file, *here) if buildings and map_file else None
    elif not isinstance(buildings, Buildings):
        buildings = read_layer_buildings(buildings, *here)
    if isinstance(water, bool | np.bool_):
        water = read_water(map_file, *here) if water and map_file else None
    elif not isinstance(water, Water):
        water = read_layer_water(water, *here)
    laid = route_lattice(
        found.ways,
        found.squares,
        buildings,
        lattice,
        half_width_m,
        half_width_by_class_m=half_width_by_class_m,
        water=water,
    )
    return replace(laid, attribution=attribution, notes=notes)


class Roads(NamedTuple):
    """Ways and squares in and just outside an area, and what was left out."""

    ways: Ways
    squares: Squares | None = None
    notes: tuple[str, ...] = ()


def read_roads(
    source: Layer,
    lattice: Lattice,
    *,
    profile: Profile = "walking",
    half_width_m: float = HALF_WIDTH_M,
    half_width_by_class_m: Mapping[str, float] | None = None,
    squares: bool = True,
    layer_name: str | None = None,
    class_column: str | None = None,
    id_column: str | None = None,
) -> Roads:
    """Read the ways and squares of a map or a vector layer; the parameters of :func:`read_routes`.

    Ways outside the area are kept as far as they reach points inside by their half width.

    Raises
    ------
    InputError
        The file is missing or damaged, or has nothing in the area.
    ConfigError
        The profile is none.
    """
    check_arguments("read_roads", keywords=[Setting("profile", profile, Profile)])
    source = Path(source) if isinstance(source, os.PathLike) else source
    by_class_m = half_width_by_class_m or {}
    crs, wide_m = lattice.crs, within_reach_m(lattice.bounds_m, half_width_m, by_class_m)
    if isinstance(source, GeoDataFrame) or layer_name is not None or not is_map(source):
        layer = read_layer_roads(
            source,
            crs,
            wide_m,
            layer_name=layer_name,
            class_column=class_column,
            id_column=id_column,
        )
        if profile == "driving":
            layer = layer.driven([name for name, width_m in by_class_m.items() if width_m > 0])
        left_out = [name for name, width_m in by_class_m.items() if width_m == 0]
        return Roads(layer.ways, layer.areas_without(left_out) if squares else None, layer.notes)
    areas = None
    if squares and profile == "walking":
        areas = read_squares(source, crs, lattice.bounds_m)
    return Roads(read_ways(source, profile, crs, wide_m), areas)


def within_reach_m(
    bounds_m: Bounds, half_width_m: float, by_class_m: Mapping[str, float]
) -> Bounds:
    """Return a box widened by the largest half width."""
    west, south, east, north = bounds_m
    pad_m = max(half_width_m, *by_class_m.values(), 0.0)
    return west - pad_m, south - pad_m, east + pad_m, north + pad_m


def unused_classes(ways: Ways, by_class_m: Mapping[str, float]) -> list[str]:
    """Return a note for each half width of a class that no way has."""
    notes = []
    for name in by_class_m:
        if name not in ways.class_names:
            close = difflib.get_close_matches(name, ways.class_names, n=1)
            tail = f"; did you mean {close[0]!r}?" if close else ""
            notes.append(f"half_width_by_class_m: no way in the area is a {name!r}{tail}")
    return notes


def gaps(ways: Ways, side_m: float, half_width_m: float, by_class_m: Mapping[str, float]) -> str:
    """Return a note on ways narrower than a pixel, whose points have gaps; empty without any.

    A corridor as wide as a pixel holds a pixel's centre in each row or column that it crosses.
    """
    width_m = 2 * np.array([by_class_m.get(name, half_width_m) for name in ways.class_names])
    narrow = (width_m > 0) & (width_m < side_m)
    length_m = shapely.length(ways.geometry)
    gappy_m = float(length_m[narrow[ways.way_class]].sum())
    if gappy_m == 0:
        return ""
    least_m = width_m[narrow][np.isin(np.flatnonzero(narrow), ways.way_class)].min()
    return (
        f"{gappy_m / length_m.sum():.0%} of the ways, down to {least_m:g} m wide, are narrower "
        f"than the pixels of {side_m:g} m: their points have gaps"
    )
