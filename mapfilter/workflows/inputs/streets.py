"""Lattice, ways, squares, buildings and water of the area of a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from mapfilter._words import number_of
from mapfilter.config.fields import SYNTHETIC_MAP, SYNTHETIC_MAPS
from mapfilter.config.inputs import Area
from mapfilter.config.sections import Config
from mapfilter.database.manifest import InputRole
from mapfilter.errors import ConfigError, fail
from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.corridors import Positions, corridors
from mapfilter.roads.landuse import LandUse, read_landuse
from mapfilter.roads.layers import read_layer_buildings, read_layer_water
from mapfilter.roads.maps import OSM_ATTRIBUTION, resolve_map
from mapfilter.roads.osm import read_water
from mapfilter.roads.raster import read_raster_ways
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.routes import Roads, gaps, read_roads, unused_classes, within_reach_m
from mapfilter.roads.ways import Bounds, Buildings, Water, Ways, clip_ways
from mapfilter.simulation.synthetic_city import SyntheticCity, manhattan, synthetic_city
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.tracks.log_folders import is_log
from mapfilter.workflows.inputs.area_lattice import area_lattice
from mapfilter.workflows.inputs.measured import recorded_rows


def city_of(area: Area, crs: str) -> SyntheticCity | None:
    """Return the synthetic city of an area, in a CRS; None where a map or nothing is named.

    It fills the area as configured, whatever part of it rasters cover.

    Raises
    ------
    ConfigError
        The area is too small or too large for one.
    """
    if area.map not in SYNTHETIC_MAPS:
        return None
    return _synthetic(area.model_copy(update={"crs": crs}))


@lru_cache(maxsize=2)
def _synthetic(area: Area) -> SyntheticCity:
    lattice = area_lattice(area)
    return synthetic_city(lattice, area.seed) if area.map == SYNTHETIC_MAP else manhattan(lattice)


@dataclass(frozen=True)
class Streets:
    """Ways, squares, buildings and water of an area; each is read when it is first asked for."""

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
        """The land-use raster, where one is given."""
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
        """Features left out or cut out, rasters resampled, and assumptions."""
        roads, notes = self.config.roads, list(self._roads.notes)
        notes += unused_classes(self._roads.ways, roads.half_width_by_class_m)
        if self.landuse is not None:
            return (*notes, *self.landuse.notes)
        if self.gaps:
            notes.append(self.gaps)
        if roads.cut_buildings and len(self.buildings):
            notes.append(f"{number_of(len(self.buildings), 'building')} cut out")
        if self._water is not None:
            notes.append(f"{number_of(len(self._water), 'water')} cut out, save under bridges")
        return tuple(notes)

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
            ("roads", roads.raster),
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
        """Attribution of the map, as its licence requires."""
        return OSM_ATTRIBUTION if self._has_map else ""

    @property
    def _has_map(self) -> bool:
        return self.config.area.map_is_a_file

    @property
    def _city(self) -> SyntheticCity | None:
        return city_of(self.config.area, self.lattice.crs)

    @cached_property
    def _roads(self) -> Roads:
        """Ways and squares in and just about the area, and notes on them.

        Ways outside reach points inside by their half width.
        """
        roads, lattice = self.config.roads, self.lattice
        by_class_m = roads.half_width_by_class_m
        if roads.tracks.files:
            wide_m = within_reach_m(lattice.bounds_m, roads.half_width_m, by_class_m)
            return _corridors(self.config, lattice.crs, wide_m)
        if roads.raster is not None:
            wide_m = within_reach_m(lattice.bounds_m, roads.half_width_m, by_class_m)
            return Roads(read_raster_ways(roads.raster, roads.raster_classes, lattice.crs, wide_m))
        if roads.layer is None and self._city is not None:
            walking, squares = roads.profile == "walking", self._city.squares
            ways = self._city.ways if walking else self._city.driving_ways
            area = self.config.area
            note = f"streets of a city that does not exist: {area.map}, seed {area.seed}"
            return Roads(ways, squares if roads.squares and walking else None, (note,))
        if roads.layer is None and not self._has_map:
            if roads.landuse is not None:
                return Roads(Ways.none(lattice.crs))
            expected = "roads without a map: roads.layer, roads.raster or roads.tracks.files"
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


def _parts(path: Path) -> list[Path]:
    """Return the files of a folder, or a file, a shapefile with its table."""
    if path.is_dir():
        inside = sorted(path.iterdir())
        logs = [file for inner in inside if is_log(inner) for file in sorted(inner.iterdir())]
        return [inner for inner in (*inside, *logs) if inner.is_file()]
    table = path.with_suffix(".dbf")
    return [path, table] if path.suffix.lower() == ".shp" and table.is_file() else [path]


def measurements_of(config: Config, files: Sequence[Path], crs: str | None) -> Measurements:
    """Read measurements as the section of the survey describes them."""
    survey = config.prediction.survey
    return read_measurements(
        files,
        crs,
        format=survey.format,
        columns=survey.columns.given or None,
        session_gap_s=survey.session_gap_s,
        recorded=recorded_rows,
    )


def _corridors(config: Config, crs: str, bounds_m: Bounds) -> Roads:
    """Return the ways along the tracks of measurements, cut to a box."""
    tracks = config.roads.tracks
    read = measurements_of(config, tracks.files, crs)
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
    """Return the positions of a session, in the order of time; a report's rows share one."""
    own = np.flatnonzero(read.session == session)
    own = own[np.argsort(read.time_s[own], kind="stable")]
    moved = np.hypot(np.diff(read.east_m[own]), np.diff(read.north_m[own])) > 0
    own = own[np.concatenate([[True], moved])] if own.size else own
    return Positions(read.east_m[own], read.north_m[own], read.accuracy_m[own])
