"""Which pictures a survey gets: its maps with the measurements, and what left-out sessions show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio._survey_trend import Covariate
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.measurements import Measurements
from mapfilter.radio.rasters import RxLevRasters
from mapfilter.radio.survey import Survey, SurveyOptions, fit_survey
from mapfilter.report.basemap import BaseMap
from mapfilter.report.survey import SurveyedLevels, plot_left_out, plot_surveyed_levels

Floats = NDArray[np.float64]

_CELLS = 3
_MOST_SESSIONS = 20
_PARTS_OF_ONE_SESSION = 5


@dataclass(frozen=True, eq=False)
class SurveyEvidence:
    """A survey as written, and what it was made from.

    Parameters
    ----------
    measurements : Measurements
        In the CRS of the rasters.
    options : SurveyOptions
    levels, deviations : RxLevRasters
        On one lattice.
    plan : CellPlan, optional
        Where antennas are.
    predicted : mapping of str to callable, optional
        What was calibrated.
    attribution : str
        Whose measurements they are.
    """

    measurements: Measurements
    options: SurveyOptions
    levels: RxLevRasters
    deviations: RxLevRasters
    plan: CellPlan | None = None
    predicted: Mapping[str, Covariate] | None = None
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
    drawn = [folder / "survey-levels.png"]
    plot_surveyed_levels(*_surveyed(survey), drawn[0])
    found, folds = left_out_levels(survey)
    if len(found):
        drawn.append(folder / "survey-left-out.png")
        plot_left_out(
            found[:, 0], found[:, 1], drawn[-1], title=_named(survey, folds),
            trend_dbm=found[:, 2], attribution=survey.attribution,
        )  # fmt: skip
    return tuple(drawn)


def left_out_levels(survey: SurveyEvidence) -> tuple[Floats, int]:
    """Return the levels of sessions left out fold by fold, and the number of folds.

    The folds are those of :func:`~mapfilter.radio.survey_validation.cross_validate`.

    Returns
    -------
    levels_dbm : numpy.ndarray, shape (N, 3)
        Measured, predicted by the other sessions, predicted by their trend alone; a row for each
        measurement within reach of theirs.
    folds : int
    """
    rows = survey.measurements
    fold = _folds(rows)
    found = [np.empty((0, 3))]
    for number in np.unique(fold):
        out = fold == number
        try:
            others = fit_survey(
                rows.where(~out), survey.options, plan=survey.plan, predicted=survey.predicted
            )
        except InputError:
            # The other sessions alone are too little for any cell.
            continue
        found.extend(_told(others, rows.where(out)))
    levels_dbm = np.concatenate(found)
    return levels_dbm[np.isfinite(levels_dbm).all(axis=1)], len(np.unique(fold))


def _told(survey: Survey, left_out: Measurements) -> list[Floats]:
    reach_m = survey.options.reach_m
    found = []
    for index in np.unique(left_out.cell):
        cell = survey.cells.get(left_out.cell_ids[index])
        if cell is None:
            continue
        some = left_out.where(left_out.cell == index)
        near = cell.distance_m(some.east_m, some.north_m, reach_m) <= reach_m
        place = some.east_m[near], some.north_m[near]
        told_dbm = cell.predict(*place)[0], cell.trend.level_dbm(*place)
        found.append(np.column_stack([some.level_dbm[near], *told_dbm]))
    return found


def _folds(rows: Measurements) -> NDArray[np.int64]:
    """Return the fold of each row: its session's, or a part in time where there is only one."""
    sessions, which = np.unique(rows.session, return_inverse=True)
    if len(sessions) > 1:
        return which % _MOST_SESSIONS
    rank = np.argsort(np.argsort(rows.time_s, kind="stable"), kind="stable")
    return rank * _PARTS_OF_ONE_SESSION // max(len(rank), 1)


def _named(survey: SurveyEvidence, folds: int) -> str:
    """Return what was left out, as a title."""
    sessions = len(np.unique(survey.measurements.session))
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
    around = ceil(survey.options.reach_m / whole.resolution_m)
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
