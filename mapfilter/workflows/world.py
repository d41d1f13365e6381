"""What several commands need of a configuration's area: lattice, streets, cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mapfilter.config.sections import Config, Rasters
from mapfilter.database.sources import LatticeRoutes, LayerRoutes, Routes
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import CellPlan, read_cell_plan
from mapfilter.radio.msi import read_antennas
from mapfilter.rasters.raster_set import RxLevRasters, open_rasters
from mapfilter.roads.buildings import rasterise_heights
from mapfilter.roads.landuse import LandUse
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.maps import resolve_map
from mapfilter.roads.routes import route_lattice_from_landuse
from mapfilter.roads.ways import Buildings, Ways
from mapfilter.simulation.layout import lay_out_plan
from mapfilter.workflows.area import LARGEST_AREA_PX as LARGEST_AREA_PX
from mapfilter.workflows.area import area_lattice as area_lattice
from mapfilter.workflows.area import check_scale as check_scale
from mapfilter.workflows.streets import Streets


def planned_rasters(config: Config) -> RxLevRasters:
    """Open the rasters of a configuration: predicted by mapfilter, or a planning tool's.

    Raises
    ------
    InputError
        They are wrong, or do not fit what the configuration says of them.
    """
    section = config.rasters
    if config.prediction.model == "survey" and config.prediction.survey.calibrate is not None:
        # What is said of rasters is said of those to calibrate; a survey's own tell it all.
        section = Rasters(path=section.path)
    if section.path is None and not config.rasters_path.exists():
        hint = "not predicted yet; run mapfilter predict first, or set rasters.path"
        raise fail(
            InputError, str(config.rasters_path), "rasters", "No such file or directory", hint
        )
    return open_as_said(config.rasters_path, section)


def open_as_said(path: Path, section: Rasters) -> RxLevRasters:
    """Open rasters as ``[rasters]`` says that they are.

    Raises
    ------
    InputError
        They are wrong, or do not fit what is said of them.
    """
    return open_rasters(
        path,
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
