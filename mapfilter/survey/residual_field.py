"""Residuals of the levels of one cell about their trend: shadowing, and fields that predict levels.

Residuals are those of a Gaussian process, or of nearest neighbours.

scikit-learn and SciPy are imported where they are used: every command reads the options of a
survey, few fit one, and the imports take a fifth of the start of a command.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.survey.level_trend import Trend
from mapfilter.survey.measured_points import Points

_CHUNK = 4096
_LEARNT_FROM = 250
_LEARNT_FROM_CELLS = 40
_BOUNDS = np.log([[1.0, 400.0], [10.0, 1000.0], [0.5, 200.0]])
SOFTENING_M = 20.0
"""Added to distances, over which neighbours are weighed."""
_PRIOR_WEIGHT = 4.0
_ROUNDED_DB2 = 1 / 12
"""Variance of rounding to whole dB, of which levels that are all the same have no less."""


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
        """As a kernel of scikit-learn."""
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

        shadow = ConstantKernel(self.variance_db2) * Matern(self.correlation_m, nu=0.5)
        return shadow + WhiteKernel(self.noise_db2)

    def covariance_db2(self, points: Points) -> Floats:
        """Return the covariance of levels, shape (N, N)."""
        return np.asarray(self.kernel(points.places))  # type: ignore[operator]


def most_telling(points: Sequence[Points]) -> list[Points]:
    """Return the points of the 40 cells with the most of them, of at least two."""
    some = [one for one in points if len(one) > 1]
    return sorted(some, key=lambda one: -len(one))[:_LEARNT_FROM_CELLS]


def learn_shadowing(
    points: Sequence[Points], trends: Sequence[Trend], start: Shadowing
) -> Shadowing:
    """Return the shadowing under which the levels of all cells together are likeliest.

    There are one of ``points`` and ``trends`` per cell, see :func:`most_telling`. ``start`` is also
    returned where there is none.
    """
    from scipy.optimize import minimize
    from scipy.spatial.distance import pdist, squareform

    cells = []
    for some, trend in zip(points, trends, strict=True):
        if len(some) < 2:
            continue
        thin = some.thinned(_LEARNT_FROM)
        residual_db = thin.level_dbm - trend.level_dbm(thin.east_m, thin.north_m)
        cells.append((squareform(pdist(thin.places)), residual_db))
    if not cells:
        return start

    def cost(theta: Floats) -> tuple[float, Floats]:
        value, slope = 0.0, np.zeros(3)
        for distance_m, residual_db in cells:
            likelihood, gradient = log_likelihood(theta, distance_m, residual_db)
            value -= likelihood
            slope -= gradient
        return value, slope

    first = np.log([start.variance_db2, start.correlation_m, start.noise_db2])
    best = minimize(cost, first, jac=True, method="L-BFGS-B", bounds=_BOUNDS)
    return Shadowing(*np.exp(best.x).tolist())


def log_likelihood(theta: Floats, distance_m: Floats, residual_db: Floats) -> tuple[float, Floats]:
    """Return the log-likelihood of the residuals of one cell, and its gradient.

    That of a Gaussian process of mean zero (Rasmussen & Williams 2006, eq. 5.8 and 5.9). It is that
    of scikit-learn, which makes all distances and all derivatives anew each time, in a fifth of the
    time.

    Parameters
    ----------
    theta : ndarray, shape (3,)
        Logarithms of variance (dB²), correlation length (m) and noise (dB²), see
        :class:`Shadowing`. The gradient is by these.
    distance_m : ndarray, shape (N, N)
        Between the points.
    residual_db : ndarray, shape (N,)
    """
    from scipy.linalg import cho_solve, cholesky
    from scipy.linalg.lapack import dpotri

    variance_db2, correlation_m, noise_db2 = np.exp(theta)
    count = len(residual_db)
    shared = np.exp(distance_m / -correlation_m)
    shared *= variance_db2
    covariance = shared.copy()
    np.einsum("ii->i", covariance)[:] += noise_db2
    lower = cholesky(covariance, lower=True, check_finite=False)
    weighed = cho_solve((lower, True), residual_db, check_finite=False)
    fit, size = residual_db @ weighed, weighed @ weighed
    logarithm = 2 * np.log(np.diag(lower)).sum() + count * np.log(2 * np.pi)
    # The lower half; the upper one stays zero.
    inverse, _ = dpotri(lower, lower=1)
    trace = np.trace(inverse)
    # The covariance less the noise; no sum over all pairs is needed for it.
    by_variance = fit - noise_db2 * size - (count - noise_db2 * trace)
    shared *= distance_m
    shared /= correlation_m
    by_length = weighed @ shared @ weighed - 2 * np.vdot(inverse.T, shared)
    by_noise = noise_db2 * (size - trace)
    gradient = 0.5 * np.array([by_variance, by_length, by_noise])
    return float(-0.5 * (fit + logarithm)), gradient


class GaussianField:
    """A Gaussian process about a trend; the trend's own uncertainty is in the deviation.

    With offset and slope uncertain this is universal kriging: the process is also asked how much of
    the design it explains, and what it does not explain carries the trend's covariance
    (Rasmussen & Williams 2006, eq. 2.42).
    """

    def __init__(self, points: Points, trend: Trend, shadowing: Shadowing) -> None:
        from sklearn.gaussian_process import GaussianProcessRegressor

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
            mean_dbm[some] = design @ [self._trend.offset_dbm, self._trend.slope] + found[:, 0]
            unexplained_db2 = self._trend.variance_db2(design - found[:, 1:])
            deviation_db[some] = np.sqrt(own[:, 0] ** 2 + unexplained_db2)
        return mean_dbm, deviation_db


class NeighbourField:
    """The distance-weighted mean of the nearest points' residuals about a trend.

    The deviation is the error with which those points are predicted by their neighbours of other
    sessions, drawn towards that of all points where there are few.
    """

    def __init__(self, points: Points, trend: Trend, shadowing: Shadowing, neighbours: int) -> None:
        self._trend = trend
        self._residual_db = points.level_dbm - trend.level_dbm(points.east_m, points.north_m)
        self._near = _Nearest(points.places, self._residual_db, neighbours)
        overall_db2 = shadowing.variance_db2 + shadowing.noise_db2
        self._squared_db2 = np.full(len(points), overall_db2, dtype=np.float64)
        sessions = np.unique(points.session)
        for session in sessions if len(sessions) > 1 else ():
            out = points.session == session
            others = _Nearest(points.places[~out], self._residual_db[~out], neighbours)
            error_db = self._residual_db[out] - others.mean(points.places[out])[0]
            self._squared_db2[out] = error_db**2
        if len(sessions) == 1 and len(points) > 1:
            self._squared_db2 = (self._residual_db - self._near.mean(None)[0]) ** 2
        self._overall_db2 = float(self._squared_db2.mean())

    def predict(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return the mean level and the deviation of a new reading at places."""
        mean_dbm = self._trend.level_dbm(east_m, north_m)
        if not len(east_m):
            return mean_dbm, mean_dbm
        near_db, index, weights = self._near.mean(np.column_stack([east_m, north_m]))
        own_db2 = np.average(self._squared_db2[index], axis=1, weights=weights)
        count = index.shape[1]
        total_db2 = count * own_db2 + _PRIOR_WEIGHT * self._overall_db2
        variance_db2 = np.maximum(total_db2 / (count + _PRIOR_WEIGHT), _ROUNDED_DB2)
        return mean_dbm + near_db, np.sqrt(variance_db2)


class _Nearest:
    def __init__(self, places: Floats, values: Floats, neighbours: int) -> None:
        from sklearn.neighbors import NearestNeighbors

        count = min(neighbours, len(places))
        self._search = NearestNeighbors(n_neighbors=count).fit(places)
        self._values = values

    def mean(self, places: Floats | None) -> tuple[Floats, Ints, Floats]:
        """Return weighted means, and the neighbours and weights behind them.

        Without places: at each of its own points, from the others.
        """
        most = len(self._values) - (places is None)
        count = min(self._search.n_neighbors, most)
        distance_m, index = self._search.kneighbors(places, n_neighbors=count)
        weights = 1 / (distance_m + SOFTENING_M)
        return np.average(self._values[index], axis=1, weights=weights), index, weights


class TrendField:
    """The trend alone."""

    def __init__(self, trend: Trend, shadowing: Shadowing) -> None:
        self._trend = trend
        self._variance_db2 = shadowing.variance_db2 + shadowing.noise_db2

    def predict(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return the mean level and the deviation of a new reading at places."""
        spread_db2 = self._trend.variance_db2(self._trend.design(east_m, north_m))
        return self._trend.level_dbm(east_m, north_m), np.sqrt(self._variance_db2 + spread_db2)


ResidualField = GaussianField | NeighbourField | TrendField
