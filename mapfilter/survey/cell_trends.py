"""The cells of a survey that get a map, and the trend of each."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

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
from mapfilter.survey.measured_points import Points
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.residual_field import Shadowing

_NAMED = 3
_LOCATED_FROM = 300
_UNKNOWN_OFFSET = ExpectedOffset(0.0, OFFSET_DEVIATION_DB)


@dataclass(frozen=True, eq=False)
class TrendRules:
    """How the trends of cells are fitted.

    Parameters
    ----------
    options : SurveyOptions
    level_dbm : float
        Mean level of all cells.
    plan : CellPlan or None
        Positions of antennas, in the survey's CRS; the others are located from their levels.
    predicted : mapping of str to callable, or None
        Predicted levels of cells, which are calibrated in place of a path loss.
    offsets : mapping of str to ExpectedOffset
        How far the levels of cells are expected from their prediction.
    """

    options: SurveyOptions
    level_dbm: float
    plan: CellPlan | None = None
    predicted: Mapping[str, Covariate] | None = None
    offsets: Mapping[str, ExpectedOffset] = field(default_factory=dict)

    def trend(self, points: Points, shadowing: Shadowing) -> Trend:
        """Return the trend of a cell, about which residuals have a shadowing."""
        prior, covariate = Prior(self.level_dbm), None
        if self.predicted is not None:
            offset = self.offsets.get(points.cell_id, _UNKNOWN_OFFSET)
            prior = Prior.of_prediction(offset.offset_db, offset.deviation_db)
            covariate = self.predicted[points.cell_id]
        elif self.options.trend == "path_loss":
            covariate = self._distance_loss(points, shadowing, prior)
        return fit_trend(covariate, points, shadowing.covariance_db2(points), prior)

    def _distance_loss(
        self, points: Points, shadowing: Shadowing, prior: Prior
    ) -> DistanceLoss | None:
        if self.plan is not None and points.cell_id in self.plan:
            return DistanceLoss.of_cell(self.plan[points.cell_id])
        if len(points) < self.options.min_points_to_locate:
            return None
        some = points.thinned(_LOCATED_FROM)
        return locate_antenna(some, shadowing.covariance_db2(some), prior)


def predicted_alone(
    found: Mapping[str, Points], predicted: Mapping[str, Covariate]
) -> tuple[dict[str, Points], tuple[str, ...]]:
    """Return the points of cells where these are predicted, and a note on cells that are not.

    Raises
    ------
    InputError
        No cell is predicted.
    """
    strange = [cell_id for cell_id in found if cell_id not in predicted]
    example, notes = next(iter(predicted), "none"), tuple[str, ...]()
    if strange and len(strange) == len(found):
        expected = f"cells of the prediction, such as {example}"
        got = f"none in {number_of(len(found), 'cell')}, such as {strange[0]}"
        raise fail(InputError, "measurements", expected, got, _renamed(strange, predicted))
    if strange:
        notes = (
            f"{number_of(len(strange), 'cell')} left out: not in the prediction, which has "
            f"such as {example}: {listed(strange, _NAMED)} (likely: "
            f"{_renamed(strange, predicted)})",
        )
    some = {
        cell_id: points.some(np.isfinite(predicted[cell_id](points.east_m, points.north_m)))
        for cell_id, points in found.items()
        if cell_id in predicted
    }
    return some, notes


def _renamed(strange: Collection[str], predicted: Collection[str]) -> str:
    """Return why cells are likely not among those of a prediction."""
    forms = {cell_id.casefold() for cell_id in predicted}
    if any(cell_id.casefold() in forms for cell_id in strange):
        return "names that differ in upper and lower case only"
    return "other names or identities, or another network"


def often_enough(
    found: Mapping[str, Points], min_points: int, *, calibrated: bool
) -> tuple[list[Points], tuple[str, ...]]:
    """Return the cells that were received in enough squares, and a note on the others.

    Parameters
    ----------
    found : mapping of str to Points
    min_points : int
        Least number of squares.
    calibrated : bool
        Whether the others have a prediction that is calibrated with these.

    Raises
    ------
    InputError
        None was received so often.
    """
    points = [some for some in found.values() if len(some) >= min_points]
    if not points:
        expected = f"a cell received in at least {min_points} squares"
        got = f"{number_of(len(found), 'cell')}, none of them"
        raise fail(InputError, "measurements", expected, got)
    if len(points) == len(found):
        return points, ()
    few = number_of(len(found) - len(points), "cell")
    left = "without a calibration of its own" if calibrated else "left out"
    return points, (f"{few} {left}: received in fewer than {min_points} squares",)


def offsets_of_prediction(
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
