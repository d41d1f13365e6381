"""How a whole class of cells differs from its prediction: an offset, and a slope over distance.

Propagation models err in both, and the body takes some decibels off every level. That is no fault
of any one cell; offsets of cells are counted from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from mapfilter._types import Bools, Floats, Ints
from mapfilter.learning.likelihood import report_log_likelihood, report_slope

REFERENCE_M = 300.0
NEAREST_M = 20.0
"""Shorter distances from a mast count as this one."""
_LEAST, _MOST = 20, 3000
_OFFSET_SD_DB, _SLOPE_SD_DB = 5.0, 8.0
_FEW_CELLS, _START_DB = 6, 9.0
_FAULTS = 0.1
_CELLS_SD_DB, _FAULT_SD_DB = 2.0, 12.0


@dataclass(frozen=True)
class Calibration:
    """The mean error of the prediction of a class of cells.

    Parameters
    ----------
    offset_db : float
        Of levels beside the prediction, at 300 m.
    slope_db : float
        Added for each decade of distance.
    """

    offset_db: float = 0.0
    slope_db: float = 0.0

    def at(self, distance_m: Floats) -> Floats:
        """Return the mean error at distances from the cell."""
        return self.offset_db + self.slope_db * log_distance(distance_m)


def log_distance(distance_m: Floats) -> Floats:
    """Return the decades of distance beyond 300 m."""
    return np.asarray(np.log10(np.maximum(distance_m, NEAREST_M) / REFERENCE_M))


def calibrate(
    excess_db: Floats,
    received: Bools,
    cell: Ints,
    distance_m: Floats,
    weight: Floats,
    sd_db: float,
    start: Calibration,
) -> Calibration:
    """Fit offset and slope of a class of cells, each with an offset of its own.

    Parameters
    ----------
    excess_db : (N,) array
        Level, or its bound, above the prediction with the phone's offset.
    received : (N,) array of bool
        Whether it is a level.
    cell : (N,) array of int
    weight : (N,) array
        How much each visit counts.
    """
    if received.sum() < _LEAST:
        return start
    every = -(-received.size // _MOST)
    some = slice(None, None, every)
    excess_db, received, cell = excess_db[some], received[some], cell[some]
    weight, decades = every * weight[some], log_distance(distance_m[some])
    cells, which = np.unique(cell, return_inverse=True)

    def cost(values: Floats) -> tuple[float, Floats]:
        """Return the cost of offset, slope and offsets of cells, and its derivatives by them."""
        own = values[2:]
        z = (excess_db - values[0] - values[1] * decades - own[which]) / sd_db
        total = weight @ report_log_likelihood(z, received, sd_db)
        slope = weight * report_slope(z, received, sd_db) / sd_db
        spike = np.log1p(-_FAULTS) - 0.5 * (own / _CELLS_SD_DB) ** 2 - np.log(_CELLS_SD_DB)
        slab = np.log(_FAULTS) - 0.5 * (own / _FAULT_SD_DB) ** 2 - np.log(_FAULT_SD_DB)
        either = np.logaddexp(spike, slab)
        common = values[:2] / (_OFFSET_SD_DB, _SLOPE_SD_DB)
        precision = np.exp(spike - either) / _CELLS_SD_DB**2
        precision += np.exp(slab - either) / _FAULT_SD_DB**2
        derivatives = np.concatenate(
            [
                common / (_OFFSET_SD_DB, _SLOPE_SD_DB) + (slope.sum(), slope @ decades),
                np.bincount(which, slope, cells.size) + precision * own,
            ]
        )
        return float(0.5 * common @ common - total - either.sum()), derivatives

    def fitted(offsets_db: Floats) -> OptimizeResult:
        first = np.array([start.offset_db, start.slope_db, *offsets_db])
        return minimize(cost, first, jac=True, method="L-BFGS-B", options={"maxiter": 40})

    # One faulty cell with many visits draws the class towards itself; from there it does not find
    # back, so each cell is taken for faulty once.
    none = np.zeros(cells.size)
    starts = [none]
    if cells.size <= _FEW_CELLS:
        starts += [sign * _START_DB * (cells == one) for one in cells for sign in (-1.0, 1.0)]
    best = min((fitted(offsets) for offsets in starts), key=lambda found: float(found.fun))
    return Calibration(float(best.x[0]), float(best.x[1]))
