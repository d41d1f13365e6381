"""Left-out sessions: what a survey predicts where it was not made, and how far off that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mapfilter._parallel import Progress
from mapfilter._types import Floats, Ints
from mapfilter.errors import InputError
from mapfilter.radio.cells import CellPlan
from mapfilter.survey.level_trend import Covariate
from mapfilter.survey.measured_map import Survey, fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions

_MOST_FOLDS = 20
_PARTS_OF_ONE_SESSION = 5
_WITHIN_1 = 0.6827


@dataclass(frozen=True)
class Validation:
    """Errors at measurements that were left out, over all folds.

    Parameters
    ----------
    folds : int
        Times that the map was made anew.
    by_session : bool
        Whether whole sessions were left out, or parts in time of the only one.
    measurements, predicted : int
        Left out in all, and how many of them the map predicts: cell known, within reach.
    rmse_db, trend_rmse_db, mean_rmse_db : float
        Root mean square error of the map, of its trend alone, and of each cell's mean level.
    bias_db : float
        Mean of measured less predicted.
    within_1_deviation, within_2_deviations : float
        Share of the errors within so many predicted deviations; 0.68 and 0.95 when they are right.
    deviation_factor : float
        By which the predicted deviations are to be multiplied so that 68 % of the errors are within
        one; 1 where nothing was predicted.
    """

    folds: int
    by_session: bool
    measurements: int
    predicted: int
    rmse_db: float
    trend_rmse_db: float
    mean_rmse_db: float
    bias_db: float
    within_1_deviation: float
    within_2_deviations: float
    deviation_factor: float


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """Levels measured in what was left out, and their predictions by the map of the rest.

    Parameters
    ----------
    folds, sessions, measurements : int
        Maps that were made, sessions of the measurements, and measurements left out in all.
    measured_dbm : numpy.ndarray, shape (N,)
        Of the measurements that the map predicts: cell known, within reach.
    predicted_dbm, deviation_db : numpy.ndarray, shape (N,)
        By the map of the rest.
    trend_dbm, mean_dbm : numpy.ndarray, shape (N,)
        By its trend alone, and by each cell's mean level.
    """

    folds: int
    sessions: int
    measurements: int
    measured_dbm: Floats
    predicted_dbm: Floats
    deviation_db: Floats
    trend_dbm: Floats
    mean_dbm: Floats

    def __len__(self) -> int:
        return len(self.measured_dbm)

    @property
    def validation(self) -> Validation:
        """The errors in a few figures."""
        counts = self.folds, self.sessions > 1, self.measurements, len(self)
        if not len(self):
            nan = float("nan")
            return Validation(*counts, nan, nan, nan, nan, nan, nan, 1.0)
        error_db = self.measured_dbm - self.predicted_dbm
        relative = np.abs(error_db) / self.deviation_db
        return Validation(
            *counts,
            rms(error_db),
            rms(self.measured_dbm - self.trend_dbm),
            rms(self.measured_dbm - self.mean_dbm),
            float(np.mean(error_db)),
            float(np.mean(relative <= 1)),
            float(np.mean(relative <= 2)),
            float(np.quantile(relative, _WITHIN_1)),
        )


def rms(values: Floats) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def leave_out(
    measurements: Measurements,
    options: SurveyOptions,
    *,
    plan: CellPlan | None = None,
    predicted: Mapping[str, Covariate] | None = None,
    progress: Progress | None = None,
) -> LeftOut:
    """Leave each session out, make the map of the others, and predict the levels left out.

    Everything is learnt anew for each fold, the shadowing and the antennas' places too. With more
    than 20 sessions several are left out together. ``progress`` is called with (folds done, folds
    in all), the other arguments are those of :func:`fit_survey`.
    """
    fold, sessions = _folds(measurements)
    count = int(fold.max()) + 1 if len(fold) else 0
    found = [np.empty((0, 5))]
    for number in range(count):
        out = fold == number
        # Maps of cells that were not received here predict nothing.
        only = {measurements.cell_ids[index] for index in np.unique(measurements.cell[out])}
        others = measurements.where(~out)
        try:
            survey = fit_survey(others, options, plan=plan, predicted=predicted, only=only)
        except InputError:
            # The other sessions alone are too little for any cell.
            pass
        else:
            found.extend(_predictions(survey, measurements.where(out)))
        if progress is not None:
            progress(number + 1, count)
    table = np.concatenate(found)
    table = table[np.isfinite(table).all(axis=1)]
    return LeftOut(count, sessions, len(measurements), *table.T)


def _folds(measurements: Measurements) -> tuple[Ints, int]:
    """Return the fold of each measurement, and the number of sessions."""
    sessions, which = np.unique(measurements.session, return_inverse=True)
    if len(sessions) > 1:
        return which % _MOST_FOLDS, len(sessions)
    order = np.argsort(measurements.time_s, kind="stable")
    fold = np.empty(len(order), dtype=np.int64)
    fold[order] = np.arange(len(order)) * _PARTS_OF_ONE_SESSION // max(len(order), 1)
    return fold, len(sessions)


def _predictions(survey: Survey, left_out: Measurements) -> list[Floats]:
    """Return for each cell the columns of :class:`LeftOut`, a row per measurement in reach."""
    reach_m, found = survey.options.reach_m, []
    for index in np.unique(left_out.cell):
        cell = survey.cells.get(left_out.cell_ids[index])
        if cell is None:
            continue
        some = left_out.where(left_out.cell == index)
        near = cell.distance_m(some.east_m, some.north_m, reach_m) <= reach_m
        place = some.east_m[near], some.north_m[near]
        mean_dbm = np.full(len(place[0]), cell.points.level_dbm.mean())
        predicted = *cell.predict(*place), cell.trend.level_dbm(*place), mean_dbm
        found.append(np.column_stack((some.level_dbm[near], *predicted)))
    return found
