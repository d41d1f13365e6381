"""Roads, buildings and water from any vector file, such as a shapefile, GeoPackage or GeoJSON.

Lines are ways; polygons in a layer of roads are accessible areas, as squares are. A layer
has no access rules: classes that must not be used are left out by a half width of 0. Of those that
the classes of OpenStreetMap name, vehicles have no footways, cycleways, paths, tracks and steps.
"""

from __future__ import annotations

from collections.abc import Collection, Container
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mapfilter._types import Ints
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.roads.buildings import (
    check_heights,
    made_buildings,
)
from mapfilter.roads.defaults import DEFAULT_HEIGHT_M, STOREY_HEIGHT_M
from mapfilter.roads.osm import DRIVING_CLASSES, NOT_DRIVEN_CLASSES
from mapfilter.roads.vector import Layer, read_layer
from mapfilter.roads.ways import (
    Bounds,
    Buildings,
    Squares,
    Water,
    Ways,
    lines_inside,
    polygons_inside,
)

ROAD_CLASS = "road"
"""The class of ways that have none."""


@dataclass(frozen=True, slots=True, eq=False)
class LayerRoads:
    """Lines and polygons of a layer of roads, and the class of each polygon."""

    ways: Ways
    areas: Squares
    area_class: tuple[str, ...]
    notes: tuple[str, ...]

    def areas_without(self, classes: Container[str]) -> Squares:
        """Return the areas that are not of some classes."""
        kept = np.array([name not in classes for name in self.area_class], dtype=np.bool_)
        return Squares(self.areas.crs, self.areas.area_id[kept], self.areas.geometry[kept])

    def driven(self, kept: Collection[str]) -> LayerRoads:
        """Return the roads without those on foot, by the words of OpenStreetMap, and a note.

        Parameters
        ----------
        kept : collection of str
            Classes that stay, whatever they name.

        Raises
        ------
        InputError
            Nothing is left.
        """
        words = {*self.ways.class_names, *self.area_class}
        on_foot = {name for name in words if name.casefold() in NOT_DRIVEN_CLASSES} - {*kept}
        if not on_foot:
            if any(name.casefold() in DRIVING_CLASSES for name in words):
                return self
            note = "profile driving: no class of the layer is known as a road or a footway "
            note += f"({listed(sorted(words))}), so all are kept; half_width_by_class_m leaves "
            note += "classes out"
            return replace(self, notes=(*self.notes, note))
        names = np.array(self.ways.class_names, dtype=object)[self.ways.way_class]
        away = np.isin(names, list(on_foot))
        areas = self.areas_without(on_foot)
        if away.all() and not len(areas):
            expected, got = "ways for vehicles in the area", listed(sorted(on_foot))
            raise fail(InputError, "layer of roads", expected, f"only {got}", "another profile")
        stay = tuple(name for name in self.area_class if name not in on_foot)
        note = f"profile driving: {number_of(int(away.sum()), 'way')} left out, of classes "
        note += f"{listed(sorted(on_foot))}; half_width_by_class_m keeps those that it names"
        # Without the names of classes that no way has any more.
        left = Ways.open(
            *(self.ways.crs, self.ways.way_id[~away]),
            *(names[~away], self.ways.geometry[~away]),
        )
        return LayerRoads(left, areas, stay, (*self.notes, note))


def read_layer_roads(
    source: Layer,
    crs: str,
    bounds_m: Bounds,
    *,
    layer_name: str | None = None,
    class_column: str | None = None,
    id_column: str | None = None,
) -> LayerRoads:
    """Read ways and areas from a vector file, cut to an area.

    Parameters
    ----------
    source : path or GeoDataFrame
        A vector file that geopandas reads, or a table in memory.
    crs : str
        Projected CRS of the result, in metres; the layer may have any.
    bounds_m : tuple of float
        West, south, east, north of the area in ``crs``.
    layer_name : str, optional
        Needed where the file has several layers.
    class_column : str, optional
        Column that holds the kind of way, in words or as a number.
    id_column : str, optional
        Column that holds the ways' numbers, > 0; by default a feature's own in the file (FID),
        plus 1.

    Raises
    ------
    InputError
        The file, its layer, its CRS or a column is missing or damaged, or no road is in the area.
    """
    found = read_layer(source, crs, bounds_m, layer_name, (class_column, id_column))
    ids = found.column(id_column)
    number = found.number if ids is None else _ids(ids, f"{found.name}, column {id_column}")
    lines, origin = lines_inside(found.geometry, bounds_m)
    order = np.argsort(number[origin], kind="stable")
    lines, origin = lines[order], origin[order]
    words = _classes(found.column(class_column), len(number))
    areas, of_area = polygons_inside(found.geometry, bounds_m, cut=True)
    if not (origin.size or of_area.size):
        raise fail(InputError, found.name, "lines or polygons in the area", found.kinds)
    ways = Ways.open(crs, number[origin], words[origin], lines)
    squares = Squares(crs, number[of_area], areas)
    return LayerRoads(ways, squares, tuple(map(str, words[of_area])), found.notes)


def read_layer_buildings(
    source: Layer,
    crs: str,
    bounds_m: Bounds,
    *,
    layer_name: str | None = None,
    height_column: str | None = None,
    levels_column: str | None = None,
    default_height_m: float = DEFAULT_HEIGHT_M,
    storey_height_m: float = STOREY_HEIGHT_M,
) -> Buildings:
    """Read the buildings that touch an area from a vector file.

    Parameters
    ----------
    source, crs, bounds_m, layer_name
        As for :func:`read_layer_roads`.
    height_column : str, optional
        Column with the height above ground, in metres, or as a text with its unit.
    levels_column : str, optional
        Column with the number of storeys, used where there is no height.
    default_height_m, storey_height_m : float
        Heights (m) of buildings without their own; the result counts how often they were used.

    Raises
    ------
    InputError
        The file, its layer, its CRS or a column is missing or damaged, a height is not > 0, or
        the area has no polygon.
    """
    check_heights(default_height_m, storey_height_m)
    found = read_layer(source, crs, bounds_m, layer_name, (height_column, levels_column))
    buildings = made_buildings(
        crs,
        found.geometry,
        bounds_m,
        found.column(height_column),
        found.column(levels_column),
        default_height_m=default_height_m,
        storey_height_m=storey_height_m,
    )
    if not len(buildings):
        raise fail(InputError, found.name, "polygons in the area", found.kinds, "another layer")
    return buildings


def read_layer_water(
    source: Layer, crs: str, bounds_m: Bounds, *, layer_name: str | None = None
) -> Water:
    """Read the polygons of a vector file as water, cut to an area; there may be none in it.

    Parameters are those of :func:`read_layer_roads`.

    Raises
    ------
    InputError
        The file, its layer or its CRS is missing or damaged, or it holds no polygons.
    """
    found = read_layer(source, crs, bounds_m, layer_name, may_be_empty=True)
    geometry, _ = polygons_inside(found.geometry, bounds_m, cut=True)
    if found.geometry.size and not geometry.size:
        raise fail(InputError, found.name, "polygons", found.kinds, "another layer")
    return Water(crs, geometry)


def _text(value: object) -> str:
    """Return a column's value as text; whole numbers without decimals."""
    return str(int(value) if isinstance(value, float) and value.is_integer() else value)


def _classes(values: NDArray[np.object_] | None, count: int) -> NDArray[np.object_]:
    words = np.full(count, ROAD_CLASS, dtype=object)
    for i, value in enumerate(values if values is not None else ()):
        known = value is not None and value is not pd.NA and value == value
        if known and (text := _text(value).strip()):
            words[i] = text
    return words


def _ids(values: NDArray[np.object_], where: str) -> Ints:
    numbers = np.zeros(len(values), dtype=np.int64)
    faults = Faults()
    for i, value in enumerate(values):
        text = _text(value)
        if not (text.isascii() and text.isdigit() and 0 < int(text[:20]) < 2**63):
            faults.add(where, "whole numbers > 0", repr(value), "another column")
            break
        numbers[i] = int(text)
    faults.raise_if_any(InputError)
    return numbers
