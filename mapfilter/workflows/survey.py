"""``mapfilter predict`` with the model "survey": measurements to RxLev rasters and deviations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter._io import VERSION, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.config.sections import Config, SurveySection
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs
from mapfilter.radio.cells import CellPlan, write_cell_plan
from mapfilter.rasters.raster_set import RxLevRasters, open_rasters
from mapfilter.survey.cell_model import Covariate
from mapfilter.survey.measured_map import Survey, SurveyOptions, Validation, fit_survey, leave_out
from mapfilter.survey.measurements import Measurements, named_after, read_measurements
from mapfilter.survey.survey_rasters import predicted_levels, surveyed_plan, write_survey
from mapfilter.workflows.cover import check_cells_near
from mapfilter.workflows.results import clear_pictures
from mapfilter.workflows.survey_pictures import SURVEY_PICTURES, SurveyEvidence, draw_survey
from mapfilter.workflows.world import (
    LARGEST_AREA_PX,
    area_lattice,
    check_scale,
    open_as_said,
    planned_cells,
)


@dataclass(frozen=True)
class SurveyResult:
    """What was made of a survey.

    Parameters
    ----------
    cells, rows, cols : int
        Counts of cells and pixels.
    measurements, sessions : int
        Levels that the map was made from, and the sessions they come from.
    rasters, deviation : Path
        Mean levels, and how far off they may be.
    ground_truth : None
        A survey has no simulated ground truth.
    plan : Path
        The surveyed cells, as CSV: what ``mapfilter build`` takes with these rasters.
    validation : Validation or None
        How well left-out sessions were told.
    notes : tuple of str
        Rows and cells left out, and what was estimated.
    pictures : tuple of Path
        What was drawn of it, in the folder ``pictures`` of the output.
    """

    cells: int
    rows: int
    cols: int
    measurements: int
    sessions: int
    rasters: Path
    deviation: Path
    ground_truth: None
    plan: Path
    validation: Validation | None
    notes: tuple[str, ...]
    pictures: tuple[Path, ...] = ()


def run_survey(config: Config, progress: Progress | None = None) -> SurveyResult:
    """Make the map of a survey's measurements, or calibrate a predicted one with them.

    Without an area the lattice covers the measurements; with rasters to calibrate it is theirs.
    With cross-validation the deviations are stretched to what left-out sessions showed.

    Raises
    ------
    MapfilterError
        Measurements, area, plan or rasters are wrong or do not fit each other, or the output
        cannot be written.
    """
    section = config.prediction.survey
    target, deviation = config.rasters_path, config.deviation_path
    for folder in (target.parent, deviation.parent, config.output.dir):
        ensure_writable_folder(folder)
    inputs = survey_inputs(config)
    measurements, plan, lattice = inputs.measurements, inputs.plan, inputs.lattice
    predicted = _predicted(inputs.predicted, plan)
    options = _options(section)
    left_out = None
    if section.cross_validate:
        left_out = leave_out(
            measurements, options, plan=plan, predicted=predicted, progress=progress
        )
    validation = left_out.validation if left_out is not None else None
    factor = validation.deviation_factor if validation is not None else 1.0
    survey = fit_survey(measurements, options, plan=plan, predicted=predicted)
    ids = write_survey(
        survey,
        lattice,
        target,
        deviation,
        fill=section.fill,
        deviation_factor=factor,
        tags={"SOFTWARE": f"mapfilter {VERSION}", "MODEL": f"survey {section.method}"},
        progress=progress,
    )
    plan_path = config.output.dir / "cells.csv"
    cells = surveyed_plan(
        survey,
        ids,
        measurements.identities,
        plan,
        height_m=config.cells.height_m,
        eirp_dbm=config.cells.eirp_dbm,
        frequency_mhz=config.cells.frequency_mhz,
    )
    write_cell_plan(cells, plan_path)
    evidence = SurveyEvidence(
        measurements, section.reach_m, open_rasters(target), open_rasters(deviation), left_out
    )
    return SurveyResult(
        len(ids),
        lattice.rows,
        lattice.cols,
        len(measurements),
        len(np.unique(measurements.session)),
        target,
        deviation,
        None,
        plan_path,
        validation,
        (*measurements.notes, *survey.notes, *_advice(config, survey, factor)),
        _draw(config, evidence),
    )


def _draw(config: Config, evidence: SurveyEvidence) -> tuple[Path, ...]:
    """Draw the survey; pictures of an older one make way in any case."""
    folder = config.pictures_path
    clear_pictures(folder, SURVEY_PICTURES)
    return () if config.output.pictures == "none" else draw_survey(evidence, folder)


@dataclass(frozen=True, eq=False)
class SurveyInputs:
    """What a survey is made of.

    Parameters
    ----------
    measurements : Measurements
        In the CRS of the lattice.
    plan : CellPlan or None
        Of the cells whose antennas are known.
    lattice : Lattice
        Of the rasters to be made.
    predicted : RxLevRasters or None
        To calibrate.
    """

    measurements: Measurements
    plan: CellPlan | None
    lattice: Lattice
    predicted: RxLevRasters | None


def survey_inputs(config: Config) -> SurveyInputs:
    """Read what the survey of a configuration is made of.

    Raises
    ------
    MapfilterError
        Measurements, area, plan or rasters are wrong or do not fit each other.
    """
    section = config.prediction.survey
    if not section.files:
        raise fail(ConfigError, "prediction.survey.files", "measurement files", "none")
    predicted = None
    if section.calibrate is not None:
        predicted = open_as_said(section.calibrate, config.rasters)
    given = _given_lattice(config, predicted)
    measurements, plan = _measurements(config, given)
    lattice = given or _lattice_about(measurements, section.reach_m, config.area.resolution_m)
    _check_inside(measurements, lattice, section.reach_m)
    # A public list holds the cells of whole countries.
    if plan is not None and config.cells.layout != "opencellid":
        check_cells_near(plan, lattice, str(config.cells.plan))
    return SurveyInputs(measurements, plan, lattice, predicted)


def _measurements(config: Config, lattice: Lattice | None) -> tuple[Measurements, CellPlan | None]:
    """Return the measurements in the CRS of the lattice or the area, named as in the plan."""
    section = config.prediction.survey
    crs = lattice.crs if lattice is not None else None
    if crs is None and config.area.crs is not None:
        crs = projected_crs(config.area.crs, "area.crs")
    columns = {name: column for name, column in section.columns if column is not None}
    found = read_measurements(
        section.files,
        crs,
        format=section.format,
        columns=columns or None,
        session_gap_s=section.session_gap_s,
    ).accurate(section.max_accuracy_m)
    if not len(found):
        expected = f"positions accurate to {section.max_accuracy_m:g} m"
        raise fail(InputError, "measurements", expected, "none")
    if config.cells.plan is None:
        return found, None
    plan = planned_cells(config, found.crs)
    return named_after(found, plan), plan


def _given_lattice(config: Config, rasters: RxLevRasters | None) -> Lattice | None:
    if rasters is not None:
        return rasters.lattice
    area = config.area
    if area.bbox is None and area.southwest is None:
        return None
    return area_lattice(area, on_map=False)


def _lattice_about(measurements: Measurements, reach_m: float, resolution_m: float) -> Lattice:
    bounds_m = (
        float(measurements.east_m.min()) - reach_m,
        float(measurements.north_m.min()) - reach_m,
        float(measurements.east_m.max()) + reach_m,
        float(measurements.north_m.max()) + reach_m,
    )
    width_m, height_m = bounds_m[2] - bounds_m[0], bounds_m[3] - bounds_m[1]
    pixels = width_m * height_m / resolution_m**2
    if pixels > LARGEST_AREA_PX:
        expected = f"at most {LARGEST_AREA_PX:.0e} pixels about all measurements"
        got = f"{width_m / 1000:.0f} km x {height_m / 1000:.0f} km at {resolution_m:g} m"
        hint = "a position far off the others; give area.bbox"
        raise fail(InputError, "measurements", expected, got, hint)
    check_scale(measurements.crs, bounds_m, "measurements")
    return Lattice.covering(measurements.crs, bounds_m, resolution_m)


def _check_inside(measurements: Measurements, lattice: Lattice, reach_m: float) -> None:
    west, south, east, north = lattice.bounds_m
    inside = (
        (measurements.east_m > west - reach_m)
        & (measurements.east_m < east + reach_m)
        & (measurements.north_m > south - reach_m)
        & (measurements.north_m < north + reach_m)
    )
    if not inside.any():
        bounds = ", ".join(f"{value:.0f}" for value in lattice.bounds_m)
        place = f"about {measurements.east_m.mean():.0f}, {measurements.north_m.mean():.0f}"
        hint = "latitude and longitude swapped, or another area"
        raise fail(InputError, "measurements", f"some in the area {bounds}", place, hint)


def _predicted(
    rasters: RxLevRasters | None, plan: CellPlan | None
) -> Mapping[str, Covariate] | None:
    if rasters is None:
        return None
    if plan is None and rasters.quantity == "loss":
        hint = "the cell plan says what to take the losses from"
        raise fail(ConfigError, "cells.plan", "the plan of the losses to calibrate", "none", hint)
    return predicted_levels(rasters, plan)


def _options(section: SurveySection) -> SurveyOptions:
    return SurveyOptions(
        method=section.method,
        trend=section.trend,
        reach_m=section.reach_m,
        min_points=section.min_points,
        min_points_to_locate=section.min_points_to_locate,
        neighbours=section.neighbours,
        square_m=section.square_m,
    )


def _advice(config: Config, survey: Survey, factor: float) -> list[str]:
    weakest_dbm = min(float(cell.points.level_dbm.min()) for cell in survey.cells.values())
    told = []
    if factor != 1.0:
        told.append(f"deviations multiplied by {factor:.2f}, as left-out sessions showed")
    if weakest_dbm < config.database.floor_dbm:
        told.append(
            f"levels down to {weakest_dbm:.0f} dBm were measured, below database.floor_dbm = "
            f"{config.database.floor_dbm:g}: build leaves out what is weaker than that"
        )
    return told
