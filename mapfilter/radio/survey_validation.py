"""How good a measured map is at places and times that it was not made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapfilter._parallel import Progress
from mapfilter.errors import InputError
from mapfilter.radio._survey_trend import Covariate
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.measurements import Measurements
from mapfilter.radio.survey import SurveyOptions, fit_survey

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


def cross_validate(
    measurements: Measurements,
    options: SurveyOptions,
    *,
    plan: CellPlan | None = None,
    predicted: Mapping[str, Covariate] | None = None,
    progress: Progress | None = None,
) -> Validation:
    """Leave each session out, make the map of the others, and compare.

    Everything is learnt anew for each fold, the shadowing and the antennas' places too. With more
    than 20 sessions several are left out together.

    Parameters
    ----------
    measurements, options, plan, predicted
        As for :func:`~mapfilter.radio.survey.fit_survey`.
    progress : callable, optional
        Called with (folds done, folds in all).
    """
    fold, by_session = _folds(measurements)
    count = int(fold.max()) + 1 if len(fold) else 0
    found = []
    for number in range(count):
        out = fold == number
        try:
            errors = _errors(
                measurements.where(~out), measurements.where(out), options, plan, predicted
            )
            found.append(errors)
        except InputError:
            # The other sessions alone are too little for any cell.
            found.append(np.empty((0, 4)))
        if progress is not None:
            progress(number + 1, count)
    table = np.concatenate([*found, np.empty((0, 4))])
    error_db, deviation_db = table[:, 0], table[:, 3]
    return Validation(
        count,
        by_session,
        len(measurements),
        len(table),
        _rms(error_db),
        _rms(table[:, 1]),
        _rms(table[:, 2]),
        _mean(error_db),
        _mean(np.abs(error_db) <= deviation_db),
        _mean(np.abs(error_db) <= 2 * deviation_db),
        float(np.quantile(np.abs(error_db) / deviation_db, _WITHIN_1)) if len(table) else 1.0,
    )


def _folds(measurements: Measurements) -> tuple[NDArray[np.int64], bool]:
    sessions, which = np.unique(measurements.session, return_inverse=True)
    if len(sessions) > 1:
        return which % _MOST_FOLDS, True
    order = np.argsort(measurements.time_s, kind="stable")
    fold = np.empty(len(order), dtype=np.int64)
    fold[order] = np.arange(len(order)) * _PARTS_OF_ONE_SESSION // max(len(order), 1)
    return fold, False


def _errors(
    known: Measurements,
    left_out: Measurements,
    options: SurveyOptions,
    plan: CellPlan | None,
    predicted: Mapping[str, Covariate] | None,
) -> NDArray[np.float64]:
    """Return errors of map, trend and mean, and the deviation, a row per measurement in reach."""
    survey = fit_survey(known, options, plan=plan, predicted=predicted)
    found = [np.empty((0, 4))]
    for index in np.unique(left_out.cell):
        cell = survey.cells.get(left_out.cell_ids[index])
        if cell is None:
            continue
        some = left_out.where(left_out.cell == index)
        near = cell.distance_m(some.east_m, some.north_m, options.reach_m) <= options.reach_m
        east_m, north_m = some.east_m[near], some.north_m[near]
        mean_dbm, deviation_db = cell.predict(east_m, north_m)
        told = np.column_stack(
            [
                mean_dbm,
                cell.trend.level_dbm(east_m, north_m),
                np.full(len(east_m), cell.points.level_dbm.mean()),
            ]
        )
        rows = np.column_stack([some.level_dbm[near][:, None] - told, deviation_db])
        found.append(rows[np.isfinite(rows).all(axis=1)])
    return np.concatenate(found)


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if values.size else float("nan")
