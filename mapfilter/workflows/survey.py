"""``mapfilter predict`` with the model "survey": measurements to RxLev rasters and deviations."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter._io import atomic_file, ensure_writable_folder, program_version
from mapfilter._parallel import Progress
from mapfilter._words import number_of
from mapfilter.config.sections import Config
from mapfilter.database.floor import floor_of
from mapfilter.database.measured import Readings
from mapfilter.database.measured_files import readings_parquet
from mapfilter.errors import ConfigError, fail, listed
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_files import write_cell_plan
from mapfilter.rasters.geotiff import READINGS_TAG
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.survey.leave_out import Validation, leave_out
from mapfilter.survey.level_trend import Covariate
from mapfilter.survey.measured_map import Survey, fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.plan_faults import plan_faults
from mapfilter.survey.survey_rasters import predicted_levels, surveyed_plan, write_survey
from mapfilter.workflows.inputs.survey_inputs import survey_inputs
from mapfilter.workflows.outputs.pictures import clear_pictures
from mapfilter.workflows.outputs.survey_pictures import SURVEY_PICTURES, SurveyEvidence, draw_survey

_NAMED = 6


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
        predicted=predicted,
        fill=section.fill,
        deviation_factor=factor,
        tags={
            "SOFTWARE": f"mapfilter {program_version()}",
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
        technologies=measurements.technologies,
        codes=measurements.codes,
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
            *(inputs.predicted.notes if inputs.predicted is not None else ()),
            *(plan.notes if plan is not None else ()),
            *measurements.notes,
            *survey.notes,
            *plan_faults(survey, plan, predicted),
            *_unmeasured(inputs.predicted, survey, ids),
            *_unvalidated(validation, options.reach_m),
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


def _predicted(
    rasters: RxLevRasters | None, plan: CellPlan | None
) -> Mapping[str, Covariate] | None:
    if rasters is None:
        return None
    if plan is None and rasters.quantity == "loss":
        hint = "levels are the EIRP of each cell less its loss"
        raise fail(ConfigError, "cells.plan", "the plan of the losses to calibrate", "none", hint)
    return predicted_levels(rasters, plan)


def _unmeasured(
    predicted: RxLevRasters | None, survey: Survey, ids: Sequence[str]
) -> Iterator[str]:
    """Yield notes on cells of a prediction that were not measured, or not often enough."""
    held, cells = set(ids), predicted.cell_ids if predicted is not None else ()
    missing = [one for one in cells if one not in held]
    count = number_of(len(cells), "cell")
    expected = [
        f"{one} by {offset.offset_db:+.1f} ± {offset.deviation_db:.1f} dB"
        for one, offset in survey.expected.items()
        if one in held
    ]
    if expected:
        yield (
            f"{len(expected)} of {count} of the prediction were measured too rarely or never, and "
            f"are corrected as the others let expect: {listed(expected, _NAMED)} (standard "
            "deviation of the offset)"
        )
    if missing:
        yield (
            f"{len(missing)} of {count} of the prediction are not in the result, measured too "
            f"rarely or never: {listed(missing, _NAMED)} (prediction.survey.fill keeps and "
            "corrects those that are in cells.plan)"
        )


def _unvalidated(validation: Validation | None, reach_m: float) -> list[str]:
    """Return a note where no measurement that was left out could be compared with the others."""
    if validation is None or validation.predicted:
        return []
    apart = "sessions" if validation.by_session else "parts of the session"
    return [
        f"not validated: no two {apart} have measurements of one cell within {reach_m:g} m of each "
        "other, so that errors and deviations are those that the model assumes"
    ]


def _unfilled(survey: Survey, ids: Sequence[str]) -> list[str]:
    """Return a note on cells that are not filled in: their trend does not hold far away."""
    measured = (survey.cells[cell_id] for cell_id in ids if cell_id in survey.cells)
    count = sum(not survey.can_fill(cell) for cell in measured)
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
