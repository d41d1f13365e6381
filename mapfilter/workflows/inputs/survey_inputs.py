"""What a survey is made of: measurements, cell plan, lattice, and rasters to calibrate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mapfilter._area_scale import check_scale
from mapfilter._words import number_of
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, InputError, fail, listed
from mapfilter.geodesy import projected_crs
from mapfilter.lattice import Lattice, outside_m
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.far_cells import check_cells_near
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.survey.floor_values import without_floor_values
from mapfilter.survey.measurements import Measurements, named_after
from mapfilter.survey.options import SurveyOptions
from mapfilter.tracks.checks.foreign_cells import foreign_cells
from mapfilter.workflows.inputs.planned_cells import planned_cells
from mapfilter.workflows.inputs.stated_power import check_eirp_stated
from mapfilter.workflows.inputs.streets import measurements_of
from mapfilter.workflows.inputs.world import (
    LARGEST_AREA_PX,
    area_lattice,
    open_by_section,
)


@dataclass(frozen=True, eq=False)
class SurveyInputs:
    """Measurements, plan, lattice and rasters that a survey is made of; all in one CRS."""

    measurements: Measurements
    plan: CellPlan | None
    """Of the cells whose antennas are known."""
    lattice: Lattice
    """Of the rasters to be made."""
    predicted: RxLevRasters | None
    """To calibrate."""


def survey_inputs(config: Config) -> SurveyInputs:
    """Read what the survey of a configuration is made of."""
    section = config.prediction.survey
    if not section.files:
        raise fail(ConfigError, "prediction.survey.files", "measurement files", "none")
    predicted = None
    if section.calibrate is not None:
        predicted = open_by_section(section.calibrate, config.rasters)
    given = predicted.lattice if predicted is not None else None
    if predicted is None and config.area.has_box:
        given = area_lattice(config.area, on_map=False)
    measurements, plan = _measurements(config, given)
    reach_m = section.of(SurveyOptions).reach_m
    lattice = given or _lattice_about(measurements, reach_m, config.area.resolution_m)
    _check_inside(measurements, lattice, reach_m)
    # A public list holds the cells of whole countries.
    if plan is not None and config.cells.layout != "opencellid":
        check_cells_near(plan, lattice, str(config.cells.plan))
    if predicted is not None and plan is not None:
        predicted = named_by_plan(predicted, plan)
        check_eirp_stated(config, predicted, plan)
    return SurveyInputs(measurements, plan, lattice, predicted)


def _measurements(config: Config, lattice: Lattice | None) -> tuple[Measurements, CellPlan | None]:
    """Return the measurements in the CRS of the lattice or the area, named as in the plan."""
    section = config.prediction.survey
    crs = lattice.crs if lattice is not None else None
    if crs is None and config.area.crs is not None:
        crs = projected_crs(config.area.crs, "area.crs")
    found = measurements_of(config, section.files, crs).accurate(section.max_accuracy_m)
    if not len(found):
        expected = f"positions accurate to {section.max_accuracy_m:g} m"
        raise fail(InputError, "measurements", expected, "none")
    found = without_floor_values(found)
    if config.cells.plan is None:
        return found, None
    plan = planned_cells(config, found.crs)
    found = named_after(found, plan)
    if note := _unplanned(found, plan, str(config.cells.plan)):
        found = replace(found, notes=(*found.notes, note))
    return found, plan


def _unplanned(measurements: Measurements, plan: CellPlan, where: str) -> str:
    """Return a note on the cells received that are not in the plan; "" where all are."""
    ids = measurements.cell_ids
    missing = [cell_id for cell_id in ids if cell_id not in plan]
    if not missing:
        return ""
    if len(missing) < len(ids):
        return (
            f"{len(missing)} of {number_of(len(ids), 'cell')} received are not in {where} "
            f"({listed(missing)}): antennas are located from their levels"
        )
    known = measurements.identities
    names = ["-".join(map(str, known[one])) if one in known else one for one in ids]
    why = foreign_cells(names, plan, "plan")
    why = why or "other names or identities, or another network"
    held = [_with_identity(cell) for cell in plan.cells[:1]]
    return (
        f"none of {number_of(len(ids), 'cell')} received is in {where}: they are such as "
        f"{listed(names, 1)}, the plan's such as {listed(held)} (likely: {why}); antennas are "
        "located from their levels"
    )


def _with_identity(cell: Cell) -> str:
    parts = (cell.mcc, cell.mnc, cell.lac, cell.ci)
    if cell.ci is None:
        return f"{cell.id} without an identity"
    return f"{cell.id} ({'-'.join('?' if part is None else str(part) for part in parts)})"


def _lattice_about(measurements: Measurements, reach_m: float, resolution_m: float) -> Lattice:
    at_m = np.array([measurements.east_m, measurements.north_m])
    west, south = (at_m.min(axis=1) - reach_m).tolist()
    east, north = (at_m.max(axis=1) + reach_m).tolist()
    bounds_m, width_m, height_m = (west, south, east, north), east - west, north - south
    pixels = width_m * height_m / resolution_m**2
    if pixels > LARGEST_AREA_PX:
        expected = f"at most {LARGEST_AREA_PX:.0e} pixels about all measurements"
        got = f"{width_m / 1000:.0f} km x {height_m / 1000:.0f} km at {resolution_m:g} m"
        hint = "a position far off the others; give area.bbox"
        raise fail(InputError, "measurements", expected, got, hint)
    check_scale(measurements.crs, bounds_m, "measurements")
    return Lattice.covering(measurements.crs, bounds_m, resolution_m)


def _check_inside(rows: Measurements, lattice: Lattice, reach_m: float) -> None:
    if not (outside_m(rows.east_m, rows.north_m, lattice) < reach_m).any():
        bounds = ", ".join(f"{value:.0f}" for value in lattice.bounds_m)
        place = f"about {rows.east_m.mean():.0f}, {rows.north_m.mean():.0f}"
        hint = "latitude and longitude swapped, or another area"
        raise fail(InputError, "measurements", f"some in the area {bounds}", place, hint)
