"""Reports as evidence on a graphics processor: kernels with a thread for each hypothesis.

They are those of :mod:`mapfilter.models.fingerprint` and :mod:`mapfilter.models.level_kernels`,
with the same elementary functions; results differ by rounding. Levels and their roughness are flat
over pixels and bands, as there, and what hypotheses keep has the same rows.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
from numba import cuda, float32

from mapfilter import _cuda
from mapfilter._kernels import exp32, log32
from mapfilter.models.cell_faults import mixed
from mapfilter.models.fingerprint import (
    REACH_DB,
    REACH_SD,
    STEPS_PER_DB,
    STEPS_PER_SD,
    BoundReading,
    RasterFrame,
)
from mapfilter.models.level_kernels import LOG_ROOT_TWO_PI, LevelTerms, Prediction
from mapfilter.models.level_memory import SLOTS

_F = np.float32
_ZERO, _HALF, _ONE = _F(0.0), _F(0.5), _F(1.0)
_HAZARD_FROM, _HAZARD_TO = _F(-8.0), _F(6.0)


def pixels(state: Any, frame: RasterFrame, pixel: Any) -> None:
    """Fill the flat pixel (N,) of each hypothesis; beyond the raster that of its edge."""
    _cuda.start(_pixels, pixel.size, state, frame, pixel)


def age(kept: Any, decay: Any, fault_keep: float, fault_log_odds: float) -> None:
    """Age what hypotheses keep, (W, N), by a distance, in place."""
    _cuda.start(_age, kept.shape[1], kept, decay, fault_keep, fault_log_odds)


def weigh_by_serving(
    pixel: Any,
    predicted: Prediction,
    cell: int,
    strongest: int,
    table: Any,
    weight: float,
    odds: Any,
    other: float,
    log_weight: Any,
) -> None:
    """Add the log-likelihood of the serving cell to weights, and update its fault, in place.

    ``strongest`` is the band with the strongest level of its layer; the next is the second.
    """
    level, bands = predicted.level_dbm, predicted.bands
    given = pixel, level, bands, cell, strongest, table, weight, odds, other, log_weight
    _cuda.start(_weigh_by_serving, pixel.size, *given)


def weigh_by_levels(
    kept: Any, pixel: Any, predicted: Prediction, terms: LevelTerms, weight: float, log_weight: Any
) -> None:
    """Add the log-likelihood of levels to weights and update what hypotheses keep, in place."""
    _cuda.start(_weigh_by_levels, pixel.size, kept, pixel, *predicted, *terms, weight, log_weight)


def weigh_by_absence(
    kept: Any,
    pixel: Any,
    predicted: Prediction,
    terms: LevelTerms,
    table: Any,
    weight: float,
    log_weight: Any,
) -> None:
    """Add the log-likelihood that cells are below a level, and update as above, in place."""
    given = kept, pixel, *predicted, *terms, table, weight, log_weight
    _cuda.start(_weigh_by_absence, pixel.size, *given)


def weigh_by_bound(
    pixel: Any, predicted: Prediction, bound: BoundReading, cells: Any, table: Any, log_weight: Any
) -> None:
    """Add the log-likelihood of one bound or ambiguous level to weights, in place.

    ``cells`` are those of the bound, on the device.
    """
    given = bound.level_dbm, bound.censored, bound.sd_db, bound.weight
    level, bands = predicted.level_dbm, predicted.bands
    _cuda.start(_weigh_by_bound, pixel.size, pixel, level, bands, cells, *given, table, log_weight)


@cuda.jit
def _pixels(state, frame, pixel):  # type: ignore[no-untyped-def]
    i = cuda.grid(1)
    if i >= pixel.size:
        return
    x = (state[0, i] - _F(frame.west_m)) * _F(frame.per_m)
    y = (_F(frame.north_m) - state[1, i]) * _F(frame.per_m)
    x = x if x > _ZERO else _ZERO
    y = y if y > _ZERO else _ZERO
    col = min(np.int32(x), np.int32(frame.cols - 1))
    row = min(np.int32(y), np.int32(frame.rows - 1))
    pixel[i] = row * np.int32(frame.cols) + col


@cuda.jit
def _age(kept, decay, fault_keep, fault_log_odds):  # type: ignore[no-untyped-def]
    i = cuda.grid(1)
    if i >= kept.shape[1]:
        return
    keep, usual = _F(fault_keep), _F(fault_log_odds)
    for d in range(decay.size):
        kept[d, i] = decay[d] * kept[d, i]
    for d in range(decay.size, kept.shape[0]):
        kept[d, i] = usual + (kept[d, i] - usual) * keep


@cuda.jit
def _weigh_by_serving(  # type: ignore[no-untyped-def]
    pixel, level_dbm, bands, cell, strongest, table, weight, odds, other, log_weight
):
    i = cuda.grid(1)
    if i >= pixel.size:
        return
    at, w = pixel[i] * bands, _F(weight)
    level, best = level_dbm[at + cell], level_dbm[at + strongest]
    beside = level_dbm[at + strongest + 1] if level >= best else best
    place = (level - beside) * _F(STEPS_PER_DB) + _F(REACH_DB * STEPS_PER_DB) + _HALF
    place = place if place > _ZERO else _ZERO
    last = _F(2 * REACH_DB * STEPS_PER_DB)
    place = place if place < last else last
    _, gained, after = mixed(odds[i], _F(weight * other), w * table[np.int32(place)])
    odds[i] = after
    log_weight[i] += gained


@cuda.jit
def _weigh_by_bound(  # type: ignore[no-untyped-def]
    pixel, predicted_dbm, bands, cell, level_dbm, censored, sd_db, weight, table, log_weight
):
    i = cuda.grid(1)
    if i >= pixel.size:
        return
    at, per_db, total, four = pixel[i] * bands, _F(1.0 / sd_db), _ZERO, _F(4.0)
    middle, last = _F(REACH_SD * STEPS_PER_SD), _F(2 * REACH_SD * STEPS_PER_SD)
    for k in range(cell.size):
        v = (_F(level_dbm) - predicted_dbm[at + cell[k]]) * per_db
        if censored == 0:
            v = v if v < four else four
            v = v if v > -four else -four
            total += exp32(-_HALF * v * v)
        else:
            place = (v if censored < 0 else -v) * _F(STEPS_PER_SD) + middle + _HALF
            place = place if place > _ZERO else _ZERO
            place = place if place < last else last
            total += exp32(table[np.int32(place)])
    log_weight[i] += _F(weight) * log32(_F(total) * _F(1.0 / cell.size))


@cuda.jit
def _weigh_by_levels(  # type: ignore[no-untyped-def]
    kept, pixel, predicted_dbm, rough_db, bands, share, cell, slot, level_dbm, gain, own_db2, other,
    weight, log_weight,
):  # fmt: skip
    i = cuda.grid(1)
    if i >= pixel.size:
        return
    means = gain.shape[1]
    slots = (means - 1) // 2
    part, total = _F(0.01 * share), _ZERO
    steps = cuda.local.array(SLOTS, float32)
    for k in range(cell.size):
        s, at = slot[k], pixel[i] * bands + cell[k]
        rough = _F(rough_db[at])
        innovation = level_dbm[k] - predicted_dbm[at]
        innovation = innovation - kept[s, i] - kept[slots + s, i] - kept[means - 1, i]
        for m in range(k):
            by = gain[m, s] + gain[m, slots + s] + gain[m, means - 1]
            innovation -= by * steps[m]
        variance = own_db2[k] + part * rough * rough
        per = _ONE / variance
        right = -_HALF * (innovation * innovation * per + log32(variance))
        fine, gained, after = mixed(kept[means + s, i], other[k], right)
        kept[means + s, i] = after
        total += gained
        steps[k] = fine * (innovation * own_db2[k] * per)
    for d in range(means):
        corrected = kept[d, i]
        for k in range(cell.size):
            corrected += gain[k, d] * steps[k]
        kept[d, i] = corrected
    log_weight[i] += _F(weight) * total


@cuda.jit
def _weigh_by_absence(  # type: ignore[no-untyped-def]
    kept, pixel, predicted_dbm, rough_db, bands, share, cell, slot, level_dbm, gain, own_db2, other,
    table, weight, log_weight,
):  # fmt: skip
    i = cuda.grid(1)
    if i >= pixel.size:
        return
    means = gain.shape[1]
    slots = (means - 1) // 2
    part, total = _F(0.01 * share), _ZERO
    middle, last = _F(REACH_SD * STEPS_PER_SD) + _HALF, _F(2 * REACH_SD * STEPS_PER_SD)
    steps = cuda.local.array(SLOTS, float32)
    for k in range(cell.size):
        s, at = slot[k], pixel[i] * bands + cell[k]
        rough = _F(rough_db[at])
        below = level_dbm[k] - predicted_dbm[at]
        below = below - kept[s, i] - kept[slots + s, i] - kept[means - 1, i]
        for m in range(k):
            by = gain[m, s] + gain[m, slots + s] + gain[m, means - 1]
            below -= by * steps[m]
        per_sd = _ONE / _F(sqrt(own_db2[k] + part * rough * rough))
        z = below * per_sd
        place = z * _F(STEPS_PER_SD) + middle
        place = place if place > _ZERO else _ZERO
        place = place if place < last else last
        right = table[np.int32(place)]
        fine, gained, after = mixed(kept[means + s, i], other[k], right)
        kept[means + s, i] = after
        total += gained
        # Above six deviations the truncation moves nothing, and the density is none.
        z = z if z > _HAZARD_FROM else _HAZARD_FROM
        hazard = exp32(-_HALF * z * z - LOG_ROOT_TWO_PI - right)
        hazard = hazard if z < _HAZARD_TO else _ZERO
        steps[k] = -fine * hazard * own_db2[k] * per_sd
    for d in range(means):
        corrected = kept[d, i]
        for k in range(cell.size):
            corrected += gain[k, d] * steps[k]
        kept[d, i] = corrected
    log_weight[i] += _F(weight) * total
