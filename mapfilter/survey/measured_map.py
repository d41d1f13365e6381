"""Measured maps: levels with positions become mean and deviation at every place near them.

Each cell's levels are a trend (path loss from its antenna, or a calibrated prediction) and
residuals about it: a Gaussian process, or nearest neighbours. An antenna of unknown place is
located from the levels.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import ThreadpoolController

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.radio.cells import CellPlan
from mapfilter.survey.cell_trends import (
    TrendRules,
    offsets_of_prediction,
    often_enough,
    predicted_alone,
)
from mapfilter.survey.expected_offsets import ExpectedOffset
from mapfilter.survey.level_trend import Covariate, DistanceLoss, Trend
from mapfilter.survey.measured_points import Points, points_by_cell
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.residual_field import (
    GaussianField,
    NeighbourField,
    ResidualField,
    Shadowing,
    TrendField,
    learn_shadowing,
    most_telling,
)
from mapfilter.survey.weakest_reported import WeakestReported, weakest_reported

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_ROUNDS = 2


@cache
def thread_pools() -> ThreadpoolController:
    """Return the thread pools of the libraries that are loaded; finding them takes long."""
    return ThreadpoolController()


@dataclass(frozen=True, eq=False)
class SurveyedCell:
    """The map of one cell.

    Parameters
    ----------
    field : ResidualField
        Trend and residuals.
    antenna : (float, float) or None
        Known or estimated place, east and north (m).
    estimated : bool
        Whether the place was estimated from the levels.
    measured : scipy.spatial.cKDTree
        Places of all readings.
    """

    points: Points
    trend: Trend
    field: ResidualField
    antenna: tuple[float, float] | None
    estimated: bool
    measured: cKDTree

    @property
    def has_given_trend(self) -> bool:
        """Whether the trend is about a given antenna or prediction."""
        return self.trend.covariate is not None and not self.estimated

    def distance_m(self, east_m: Floats, north_m: Floats, beyond_m: float = np.inf) -> Floats:
        """Return how far places are from the nearest reading; infinite beyond ``beyond_m``."""
        # The bound itself must still count.
        bound_m = np.nextafter(beyond_m, np.inf)
        places = np.column_stack([east_m, north_m])
        return np.asarray(self.measured.query(places, distance_upper_bound=bound_m)[0])

    def predict(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return the mean level (dBm) and the deviation (dB) of a new reading at places."""
        # Threads make small matrices slower, and their sums depend on how many there are.
        with thread_pools().limit(limits=1):
            return self.field.predict(east_m, north_m)


@dataclass(frozen=True, eq=False)
class Survey:
    """The maps of all cells.

    Parameters
    ----------
    shadowing : Shadowing
        Learnt from all cells together.
    cells : mapping of str to SurveyedCell
        In the order of their ids.
    expected : mapping of str to ExpectedOffset
        Of the cells of the plan that were predicted, not measured: how far their levels are from
        the prediction, as the other cells let expect.
    weakest : mapping of str to WeakestReported
        What bounds the levels of cells that are not in the reports, by
        :func:`~mapfilter.survey.weakest_reported.scale_of` their technology.
    technologies : mapping of str to str
        Of the cells of which it is known.
    notes : tuple of str
        What was left out or estimated.
    """

    crs: str
    options: SurveyOptions
    shadowing: Shadowing
    cells: Mapping[str, SurveyedCell]
    expected: Mapping[str, ExpectedOffset]
    weakest: Mapping[str, WeakestReported]
    technologies: Mapping[str, str]
    notes: tuple[str, ...]

    def can_fill(self, cell: SurveyedCell) -> bool:
        """Return whether a cell's trend holds far from its readings.

        That about a given antenna or prediction does. That of few levels does not, nor of levels
        which are all the same, as those at the end of a phone's scale.
        """
        if cell.has_given_trend:
            return True
        count = len(cell.points)
        if count < self.options.min_points_to_fill:
            return False
        # Few levels may be the same by chance.
        few = count < self.options.min_points_to_locate
        return few or bool(np.ptp(cell.points.level_dbm) > 0)


def fit_survey(
    measurements: Measurements,
    options: SurveyOptions,
    *,
    plan: CellPlan | None = None,
    predicted: Mapping[str, Covariate] | None = None,
    only: Collection[str] | None = None,
) -> Survey:
    """Make the maps of all cells that were received often enough.

    Parameters
    ----------
    plan : CellPlan, optional
        Positions of the antennas it names; the others are located from their levels.
    predicted : mapping of str to callable, optional
        Calibrate predictions: for each cell a function from east and north (m) to the predicted
        level (dBm, NaN where there is none). Offset, slope and residuals are fitted about it, the
        offset drawn towards that of the other cells. Cells that were not predicted are left out.
    only : collection of str, optional
        Make the maps of these cells alone. The shadowing is that of all.

    Raises
    ------
    InputError
        No cell was received often enough, or none was predicted.
    """
    found = points_by_cell(measurements, options.square_m, options.most_points)
    strange: tuple[str, ...] = ()
    if predicted is not None:
        found, strange = predicted_alone(found, predicted)
    points, few = often_enough(found, options.min_points, calibrated=predicted is not None)
    level_dbm = float(np.mean([some.level_dbm.mean() for some in points]))
    plan = plan.to_crs(measurements.crs) if plan is not None else None
    rules, shadowing = TrendRules(options, level_dbm, plan, predicted), Shadowing()
    wanted = [some for some in points if only is None or some.cell_id in only]
    # Threads make small matrices slower, and their sums depend on how many there are.
    with thread_pools().limit(limits=1):
        telling = most_telling(points)
        for _ in range(_ROUNDS):
            trends = [rules.trend(some, shadowing) for some in telling]
            shadowing = learn_shadowing(telling, trends, shadowing)
        if predicted is not None:
            offsets = offsets_of_prediction(points, predicted, plan, shadowing)
            rules = replace(rules, offsets=offsets)
        cells = {some.cell_id: _surveyed(some, rules, shadowing) for some in wanted}
    known = {some.cell_id for some in points}
    return Survey(
        measurements.crs,
        options,
        shadowing,
        cells,
        {one: offset for one, offset in rules.offsets.items() if one not in known},
        weakest_reported(measurements),
        measurements.technologies,
        (*strange, *few, *_antenna_notes(cells.values(), rules)),
    )


def _surveyed(points: Points, rules: TrendRules, shadowing: Shadowing) -> SurveyedCell:
    # Here, as it takes long to import, and the types above are of use without it.
    from scipy.spatial import cKDTree

    trend, options, plan = rules.trend(points, shadowing), rules.options, rules.plan
    antenna = trend.covariate if isinstance(trend.covariate, DistanceLoss) else None
    made: ResidualField = TrendField(trend, shadowing)
    if options.method == "gp":
        made = GaussianField(points, trend, shadowing)
    elif options.method == "knn":
        made = NeighbourField(points, trend, shadowing, options.neighbours)
    return SurveyedCell(
        points,
        trend,
        made,
        (antenna.east_m, antenna.north_m) if antenna is not None else None,
        antenna is not None and not (plan is not None and points.cell_id in plan),
        cKDTree(points.measured_at),
    )


def _antenna_notes(cells: Collection[SurveyedCell], rules: TrendRules) -> list[str]:
    """Return notes on antennas that were located from their levels, and that could not be."""
    notes, options = [], rules.options
    if located := sum(cell.estimated for cell in cells):
        notes.append(f"{number_of(located, 'antenna')} located from their levels")
    unknown = sum(cell.antenna is None for cell in cells)
    if unknown and rules.predicted is None and options.trend == "path_loss":
        notes.append(
            f"{number_of(unknown, 'antenna')} not located (fewer than "
            f"{options.min_points_to_locate} squares): the trend is their mean level"
        )
    return notes
