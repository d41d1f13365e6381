"""The serving cell: how probably a cell serves at a place, by its margin over the others there.

With handover hysteresis and prediction errors the serving cell is often not the one predicted best.
Its probability is a smooth function of the margin m, its predicted level above the best other
cell's: ``Φ((m + h) / σ)``, with h the hysteresis in the serving cell's favour. It is never hard.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.special import log_ndtr

from mapfilter._types import Floats, Floats32, Ints32

_F = np.float32
_STEPS_PER_DB = 4
_REACH_DB = 64


@dataclass(frozen=True, slots=True)
class ServingWeights:
    """How a serving cell counts.

    Parameters
    ----------
    hysteresis_db : float
        h.
    sd_db : float
        σ of the margin's error.
    weight_per_m : float
        Of the log-likelihood, for each metre travelled, because errors last.
    """

    hysteresis_db: float = 2.0
    sd_db: float = 9.0
    weight_per_m: float = 1 / 22


def log_serving(margin_db: ArrayLike, weights: ServingWeights) -> Floats:
    """Return the log-likelihood that a cell serves where its margin is so.

    Examples
    --------
    >>> log_serving([-20.0, -2.0, 20.0], ServingWeights()).round(3).tolist()
    [-3.783, -0.693, -0.007]
    """
    margin = np.asarray(margin_db, dtype=np.float64)
    return np.asarray(log_ndtr((margin + weights.hysteresis_db) / weights.sd_db))


def serving_table(weights: ServingWeights) -> Floats32:
    """Return the log-likelihood for margins of -64 to 64 dB in quarters, for the kernel."""
    steps = _REACH_DB * _STEPS_PER_DB
    margin_db = np.arange(-steps, steps + 1) / _STEPS_PER_DB
    return log_serving(margin_db, weights).astype(np.float32)


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_by_serving(
    pixel: Ints32,
    level_dbm: Floats32,
    bands: int,
    cell: int,
    table: Floats32,
    weight: float,
    log_weight: Floats,
) -> None:
    """Add the serving cell's log-likelihood to weights, in place.

    Parameters
    ----------
    pixel : ndarray of int32, shape (N,)
        Flat pixel of each hypothesis.
    level_dbm : ndarray of float32, shape (pixels * bands,)
        Levels of all cells, then the best and the second best.
    bands, cell : int
    table : ndarray of float32
        From :func:`serving_table`.
    weight : float
    log_weight : ndarray of float64, shape (N,)
    """
    middle = _F(_REACH_DB * _STEPS_PER_DB)
    zero, last = _F(0.0), _F(2 * _REACH_DB * _STEPS_PER_DB)
    per_db, w, half = _F(_STEPS_PER_DB), _F(weight), _F(0.5)
    own, first, second = np.uint32(cell), np.uint32(bands - 2), np.uint32(bands - 1)
    width = np.uint32(bands)
    for i in range(pixel.size):
        at = np.uint32(np.uint32(pixel[i]) * width)
        level = level_dbm[at + own]
        best = level_dbm[at + first]
        other = level_dbm[at + second] if level >= best else best
        place = (level - other) * per_db + middle + half
        place = place if place > zero else zero
        place = place if place < last else last
        log_weight[i] += w * table[np.int32(place)]
