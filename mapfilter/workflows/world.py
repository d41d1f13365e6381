"""What several commands need of a configuration's area: lattice, streets, cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mapfilter.database.sources import LaidRoutes, LayerRoutes, Routes
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.geodesy import Lattice, check_bbox, project, projected_crs, unproject, utm_crs
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import CellPlan, read_cell_plan
from mapfilter.radio.msi import read_antennas
from mapfilter.radio.rasters import RxLevRasters, open_rasters
from mapfilter.roads.buildings import rasterise_heights
from mapfilter.roads.landuse import LandUse
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.maps import check_on_map, map_bounds_deg, resolve_map
from mapfilter.roads.routable import route_lattice_from_landuse
from mapfilter.roads.ways import Buildings, Ways
from mapfilter.simulation.layout import lay_out_plan
from mapfilter.workflows.fields import NO_MAP
from mapfilter.workflows.sections import Area, Config
from mapfilter.workflows.streets import Streets

LARGEST_AREA_PX = 400_000_000
EARTH_RADIUS_M = 6_371_000.0

_SHORT_M = 100.0
_SCALE_TOLERANCE = 0.03


def area_lattice(area: Area, *, on_map: bool = True) -> Lattice:
    """Return the lattice over an area; without ``on_map`` the map need not cover it.

    Raises
    ------
    InputError, ConfigError
        The box or the CRS is wrong, the map is missing or of another place, or the lattice would
        be absurdly large.
    """
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
    faults = Faults()
    if not np.all(np.isfinite(bounds_m)):
        faults.add("area", f"a box that {crs} can show", bounds_m, "a CRS of another region")
        faults.raise_if_any(InputError)
    width_m, height_m = bounds_m[2] - bounds_m[0], bounds_m[3] - bounds_m[1]
    if max(width_m, height_m) < area.resolution_m:
        expected = f"metres, at most the area's {max(width_m, height_m):.0f}"
        faults.add("area.resolution_m", expected, area.resolution_m, "a resolution in another unit")
    pixels = width_m * height_m / area.resolution_m**2
    if pixels > LARGEST_AREA_PX:
        faults.add(
            "area",
            f"at most {LARGEST_AREA_PX:.0e} pixels",
            f"{pixels:.1e} at {area.resolution_m:g} m",
            "a box or a resolution in the wrong unit",
        )
    faults.raise_if_any(ConfigError)
    if on_map and area.map != NO_MAP:
        check_on_map(area.map, crs, bounds_m)
    check_scale(crs, bounds_m, "area.crs")
    return Lattice.covering(crs, bounds_m, area.resolution_m)


def check_scale(crs: str, bounds_m: tuple[float, float, float, float], where: str) -> None:
    """See that metres of a CRS are metres on the ground in the middle of an area.

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


def planned_rasters(config: Config) -> RxLevRasters:
    """Open the rasters of a configuration: predicted by mapfilter, or a planning tool's.

    Raises
    ------
    InputError
        They are wrong, or do not fit what the configuration says of them.
    """
    section = config.rasters
    if section.path is None and not config.rasters_path.exists():
        hint = "not predicted yet; run mapfilter predict first, or set rasters.path"
        raise fail(
            InputError, str(config.rasters_path), "rasters", "No such file or directory", hint
        )
    return open_rasters(
        config.rasters_path,
        section.quantity,
        crs=section.crs,
        factor=section.factor,
        nodata=section.nodata,
        resolution_m=section.resolution_m,
        resampling=section.resampling,
    )


def planned_cells(config: Config, crs: str, area: Lattice | None = None) -> CellPlan:
    """Read the cell plan of a configuration; of a public list, only what is near the area.

    Raises
    ------
    InputError
        There is none, or it is wrong.
    """
    cells = config.cells
    if cells.plan is None:
        raise fail(InputError, "cells.plan", "a cell plan", "none")
    bounds_m = None
    if cells.layout == "opencellid" and area is not None:
        west, south, east, north = area.bounds_m
        reach_m = cells.reach_m
        bounds_m = west - reach_m, south - reach_m, east + reach_m, north + reach_m
    return read_cell_plan(
        cells.plan,
        crs,
        layout=cells.layout,
        columns={name: column for name, column in cells.columns if column is not None},
        defaults={
            "height_m": cells.height_m,
            "eirp_dbm": cells.eirp_dbm,
            "frequency_mhz": cells.frequency_mhz,
        },
        bounds_m=bounds_m,
    )


@dataclass(frozen=True)
class World:
    """The area of a configuration; each part is read when it is first asked for.

    Parameters
    ----------
    config : Config
        Checked.
    lattice : Lattice
        Of the area, or that of rasters that are given.
    """

    config: Config
    lattice: Lattice

    @classmethod
    def of(cls, config: Config) -> World:
        """Return the world of a configuration's area."""
        return cls(config, area_lattice(config.area))

    @cached_property
    def streets(self) -> Streets:
        """The layers that say where one can be."""
        return Streets(self.config, self.lattice)

    @property
    def map_name(self) -> str:
        """Name of the map's file, without its folder."""
        name = self.config.area.map
        return name if name == NO_MAP else resolve_map(name).name

    @property
    def buildings(self) -> Buildings:
        """Buildings of the area."""
        return self.streets.buildings

    @cached_property
    def heights_m(self) -> np.ndarray:
        """Building heights on the lattice, shape (rows, cols)."""
        return rasterise_heights(self.buildings, self.lattice)

    @property
    def ways(self) -> Ways:
        """Ways of the area, cut at its edge."""
        return self.streets.ways

    @property
    def landuse(self) -> LandUse | None:
        """What the land-use raster says, where one is given."""
        return self.streets.landuse

    @cached_property
    def routes(self) -> RouteLattice:
        """Where one can be: near ways and in squares, or from a land-use raster."""
        if self.landuse is None:
            return self.streets.source.over(self.lattice)
        roads = self.config.roads
        return route_lattice_from_landuse(
            self.landuse.walkable,
            self.lattice,
            self.ways,
            roads.half_width_m,
            half_width_by_class_m=roads.half_width_by_class_m,
        )

    @cached_property
    def route_tiles(self) -> Routes:
        """The same points, laid tile by tile when they are wanted."""
        if self.landuse is not None:
            return LaidRoutes(self.routes)
        return LayerRoutes(self.streets.source, self.lattice)

    @cached_property
    def plan(self) -> CellPlan:
        """The cell plan: read, or laid out by rule."""
        cells = self.config.cells
        if cells.plan is not None:
            return planned_cells(self.config, self.lattice.crs, self.lattice)
        return lay_out_plan(
            self.lattice,
            cells.sites,
            cells.sectors,
            cells.indoor,
            seed=cells.seed,
            heights_m=self.heights_m,
            frequency_mhz=cells.frequency_mhz,
            eirp_dbm=cells.eirp_dbm,
            site_height_m=cells.height_m,
        )

    @cached_property
    def antennas(self) -> dict[str, MeasuredAntenna]:
        """The measured antennas that the plan names, read from their folder."""
        folder = self.config.cells.antennas
        if folder is None:
            return {}
        return read_antennas(folder, (cell.antenna for cell in self.plan.cells))
