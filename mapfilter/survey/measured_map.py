"""Measured maps: levels with positions become mean and deviation at every place near them.

Each cell's levels are a trend (path loss from its antenna, or a calibrated prediction) and
residuals about it: a Gaussian process, or nearest neighbours. An antenna of unknown place is
located from the levels.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import ThreadpoolController

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail, listed
from mapfilter.radio.cells import CellPlan
from mapfilter.survey.expected_offsets import ExpectedOffset, expected_offsets, measured_offset
from mapfilter.survey.level_trend import (
    OFFSET_DEVIATION_DB,
    Covariate,
    DistanceLoss,
    Prior,
    Trend,
    fit_trend,
    locate_antenna,
)
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
_NAMED = 3
_LOCATED_FROM = 300


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
        No cell was received often enough.
    """
    found = points_by_cell(measurements, options.square_m, options.most_points)
    notes = []
    if predicted is not None:
        strange = [cell_id for cell_id in found if cell_id not in predicted]
        example = next(iter(predicted), "none")
        if strange and len(strange) == len(found):
            expected = f"cells of the prediction, such as {example}"
            got = f"none in {number_of(len(found), 'cell')}, such as {strange[0]}"
            raise fail(InputError, "measurements", expected, got, _renamed(strange, predicted))
        if strange:
            notes.append(
                f"{number_of(len(strange), 'cell')} left out: not in the prediction, which has "
                f"such as {example}: {listed(strange, _NAMED)} (likely: "
                f"{_renamed(strange, predicted)})"
            )
        found = {
            cell_id: some.some(np.isfinite(predicted[cell_id](some.east_m, some.north_m)))
            for cell_id, some in found.items()
            if cell_id in predicted
        }
    from scipy.spatial import cKDTree

    points = [some for some in found.values() if len(some) >= options.min_points]
    if len(points) < len(found):
        few = len(found) - len(points)
        left = "left out" if predicted is None else "without a calibration of its own"
        cause = f"received in fewer than {options.min_points} squares"
        notes.append(f"{number_of(few, 'cell')} {left}: {cause}")
    if not points:
        expected = f"a cell received in at least {options.min_points} squares"
        raise fail(
            InputError,
            "measurements",
            expected,
            f"{number_of(len(found), 'cell')}, none of them",
        )
    level_dbm = float(np.mean([some.level_dbm.mean() for some in points]))
    plan = plan.to_crs(measurements.crs) if plan is not None else None
    shadowing = Shadowing()
    offsets: dict[str, ExpectedOffset] = {}
    unknown_offset = ExpectedOffset(0.0, OFFSET_DEVIATION_DB)

    def trend_of(points: Points) -> Trend:
        prior = Prior(level_dbm)
        covariate: Covariate | None = None
        if predicted is not None:
            offset = offsets.get(points.cell_id, unknown_offset)
            prior = Prior.of_prediction(offset.offset_db, offset.deviation_db)
            covariate = predicted[points.cell_id]
        elif options.trend == "path_loss" and plan is not None and points.cell_id in plan:
            covariate = DistanceLoss.of_cell(plan[points.cell_id])
        elif options.trend == "path_loss" and len(points) >= options.min_points_to_locate:
            some = points.thinned(_LOCATED_FROM)
            covariate = locate_antenna(some, shadowing.covariance_db2(some), prior)
        return fit_trend(covariate, points, shadowing.covariance_db2(points), prior)

    cells = {}
    # Threads make small matrices slower, and their sums depend on how many there are.
    with thread_pools().limit(limits=1):
        telling = most_telling(points)
        for _ in range(_ROUNDS):
            shadowing = learn_shadowing(telling, [trend_of(some) for some in telling], shadowing)
        if predicted is not None:
            offsets = _expected(points, predicted, plan, shadowing)
        for some in points:
            if only is not None and some.cell_id not in only:
                continue
            trend = trend_of(some)
            antenna = trend.covariate if isinstance(trend.covariate, DistanceLoss) else None
            made: ResidualField = TrendField(trend, shadowing)
            if options.method == "gp":
                made = GaussianField(some, trend, shadowing)
            elif options.method == "knn":
                made = NeighbourField(some, trend, shadowing, options.neighbours)
            cells[some.cell_id] = SurveyedCell(
                some,
                trend,
                made,
                (antenna.east_m, antenna.north_m) if antenna is not None else None,
                antenna is not None and not (plan is not None and some.cell_id in plan),
                cKDTree(some.measured_at),
            )
    located = sum(cell.estimated for cell in cells.values())
    if located:
        notes.append(f"{number_of(located, 'antenna')} located from their levels")
    unknown = sum(cell.antenna is None for cell in cells.values())
    if unknown and predicted is None and options.trend == "path_loss":
        notes.append(
            f"{number_of(unknown, 'antenna')} not located (fewer than "
            f"{options.min_points_to_locate} squares): the trend is their mean level"
        )
    weakest, kinds = weakest_reported(measurements), measurements.technologies
    known = {some.cell_id for some in points}
    unmeasured = {one: offset for one, offset in offsets.items() if one not in known}
    return Survey(
        measurements.crs, options, shadowing, cells, unmeasured, weakest, kinds, tuple(notes)
    )


def _expected(
    points: Sequence[Points],
    predicted: Mapping[str, Covariate],
    plan: CellPlan | None,
    shadowing: Shadowing,
) -> dict[str, ExpectedOffset]:
    """Return the offset that other cells let expect: of cells with points, and of the plan's."""
    sites = {cell.id: cell.site for cell in plan.cells} if plan is not None else {}
    measured = []
    for some in (one.thinned(_LOCATED_FROM) for one in points):
        error_db = some.level_dbm - predicted[some.cell_id](some.east_m, some.north_m)
        site = sites.get(some.cell_id, some.cell_id)
        measured.append(measured_offset(site, error_db, shadowing.covariance_db2(some)))
    ids = dict.fromkeys(some.cell_id for some in points)
    others = [one for one in predicted if one in sites and one not in ids]
    expected = expected_offsets(measured, [sites[one] for one in others])
    return dict(zip([*ids, *others], expected, strict=True))


def _renamed(strange: Collection[str], predicted: Collection[str]) -> str:
    """Return why cells are likely not among those of a prediction."""
    forms = {cell_id.casefold() for cell_id in predicted}
    if any(cell_id.casefold() in forms for cell_id in strange):
        return "names that differ in upper and lower case only"
    return "other names or identities, or another network"
