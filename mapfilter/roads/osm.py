"""Ways, squares and water from OpenStreetMap.

Which ways a profile may use is decided by these tables and nothing else.

========== =============================================================================
walking    classes: :data:`WALKING_CLASSES` (no motorway, no trunk). ``foot=yes`` and the
           like allow, ``foot=no`` and the like forbid; otherwise ``access=private``, ``no``
           and the like forbid. Tunnels are left out (no sky, no prediction), passages
           through buildings are kept and marked ``covered``. Indoor ways are left out.
driving    classes: :data:`DRIVING_CLASSES`. The most specific of ``motorcar``,
           ``motor_vehicle``, ``vehicle`` and ``access`` decides. Tunnels are kept and marked
           ``covered``. One-way streets follow ``oneway``.
squares    ``place=square``, and ``area=yes`` or multipolygon areas of the classes
           :data:`SQUARE_CLASSES`, with the access rules of walking. A closed way without
           ``area=yes`` is a loop to walk along, not an area.
water      ``natural=water``, ``waterway=riverbank`` and ``dock``, ``landuse=reservoir``; not
           in tunnels, below ground or ``intermittent=yes``. An extract holds no sea: the
           coast is a line there, and polygons of the sea come from a layer.
========== =============================================================================
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import shapely
from geopandas import GeoDataFrame
from numpy.typing import NDArray

from mapfilter._arguments import Setting, check_arguments
from mapfilter._types import Bools
from mapfilter.roads.elements import Query
from mapfilter.roads.maps import nothing_there, read_elements
from mapfilter.roads.ways import Bounds, Squares, Water, Ways, lines_inside, polygons_inside

Profile = Literal["walking", "driving"]

_MAIN = ("primary", "primary_link", "secondary", "secondary_link", "tertiary", "tertiary_link")
_MINOR = ("unclassified", "residential", "living_street", "service", "road")
_SHARED = frozenset((*_MAIN, *_MINOR))
_ON_FOOT = ("bridleway", "cycleway", "footway", "path", "pedestrian", "platform", "steps", "track")
WALKING_CLASSES = _SHARED.union(_ON_FOOT)
DRIVING_CLASSES = _SHARED.union(("motorway", "motorway_link", "trunk", "trunk_link"))
NOT_DRIVEN_CLASSES = WALKING_CLASSES - DRIVING_CLASSES
SQUARE_CLASSES = frozenset(("footway", "living_street", "path", "pedestrian"))

_ALLOWING = frozenset(("yes", "designated", "permissive", "official", "destination", "customers"))
_PERMITTED = ("agricultural", "forestry", "delivery", "permit", "residents", "emergency")
_FORBIDDING = frozenset(("no", "private", "military", "use_sidepath", *_PERMITTED))
_OPEN_TUNNELS = frozenset(("", "no", "building_passage", "covered", "avalanche_protector"))
_ACCESS = ("access", "foot", "vehicle", "motor_vehicle", "motorcar")
_FORM = ("tunnel", "covered", "indoor", "oneway", "junction")
_HIGHWAYS = Query(
    {"highway": (), "place": ("square",)}, ("highway", "place", "area", *_ACCESS, *_FORM)
)
_WATER = Query(
    {"natural": ("water",), "waterway": ("riverbank", "dock"), "landuse": ("reservoir",)},
    ("natural", "waterway", "landuse", "tunnel", "covered", "location", "intermittent"),
)
_NOT_OPEN = frozenset(("yes", "culvert", "flooded", "building_passage"))
_BURIED = frozenset(("underground", "indoor"))


def read_ways(path: str | Path, profile: Profile, crs: str, bounds_m: Bounds) -> Ways:
    """Read the ways that a profile may use, clipped to an area.

    Parameters
    ----------
    path : str or Path
        An ``.osm.pbf``, ``.osm`` or ``.osm.gz`` file, or the name of an embedded map ("helsinki").
    profile : {"walking", "driving"}
        The rules of the table above.
    crs : str
        Projected CRS of the result, in metres.
    bounds_m : tuple of float
        West, south, east, north of the area in ``crs``. Ways are cut at its edge; within it they
        keep all their vertices.

    Returns
    -------
    Ways
        Sorted by way id.

    Raises
    ------
    InputError
        The map is missing or damaged, or has no such ways in the area.
    ConfigError
        The profile is none of these.
    """
    check_arguments("read_ways", keywords=[Setting("profile", profile, Profile)])
    found = read_elements(path, crs, bounds_m, _HIGHWAYS)
    area = _is_area(found)
    # Lifts drawn as outlines come as polygons, too; they fall out by their class.
    loops = ~area & (shapely.get_type_id(found.geometry.to_numpy()) == 3)
    found.loc[loops, "geometry"] = shapely.get_exterior_ring(found.geometry[loops].to_numpy())
    found = found[~area & _allowed(found, profile)]
    geometry, origin = lines_inside(found.geometry.to_numpy(), bounds_m)
    if origin.size == 0:
        raise nothing_there(path, crs, bounds_m)
    kept = found.iloc[origin]
    names, codes = np.unique(kept["highway"].to_numpy(dtype=str), return_inverse=True)
    return Ways(
        crs,
        kept["id"].to_numpy(dtype=np.int64),
        codes.astype(np.int16),
        tuple(str(name) for name in names),
        geometry,
        (~kept["tunnel"].isin(["", "no"]) | (kept["covered"] == "yes")).to_numpy(dtype=bool),
        _oneway(kept) if profile == "driving" else np.zeros(len(kept), dtype=np.int8),
    )


def read_squares(path: str | Path, crs: str, bounds_m: Bounds) -> Squares:
    """Read squares and pedestrian areas, clipped; there may be none. As :func:`read_ways`."""
    found = read_elements(path, crs, bounds_m, _HIGHWAYS)
    chosen = (found["place"] == "square") | found["highway"].isin(SQUARE_CLASSES)
    found = found[_is_area(found) & chosen & _walkable(found)]
    geometry, origin = polygons_inside(found.geometry.to_numpy(), bounds_m, cut=True)
    kept = found.iloc[origin]
    number = kept["id"].to_numpy(dtype=np.int64)
    relation = (kept["osm_type"] == "relation").to_numpy(dtype=bool)
    return Squares(crs, np.where(relation, -number, number), geometry)


def _is_area(found: GeoDataFrame) -> Bools:
    kind = shapely.get_type_id(found.geometry.to_numpy())
    polygon = np.isin(kind, (3, 6))
    meant = (found["area"] == "yes") | (found["place"] == "square")
    return np.asarray(polygon & (meant | (found["osm_type"] == "relation")), dtype=np.bool_)


def _allowed(found: GeoDataFrame, profile: Profile) -> Bools:
    if profile == "walking":
        return _walkable(found) & np.asarray(found["highway"].isin(WALKING_CLASSES), np.bool_)
    allowed = np.where(found["access"].isin(_FORBIDDING), -1, 0)
    for tag in ("vehicle", "motor_vehicle", "motorcar"):
        allowed = np.where(found[tag].isin(_ALLOWING), 1, allowed)
        allowed = np.where(found[tag].isin(_FORBIDDING), -1, allowed)
    return np.asarray(found["highway"].isin(DRIVING_CLASSES) & (allowed >= 0), dtype=np.bool_)


def _walkable(found: GeoDataFrame) -> Bools:
    barred = found["access"].isin(_FORBIDDING) & ~found["foot"].isin(_ALLOWING)
    barred |= found["foot"].isin(_FORBIDDING)
    outdoors = found["tunnel"].isin(_OPEN_TUNNELS) & ~found["indoor"].isin(["yes", "corridor"])
    return np.asarray(outdoors & ~barred, dtype=np.bool_)


def _oneway(found: GeoDataFrame) -> NDArray[np.int8]:
    implied = (found["junction"] == "roundabout") | (found["highway"] == "motorway")
    forward = found["oneway"].isin(["yes", "true", "1"]) | (implied & (found["oneway"] == ""))
    backward = found["oneway"].isin(["-1", "reverse"])
    return np.where(backward, -1, np.where(forward, 1, 0)).astype(np.int8)


def read_water(path: str | Path, crs: str, bounds_m: Bounds) -> Water:
    """Read the water of a map, clipped to an area; there may be none. As :func:`read_ways`."""
    found = read_elements(path, crs, bounds_m, _WATER)
    hidden = found["tunnel"].isin(_NOT_OPEN) | found["covered"].isin(_NOT_OPEN)
    hidden |= found["location"].isin(_BURIED) | (found["intermittent"] == "yes")
    geometry, _ = polygons_inside(found.geometry[~hidden].to_numpy(), bounds_m, cut=True)
    return Water(crs, geometry)
