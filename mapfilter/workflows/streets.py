"""Where one can be in the area of a configuration, from whatever files it names."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mapfilter.config.sections import Config
from mapfilter.database.manifest import InputRole
from mapfilter.errors import ConfigError, fail
from mapfilter.geodesy import Lattice
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.corridors import Positions, corridors
from mapfilter.roads.index import RouteSource
from mapfilter.roads.landuse import LandUse, read_landuse
from mapfilter.roads.layers import read_layer_buildings, read_layer_water
from mapfilter.roads.maps import resolve_map
from mapfilter.roads.osm import read_water
from mapfilter.roads.routes import Roads, gaps, read_roads, unused_classes, within_reach_m
from mapfilter.roads.ways import Bounds, Buildings, Water, Ways, clip_ways
from mapfilter.simulation.synthetic_city import SyntheticCity
from mapfilter.survey.measurements import Measurements, read_measurements
from mapfilter.workflows.area import city_of

OSM_ATTRIBUTION = "© OpenStreetMap contributors (ODbL)"


@dataclass(frozen=True)
class Streets:
    """Ways, squares, buildings and water of an area; each is read when it is first asked for.

    Parameters
    ----------
    config : Config
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
        return clip_ways(self._roads.ways, self.lattice.bounds_m)

    @cached_property
    def landuse(self) -> LandUse | None:
        """What the land-use raster says, where one is given."""
        roads = self.config.roads
        if roads.landuse is None or roads.landuse_table is None:
            return None
        return read_landuse(roads.landuse, roads.landuse_table, self.lattice)

    @cached_property
    def source(self) -> RouteSource:
        """All layers, ready for laying the points of any tile."""
        roads = self.config.roads
        return RouteSource.of(
            self._roads.ways,
            self._roads.squares,
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
        roads, told = self.config.roads, list(self._roads.notes)
        told += unused_classes(self._roads.ways, roads.half_width_by_class_m)
        if self.gaps:
            told.append(self.gaps)
        if roads.cut_buildings and len(self.buildings):
            told.append(f"{len(self.buildings)} buildings cut out")
        if self._water is not None:
            told.append(f"{len(self._water)} waters cut out, save under bridges")
        return tuple(told)

    @property
    def gaps(self) -> str:
        """Which ways are narrower than a pixel, so that their points have gaps; or nothing."""
        if self.landuse is not None:
            return ""
        roads = self.config.roads
        side_m, by_class_m = self.lattice.resolution_m, roads.half_width_by_class_m
        return gaps(self.ways, side_m, roads.half_width_m, by_class_m)

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
    def _roads(self) -> Roads:
        roads, lattice = self.config.roads, self.lattice
        by_class_m = roads.half_width_by_class_m
        if roads.tracks.files:
            wide_m = within_reach_m(lattice.bounds_m, roads.half_width_m, by_class_m)
            return _corridors(self.config, lattice.crs, wide_m)
        if roads.layer is None and self._city is not None:
            return _made_roads(self._city, self.config)
        if roads.layer is None and not self._has_map:
            if roads.landuse is not None:
                return Roads(Ways.none(lattice.crs))
            expected = "roads without a map: roads.layer or roads.tracks.files"
            raise fail(ConfigError, "roads", expected, "none")
        return read_roads(
            self.config.area.map if roads.layer is None else roads.layer,
            lattice,
            profile=roads.profile,
            half_width_m=roads.half_width_m,
            half_width_by_class_m=by_class_m,
            squares=roads.squares,
            layer_name=roads.layer_name,
            class_column=roads.class_column,
            id_column=roads.id_column,
        )

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


def _made_roads(city: SyntheticCity, config: Config) -> Roads:
    """Return the ways and squares of a made city that a profile may use."""
    area, roads = config.area, config.roads
    walking = roads.profile == "walking"
    ways = city.ways if walking else city.driving_ways
    squares = city.squares if roads.squares and walking else None
    return Roads(
        ways, squares, (f"streets of a city that does not exist: {area.map}, seed {area.seed}",)
    )


def _parts(path: Path) -> list[Path]:
    """Return the files of a folder, or of a shapefile what it keeps beside itself."""
    if path.is_dir():
        return sorted(inner for inner in path.iterdir() if inner.is_file())
    table = path.with_suffix(".dbf")
    return [path, table] if path.suffix.lower() == ".shp" and table.is_file() else [path]


def _corridors(config: Config, crs: str, bounds_m: Bounds) -> Roads:
    """Return the ways that the tracks of measurements make, cut to a box."""
    tracks, survey = config.roads.tracks, config.prediction.survey
    columns = {name: column for name, column in survey.columns if column is not None}
    read = read_measurements(
        tracks.files,
        crs,
        format=survey.format,
        columns=columns or None,
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
    return Roads(ways, None, found.notes)


def _positions(read: Measurements, session: int) -> Positions:
    """Return the places of a session, in the order of time; a report's rows share one."""
    own = np.flatnonzero(read.session == session)
    own = own[np.argsort(read.time_s[own], kind="stable")]
    moved = np.hypot(np.diff(read.east_m[own]), np.diff(read.north_m[own])) > 0
    own = own[np.concatenate([[True], moved])] if own.size else own
    return Positions(read.east_m[own], read.north_m[own], read.accuracy_m[own])
