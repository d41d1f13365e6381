"""Offsets of cells from their prediction, as the offsets of other cells let expect them.

What a prediction errs by has a part that all cells share (the car, the model), one that those of a
site share (its surroundings, its cables), and one of each cell. How large the latter two are is
learnt from the cells that were measured; an expected offset is the mean over what they may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.survey.level_trend import OFFSET_DEVIATION_DB

_DEVIATIONS_DB = np.geomspace(0.5, 12.0, 9)
_USUAL_DB = 5.0
"""Scale of the half-normal prior of the deviations of sites and of cells."""
_FACTOR = 1.6
"""By which deviations are multiplied: offsets differ between the places driven and others, too."""


@dataclass(frozen=True, slots=True)
class MeasuredOffset:
    """Mean of measured less predicted levels of a cell, and the variance of its error.

    ``site`` is the name of its site, or its own where that is unknown.
    """

    site: str
    offset_db: float
    variance_db2: float


@dataclass(frozen=True, slots=True)
class ExpectedOffset:
    """Mean and deviation of an offset that is not known."""

    offset_db: float
    deviation_db: float


def measured_offset(site: str, error_db: Floats, covariance_db2: Floats) -> MeasuredOffset:
    """Return the offset of errors, measured less predicted, with a covariance (N, N)."""
    weights = np.linalg.solve(covariance_db2, np.ones(len(error_db)))
    variance_db2 = 1.0 / float(weights.sum())
    return MeasuredOffset(site, variance_db2 * float(weights @ error_db), variance_db2)


def expected_offsets(
    measured: Sequence[MeasuredOffset], unmeasured: Sequence[str]
) -> tuple[ExpectedOffset, ...]:
    """Return the offsets that the other cells let expect, of each measured and unmeasured cell.

    Parameters
    ----------
    measured : sequence of MeasuredOffset
        That of the cell itself counts only for how large the deviations are.
    unmeasured : sequence of str
        Sites of cells without measurements.
    """
    names, site = np.unique([one.site for one in measured] + list(unmeasured), return_inverse=True)
    count = len(measured)
    offset_db = np.array([one.offset_db for one in measured])
    variance_db2 = np.array([one.variance_db2 for one in measured])
    logs, means, squares = [], [], []
    for of_site in _DEVIATIONS_DB**2:
        for of_cell in _DEVIATIONS_DB**2:
            # Of a cell about its site; nothing of those without measurements.
            weight = np.zeros(len(site))
            weight[:count] = 1.0 / (of_cell + variance_db2)
            pull = weight.copy()
            pull[:count] *= offset_db
            a = np.bincount(site, weight, len(names))
            b = np.bincount(site, pull, len(names))
            shrunk = 1.0 + of_site * a
            precision = 1.0 / OFFSET_DEVIATION_DB**2 + float((a / shrunk).sum())
            total = float((b / shrunk).sum())
            quadratic = pull[:count] @ offset_db - of_site * (b**2 / shrunk).sum()
            quadratic -= total**2 / precision
            log = np.log(weight[:count]).sum() - np.log(shrunk).sum() - np.log(precision)
            logs.append(0.5 * (log - quadratic - (of_site + of_cell) / _USUAL_DB**2))
            # Without the cell itself, in its site and in the network.
            own_a, own_b = a[site] - weight, b[site] - pull
            own = 1.0 + of_site * own_a
            rest = precision - (a / shrunk)[site] + own_a / own
            mean = (total - (b / shrunk)[site] + own_b / own) / rest
            means.append((mean + of_site * own_b) / own)
            squares.append(of_cell + of_site / own + 1.0 / (rest * own**2) + means[-1] ** 2)
    share = np.exp(np.array(logs) - max(logs))
    share /= share.sum()
    mean_db = share @ np.array(means)
    deviation_db = _FACTOR * np.sqrt(share @ np.array(squares) - mean_db**2)
    return tuple(map(ExpectedOffset, mean_db.tolist(), deviation_db.tolist()))
