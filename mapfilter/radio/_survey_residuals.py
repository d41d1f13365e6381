"""What a survey finds at each spot about the trend: Gaussian process or nearest neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from sklearn.neighbors import NearestNeighbors

from mapfilter.radio._survey_points import Points
from mapfilter.radio._survey_trend import Trend

Floats = NDArray[np.float64]

_CHUNK = 4096
_LEARNT_FROM = 250
_BOUNDS = np.log([[1.0, 400.0], [10.0, 1000.0], [0.5, 200.0]])
_SOFTENING_M = 20.0
_PRIOR_WEIGHT = 4.0


@dataclass(frozen=True, slots=True)
class Shadowing:
    """Variances and correlation length of the levels about their trend.

    The correlation falls as ``exp(-distance / correlation_m)`` (Gudmundson, Electronics Letters 27,
    1991); the noise is what a second reading at the same spot would differ by.
    """

    variance_db2: float = 25.0
    correlation_m: float = 60.0
    noise_db2: float = 16.0

    @property
    def kernel(self) -> object:
        """The same as scikit-learn writes it."""
        shadow = ConstantKernel(self.variance_db2) * Matern(self.correlation_m, nu=0.5)
        return shadow + WhiteKernel(self.noise_db2)

    def covariance_db2(self, points: Points) -> Floats:
        """Return the covariance of levels, shape (N, N)."""
        return np.asarray(self.kernel(points.places))  # type: ignore[operator]


def learn_shadowing(
    points: Sequence[Points], trends: Sequence[Trend], start: Shadowing
) -> Shadowing:
    """Return the shadowing under which the levels of all cells together are likeliest.

    Parameters
    ----------
    points, trends : sequences of equal length
        One of each per cell.
    start : Shadowing
        Also the answer when no cell has two points.
    """
    processes = []
    for some, trend in zip(points, trends, strict=True):
        if len(some) < 2:
            continue
        thin = some.thinned(_LEARNT_FROM)
        residual_db = thin.level_dbm - trend.level_dbm(thin.east_m, thin.north_m)
        process = GaussianProcessRegressor(start.kernel, optimizer=None)
        processes.append(process.fit(thin.places, residual_db))
    if not processes:
        return start

    def cost(theta: Floats) -> tuple[float, Floats]:
        value, slope = 0.0, np.zeros(3)
        for process in processes:
            likelihood, gradient = process.log_marginal_likelihood(theta, eval_gradient=True)
            value -= likelihood
            slope -= gradient
        return value, slope

    first = np.log([start.variance_db2, start.correlation_m, start.noise_db2])
    best = minimize(cost, first, jac=True, method="L-BFGS-B", bounds=_BOUNDS)
    return Shadowing(*np.exp(best.x).tolist())


class GaussianField:
    """A Gaussian process about a trend; the trend's own uncertainty is in the deviation.

    With offset and slope uncertain this is universal kriging: the process is also asked how much of
    the design it explains, and what it does not explain carries the trend's covariance
    (Rasmussen & Williams 2006, eq. 2.42).
    """

    def __init__(self, points: Points, trend: Trend, shadowing: Shadowing) -> None:
        design = trend.design(points.east_m, points.north_m)
        residual_db = points.level_dbm - design @ [trend.offset_dbm, trend.slope]
        process = GaussianProcessRegressor(shadowing.kernel, optimizer=None)
        self._process = process.fit(points.places, np.column_stack([residual_db, design]))
        self._trend = trend

    def predict(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return the mean level and the deviation of a new reading at places."""
        mean_dbm, deviation_db = np.empty(len(east_m)), np.empty(len(east_m))
        for first in range(0, len(east_m), _CHUNK):
            some = slice(first, first + _CHUNK)
            places = np.column_stack([east_m[some], north_m[some]])
            found, own = self._process.predict(places, return_std=True)
            design = self._trend.design(east_m[some], north_m[some])
            unexplained = design - found[:, 1:]
            spread = np.einsum("ni,ij,nj->n", unexplained, self._trend.covariance, unexplained)
            mean_dbm[some] = design @ [self._trend.offset_dbm, self._trend.slope] + found[:, 0]
            deviation_db[some] = np.sqrt(own[:, 0] ** 2 + spread)
        return mean_dbm, deviation_db


class NeighbourField:
    """The distance-weighted mean of the nearest points' residuals about a trend.

    The deviation comes from how well each of those points is told by its own neighbours, drawn
    towards that of all points where there are few.
    """

    def __init__(self, points: Points, trend: Trend, shadowing: Shadowing, neighbours: int) -> None:
        self._trend = trend
        self._count = min(neighbours, len(points))
        self._search = NearestNeighbors(n_neighbors=self._count).fit(points.places)
        self._residual_db = points.level_dbm - trend.level_dbm(points.east_m, points.north_m)
        variance_db2 = shadowing.variance_db2 + shadowing.noise_db2
        self._squared_db2 = np.full(len(points), variance_db2)
        if len(points) > 1:
            # Without an argument, scikit-learn leaves each point out of its own neighbours.
            distance_m, index = self._search.kneighbors(
                n_neighbors=min(self._count, len(points) - 1)
            )
            told = np.average(
                self._residual_db[index], axis=1, weights=1 / (distance_m + _SOFTENING_M)
            )
            self._squared_db2 = (self._residual_db - told) ** 2
            variance_db2 = float(self._squared_db2.mean())
        self._overall_db2 = variance_db2

    def predict(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return the mean level and the deviation of a new reading at places."""
        mean_dbm = self._trend.level_dbm(east_m, north_m)
        if not len(east_m):
            return mean_dbm, mean_dbm
        distance_m, index = self._search.kneighbors(np.column_stack([east_m, north_m]))
        weights = 1 / (distance_m + _SOFTENING_M)
        mean_dbm += np.average(self._residual_db[index], axis=1, weights=weights)
        own_db2 = np.average(self._squared_db2[index], axis=1, weights=weights)
        variance_db2 = (self._count * own_db2 + _PRIOR_WEIGHT * self._overall_db2) / (
            self._count + _PRIOR_WEIGHT
        )
        return mean_dbm, np.sqrt(variance_db2)


class TrendField:
    """The trend alone."""

    def __init__(self, trend: Trend, shadowing: Shadowing) -> None:
        self._trend = trend
        self._variance_db2 = shadowing.variance_db2 + shadowing.noise_db2

    def predict(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return the mean level and the deviation of a new reading at places."""
        design = self._trend.design(east_m, north_m)
        spread = np.einsum("ni,ij,nj->n", design, self._trend.covariance, design)
        level_dbm = design @ [self._trend.offset_dbm, self._trend.slope]
        return level_dbm, np.sqrt(self._variance_db2 + spread)


ResidualField = GaussianField | NeighbourField | TrendField
