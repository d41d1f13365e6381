"""How probable a report is at a place by its serving cell, and by levels that are only bounds.

With handover hysteresis and prediction errors the serving cell is often not the one predicted best.
Its probability is a smooth function of the margin m, its predicted level above the best other
cell's: ``Φ((m + h) / σ)``, with h the hysteresis in the serving cell's favour. It is never hard.
The other cells are those of its layer (:mod:`mapfilter.radio.layers`).

In the kernels, hypotheses are given by flat pixels, shape (N,), and levels as one flat array of
shape (pixels * bands,), of which some bands are the best and the second best level of a layer.
Levels themselves are compared in :mod:`mapfilter.models.level_errors`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from mapfilter._kernels import exp32, log32
from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.models.cell_faults import mixed
from mapfilter.options import NotNegative, Options, Positive

_F = np.float32
_BLOCK = 256
STEPS_PER_SD, REACH_SD = 32, 8
STEPS_PER_DB, REACH_DB = 4, 64


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


class ServingBands(NamedTuple):
    """Where a serving cell is compared with others.

    Parameters
    ----------
    all : int
        Bands of a pixel.
    serving, strongest, second : int
        Its band, and those with the strongest and the second strongest level of its layer.
    """

    all: int
    serving: int
    strongest: int
    second: int


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
    fault_nats : float
        Negative log-likelihood of a serving cell whose prediction is wrong.
    """

    hysteresis_db: NotNegative = 2.0
    sd_db: Positive = 9.0
    weight_per_m: NotNegative = 1 / 22
    fault_nats: NotNegative = 0.7


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
    from scipy.special import log_ndtr

    margin = np.asarray(margin_db, dtype=np.float64)
    return np.asarray(log_ndtr((margin + weights.hysteresis_db) / weights.sd_db))


def serving_table(weights: ServingWeights) -> Floats32:
    """Return the log-likelihood for margins of -64 to 64 dB in quarters, for the kernel."""
    steps = REACH_DB * STEPS_PER_DB
    margin_db = np.arange(-steps, steps + 1) / STEPS_PER_DB
    return log_serving(margin_db, weights).astype(np.float32)


def bound_table() -> Floats32:
    """Return log Φ at -8 to 8 standard deviations, for the kernel."""
    from scipy.special import log_ndtr

    steps = REACH_SD * STEPS_PER_SD
    sds = np.arange(-steps, steps + 1) / STEPS_PER_SD
    return np.asarray(log_ndtr(sds), dtype=np.float32)


def pixels(state: Floats32, raster: RasterFrame) -> Ints32:
    """Return the flat pixel of each hypothesis; beyond the raster that of its edge."""
    pixel = np.empty(state.shape[1], dtype=np.int32)
    fill_pixels(0, pixel.size, state, raster, raster.rows - 1, raster.cols - 1, pixel)
    return pixel


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def pixels_up_to(state: Floats32, raster: RasterFrame, last_row: int, last_col: int) -> Ints32:
    """Return the flat pixel of each hypothesis; rows and columns beyond the last ones are these."""
    pixel = np.empty(state.shape[1], dtype=np.int32)
    fill_pixels(0, pixel.size, state, raster, last_row, last_col, pixel)
    return pixel


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def fill_pixels(
    first: int,
    stop: int,
    state: Floats32,
    raster: RasterFrame,
    last_row: int,
    last_col: int,
    pixel: Ints32,
) -> None:
    """Fill the flat pixels of hypotheses ``first`` to ``stop``, as :func:`pixels_up_to`."""
    east, north, found = state[0, first:stop], state[1, first:stop], pixel[first:stop]
    w, n, k, zero = _F(raster.west_m), _F(raster.north_m), _F(raster.per_m), _F(0.0)
    lower, right, width = np.int32(last_row), np.int32(last_col), np.int32(raster.cols)
    for i in range(found.size):
        x = (east[i] - w) * k
        y = (n - north[i]) * k
        x = x if x > zero else zero
        y = y if y > zero else zero
        col, row = np.int32(x), np.int32(y)
        col = col if col < right else right
        row = row if row < lower else lower
        found[i] = np.int32(np.int32(row * width) + col)


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
    middle, last = _F(REACH_SD * STEPS_PER_SD), _F(2 * REACH_SD * STEPS_PER_SD)
    width = np.uint32(bands)
    value, total = np.empty(_BLOCK, dtype=np.float32), np.empty(_BLOCK, dtype=np.float32)
    place = np.empty(_BLOCK, dtype=np.int32)
    # Loops that look up are apart from those that compute, which are vectorised.
    for first in range(0, pixel.size, _BLOCK):
        count, own = min(_BLOCK, pixel.size - first), pixel[first:]
        total[:] = zero
        for j in range(cells.size):
            cell = np.uint32(cells[j])
            for i in range(count):
                value[i] = level_dbm[np.uint32(np.uint32(own[i]) * width) + cell]
            if censored == 0:
                for i in range(count):
                    v = (reported - value[i]) * per_db
                    v = v if v < _F(4.0) else _F(4.0)
                    v = v if v > _F(-4.0) else _F(-4.0)
                    total[i] += exp32(_F(-0.5) * v * v)
            else:
                for i in range(count):
                    v = (reported - value[i]) * per_db
                    v = v if censored < 0 else -v
                    step = v * _F(STEPS_PER_SD) + middle + _F(0.5)
                    step = step if step > zero else zero
                    step = step if step < last else last
                    place[i] = np.int32(step)
                for i in range(count):
                    value[i] = table[np.uint32(place[i])]
                for i in range(count):
                    total[i] += exp32(value[i])
        into = log_weight[first:]
        for i in range(count):
            into[i] += w * log32(total[i] * share)


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def weigh_by_serving(
    first: int,
    stop: int,
    pixel: Ints32,
    level_dbm: Floats32,
    cells: ServingBands,
    table: Floats32,
    weight: float,
    odds: Floats32,
    other: float,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood of the serving cell, times a weight, to weights, in place.

    It is that of hypotheses ``first`` to ``stop``; ``table`` is that of
    :func:`serving_table`. ``odds`` (N,) are the log odds of its fault, updated in place, and
    ``other`` is the log-likelihood with a fault.
    """
    pixel, odds, log_weight = pixel[first:stop], odds[first:stop], log_weight[first:stop]
    middle = _F(REACH_DB * STEPS_PER_DB)
    zero, last = _F(0.0), _F(2 * REACH_DB * STEPS_PER_DB)
    per_db, w, half, wrong = _F(STEPS_PER_DB), _F(weight), _F(0.5), _F(weight * other)
    own, strongest = np.uint32(cells.serving), np.uint32(cells.strongest)
    width, second = np.uint32(cells.all), np.uint32(cells.second)
    right = np.empty(pixel.size, dtype=np.float32)
    # Loops that look up are apart from the one that computes, which is vectorised.
    for i in range(pixel.size):
        at = np.uint32(np.uint32(pixel[i]) * width)
        level = level_dbm[at + own]
        best = level_dbm[at + strongest]
        beside = level_dbm[at + second] if level >= best else best
        place = (level - beside) * per_db + middle + half
        place = place if place > zero else zero
        place = place if place < last else last
        right[i] = table[np.uint32(np.int32(place))]
    for i in range(pixel.size):
        _, gained, after = mixed(odds[i], wrong, w * right[i])
        odds[i] = after
        log_weight[i] += gained
