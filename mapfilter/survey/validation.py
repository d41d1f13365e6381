"""How good a measured map is at places and times that it was not made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mapfilter._parallel import Progress
from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import InputError
from mapfilter.radio.cells import CellPlan
from mapfilter.survey.fit import Survey, SurveyOptions, fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.trend import Covariate

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
        Whether whole sessions were left out; otherwise there is one session, and its parts in time
        were.
    measurements, predicted : int
        Left out in all, and how many of them the map could tell: cell known, within reach.
    rmse_db, trend_rmse_db, mean_rmse_db : float
        Root mean square error of the map, of its trend alone, and of each cell's mean level.
    bias_db : float
        Mean of measured less predicted.
    within_1_deviation, within_2_deviations : float
        Share of the errors within so many predicted deviations; 0.68 and 0.95 when they are right.
    deviation_factor : float
        What to multiply the predicted deviations by so that 68 % of the errors are within one; 1
        where nothing was told.
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
    """Levels measured in what was left out, and what the map of the rest tells of them.

    Parameters
    ----------
    folds : int
        Times that the map was made anew.
    sessions : int
        Of the measurements; of one alone, parts in time were left out.
    measurements : int
        Left out in all.
    measured_dbm : numpy.ndarray, shape (N,)
        Of those that the map could tell: cell known, within reach.
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
        error_db = self.measured_dbm - self.predicted_dbm
        relative = np.abs(error_db) / self.deviation_db
        return Validation(
            self.folds,
            self.sessions > 1,
            self.measurements,
            len(self),
            _rms(error_db),
            _rms(self.measured_dbm - self.trend_dbm),
            _rms(self.measured_dbm - self.mean_dbm),
            _mean(error_db),
            _mean(relative <= 1),
            _mean(relative <= 2),
            float(np.quantile(relative, _WITHIN_1)) if len(self) else 1.0,
        )


def leave_out(
    measurements: Measurements,
    options: SurveyOptions,
    *,
    plan: CellPlan | None = None,
    predicted: Mapping[str, Covariate] | None = None,
    progress: Progress | None = None,
) -> LeftOut:
    """Leave each session out, make the map of the others, and tell what they say of it.

    Everything is learnt anew for each fold, the shadowing and the antennas' places too. With more
    than 20 sessions several are left out together.

    Parameters
    ----------
    measurements, options, plan, predicted
        As for :func:`~mapfilter.survey.fit.fit_survey`.
    progress : callable, optional
        Called with (folds done, folds in all).
    """
    fold, sessions = _folds(measurements)
    count = int(fold.max()) + 1 if len(fold) else 0
    found = [np.empty((0, 5))]
    for number in range(count):
        out = fold == number
        try:
            others = fit_survey(measurements.where(~out), options, plan=plan, predicted=predicted)
        except InputError:
            # The other sessions alone are too little for any cell.
            pass
        else:
            found.extend(_told(others, measurements.where(out)))
        if progress is not None:
            progress(number + 1, count)
    table = np.concatenate(found)
    table = table[np.isfinite(table).all(axis=1)]
    return LeftOut(count, sessions, len(measurements), *table.T)


def cross_validate(
    measurements: Measurements,
    options: SurveyOptions,
    *,
    plan: CellPlan | None = None,
    predicted: Mapping[str, Covariate] | None = None,
    progress: Progress | None = None,
) -> Validation:
    """Return the errors of what :func:`leave_out` finds, in a few figures."""
    return leave_out(
        measurements, options, plan=plan, predicted=predicted, progress=progress
    ).validation


def _folds(measurements: Measurements) -> tuple[Ints, int]:
    """Return the fold of each measurement, and the number of sessions."""
    sessions, which = np.unique(measurements.session, return_inverse=True)
    if len(sessions) > 1:
        return which % _MOST_FOLDS, len(sessions)
    order = np.argsort(measurements.time_s, kind="stable")
    fold = np.empty(len(order), dtype=np.int64)
    fold[order] = np.arange(len(order)) * _PARTS_OF_ONE_SESSION // max(len(order), 1)
    return fold, len(sessions)


def _told(survey: Survey, left_out: Measurements) -> list[Floats]:
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
        told = some.level_dbm[near], *cell.predict(*place), cell.trend.level_dbm(*place), mean_dbm
        found.append(np.column_stack(told))
    return found


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def _mean(values: Floats | Bools) -> float:
    return float(np.mean(values)) if values.size else float("nan")
