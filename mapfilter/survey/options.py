"""Options of a survey; they import nothing that fits one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from mapfilter.options import Options

SESSION_GAP_S = 1800.0
"""A longer silence begins a new session."""

_Count = Annotated[int, Ge(1), Le(1_000_000)]


@dataclass(frozen=True, slots=True)
class SurveyOptions(Options):
    """How measurements become a map.

    Parameters
    ----------
    method : {"gp", "knn", "trend"}
        Gaussian process, nearest neighbours, or the trend alone.
    trend : {"path_loss", "mean"}
        Path loss from the antenna, or the cell's mean level. Not used where a prediction is
        calibrated.
    reach_m : float
        Places farther than this from every reading of a cell count as not measured.
    min_points : int
        Cells received in fewer squares are left out.
    min_points_to_locate : int
        An antenna of unknown place is located from at least so many; with fewer the trend is the
        mean.
    min_points_to_fill : int
        With fewer, or one level everywhere, the trend of a cell is not kept far from its readings,
        unless its antenna or a prediction is given.
    neighbours : int
        Number of neighbours that "knn" averages.
    square_m : float
        Readings of one session in one such square count once.
    most_points : int
        Larger squares are taken for a cell until it has at most so many points.
    """

    method: Literal["gp", "knn", "trend"] = "gp"
    trend: Literal["path_loss", "mean"] = "path_loss"
    reach_m: Annotated[float, Ge(1)] = 100.0
    min_points: _Count = 3
    min_points_to_locate: Annotated[int, Ge(3), Le(1_000_000)] = 15
    min_points_to_fill: _Count = 15
    neighbours: _Count = 8
    square_m: Annotated[float, Ge(0.1)] = 10.0
    most_points: Annotated[int, Ge(10)] = 1500
