"""Trend of the level of one cell by position.

A trend is ``offset + slope * covariate``: the covariate is the loss over distance, a prediction, or
nothing. It is fitted by generalised least squares, because neighbouring levels err together, with
normal priors, because a cell may have been received along one street only.

SciPy is imported where it is used: every command reads the options of a survey, few fit one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mapfilter._types import Floats
from mapfilter.radio.cells import Cell
from mapfilter.survey.measured_points import Points

Covariate = Callable[[Floats, Floats], Floats]
"""From east and north (m) to a value for each place."""

EXPONENT, EXPONENT_DEVIATION = 3.5, 0.7
"""Prior of the path-loss exponent: between free space and a dense city."""
OFFSET_DEVIATION_DB = 12.0
"""Prior deviation of a cell's mean level from that of all cells."""

CALIBRATION_SLOPE = 1.0, 0.2
"""Prior mean and deviation of the slope of levels over those that were predicted."""

_SEARCH_BEYOND_M = 800.0
_GRID = 25
_ROUNDS = 4
_ANTENNA_ABOVE_PHONE_M = 25.0
_PHONE_HEIGHT_M = 1.5


@dataclass(frozen=True)
class DistanceLoss:
    """``-10 log10 d``, d the slant distance from an antenna: its factor is the exponent."""

    east_m: float
    north_m: float
    above_phone_m: float = _ANTENNA_ABOVE_PHONE_M

    @classmethod
    def of_cell(cls, cell: Cell) -> DistanceLoss:
        """Return that of a cell of the plan."""
        return cls(cell.east_m, cell.north_m, max(cell.height_m - _PHONE_HEIGHT_M, 1.0))

    def __call__(self, east_m: Floats, north_m: Floats) -> Floats:
        """Return the covariate at places."""
        return _distance_loss(east_m - self.east_m, north_m - self.north_m, self.above_phone_m)


@dataclass(frozen=True, eq=False)
class Trend:
    """A fitted trend: ``offset_dbm + slope * (covariate - centre)``.

    Without a covariate it is a mean level alone. ``covariance`` (2, 2) is that of offset and slope,
    ``cost`` minus twice the log marginal likelihood, up to a constant.
    """

    covariate: Covariate | None
    offset_dbm: float
    slope: float
    centre: float
    covariance: Floats
    cost: float

    def design(self, east_m: Floats, north_m: Floats) -> Floats:
        """Return the factors of offset and slope at places, shape (N, 2)."""
        values = np.zeros_like(east_m)
        if self.covariate is not None:
            values = self.covariate(east_m, north_m) - self.centre
        return np.column_stack([np.ones_like(east_m), values])

    def level_dbm(self, east_m: Floats, north_m: Floats) -> Floats:
        """Return the trend's level at places."""
        return np.asarray(self.design(east_m, north_m) @ [self.offset_dbm, self.slope])

    def variance_db2(self, design: Floats) -> Floats:
        """Return the variance that offset and slope bring to rows of their factors."""
        return np.asarray(np.einsum("ni,ij,nj->n", design, self.covariance, design))


@dataclass(frozen=True)
class Prior:
    """Normal prior of offset and slope.

    Of a calibration the offset is one from the covariate, a prediction, in dB.
    """

    offset_dbm: float
    slope: float = EXPONENT
    slope_deviation: float = EXPONENT_DEVIATION
    offset_deviation_db: float = OFFSET_DEVIATION_DB
    of_calibration: bool = False

    @classmethod
    def of_prediction(cls, offset_db: float, deviation_db: float) -> Prior:
        """Return that of a calibration."""
        return cls(offset_db, *CALIBRATION_SLOPE, deviation_db, of_calibration=True)


def fit_trend(
    covariate: Covariate | None, points: Points, covariance_db2: Floats, prior: Prior
) -> Trend:
    """Fit offset and slope of a covariate to levels with a covariance of errors (N, N)."""
    from scipy.linalg import cholesky

    east_m, level_dbm = points.east_m, points.level_dbm
    values = np.zeros_like(east_m) if covariate is None else covariate(east_m, points.north_m)
    centre = float(values.mean())
    if prior.of_calibration:
        prior = replace(prior, offset_dbm=centre + prior.offset_dbm)
    root = cholesky(covariance_db2, lower=True)
    offset, slope, spread, cost = _profile(root, level_dbm, (values - centre)[:, None], prior)
    return Trend(
        covariate, float(offset[0]), float(slope[0]), centre, spread[:, :, 0], float(cost[0])
    )


def locate_antenna(points: Points, covariance_db2: Floats, prior: Prior) -> DistanceLoss:
    """Estimate where a cell's antenna is from levels with a covariance of errors (N, N).

    The place with the largest marginal likelihood of the levels under the path-loss trend, offset
    and exponent integrated out, on a grid that is refined about the best point of each round.
    """
    from scipy.linalg import cholesky

    east_m, north_m, level_dbm = points.east_m, points.north_m, points.level_dbm
    root = cholesky(covariance_db2, lower=True)
    centre = np.array([(east_m.min() + east_m.max()) / 2, (north_m.min() + north_m.max()) / 2])
    half_m = max(np.ptp(east_m), np.ptp(north_m)) / 2 + _SEARCH_BEYOND_M
    for _ in range(_ROUNDS):
        steps = np.linspace(-half_m, half_m, _GRID)
        grid = np.stack(np.meshgrid(centre[0] + steps, centre[1] + steps), axis=-1).reshape(-1, 2)
        values = _distance_loss(
            east_m[:, None] - grid[:, 0], north_m[:, None] - grid[:, 1], _ANTENNA_ABOVE_PHONE_M
        )
        cost = _profile(root, level_dbm, values - values.mean(axis=0), prior)[3]
        centre = grid[cost.argmin()]
        half_m *= 4.0 / _GRID
    return DistanceLoss(float(centre[0]), float(centre[1]))


def _distance_loss(east_m: Floats, north_m: Floats, above_m: float) -> Floats:
    return np.asarray(-5.0 * np.log10(east_m**2 + north_m**2 + above_m**2))


def _profile(
    root: Floats, level_dbm: Floats, values: Floats, prior: Prior
) -> tuple[Floats, Floats, Floats, Floats]:
    """Fit many covariates at once, ``values`` (N, M): offset, slope, their covariance, cost (M)."""
    from scipy.linalg import solve_triangular

    white = solve_triangular(
        root, np.column_stack([np.ones(len(values)), level_dbm - prior.offset_dbm]), lower=True
    )
    ones, level = white[:, :1], white[:, 1:]
    values = solve_triangular(root, values, lower=True)
    weight = 1 / prior.offset_deviation_db**2, 1 / prior.slope_deviation**2
    a = (ones**2).sum(axis=0) + weight[0]
    b = (ones * values).sum(axis=0)
    c = (values**2).sum(axis=0) + weight[1]
    right_a = (ones * level).sum(axis=0)
    right_c = (values * level).sum(axis=0) + weight[1] * prior.slope
    determinant = a * c - b**2
    offset = (c * right_a - b * right_c) / determinant
    slope = (a * right_c - b * right_a) / determinant
    cost = (
        (level**2).sum()
        + weight[1] * prior.slope**2
        - offset * right_a
        - slope * right_c
        + np.log(determinant)
    )
    spread = np.array([[c, -b], [-b, np.broadcast_to(a, c.shape)]]) / determinant
    return offset + prior.offset_dbm, slope, spread, cost
