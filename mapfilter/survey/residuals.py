"""What a survey finds at each spot about the trend: Gaussian process or nearest neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from sklearn.neighbors import NearestNeighbors

from mapfilter._types import Bools, Floats, Ints
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.trend import Trend


@dataclass(frozen=True, eq=False)
class Points:
    """Mean level and position of a cell's readings in each square and session.

    Who stands still does not learn more than who walks on, so readings of one session in one
    square count once.

    Parameters
    ----------
    cell_id : str
    east_m, north_m, level_dbm : numpy.ndarray, shape (N,)
    session : numpy.ndarray of int, shape (N,)
    heard_at : numpy.ndarray, shape (M, 2)
        East and north of every reading behind them.
    """

    cell_id: str
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    session: Ints
    heard_at: Floats

    def __len__(self) -> int:
        return len(self.level_dbm)

    @property
    def places(self) -> Floats:
        """Positions, shape (N, 2)."""
        return np.column_stack([self.east_m, self.north_m])

    def thinned(self, most: int) -> Points:
        """Return at most so many of the points, evenly taken."""
        if len(self) <= most:
            return self
        return self.some(np.linspace(0, len(self) - 1, most).astype(np.int64))

    def some(self, kept: Ints | Bools) -> Points:
        """Return some of the points."""
        return Points(
            self.cell_id,
            self.east_m[kept],
            self.north_m[kept],
            self.level_dbm[kept],
            self.session[kept],
            self.heard_at,
        )


def points_by_cell(measurements: Measurements, square_m: float, most: int) -> dict[str, Points]:
    """Return the points of each cell that was heard.

    Parameters
    ----------
    measurements : Measurements
    square_m : float
        Side of the squares; doubled for a cell until it has at most ``most`` points.
    most : int
    """
    order = np.argsort(measurements.cell, kind="stable")
    edges = np.searchsorted(measurements.cell[order], np.arange(len(measurements.cell_ids) + 1))
    found = {}
    for i, cell_id in enumerate(measurements.cell_ids):
        own = order[edges[i] : edges[i + 1]]
        if not own.size:
            continue
        east_m, north_m = measurements.east_m[own], measurements.north_m[own]
        level_dbm, session = measurements.level_dbm[own], measurements.session[own]
        side_m = square_m
        while True:
            keys = np.column_stack(
                [session, np.floor(north_m / side_m), np.floor(east_m / side_m)]
            ).astype(np.int64)
            squares, which = np.unique(keys, axis=0, return_inverse=True)
            if len(squares) <= most:
                break
            side_m *= 2
        count = np.bincount(which)
        heard_at = np.column_stack([east_m, north_m])
        found[cell_id] = Points(
            cell_id,
            np.bincount(which, east_m) / count,
            np.bincount(which, north_m) / count,
            np.bincount(which, level_dbm) / count,
            squares[:, 0],
            heard_at,
        )
    return found


_CHUNK = 4096
_LEARNT_FROM = 250
_LEARNT_FROM_CELLS = 40
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
        One of each per cell. The 40 cells with the most points are taken.
    start : Shadowing
        Also the answer when no cell has two points.
    """
    processes = []
    pairs = [pair for pair in zip(points, trends, strict=True) if len(pair[0]) > 1]
    pairs.sort(key=lambda pair: -len(pair[0]))
    for some, trend in pairs[:_LEARNT_FROM_CELLS]:
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

    The deviation comes from how well each of those points is told by its neighbours of other
    sessions, drawn towards that of all points where there are few.
    """

    def __init__(self, points: Points, trend: Trend, shadowing: Shadowing, neighbours: int) -> None:
        self._trend = trend
        self._residual_db = points.level_dbm - trend.level_dbm(points.east_m, points.north_m)
        self._near = _Nearest(points.places, self._residual_db, neighbours)
        self._squared_db2 = np.full(
            len(points), shadowing.variance_db2 + shadowing.noise_db2, dtype=np.float64
        )
        sessions = np.unique(points.session)
        for session in sessions if len(sessions) > 1 else ():
            out = points.session == session
            others = _Nearest(points.places[~out], self._residual_db[~out], neighbours)
            self._squared_db2[out] = (
                self._residual_db[out] - others.mean(points.places[out])[0]
            ) ** 2
        if len(sessions) == 1 and len(points) > 1:
            self._squared_db2 = (self._residual_db - self._near.mean(None)[0]) ** 2
        self._overall_db2 = float(self._squared_db2.mean())

    def predict(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return the mean level and the deviation of a new reading at places."""
        mean_dbm = self._trend.level_dbm(east_m, north_m)
        if not len(east_m):
            return mean_dbm, mean_dbm
        told_db, index, weights = self._near.mean(np.column_stack([east_m, north_m]))
        own_db2 = np.average(self._squared_db2[index], axis=1, weights=weights)
        count = index.shape[1]
        variance_db2 = (count * own_db2 + _PRIOR_WEIGHT * self._overall_db2) / (
            count + _PRIOR_WEIGHT
        )
        return mean_dbm + told_db, np.sqrt(variance_db2)


class _Nearest:
    def __init__(self, places: Floats, values: Floats, neighbours: int) -> None:
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
        weights = 1 / (distance_m + _SOFTENING_M)
        return np.average(self._values[index], axis=1, weights=weights), index, weights


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
