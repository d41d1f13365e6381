"""Pictures of a survey: the cells with the most measurements, and the sessions left out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.lattice import outside_m
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.report.basemap import BaseMap
from mapfilter.report.saving import save
from mapfilter.report.survey import SurveyedLevels, plot_left_out, plot_surveyed_levels
from mapfilter.survey.leave_out import LeftOut
from mapfilter.survey.measurements import Measurements
from mapfilter.workflows.outputs.served import thinned_lattice

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
