"""Levels of a report: how probable they are at a place, with errors that are correlated in space.

The error of a predicted level is a Gauss-Markov process along the path, with the exponential
autocorrelation of Gudmundson (1991): after d metres it has the correlation ``ρ = exp(-d / d_c)``.
So a level is compared by its *innovation* ``(r - p) - ρ (r' - p')``, with r and p the level as
reported and as predicted now and ' the same at the last report, whose variance is
``σ² (1 - ρ²)`` and that of the measurement. The errors of different cells have a common part
(the phone, the body, the site's surroundings): an equal correlation c between all of them, whose
inverse is known in closed form. Innovations are clipped, because predictions err by whole houses.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np
from numba import njit
from scipy.special import log_ndtr

from mapfilter._kernels import cos_sin32, exp32, log32
from mapfilter._types import Floats, Floats32, Ints32

_F = np.float32
_STEPS_PER_SD = 32
_REACH_SD = 8


@dataclass(frozen=True, slots=True)
class LevelErrors:
    """How levels differ from their prediction.

    Parameters
    ----------
    sd_db : float
        Of a prediction's error.
    correlation_m : float
        Distance after which its correlation is 1/e.
    measurement_db : float
        Independent error of each report.
    roughness_db : float
        How much the prediction itself varies over ``correlation_m``: a hypothesis that lies some
        metres beside the truth is told the levels of another place.
    common : float
        Correlation of the errors of different cells.
    clip_sd : float
        Innovations beyond it count as this.
    weight : float
        Exponent of the likelihood; below 1 where the model is not trusted to be exact.
    """

    sd_db: float = 10.0
    correlation_m: float = 50.0
    measurement_db: float = 1.5
    roughness_db: float = 6.0
    common: float = 0.3
    clip_sd: float = 3.0
    weight: float = 0.7

    def offset_variance_db2(self, particle_spacing_m: float) -> float:
        """Return the variance of a prediction so far beside the truth."""
        return 2 * self.roughness_db**2 * (1 - exp(-particle_spacing_m / self.correlation_m))


@dataclass(frozen=True, slots=True)
class LevelReading:
    """The levels of one report, as kernels take them; K levels.

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
    common : float
        c of these levels.
    weight, clip : float
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


@dataclass(frozen=True, slots=True)
class BoundReading:
    """A level that is only a bound, or one of a cell that may be any of several.

    Parameters
    ----------
    cells : ndarray of int32, shape (J,)
        Bands of the candidates; the likelihood is the mean over them.
    level_dbm : float
    censored : int
        -1: the level is below; 1: it is above; 0: it is this.
    sd_db, weight : float
    """

    cells: Ints32
    level_dbm: float
    censored: int
    sd_db: float
    weight: float


def bound_table() -> Floats32:
    """Return log Φ at -8 to 8 standard deviations, for the kernel."""
    steps = _REACH_SD * _STEPS_PER_SD
    sds = np.arange(-steps, steps + 1) / _STEPS_PER_SD
    return np.asarray(log_ndtr(sds), dtype=np.float32)


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def pixels(
    state: Floats32,
    back_east_m: float,
    back_north_m: float,
    west_m: float,
    north_m: float,
    per_m: float,
    rows: int,
    cols: int,
    pixel: Ints32,
) -> None:
    """Find the pixel that holds each hypothesis, or held it some displacement ago.

    Parameters
    ----------
    state : ndarray of float32, shape (5, N)
    back_east_m, back_north_m : float
        The displacement by dead reckoning, turned and scaled by each hypothesis's own errors.
    west_m, north_m : float
        Corner of the raster.
    per_m : float
        Pixels per metre.
    rows, cols : int
    pixel : ndarray of int32, shape (N,)
        Filled with flat indices; beyond the edge with the edge's.
    """
    east, north, bias, scale = state[0], state[1], state[2], state[3]
    be, bn, zero = _F(back_east_m), _F(back_north_m), _F(0.0)
    w, n, k = _F(west_m), _F(north_m), _F(per_m)
    last_col, last_row, width = np.int32(cols - 1), np.int32(rows - 1), np.int32(cols)
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


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_by_levels(
    pixel: Ints32,
    before: Ints32,
    level_dbm: Floats32,
    bands: int,
    cell: Ints32,
    offset_db: Floats32,
    rho: Floats32,
    scale: Floats32,
    common: float,
    weight: float,
    clip: float,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood of levels to weights, in place; see :class:`LevelReading`.

    Parameters
    ----------
    pixel, before : ndarray of int32, shape (N,)
        Flat pixels of each hypothesis now and at the last report.
    level_dbm : ndarray of float32, shape (pixels * bands,)
    bands : int
    """
    count = cell.size
    high, low = _F(clip), _F(-clip)
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
    cells: Ints32,
    reported_dbm: float,
    censored: int,
    sd_db: float,
    weight: float,
    table: Floats32,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood of one bound or ambiguous level to weights; see `BoundReading`."""
    per_db, w, zero = _F(1.0 / sd_db), _F(weight), _F(0.0)
    reported, share = _F(reported_dbm), _F(1.0 / cells.size)
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
