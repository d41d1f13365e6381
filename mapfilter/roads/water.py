"""Where one cannot be without a boat: rivers and lakes of OpenStreetMap, or any file's polygons.

An OpenStreetMap extract holds no sea: the coast is a line there. Polygons of the sea come from
elsewhere, such as osmdata.openstreetmap.de, as a layer.
"""

from __future__ import annotations

from pathlib import Path

from mapfilter.errors import InputError, fail
from mapfilter.roads.clip import polygons_inside
from mapfilter.roads.maps import read_elements
from mapfilter.roads.osm_readers import Query
from mapfilter.roads.vector import read_layer
from mapfilter.roads.ways import Bounds, Water

_WATER = Query(
    {"natural": ("water",), "waterway": ("riverbank", "dock"), "landuse": ("reservoir",)},
    ("natural", "waterway", "landuse", "tunnel", "covered", "location", "intermittent"),
)
_NOT_OPEN = frozenset(("yes", "culvert", "flooded", "building_passage"))
_BURIED = frozenset(("underground", "indoor"))


def read_water(path: str | Path, crs: str, bounds_m: Bounds) -> Water:
    """Read the waters of a map, cut to an area; there may be none.

    Waters are ``natural=water``, ``waterway=riverbank`` and ``dock``, ``landuse=reservoir``; not
    those in tunnels, below ground, or dry for a part of the year (``intermittent=yes``).

    Parameters
    ----------
    path : str or Path
        An ``.osm.pbf``, ``.osm`` or ``.osm.gz`` file, or the name of an embedded map ("helsinki").
    crs : str
        Projected CRS of the result, in metres.
    bounds_m : tuple of float
        West, south, east, north of the area in ``crs``.

    Raises
    ------
    InputError
        The map is missing or damaged.
    """
    found = read_elements(path, crs, bounds_m, _WATER)
    hidden = found["tunnel"].isin(_NOT_OPEN) | found["covered"].isin(_NOT_OPEN)
    hidden |= found["location"].isin(_BURIED) | (found["intermittent"] == "yes")
    geometry, _ = polygons_inside(found.geometry[~hidden].to_numpy(), bounds_m, cut=True)
    return Water(crs, geometry)


def read_layer_water(
    path: Path | str, crs: str, bounds_m: Bounds, *, layer_name: str | None = None
) -> Water:
    """Read the polygons of a vector file as water, cut to an area; there may be none in it.

    Parameters
    ----------
    path : Path or str
        Whatever geopandas reads.
    crs, bounds_m
        As for :func:`read_water`; the layer may have any CRS.
    layer_name : str, optional
        Needed where the file has several layers.

    Raises
    ------
    InputError
        The file, its layer or its CRS is missing or damaged, or it holds other things than
        polygons.
    """
    found = read_layer(Path(path), crs, bounds_m, layer_name, may_be_empty=True)
    geometry, _ = polygons_inside(found.geometry, bounds_m, cut=True)
    if found.geometry.size and not geometry.size:
        kinds = ", ".join(sorted({shape.geom_type for shape in found.geometry}))
        raise fail(InputError, str(path), "polygons", kinds, "another layer")
    return Water(crs, geometry)
