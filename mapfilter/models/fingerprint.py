"""How probable a report is at a place: by its levels and by its serving cell.

The error of a predicted level is a Gauss-Markov process along the path, with the exponential
autocorrelation of Gudmundson (1991): after d metres it has the correlation ``ρ = exp(-d / d_c)``.
So a level is compared by its *innovation* ``(r - p) - ρ (r' - p')``, with r and p the level as
reported and as predicted now and ' the same at the last report, whose variance is
``σ² (1 - ρ²)`` and that of the measurement. The errors of different cells have a common part
(the phone, the body, the site's surroundings): an equal correlation c between all of them, whose
inverse is known in closed form. Innovations are clipped, because predictions err by whole houses.

With handover hysteresis and prediction errors the serving cell is often not the one predicted best.
Its probability is a smooth function of the margin m, its predicted level above the best other
cell's: ``Φ((m + h) / σ)``, with h the hysteresis in the serving cell's favour. It is never hard.

In the kernels, hypotheses are given by flat pixels, shape (N,), and levels as one flat array of
shape (pixels * bands,), whose last two bands are the best and the second best level of all cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.special import log_ndtr

from mapfilter._kernels import cos_sin32, exp32, log32
from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.options import NotNegative, Options, Positive, Share

_F = np.float32
_STEPS_PER_SD, _REACH_SD = 32, 8
_STEPS_PER_DB, _REACH_DB = 4, 64


@dataclass(frozen=True, slots=True)
class LevelErrors(Options):
    """How levels differ from their prediction.

    Parameters
    ----------
    sd_db : float
        Standard deviation of a prediction's error.
    correlation_m : float
        Distance after which its correlation is 1/e.
    measurement_db : float
        Standard deviation of the independent error of each report.
    roughness_db : float
        How much the prediction itself varies over ``correlation_m``: a hypothesis some metres
        beside the true position predicts the levels of another place.
    common : float
        Correlation of the errors of different cells.
    clip_sd : float
        Innovations beyond so many standard deviations count as this.
    weight : float
        Exponent of the likelihood; below 1 where the model is not trusted to be exact.
    """

    sd_db: NotNegative = 10.0
    correlation_m: Positive = 50.0
    measurement_db: NotNegative = 1.5
    roughness_db: NotNegative = 6.0
    common: Share = 0.3
    clip_sd: Positive = 3.0
    weight: Share = 0.7

    def offset_variance_db2(self, particle_spacing_m: float) -> float:
        """Return the variance of a prediction so far beside the true position."""
        return 2 * self.roughness_db**2 * (1 - exp(-particle_spacing_m / self.correlation_m))


class LevelReading(NamedTuple):
    """The K levels of one report, as kernels take them.

    Parameters
    ----------
    cell : ndarray of int32, shape (K,)
        Bands of the cells.
    offset_db : ndarray of float32, shape (K,)
        ``r - ρ r'``.
    rho : ndarray of float32, shape (K,)
        Correlation with the last report; 0 where the cell was not in it.
    scale : ndarray of float32, shape (K,)
        One over the innovation's standard deviation, times the root of the level's weight.
    common, weight, clip : float
        As in :class:`LevelErrors`.
    back_east_m, back_north_m : float
        Displacement by dead reckoning since the last report.
    """

    cell: Ints32
    offset_db: Floats32
    rho: Floats32
    scale: Floats32
    common: float
    weight: float
    clip: float
    back_east_m: float
    back_north_m: float


class BoundReading(NamedTuple):
    """A level that is only a bound, or one of a cell that may be any of several.

    Parameters
    ----------
    cells : ndarray of int32, shape (J,)
        Bands of the candidates; the likelihood is the mean over them.
    censored : int
        -1: the level is below; 1: it is above; 0: it is this.
    sd_db : float
        Standard deviation of the level's error.
    weight : float
        Exponent of the likelihood.
    """

    cells: Ints32
    level_dbm: float
    censored: int
    sd_db: float
    weight: float


@dataclass(frozen=True, slots=True)
class ServingWeights(Options):
    """How the serving cell counts.

    Parameters
    ----------
    hysteresis_db : float
        h, in the serving cell's favour.
    sd_db : float
        σ of the margin's error.
    weight_per_m : float
        Exponent of the likelihood for each metre travelled, because errors last.
    """

    hysteresis_db: NotNegative = 2.0
    sd_db: Positive = 9.0
    weight_per_m: NotNegative = 1 / 22


class RasterFrame(NamedTuple):
    """Where the pixels of a raster lie: its north-western corner, pixels per metre, and size."""

    west_m: float
    north_m: float
    per_m: float
    rows: int
    cols: int


def log_serving(margin_db: ArrayLike, weights: ServingWeights) -> Floats:
    """Return the log-likelihood that a cell serves at a margin over the best other cell.

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


def bound_table() -> Floats32:
    """Return log Φ at -8 to 8 standard deviations, for the kernel."""
    steps = _REACH_SD * _STEPS_PER_SD
    sds = np.arange(-steps, steps + 1) / _STEPS_PER_SD
    return np.asarray(log_ndtr(sds), dtype=np.float32)


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def pixels(state: Floats32, back_east_m: float, back_north_m: float, raster: RasterFrame) -> Ints32:
    """Return the flat pixel of each hypothesis, or of where it was before a displacement.

    The displacement by dead reckoning is turned and scaled by each hypothesis's own errors. Beyond
    the edge of the raster pixels are those of the edge.
    """
    east, north, bias, scale = state[0], state[1], state[2], state[3]
    be, bn, zero = _F(back_east_m), _F(back_north_m), _F(0.0)
    w, n, k = _F(raster.west_m), _F(raster.north_m), _F(raster.per_m)
    last_col, last_row = np.int32(raster.cols - 1), np.int32(raster.rows - 1)
    width = np.int32(raster.cols)
    pixel = np.empty(state.shape[1], dtype=np.int32)
    for i in range(pixel.size):
        cosine, sine = cos_sin32(bias[i])
        stretch = exp32(scale[i])
        x = (east[i] - stretch * (be * cosine - bn * sine) - w) * k
        y = (n - north[i] + stretch * (be * sine + bn * cosine)) * k
        x = x if x > zero else zero
        y = y if y > zero else zero
        col, row = np.int32(x), np.int32(y)
        col = col if col < last_col else last_col
        row = row if row < last_row else last_row
        pixel[i] = np.int32(np.int32(row * width) + col)
    return pixel


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_by_levels(
    pixel: Ints32,
    before: Ints32,
    level_dbm: Floats32,
    bands: int,
    levels: LevelReading,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood of levels to weights, in place.

    ``pixel`` and ``before`` hold each hypothesis now and at the last report.
    """
    count, common, weight = levels.cell.size, levels.common, levels.weight
    cell, offset_db, rho, scale = levels.cell, levels.offset_db, levels.rho, levels.scale
    high, low = _F(levels.clip), _F(-levels.clip)
    own = _F(-0.5 * weight / (1.0 - common))
    shared = _F(0.5 * weight / (1.0 - common) * common / (1.0 + (count - 1) * common))
    width = np.uint32(bands)
    for i in range(pixel.size):
        now, then = np.uint32(np.uint32(pixel[i]) * width), np.uint32(np.uint32(before[i]) * width)
        total, squares = _F(0.0), _F(0.0)
        for j in range(count):
            band = np.uint32(cell[j])
            v = (offset_db[j] - level_dbm[now + band] + rho[j] * level_dbm[then + band]) * scale[j]
            v = v if v < high else high
            v = v if v > low else low
            total += v
            squares += v * v
        log_weight[i] += own * squares + shared * total * total


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_by_bound(
    pixel: Ints32,
    level_dbm: Floats32,
    bands: int,
    bound: BoundReading,
    table: Floats32,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood of one bound or ambiguous level to weights, in place.

    ``table`` is that of :func:`bound_table`.
    """
    cells, censored = bound.cells, bound.censored
    per_db, w, zero = _F(1.0 / bound.sd_db), _F(bound.weight), _F(0.0)
    reported, share = _F(bound.level_dbm), _F(1.0 / cells.size)
    middle, last = _F(_REACH_SD * _STEPS_PER_SD), _F(2 * _REACH_SD * _STEPS_PER_SD)
    width = np.uint32(bands)
    for i in range(pixel.size):
        at = np.uint32(np.uint32(pixel[i]) * width)
        total = zero
        for j in range(cells.size):
            v = (reported - level_dbm[at + np.uint32(cells[j])]) * per_db
            if censored == 0:
                v = v if v < _F(4.0) else _F(4.0)
                v = v if v > _F(-4.0) else _F(-4.0)
                total += exp32(_F(-0.5) * v * v)
            else:
                place = (v if censored < 0 else -v) * _F(_STEPS_PER_SD) + middle + _F(0.5)
                place = place if place > zero else zero
                place = place if place < last else last
                total += exp32(table[np.int32(place)])
        log_weight[i] += w * log32(total * share)


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
    """Add the log-likelihood of the serving cell, times a weight, to weights, in place.

    ``cell`` is its band, ``table`` that of :func:`serving_table`.
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
