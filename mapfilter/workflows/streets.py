"""Where one can be in the area of a configuration, from whatever files it names."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import shapely

from mapfilter.config.sections import Config
from mapfilter.database.manifest import InputRole
from mapfilter.errors import ConfigError, fail
from mapfilter.geodesy import Lattice
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.clip import clip_ways
from mapfilter.roads.corridors import Positions, corridors
from mapfilter.roads.landuse import LandUse, read_landuse
from mapfilter.roads.layers import read_layer_buildings, read_layer_roads
from mapfilter.roads.maps import resolve_map
from mapfilter.roads.osm import read_squares, read_ways
from mapfilter.roads.routable import RouteSource
from mapfilter.roads.water import read_layer_water, read_water
from mapfilter.roads.ways import Bounds, Buildings, Squares, Water, Ways
from mapfilter.simulation.synthetic_city import SyntheticCity
from mapfilter.survey.measurements import Measurements, read_measurements
from mapfilter.workflows.area import city_of

OSM_ATTRIBUTION = "© OpenStreetMap contributors (ODbL)"

_Roads = tuple[Ways, Squares | None, tuple[str, ...]]


@dataclass(frozen=True)
class Streets:
    """Ways, squares, buildings and water of an area; each is read when it is first asked for.

    Parameters
    ----------
    lattice : Lattice
        Of the area.
    """

    config: Config
    lattice: Lattice

    @cached_property
    def buildings(self) -> Buildings:
        """Buildings of a layer, or else of the map."""
        section, crs, bounds_m = self.config.buildings, self.lattice.crs, self.lattice.bounds_m
        if section.layer is not None:
            return read_layer_buildings(
                section.layer,
                crs,
                bounds_m,
                layer_name=section.layer_name,
                height_column=section.height_column,
                levels_column=section.levels_column,
                default_height_m=section.default_height_m,
                storey_height_m=section.storey_m,
            )
        if self._city is not None:
            return self._city.buildings
        if not self._has_map:
            return Buildings(crs, np.empty(0, dtype=object), np.empty(0), 0, 0, 0)
        return read_buildings(
            self.config.area.map,
            crs,
            bounds_m,
            default_height_m=section.default_height_m,
            storey_height_m=section.storey_m,
        )

    @cached_property
    def ways(self) -> Ways:
        """Ways, cut at the edge of the area."""
        return clip_ways(self._roads[0], self.lattice.bounds_m)

    @cached_property
    def landuse(self) -> LandUse | None:
        """The land-use raster, where one is given."""
        roads = self.config.roads
        if roads.landuse is None or roads.landuse_table is None:
            return None
        return read_landuse(roads.landuse, roads.landuse_table, self.lattice)

    @cached_property
    def source(self) -> RouteSource:
        """All layers, ready for laying the points of any tile."""
        roads = self.config.roads
        ways, squares, _ = self._roads
        return RouteSource.of(
            ways,
            squares,
            self.buildings if roads.cut_buildings else None,
            roads.half_width_m,
            half_width_by_class_m=roads.half_width_by_class_m,
            water=self._water,
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, cut out, resampled or assumed."""
        if self.landuse is not None:
            return self.landuse.notes
        roads, told = self.config.roads, list(self._roads[2])
        told += _unused(roads.half_width_by_class_m, self._roads[0].class_names)
        if self.gaps:
            told.append(self.gaps)
        if roads.cut_buildings and len(self.buildings):
            told.append(f"{len(self.buildings)} buildings cut out")
        if self._water is not None:
            told.append(f"{len(self._water)} waters cut out, save under bridges")
        return tuple(told)

    @property
    def gaps(self) -> str:
        """Which ways are narrower than a pixel, so that their points have gaps; or nothing.

        A corridor as wide as a pixel holds a pixel's centre in each row or column that it crosses.
        """
        roads, side_m = self.config.roads, self.lattice.resolution_m
        if self.landuse is not None:
            return ""
        ways = self.ways
        default_m, by_class_m = roads.half_width_m, roads.half_width_by_class_m
        width_m = 2 * np.array([by_class_m.get(name, default_m) for name in ways.class_names])
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

    @property
    def files(self) -> tuple[tuple[InputRole, Path], ...]:
        """The files that all this comes from, and what each is."""
        roads = self.config.roads
        named: list[tuple[InputRole, Path | None]] = [
            ("map", resolve_map(self.config.area.map) if self._has_map else None),
            ("roads", roads.layer),
            *(("tracks", path) for path in roads.tracks.files),
            ("buildings", self.config.buildings.layer),
            ("water", roads.water_layer if roads.cut_water else None),
            ("landuse", roads.landuse),
            ("landuse_table", roads.landuse_table),
        ]
        return tuple(
            (role, file) for role, path in named if path is not None for file in _parts(path)
        )

    @property
    def attribution(self) -> str:
        """Whose map this is, as its licence wants it shown."""
        return OSM_ATTRIBUTION if self._has_map else ""

    @property
    def _has_map(self) -> bool:
        return self.config.area.map_is_a_file

    @property
    def _city(self) -> SyntheticCity | None:
        return city_of(self.config.area, self.lattice.crs)

    @cached_property
    def _roads(self) -> _Roads:
        """Ways and squares in and just about the area, and notes on them.

        Ways outside reach points inside by their half width.
        """
        roads, lattice = self.config.roads, self.lattice
        pad_m = max(roads.half_width_m, *roads.half_width_by_class_m.values(), 0.0)
        west, south, east, north = lattice.bounds_m
        bounds_m = west - pad_m, south - pad_m, east + pad_m, north + pad_m
        if roads.tracks.files:
            found = _corridors(self.config, lattice.crs, bounds_m)
            return found[0], None, found[1]
        if roads.layer is not None:
            layer = read_layer_roads(
                roads.layer,
                lattice.crs,
                bounds_m,
                layer_name=roads.layer_name,
                class_column=roads.class_column,
                id_column=roads.id_column,
            )
            left_out = [name for name, m in roads.half_width_by_class_m.items() if m == 0]
            areas = layer.areas_without(left_out) if roads.squares else None
            return layer.ways, areas, layer.notes
        if self._city is not None:
            return _made_roads(self._city, self.config)
        if not self._has_map and roads.landuse is not None:
            return Ways.none(lattice.crs), None, ()
        if not self._has_map:
            expected = "roads without a map: roads.layer or roads.tracks.files"
            raise fail(ConfigError, "roads", expected, "none")
        squares = None
        if roads.squares and roads.profile == "walking":
            squares = read_squares(self.config.area.map, lattice.crs, lattice.bounds_m)
        ways = read_ways(self.config.area.map, roads.profile, lattice.crs, bounds_m)
        return ways, squares, ()

    @cached_property
    def _water(self) -> Water | None:
        roads, crs, bounds_m = self.config.roads, self.lattice.crs, self.lattice.bounds_m
        if not roads.cut_water:
            return None
        waters = []
        if self._has_map:
            waters.append(read_water(self.config.area.map, crs, bounds_m))
        elif self._city is not None:
            waters.append(self._city.water)
        if roads.water_layer is not None:
            name = roads.water_layer_name
            waters.append(read_layer_water(roads.water_layer, crs, bounds_m, layer_name=name))
        if not any(map(len, waters)):
            return None
        return Water(crs, np.concatenate([water.geometry for water in waters]))


def _made_roads(city: SyntheticCity, config: Config) -> _Roads:
    """Return the ways and squares of a made city that a profile may use."""
    area, roads = config.area, config.roads
    walking = roads.profile == "walking"
    ways = city.ways if walking else city.driving_ways
    squares = city.squares if roads.squares and walking else None
    return ways, squares, (f"streets of a city that does not exist: {area.map}, seed {area.seed}",)


def _parts(path: Path) -> list[Path]:
    """Return the files of a folder, or of a shapefile what it keeps beside itself."""
    if path.is_dir():
        return sorted(inner for inner in path.iterdir() if inner.is_file())
    table = path.with_suffix(".dbf")
    return [path, table] if path.suffix.lower() == ".shp" and table.is_file() else [path]


def _corridors(config: Config, crs: str, bounds_m: Bounds) -> tuple[Ways, tuple[str, ...]]:
    """Return the ways that the tracks of measurements make, cut to a box."""
    tracks, survey = config.roads.tracks, config.prediction.survey
    read = read_measurements(
        tracks.files,
        crs,
        format=survey.format,
        columns=survey.columns.given or None,
        session_gap_s=survey.session_gap_s,
    )
    found = corridors(
        crs,
        [_positions(read, session) for session in range(len(read.sessions))],
        config.roads.half_width_m,
        max_accuracy_m=tracks.max_accuracy_m,
        max_gap_m=tracks.max_gap_m,
        min_sessions=tracks.min_sessions,
    )
    ways = clip_ways(found.ways, bounds_m)
    if not len(ways):
        expected = "tracks in the area"
        raise fail(ConfigError, "roads.tracks.files", expected, "none", "tracks of another place")
    return ways, found.notes


def _positions(read: Measurements, session: int) -> Positions:
    """Return the places of a session, in the order of time; a report's rows share one."""
    own = np.flatnonzero(read.session == session)
    own = own[np.argsort(read.time_s[own], kind="stable")]
    moved = np.hypot(np.diff(read.east_m[own]), np.diff(read.north_m[own])) > 0
    own = own[np.concatenate([[True], moved])] if own.size else own
    return Positions(read.east_m[own], read.north_m[own], read.accuracy_m[own])


def _unused(widths_m: Mapping[str, float], names: tuple[str, ...]) -> list[str]:
    """Return notes on half widths of classes that no way has."""
    notes = []
    for name in widths_m:
        if name not in names:
            close = difflib.get_close_matches(name, names, n=1)
            tail = f"; did you mean {close[0]!r}?" if close else ""
            notes.append(f"half_width_by_class_m: no way in the area is a {name!r}{tail}")
    return notes
