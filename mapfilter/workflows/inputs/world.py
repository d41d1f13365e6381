"""What several commands need of a configuration's area: lattice, streets, cells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import shapely

from mapfilter._area_scale import check_scale
from mapfilter.config.inputs import Area, Rasters
from mapfilter.config.sections import Config
from mapfilter.database.sources import LatticeRoutes, LayerRoutes, Routes
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import projected_crs, same_crs, short_crs, shown_crs, unproject
from mapfilter.lattice import Lattice
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.far_cells import check_cells_near
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.buildings import rasterise_heights
from mapfilter.roads.landuse import LandUse
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.maps import box_deg, map_bounds_deg, overlaps_swapped, resolve_map
from mapfilter.roads.route_points import route_lattice_from_landuse
from mapfilter.roads.ways import Buildings, Ways
from mapfilter.workflows.inputs.area_lattice import LARGEST_AREA_PX as LARGEST_AREA_PX
from mapfilter.workflows.inputs.area_lattice import area_lattice as area_lattice
from mapfilter.workflows.inputs.area_lattice import roads_lattice as roads_lattice
from mapfilter.workflows.inputs.on_lattice import pixels_on
from mapfilter.workflows.inputs.planned_cells import plan_antennas, planned_cells
from mapfilter.workflows.inputs.stated_power import check_eirp_stated
from mapfilter.workflows.inputs.streets import Streets

_ENOUGH = 0.95
_ABOUT_WAYS_M = 100.0
_SAMPLES = 64


def planned_rasters(config: Config) -> RxLevRasters:
    """Open the rasters of a configuration: predicted by mapfilter, or a planning tool's.

    Raises
    ------
    InputError
        They are wrong, or do not fit the configuration.
    """
    section = config.rasters
    if config.prediction.model == "survey" and config.prediction.survey.calibrate is not None:
        # The other keys describe the rasters to calibrate; a survey's own need none.
        section = Rasters(path=section.path)
    if section.path is None and not config.rasters_path.exists():
        # What would keep them from being predicted comes first.
        if config.prediction.model != "survey" and config.area.has_extent:
            roads_lattice(config)
        hint = "not predicted yet; run mapfilter predict first, or set rasters.path"
        raise fail(
            InputError, str(config.rasters_path), "rasters", "No such file or directory", hint
        )
    return open_by_section(config.rasters_path, section)


def open_by_section(path: Path, section: Rasters) -> RxLevRasters:
    """Open rasters as ``[rasters]`` describes them.

    Raises
    ------
    InputError
        They are wrong, or do not fit their description.
    """
    # Faults of the CRS name the setting.
    crs = projected_crs(section.crs, "rasters.crs") if section.crs else section.crs
    return open_rasters(
        path,
        section.quantity,
        crs=crs,
        factor=section.factor,
        nodata=section.nodata,
        resolution_m=section.resolution_m,
        resampling=section.resampling,
    )


def check_crs_of_area(area: Area, rasters: RxLevRasters) -> None:
    """Check that rasters are in the CRS that the area states, if any."""
    if area.crs is None:
        return
    wanted, found = projected_crs(area.crs, "area.crs"), rasters.lattice.crs
    if not same_crs(wanted, found):
        expected = f"{shown_crs(wanted)}, the CRS of the area"
        hint = f'another zone or datum: set area.crs = "{short_crs(found)}"'
        raise fail(InputError, f"{rasters.path}, CRS", expected, shown_crs(found), hint)


def covered_lattice(area: Area, rasters: RxLevRasters) -> Lattice:
    """Return the lattice of the rasters, cut to the area's box if it has one.

    This is the area that a database covers and in which journeys go: beyond it nothing is received.

    Raises
    ------
    InputError
        The area states another CRS than the rasters, or does not overlap them.
    """
    lattice = rasters.lattice
    check_crs_of_area(area, rasters)
    if not area.has_box:
        return lattice
    covered_deg = box_deg(lattice.crs, lattice.bounds_m)
    if area.bbox is not None and overlaps_swapped(area.bbox, covered_deg):
        sides = ", ".join(f"{side:.4f}" for side in covered_deg)
        expected = f"an area that overlaps the rasters {rasters.path} ({sides})"
        hint = "longitude and latitude swapped"
        raise fail(InputError, "area.bbox", expected, area.bbox, hint)
    wanted = area_lattice(area.model_copy(update={"crs": lattice.crs}))
    found = pixels_on(lattice, wanted.bounds_m)
    if found is None:
        covered, asked = (
            ", ".join(f"{value:.0f}" for value in one.bounds_m) for one in (lattice, wanted)
        )
        expected = f"an area that overlaps the rasters {rasters.path} ({covered})"
        raise fail(InputError, "area", expected, asked, "rasters and roads of different places")
    return lattice.window(*found)


def raster_world(config: Config, rasters: RxLevRasters) -> tuple[RxLevRasters, CellPlan, World]:
    """Return rasters, plan, and the world on the rasters' lattice, cut to the area if one is given.

    The rasters are then read as if they held no more than that: a database covers the area that it
    was built for, and replaces nothing beyond it when merged. A plan by rule is laid out over the
    whole rasters, as when they were predicted.
    """
    lattice = covered_lattice(config.area, rasters)
    check_scale(rasters.lattice.crs, rasters.lattice.bounds_m, f"{rasters.path}, CRS")
    whole = world = World(config, rasters.lattice)
    rasters = named_by_plan(rasters, whole.plan)
    check_eirp_stated(config, rasters, whole.plan)
    if lattice != rasters.lattice:
        rasters, world = replace(rasters, lattice=lattice), World(config, lattice)
    check_cells_near(whole.plan, world.lattice, str(config.cells.plan or "cells"))
    return rasters, whole.plan, world


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
        return cls(config, roads_lattice(config))

    @cached_property
    def streets(self) -> Streets:
        """The layers of ways, squares and buildings."""
        return Streets(self.config, self.lattice)

    @property
    def map_name(self) -> str:
        """Name of the map's file, without its folder, or of what stands for one."""
        area = self.config.area
        return resolve_map(area.map).name if area.map_is_a_file else area.map

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
        """The land-use raster, where one is given."""
        return self.streets.landuse

    @cached_property
    def routes(self) -> RouteLattice:
        """Walkable or drivable points: near ways and in squares, or of a land-use raster."""
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
        """The same points, laid tile by tile on request."""
        if self.landuse is not None:
            return LatticeRoutes(self.routes)
        return LayerRoutes(self.streets.source, self.lattice)

    @cached_property
    def plan(self) -> CellPlan:
        """The cell plan: read, written with a survey, or laid out by rule."""
        cells, surveyed = self.config.cells, self.config.surveyed_plan
        if surveyed is not None:
            return read_cell_plan(surveyed, self.lattice.crs)
        if cells.plan is not None:
            return planned_cells(self.config, self.lattice.crs, self.lattice)
        from mapfilter.simulation.layout import lay_out_plan

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
        """The measured antennas that the plan names."""
        return plan_antennas(self.config, self.plan)


def map_cover(world: World) -> tuple[str, ...]:
    """Return a note when the ways of a map cover only a part of the requested area.

    The extent in a map's header is only a reason to look: maps often hold more, as whole ways are
    kept. The share is that of the ways' convex hull, 100 m about it included.
    """
    config, lattice = world.config, world.lattice
    area, roads = config.area, config.roads
    if not area.has_box or not area.map_is_a_file or roads.replace_map:
        return ()
    if _declared_share(area, lattice) >= _ENOUGH:
        return ()
    box = shapely.box(*lattice.bounds_m)
    try:
        hull = shapely.convex_hull(shapely.geometrycollections(world.ways.geometry))
    except InputError:
        return _note(f"the map {area.map}", 0.0)
    near = shapely.intersection(shapely.buffer(hull, _ABOUT_WAYS_M), box)
    return _note(f"the map {area.map}", float(near.area / box.area))


def _declared_share(area: Area, lattice: Lattice) -> float:
    along = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    rows, cols = np.meshgrid(along * lattice.rows - 0.5, along * lattice.cols - 0.5, indexing="ij")
    lon, lat = unproject(lattice.crs, *lattice.east_north(rows.ravel(), cols.ravel()))
    west, south, east, north = map_bounds_deg(area.map)
    inside = (lon >= west) & (lon <= east) & (lat >= south) & (lat <= north)
    return float(inside.mean())


def raster_cover(area: Area, lattice: Lattice) -> tuple[str, ...]:
    """Return a note when rasters, cut to ``lattice``, cover only a part of the requested area."""
    if not area.has_box:
        return ()
    wanted = area_lattice(area.model_copy(update={"crs": lattice.crs}))
    covered_m2 = lattice.rows * lattice.cols * lattice.resolution_m**2
    wanted_m2 = wanted.rows * wanted.cols * wanted.resolution_m**2
    return _note("the set of rasters", covered_m2 / wanted_m2)


def _note(what: str, share: float) -> tuple[str, ...]:
    return () if share >= _ENOUGH else (f"{what} covers {share:.0%} of the area",)
