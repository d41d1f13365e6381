"""The cell plan that a configuration names, and the measured antennas of its cells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mapfilter.config.inputs import Cells
from mapfilter.config.sections import Config
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import projected_crs, short_crs, unproject, utm_crs_of
from mapfilter.lattice import Lattice
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.msi import read_antennas
from mapfilter.radio.plan_files import read_cell_plan

_DEFAULTS = ("height_m", "eirp_dbm", "frequency_mhz")
_WORLD, _WIDEST_FRAME_M = "+proj=merc +datum=WGS84 +units=m +type=crs", 500_000.0
"""A projected CRS of the whole earth without an area of use, and how far from its origin a frame of
one's own reaches: no land with cells is so near to latitude and longitude 0."""


def own_layout(cells: Cells) -> bool:
    """Return whether a cell plan has the columns that mapfilter writes, by their own names."""
    return cells.layout == "plan" and not cells.columns.given


def planned_cells(config: Config, crs: str, area: Lattice | None = None) -> CellPlan:
    """Read the cell plan of a configuration; of a public list, only the cells near the area.

    Height, EIRP and frequency of cells without one are those of the configuration; a plan in
    mapfilter's own layout has to have them unless they are stated there.

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
    own, stated = own_layout(cells), cells.model_fields_set
    return read_cell_plan(
        cells.plan,
        crs,
        layout=cells.layout,
        columns=cells.columns.given,
        defaults={name: getattr(cells, name) for name in _DEFAULTS if not own or name in stated},
        bounds_m=bounds_m,
        plan_crs=cells.crs,
    )


def cells_beside_log(config: Config, crs: str) -> CellPlan:
    """Read the cell plan of a configuration in the CRS of a log; an empty one where none is given.

    Raises
    ------
    InputError
        It is wrong; or its cells lie where the CRS is not used, for which positions of the log may
        be the cause.
    """
    if config.cells.plan is None:
        return CellPlan(crs, ())
    try:
        return planned_cells(config, crs)
    except InputError as error:
        if config.area.crs is not None:
            raise
        cause = f"or so in the log, by whose positions the CRS is {short_crs(crs)}"
        faults = (
            replace(one, hint=f"{one.hint}, {cause}") if one.hint.endswith("swapped") else one
            for one in error.faults
        )
        raise InputError(tuple(faults)) from error


def cells_of_unplaced_logs(config: Config, frame: str) -> CellPlan:
    """Read the cell plan of a configuration in the CRS for logs without positions.

    That is the one of the configuration's area, else the UTM zone of the cells.

    Parameters
    ----------
    config : Config
        With a cell plan.
    frame : str
        Local frame of the logs, in which cells stay whose metres are in a frame of their own.

    Raises
    ------
    InputError
        As of :func:`planned_cells`.
    """
    if config.area.crs is not None:
        return planned_cells(config, projected_crs(config.area.crs, "area.crs"))
    cells = planned_cells(config, _WORLD).cells
    east_m, north_m = np.array([(cell.east_m, cell.north_m) for cell in cells]).T
    if np.hypot(np.median(east_m), np.median(north_m)) < _WIDEST_FRAME_M:
        return planned_cells(config, frame)
    return planned_cells(config, utm_crs_of(*unproject(_WORLD, east_m, north_m)))


def plan_antennas(config: Config, plan: CellPlan) -> dict[str, MeasuredAntenna]:
    """Read the measured antennas that a plan names from their folder, where one is given."""
    folder = config.cells.antennas
    return {} if folder is None else read_antennas(folder, (cell.antenna for cell in plan.cells))
