"""Compiled kernels of :mod:`mapfilter.models.level_errors`: levels and absent cells as evidence.

Hypotheses go through in blocks that stay in the cache; within a block each loop runs over its
hypotheses, so that the arithmetic is vectorised. A block has a row for each number of a record:
each slot's slow error, each fast one, that of the device, then the log odds of each slot's fault.
:mod:`mapfilter.models.report_kernel` fills the rows from records and writes them back.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._kernels import exp32, log32
from mapfilter._types import Bytes, Floats, Floats32, Ints32
from mapfilter.models.cell_faults import mixed, mixed_but_for_logarithm
from mapfilter.models.fingerprint import REACH_SD, STEPS_PER_SD
from mapfilter.models.record_tiles import fetch

_F = np.float32
BLOCK = 128
"""Hypotheses of a block: what they keep, and the steps of a report, fit into the first cache."""
_HALF, _ONE, _ZERO = _F(0.5), _F(1.0), _F(0.0)
LOG_ROOT_TWO_PI = _F(0.9189385)


class LevelTerms(NamedTuple):
    """One report prepared for :func:`add_levels` or :func:`add_absence`.

    ``gain`` (K, 2S + 1) and ``variance_db2`` (K,) are those of sequential Kalman updates;
    ``other`` (K,) the log-likelihoods of the levels if the prediction is wrong.
    """

    cell: Ints32
    slot: Ints32
    level_dbm: Floats32
    gain: Floats32
    variance_db2: Floats32
    other: Floats32


class Prediction(NamedTuple):
    """Predicted levels and their roughness (tenths of a dB), flat over pixels and ``bands``.

    ``share`` of the local variance is added to that of an innovation.
    """

    level_dbm: Floats32
    rough_db: Bytes
    bands: int
    share: float


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def add_levels(
    kept: Floats32,
    count: int,
    pixel: Ints32,
    predicted: Prediction,
    terms: LevelTerms,
    gain: Floats32,
    upon: Floats32,
    steps: Floats32,
    more: Floats32,
    factors: Floats32,
    total: Floats32,
    weight: np.float32,
    log_weight: Floats,
    before: Floats32,
    ahead: Ints32,
) -> None:
    """Add the log-likelihood of levels to the weights of a block, and update its rows, in place.

    ``gain`` and ``upon`` are those of :func:`in_fours` and :func:`gain_of_sums`. The arrays behind
    them are room for ``gain.shape[0]`` steps (those behind the last one are zeros), and rows.
    Meanwhile the records ``ahead`` of ``before`` are fetched, some with each level.
    """
    means, levels = terms.gain.shape[1], terms.cell.size
    total[:], factors[:] = _ZERO, _ONE
    for k in range(terms.cell.size):
        for i in range(ahead.size * k // levels, ahead.size * (k + 1) // levels):
            fetch(before, ahead[i])
        s, cell, innovation = terms.slot[k], terms.cell[k], steps[k]
        _look_up(predicted, pixel, count, cell, innovation, more)
        _less_errors(kept, means, count, s, terms.level_dbm[k], innovation)
        _less_steps(upon[k], steps, k, count, innovation)
        odds = kept[means + s]
        own, other = terms.variance_db2[k], terms.other[k]
        # Two loops of half the length: more hypotheses are under way at a time.
        for j in range(count):
            v, variance = innovation[j], own + more[j]
            per = _ONE / variance
            more[j] = -_HALF * (v * v * per + log32(variance))
            innovation[j] = v * own * per
        for j in range(count):
            fine, gained, factor, odds[j] = mixed_but_for_logarithm(odds[j], other, more[j])
            total[j] += gained
            factors[j] *= factor
            innovation[j] = fine * innovation[j]
        # One logarithm for four levels.
        if k % 4 == 3 or k == terms.cell.size - 1:
            for j in range(count):
                total[j] -= log32(factors[j])
                factors[j] = _ONE
    _corrected(kept, count, gain, steps)
    for j in range(count):
        log_weight[j] += weight * total[j]


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def add_absence(
    kept: Floats32,
    count: int,
    pixel: Ints32,
    predicted: Prediction,
    terms: LevelTerms,
    gain: Floats32,
    upon: Floats32,
    table: Floats32,
    steps: Floats32,
    per_sd: Floats32,
    right: Floats32,
    total: Floats32,
    place: Ints32,
    weight: np.float32,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood that cells are below a level, and update as above, in place.

    ``table`` is that of :func:`mapfilter.models.fingerprint.bound_table`. Means move to those of
    the truncated normal distribution.
    """
    means = terms.gain.shape[1]
    middle, last = _F(REACH_SD * STEPS_PER_SD) + _HALF, _F(2 * REACH_SD * STEPS_PER_SD)
    total[:] = _ZERO
    for k in range(terms.cell.size):
        s, cell, below = terms.slot[k], terms.cell[k], steps[k]
        _look_up(predicted, pixel, count, cell, below, per_sd)
        _less_errors(kept, means, count, s, terms.level_dbm[k], below)
        _less_steps(upon[k], steps, k, count, below)
        odds = kept[means + s]
        own, other = terms.variance_db2[k], terms.other[k]
        for j in range(count):
            per = _ONE / np.sqrt(own + per_sd[j])
            z = below[j] * per
            at_step = z * _F(STEPS_PER_SD) + middle
            at_step = at_step if at_step > _ZERO else _ZERO
            at_step = at_step if at_step < last else last
            below[j], per_sd[j], place[j] = z, per, np.int32(at_step)
        for j in range(count):
            right[j] = table[np.uint32(place[j])]
        for j in range(count):
            fine, gained, odds[j] = mixed(odds[j], other, right[j])
            total[j] += gained
            # Above six deviations the truncation moves nothing, and the density is none.
            z = below[j] if below[j] > _F(-8.0) else _F(-8.0)
            hazard = exp32(-_HALF * z * z - LOG_ROOT_TWO_PI - right[j])
            hazard = hazard if z < _F(6.0) else _ZERO
            below[j] = -fine * hazard * own * per_sd[j]
    _corrected(kept, count, gain, steps)
    for j in range(count):
        log_weight[j] += weight * total[j]


@njit(error_model="numpy", cache=True)
def gained(before: Floats, after: Floats, share: float) -> Floats:
    """Return a share of what log weights (N,) have gained; 0 where there is no weight."""
    found = np.zeros(after.size)
    for i in range(after.size):
        if np.isfinite(after[i]):
            found[i] = share * (after[i] - before[i])
    return found


@njit(error_model="numpy", cache=True)
def shares_above(
    pixel: Ints32, every: int, predicted: Prediction, cell: Ints32, limit_dbm: Floats32
) -> Floats:
    """Return the share of hypotheses, one of ``every``, that predict cells (K,) above levels."""
    bands = predicted.bands
    share = np.zeros(cell.size)
    for i in range(0, pixel.size, every):
        first = pixel[i] * bands
        for k in range(cell.size):
            share[k] += predicted.level_dbm[first + cell[k]] > limit_dbm[k]
    return share / ((pixel.size + every - 1) // every)


@njit(error_model="numpy", cache=True)
def rough_squares(pixel: Ints32, every: int, predicted: Prediction, cell: Ints32) -> Floats:
    """Return the local variance of predictions at one of ``every`` hypotheses, (K, count)."""
    found, bands = np.empty((cell.size, (pixel.size + every - 1) // every)), predicted.bands
    for i in range(found.shape[1]):
        first = pixel[i * every] * bands
        for k in range(cell.size):
            rough_db = 0.1 * predicted.rough_db[first + cell[k]]
            found[k, i] = rough_db * rough_db
    return found


@njit(inline="always")
def _look_up(
    predicted: Prediction,
    pixel: Ints32,
    count: int,
    cell: np.int32,
    level_dbm: Floats32,
    more_db2: Floats32,
) -> None:
    """Fill in a cell's levels at the pixels of a block, and what roughness adds to the variance."""
    share, width, band = _F(0.01 * predicted.share), np.uint32(predicted.bands), np.uint32(cell)
    for j in range(count):
        at = np.uint32(np.uint32(pixel[j]) * width) + band
        level_dbm[j] = predicted.level_dbm[at]
        more_db2[j] = _F(predicted.rough_db[at])
    # Apart from what is looked up, as that is not vectorised.
    for j in range(count):
        more_db2[j] = share * more_db2[j] * more_db2[j]


@njit(inline="always")
def gain_of_sums(terms: LevelTerms) -> Floats32:
    """Return by how much the error of a term's level (row) moves with each step (column)."""
    count, means = terms.gain.shape
    slots = (means - 1) // 2
    found = np.zeros((count, count), dtype=np.float32)
    for k in range(count):
        for m in range(k):
            gain, s = terms.gain[m], terms.slot[k]
            found[k, m] = gain[s] + gain[slots + s] + gain[means - 1]
    return found


@njit(inline="always")
def _less_errors(
    kept: Floats32, means: int, count: int, slot: int, level_dbm: np.float32, predicted: Floats32
) -> None:
    """Replace predicted levels of a block by how far a level is above them and their errors."""
    slow, fast, device = kept[slot], kept[(means - 1) // 2 + slot], kept[means - 1]
    for j in range(count):
        predicted[j] = level_dbm - predicted[j] - slow[j] - fast[j] - device[j]


@njit(inline="always")
def _less_steps(
    gain: Floats32, steps: Floats32, known: int, count: int, innovation: Floats32
) -> None:
    """Take from innovations what the known steps have moved the errors by, in place."""
    for m in range(known):
        by, step = gain[m], steps[m]
        for j in range(count):
            innovation[j] -= by * step[j]


@njit(inline="always")
def in_fours(gain: Floats32) -> Floats32:
    """Return gains (K, D) with rows of zeros behind them: as many as four go into."""
    whole = np.zeros(((gain.shape[0] + 3) // 4 * 4, gain.shape[1]), dtype=np.float32)
    for k in range(gain.shape[0]):
        for d in range(gain.shape[1]):
            whole[k, d] = gain[k, d]
    return whole


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def _corrected(kept: Floats32, count: int, gain: Floats32, steps: Floats32) -> None:
    """Add gains (K, D) times steps (K, block), K by fours, to the means of a block, in place."""
    half = (gain.shape[1] - 1) // 2
    for k in range(0, gain.shape[0], 4):
        one, two, three, four = steps[k], steps[k + 1], steps[k + 2], steps[k + 3]
        # Slow and fast errors take the same steps.
        for d in range(half):
            row, other = kept[d], kept[half + d]
            a, b, c, e = gain[k, d], gain[k + 1, d], gain[k + 2, d], gain[k + 3, d]
            m = half + d
            f, g, h, i = gain[k, m], gain[k + 1, m], gain[k + 2, m], gain[k + 3, m]
            none = (a == _ZERO) & (b == _ZERO) & (c == _ZERO) & (e == _ZERO)
            if not (none & (f == _ZERO) & (g == _ZERO) & (h == _ZERO) & (i == _ZERO)):
                for j in range(count):
                    p, q, r, s = one[j], two[j], three[j], four[j]
                    row[j] = row[j] + a * p + b * q + c * r + e * s
                    other[j] = other[j] + f * p + g * q + h * r + i * s
        row, d = kept[2 * half], 2 * half
        a, b, c, e = gain[k, d], gain[k + 1, d], gain[k + 2, d], gain[k + 3, d]
        for j in range(count):
            row[j] = row[j] + a * one[j] + b * two[j] + c * three[j] + e * four[j]
