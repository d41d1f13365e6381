"""Which pictures a survey gets: its maps with the measurements, and what left-out sessions show."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio.measurements import Measurements
from mapfilter.radio.rasters import RxLevRasters
from mapfilter.radio.survey_validation import LeftOut
from mapfilter.report.basemap import BaseMap
from mapfilter.report.survey import SurveyedLevels, plot_left_out, plot_surveyed_levels

SURVEY_PICTURES = ("survey-levels.png", "survey-left-out.png")

_CELLS = 3


@dataclass(frozen=True, eq=False)
class SurveyEvidence:
    """A survey as written, and what it was made from.

    Parameters
    ----------
    measurements : Measurements
        In the CRS of the rasters.
    reach_m : float
        Places farther from every reading of a cell count as not measured.
    levels, deviations : RxLevRasters
        On one lattice.
    left_out : LeftOut, optional
        What left-out sessions showed.
    attribution : str
        Whose measurements they are.
    """

    measurements: Measurements
    reach_m: float
    levels: RxLevRasters
    deviations: RxLevRasters
    left_out: LeftOut | None = None
    attribution: str = ""


def draw_survey(survey: SurveyEvidence, folder: Path) -> tuple[Path, ...]:
    """Draw the three cells with the most measurements, and the sessions left out one by one.

    Without a left-out measurement that the others could tell there is no second picture.

    Raises
    ------
    InputError
        A raster is damaged, or no cell of the rasters was measured.
    OutputError
        A picture cannot be written.
    """
    levels, left_out_levels = (folder / name for name in SURVEY_PICTURES)
    plot_surveyed_levels(*_surveyed(survey), levels)
    told = survey.left_out
    if told is None or not len(told):
        return (levels,)
    plot_left_out(
        told.measured_dbm, told.predicted_dbm, left_out_levels, title=_named(told),
        trend_dbm=told.trend_dbm, attribution=survey.attribution,
    )  # fmt: skip
    return levels, left_out_levels


def _named(left_out: LeftOut) -> str:
    """Return what was left out, as a title."""
    folds, sessions = left_out.folds, left_out.sessions
    if sessions == 1:
        return f"{folds} parts of one session, each told by the others"
    groups = f" in {folds} groups" if folds < sessions else ""
    return f"{sessions} sessions{groups}, each told by the others"


def _surveyed(survey: SurveyEvidence) -> tuple[list[SurveyedLevels], Lattice, BaseMap]:
    """Return the cells with the most measurements, the lattice about these, and its map."""
    rows, whole = survey.measurements, survey.levels.lattice
    row, col = whole.row_col(rows.east_m, rows.north_m)
    on = np.asarray(whole.contains(row, col))
    counts = np.bincount(rows.cell[on], minlength=len(rows.cell_ids))
    shown = [
        index
        for index in np.argsort(-counts, kind="stable").tolist()
        if counts[index] and rows.cell_ids[index] in survey.levels.cell_ids
    ][:_CELLS]
    if not shown:
        expected = "measurements of cells of the survey's rasters"
        raise fail(InputError, str(survey.levels.path), expected, "none", "rasters of another area")
    there = on & np.isin(rows.cell, shown)
    around = ceil(survey.reach_m / whole.resolution_m)
    top, left = max(row[there].min() - around, 0), max(col[there].min() - around, 0)
    bottom = min(row[there].max() + around, whole.rows - 1)
    right = min(col[there].max() + around, whole.cols - 1)
    window = int(top), int(left), int(bottom - top) + 1, int(right - left) + 1
    cells = []
    for index in shown:
        cell_id, own = rows.cell_ids[index], rows.where(there & (rows.cell == index))
        level_dbm = survey.levels.read(window, (cell_id,))[0]
        deviation_db = survey.deviations.read(window, (cell_id,))[0]
        cells.append(
            SurveyedLevels(cell_id, level_dbm, deviation_db, own.east_m, own.north_m, own.level_dbm)
        )
    area = whole.window(*window)
    return cells, area, BaseMap(area.bounds_m, attribution=survey.attribution)
