"""Lattice, ways, squares, buildings and water of the area of a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from mapfilter.config.fields import SYNTHETIC_MAP, SYNTHETIC_MAPS
from mapfilter.config.inputs import Area
from mapfilter.config.sections import Config
from mapfilter.database.manifest import InputRole
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.geodesy import Lattice, check_bbox, project, projected_crs, unproject, utm_crs
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.corridors import Positions, corridors
from mapfilter.roads.index import RouteSource
from mapfilter.roads.landuse import LandUse, read_landuse
from mapfilter.roads.layers import read_layer_buildings, read_layer_water
from mapfilter.roads.maps import check_on_map, map_bounds_deg, resolve_map
from mapfilter.roads.osm import read_water
from mapfilter.roads.raster import raster_lattice, read_raster_ways
from mapfilter.roads.routes import Roads, gaps, read_roads, unused_classes, within_reach_m
from mapfilter.roads.ways import Bounds, Buildings, Water, Ways, clip_ways
from mapfilter.simulation.synthetic_city import SyntheticCity, manhattan, synthetic_city
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.tracks.store import is_log
from mapfilter.workflows.measured import recorded_rows

LARGEST_AREA_PX = 400_000_000
EARTH_RADIUS_M = 6_371_000.0
OSM_ATTRIBUTION = "© OpenStreetMap contributors (ODbL)"

_SHORT_M = 100.0
_SCALE_TOLERANCE = 0.03


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


def pixels_on(
    lattice: Lattice, bounds_m: tuple[float, float, float, float]
) -> tuple[int, int, int, int] | None:
    """Return the pixels of a lattice that a box in its CRS touches, or None where there are none.

    Examples
    --------
    >>> lattice = Lattice("EPSG:32635", 0.0, 100.0, 5.0, 20, 20)
    >>> pixels_on(lattice, (10.0, 50.0, 30.0, 200.0))
    (0, 2, 10, 4)
    >>> pixels_on(lattice, (100.0, 0.0, 200.0, 100.0)) is None
    True
    """
    west, south, east, north = bounds_m
    # A hair inside, so that an edge on a pixel's edge takes no pixel beyond it.
    hair_m = 1e-6 * lattice.resolution_m
    top, left = lattice.row_col(west + hair_m, north - hair_m)
    bottom, right = lattice.row_col(east - hair_m, south + hair_m)
    top, left = max(int(top), 0), max(int(left), 0)
    rows = min(int(bottom), lattice.rows - 1) - top + 1
    cols = min(int(right), lattice.cols - 1) - left + 1
    return None if rows < 1 or cols < 1 else (top, left, rows, cols)


def check_scale(crs: str, bounds_m: tuple[float, float, float, float], where: str) -> None:
    """Check that metres of a CRS are metres on the ground in the middle of an area.

    Raises
    ------
    InputError
        They differ by more than 3 %: the CRS is made for another region or is Web Mercator.
    """
    west, south, east, north = bounds_m
    middle_m = np.array([[(west + east) / 2], [(south + north) / 2]])
    ends_m = middle_m + np.array([[0.0, _SHORT_M], [0.0, 0.0]])
    lon_rad, lat_rad = np.radians(unproject(crs, *ends_m))
    along_rad = np.hypot(np.diff(lon_rad) * np.cos(lat_rad[0]), np.diff(lat_rad))
    ground_m = float(along_rad[0] * EARTH_RADIUS_M)
    if not abs(ground_m / _SHORT_M - 1) <= _SCALE_TOLERANCE:
        expected = "a CRS whose metres are metres on the ground in this area"
        got = f"{crs}, of which {_SHORT_M:g} m are {ground_m:.0f} m"
        raise fail(InputError, where, expected, got, "a CRS of another region, or Web Mercator")


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
        if self.landuse is not None:
            return self.landuse.notes
        roads, notes = self.config.roads, list(self._roads.notes)
        notes += unused_classes(self._roads.ways, roads.half_width_by_class_m)
        if self.gaps:
            notes.append(self.gaps)
        if roads.cut_buildings and len(self.buildings):
            notes.append(f"{len(self.buildings)} buildings cut out")
        if self._water is not None:
            notes.append(f"{len(self._water)} waters cut out, save under bridges")
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
