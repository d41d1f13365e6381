"""How probable visits are, given predicted levels and an offset of the cell.

A level differs from its prediction by the phone's offset, the cell's offset and an error of
deviation σ, or it is an outlier (a track that went wrong, a tunnel); that a cell was not received
has the probability of a level below the bound. Errors last over tens of metres and recur in the
same place on every journey, so visits count in part: their likelihoods are raised to a weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from mapfilter._types import Bools, Floats
from mapfilter.learning.visits import Visits

OFFSETS_DB: Floats = np.arange(-30.0, 31.0, 2.0)
"""Offsets of a cell over which is integrated."""
OUTLIERS = 0.1
RANGE_DB = 60.0
_BELOW_FLOOR_DB = 5.0
_ALONG = 0.5
"""Two visits of one journey in neighbouring squares count as one."""
_AGAIN = 0.7
"""Correlation of the errors in one square between journeys."""


@dataclass(frozen=True)
class LevelNoise:
    """Errors of levels over a log-likelihood.

    Parameters
    ----------
    sd_db : float
        Deviation of levels from the prediction, offsets taken out.
    cells_sd_db : float
        Deviation of the offsets of cells that are as they should be.
    fault_sd_db : float
        Deviation of the offsets of cells that are not.
    """

    sd_db: float = 9.0
    cells_sd_db: float = 2.0
    fault_sd_db: float = 12.0


def visit_weights(visits: Visits) -> Floats:
    """Return how much each visit counts, 0..1.

    Of n journeys that met a cell in one square, all together count as ``n / (1 + (n - 1) ρ)``.
    """
    key = np.stack([visits.cell, visits.square])
    _, which, number = np.unique(key, axis=1, return_inverse=True, return_counts=True)
    return np.asarray(_ALONG / (1.0 + (number[which.ravel()] - 1) * _AGAIN))


def log_likelihoods(
    visits: Visits,
    expected_dbm: Floats,
    floor_dbm: float,
    sd_db: float,
    offsets_db: Floats = OFFSETS_DB,
) -> Floats:
    """Return the log-likelihood of each visit for each offset, shape (N, offsets).

    Parameters
    ----------
    expected_dbm : (N,) array
        Predicted levels with the phone's offset; NaN below the floor. There a level is compared
        with one a little below the floor, and silence is what was expected, whatever the offset.
    floor_dbm : float
        Of the database.
    """
    z = excess_db(visits, expected_dbm, floor_dbm)[:, None] - offsets_db
    z /= sd_db
    found = report_log_likelihood(z, visits.received, sd_db)
    found[np.isnan(z)] = 0.0
    return found


def excess_db(visits: Visits, expected_dbm: Floats, floor_dbm: float) -> Floats:
    """Return how far levels, and bounds, are above their prediction; NaN where none says anything.

    Parameters
    ----------
    expected_dbm, floor_dbm
        As in :func:`log_likelihoods`.
    """
    below = np.isnan(expected_dbm)
    expected = np.where(below, floor_dbm - _BELOW_FLOOR_DB, expected_dbm)
    return np.where(below & ~visits.received, np.nan, visits.level_dbm - expected)


def report_log_likelihood(z: Floats, received: Bools, sd_db: float) -> Floats:
    """Return the log-likelihood of levels, or of bounds, that lie z deviations above.

    Parameters
    ----------
    z : (N, ...) array
    received : (N,) array of bool
        Whether it is a level; else the bound below which it was.
    """
    found = np.empty(z.shape)
    density = (1.0 - OUTLIERS) / (sd_db * np.sqrt(2 * np.pi))
    found[received] = np.log(density * np.exp(-0.5 * z[received] ** 2) + OUTLIERS / RANGE_DB)
    found[~received] = np.log((1.0 - OUTLIERS) * ndtr(z[~received]) + OUTLIERS)
    return found


def report_slope(z: Floats, received: Bools, sd_db: float) -> Floats:
    """Return the derivative of :func:`report_log_likelihood` by z."""
    found = np.empty(z.shape)
    level, bound = z[received], z[~received]
    density = (1.0 - OUTLIERS) / (sd_db * np.sqrt(2 * np.pi)) * np.exp(-0.5 * level**2)
    found[received] = -level * density / (density + OUTLIERS / RANGE_DB)
    density = (1.0 - OUTLIERS) / np.sqrt(2 * np.pi) * np.exp(-0.5 * bound**2)
    found[~received] = density / ((1.0 - OUTLIERS) * ndtr(bound) + OUTLIERS)
    return found


def log_sum(values: Floats | Sequence[float]) -> float:
    """Return the logarithm of the sum of the exponentials of some finite numbers.

    For thirty of them SciPy's takes twenty times as long, nearly all of it to look at their types.

    Examples
    --------
    >>> round(log_sum([1000.0, 1000.0]) - 1000.0, 6)
    0.693147
    """
    values = np.asarray(values, dtype=np.float64)
    most = values.max()
    return float(most + np.log(np.exp(values - most).sum()))


def marginal(by_offset: Floats, sd_db: float, offsets_db: Floats = OFFSETS_DB) -> float:
    """Return the log-likelihood with the offset integrated over N(0, sd²).

    Parameters
    ----------
    by_offset : (offsets,) array
        Log-likelihood of all visits for each offset.
    """
    prior = -0.5 * (offsets_db / sd_db) ** 2
    return log_sum(by_offset + prior) - log_sum(prior)


def posterior_offset(by_offset: Floats, sd_db: float) -> tuple[float, float]:
    """Return mean and standard deviation of the offset under the prior N(0, sd²)."""
    weight = by_offset - 0.5 * (OFFSETS_DB / sd_db) ** 2
    weight = np.exp(weight - log_sum(weight))
    mean = float(weight @ OFFSETS_DB)
    # The grid's step does not let it vanish.
    variance = float(weight @ (OFFSETS_DB - mean) ** 2)
    return mean, max(variance, (OFFSETS_DB[1] - OFFSETS_DB[0]) ** 2 / 12) ** 0.5
