"""``mapfilter predict`` with the model "survey": measurements to RxLev rasters and deviations."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np

from mapfilter._io import VERSION, atomic_file, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter._words import number_of
from mapfilter.config.sections import Config
from mapfilter.database.floor import floor_of
from mapfilter.database.measured import Readings, readings_parquet
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs
from mapfilter.radio.cells import CellPlan, write_cell_plan
from mapfilter.rasters.geotiff import READINGS_TAG
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import save
from mapfilter.report.survey import SurveyedLevels, plot_left_out, plot_surveyed_levels
from mapfilter.survey.cell_model import Covariate
from mapfilter.survey.leave_out import LeftOut, Validation, leave_out
from mapfilter.survey.measured_map import Survey, SurveyOptions, fit_survey
from mapfilter.survey.measurements import Measurements, named_after
from mapfilter.survey.survey_rasters import predicted_levels, surveyed_plan, write_survey
from mapfilter.tracks.misplaced import outside_m
from mapfilter.workflows.pictures import clear_pictures
from mapfilter.workflows.planned_cells import planned_cells
from mapfilter.workflows.served import thinned_lattice
from mapfilter.workflows.stated_power import check_eirp_stated
from mapfilter.workflows.streets import measurements_of
from mapfilter.workflows.world import (
    LARGEST_AREA_PX,
    area_lattice,
    check_cells_near,
    check_scale,
    open_by_section,
)

SURVEY_PICTURES = ("survey-levels.png", "survey-left-out.png")

_CELLS = 3


@dataclass(frozen=True, eq=False)
class SurveyEvidence:
    """A survey as written, with its measurements; all in one CRS, rasters on one lattice."""

    measurements: Measurements
    reach_m: float
    """Places farther from every reading of a cell count as not measured."""
    levels: RxLevRasters
    deviations: RxLevRasters
    left_out: LeftOut | None = None
    """Measured and predicted levels of left-out sessions."""
    attribution: str = ""


def draw_survey(survey: SurveyEvidence, folder: Path) -> tuple[Path, ...]:
    """Draw the three cells with the most measurements, and the sessions left out one by one.

    There is no second picture where nothing could be predicted from other sessions.

    Raises
    ------
    InputError
        A raster is damaged, or no cell of the rasters was measured.
    OutputError
        A picture cannot be written.
    """
    levels, left_out_levels = (folder / name for name in SURVEY_PICTURES)
    save(plot_surveyed_levels(*_surveyed(survey)), levels)
    left_out = survey.left_out
    if left_out is None or not len(left_out):
        return (levels,)
    folds, sessions = left_out.folds, left_out.sessions
    parts = f"{sessions} sessions" + (f" in {folds} groups" if folds < sessions else "")
    if sessions == 1:
        parts = f"{folds} parts of one session"
    drawn = plot_left_out(
        left_out.measured_dbm,
        left_out.predicted_dbm,
        title=f"{parts}, each predicted from the others",
        trend_dbm=left_out.trend_dbm,
        attribution=survey.attribution,
    )
    return levels, save(drawn, left_out_levels)


def _surveyed(survey: SurveyEvidence) -> tuple[list[SurveyedLevels], BaseMap]:
    """Return the cells with the most measurements in reach of the lattice, and its map."""
    rows, whole = survey.measurements, survey.levels.lattice
    near = outside_m(rows.east_m, rows.north_m, whole) <= survey.reach_m
    counts = np.bincount(rows.cell[near], minlength=len(rows.cell_ids))
    cells: list[SurveyedLevels] = []
    for index in np.argsort(-counts, kind="stable").tolist():
        if counts[index] and rows.cell_ids[index] in survey.levels.cell_ids:
            own = rows.where(near & (rows.cell == index))
            cells.append(_cell(survey, own, rows.cell_ids[index]))
        if len(cells) == _CELLS:
            break
    if not cells:
        expected = "measurements of cells of the survey's rasters"
        raise fail(InputError, str(survey.levels.path), expected, "none", "rasters of another area")
    return cells, BaseMap(whole.bounds_m, attribution=survey.attribution)


def _cell(survey: SurveyEvidence, own: Measurements, cell_id: str) -> SurveyedLevels:
    """Return the map about a cell's measurements, thinned to what a picture can show."""
    whole = survey.levels.lattice
    row, col = whole.row_col(own.east_m, own.north_m)
    around = ceil(survey.reach_m / whole.resolution_m)
    top, bottom = np.clip((row.min() - around, row.max() + around), 0, whole.rows - 1).tolist()
    left, right = np.clip((col.min() - around, col.max() + around), 0, whole.cols - 1).tolist()
    part = whole.window(top, left, bottom - top + 1, right - left + 1)
    lattice, _ = thinned_lattice(part)
    level_dbm, deviation_db = (
        replace(rasters, lattice=lattice, resampling="nearest").read(cells=(cell_id,))[0]
        for rasters in (survey.levels, survey.deviations)
    )
    places = own.east_m, own.north_m, own.level_dbm
    return SurveyedLevels(cell_id, lattice, level_dbm, deviation_db, *places)


@dataclass(frozen=True)
class SurveyResult:
    """Size, files and validation of the map of a survey."""

    cells: int
    rows: int
    cols: int
    measurements: int
    """Levels that the map was made from."""
    sessions: int
    rasters: Path
    """Mean levels."""
    deviation: Path
    """Standard deviations of the levels."""
    ground_truth: None
    """A survey has no simulated ground truth."""
    plan: Path
    """The surveyed cells, as CSV: what ``mapfilter build`` takes with these rasters."""
    validation: Validation | None
    """Errors of the prediction of left-out sessions."""
    notes: tuple[str, ...]
    """Rows and cells left out, and what was estimated."""
    pictures: tuple[Path, ...] = ()


def run_survey(config: Config, progress: Progress | None = None) -> SurveyResult:
    """Make the map of a survey's measurements, or calibrate a predicted one with them.

    Without an area the lattice covers the measurements; with rasters to calibrate it is theirs.
    With cross-validation the deviations are stretched to what left-out sessions showed.
    """
    section = config.prediction.survey
    options = section.of(SurveyOptions)
    target, deviation = config.rasters_path, config.deviation_path
    for folder in (target.parent, deviation.parent, config.output.dir):
        ensure_writable_folder(folder)
    inputs = survey_inputs(config)
    measurements, plan, lattice = inputs.measurements, inputs.plan, inputs.lattice
    predicted = _predicted(inputs.predicted, plan)
    left_out = None
    if section.cross_validate:
        left_out = leave_out(
            measurements, options, plan=plan, predicted=predicted, progress=progress
        )
    validation = left_out.validation if left_out is not None else None
    factor = validation.deviation_factor if validation is not None else 1.0
    survey = fit_survey(measurements, options, plan=plan, predicted=predicted)
    readings = readings_parquet(readings_of(measurements))
    ids = write_survey(
        survey,
        lattice,
        target,
        deviation,
        fill=section.fill,
        deviation_factor=factor,
        tags={
            "SOFTWARE": f"mapfilter {VERSION}",
            "MODEL": f"survey {options.method}",
            READINGS_TAG: hashlib.sha256(readings).hexdigest(),
        },
        progress=progress,
    )
    with atomic_file(config.readings_path) as temporary:
        temporary.write_bytes(readings)
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
    pictures: tuple[Path, ...] = ()
    clear_pictures(config.pictures_path, SURVEY_PICTURES)
    if config.output.pictures != "none":
        rasters = open_rasters(target), open_rasters(deviation)
        evidence = SurveyEvidence(measurements, options.reach_m, *rasters, left_out)
        pictures = draw_survey(evidence, config.pictures_path)
    floor_dbm = floor_of(cells, config.database.floor_dbm)
    return SurveyResult(
        cells=len(ids),
        rows=lattice.rows,
        cols=lattice.cols,
        measurements=len(measurements),
        sessions=len(np.unique(measurements.session)),
        rasters=target,
        deviation=deviation,
        ground_truth=None,
        plan=plan_path,
        validation=validation,
        notes=(
            *measurements.notes,
            *survey.notes,
            *(_unfilled(survey, ids) if section.fill else ()),
            *_advice(survey, factor, floor_dbm),
        ),
        pictures=pictures,
    )


def readings_of(measurements: Measurements) -> Readings:
    """Return the readings of a survey, in its CRS; those of one session and time are one report."""
    count = len(measurements)
    serving, advance = measurements.serving, measurements.timing_advance
    return Readings(
        measurements.cell_ids,
        measurements.cell,
        measurements.report,
        measurements.session,
        measurements.east_m,
        measurements.north_m,
        measurements.level_dbm,
        advance if advance is not None else np.full(count, np.nan),
        serving if serving is not None else np.zeros(count, dtype=np.bool_),
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
    if config.cells.plan is None:
        return found, None
    plan = planned_cells(config, found.crs)
    return named_after(found, plan), plan


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


def _predicted(
    rasters: RxLevRasters | None, plan: CellPlan | None
) -> Mapping[str, Covariate] | None:
    if rasters is None:
        return None
    if plan is None and rasters.quantity == "loss":
        hint = "levels are the EIRP of each cell less its loss"
        raise fail(ConfigError, "cells.plan", "the plan of the losses to calibrate", "none", hint)
    return predicted_levels(rasters, plan)


def _unfilled(survey: Survey, ids: Sequence[str]) -> list[str]:
    """Return a note on cells that are not filled in: their trend does not hold far away."""
    count = sum(not survey.can_fill(survey.cells[cell_id]) for cell_id in ids)
    if not count:
        return []
    return [
        f"{number_of(count, 'cell')} not filled beyond {survey.options.reach_m:g} m from readings: "
        f"fewer than {survey.options.min_points_to_fill} squares, or one level everywhere"
    ]


def _advice(survey: Survey, factor: float, floor_dbm: float) -> list[str]:
    weakest_dbm = min(float(cell.points.level_dbm.min()) for cell in survey.cells.values())
    notes = []
    if factor != 1.0:
        notes.append(f"deviations multiplied by {factor:.2f}, as left-out sessions showed")
    if weakest_dbm < floor_dbm:
        notes.append(
            f"levels down to {weakest_dbm:.0f} dBm were measured, below database.floor_dbm = "
            f"{floor_dbm:g}: build leaves out what is weaker than that"
        )
    return notes
