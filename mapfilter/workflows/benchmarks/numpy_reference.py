"""A step of the Bayes map filter's model by whole arrays of NumPy: the reference of its speed.

State rows are those of :mod:`mapfilter.models.street_motion`, in double precision.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from math import exp
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from mapfilter._types import Floats, Floats32, Ints, Ints32
from mapfilter.filters.copies import array_of
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.fingerprint import log_serving
from mapfilter.models.level_kernels import LevelTerms
from mapfilter.models.level_memory import LevelMemory
from mapfilter.models.street_motion import (
    BIAS,
    EAST,
    LOG_SCALE,
    NORTH,
    OFF,
    RATE,
    STATES,
    STRETCH,
    TURN,
)
from mapfilter.positioning.bayes.sources.sampled_cells import expected_absent, mean_rough_db2
from mapfilter.workflows.benchmarks.filter import StepInputs

Step = Callable[[Floats], Floats]
"""From equally weighted particles, shape (9, N), to those after a whole step."""

MAP = STATES
"""Row of a step's log-likelihood of the map, after the rows of the model's own state."""

Resample = Callable[[Floats, np.random.Generator], Ints]
"""From weights that sum to one to the indices of the particles that as many new ones copy."""

_MOST_ODDS, _KEPT_ODDS = 20.0, 8.0
_TABLE_DB, _PER_DB = 64, 4
_TABLE_SD, _PER_SD = 8, 32


class NumpyModel:
    """One step of the Bayes map filter's model, by whole arrays.

    What all particles share of the errors of levels is prepared by the package itself; what each
    keeps of them is that of a belief before the step.
    """

    def __init__(self, inputs: StepInputs, belief: ParticleBelief) -> None:
        self.model, self.motion = inputs.model, inputs.motion
        self.reading, self.levels = inputs.reading, inputs.levels
        kept = array_of(belief.kept_unread)
        self.kept: Floats = np.ascontiguousarray(kept, dtype=np.float64)
        self.shared: LevelMemory = belief.shared

    @cached_property
    def _serving(self) -> Floats:
        span = np.arange(-_TABLE_DB * _PER_DB, _TABLE_DB * _PER_DB + 1) / _PER_DB
        return log_serving(span, self.model.evidence.serving)

    @cached_property
    def _below(self) -> Floats:
        return np.asarray(
            log_ndtr(np.arange(-_TABLE_SD * _PER_SD, _TABLE_SD * _PER_SD + 1) / _PER_SD)
        )

    def move(self, state: Floats, rng: np.random.Generator) -> Floats:
        """Return particles after the step of dead reckoning and the map, with the latter's row."""
        errors, count = self.model.motion, state.shape[1]
        length_m = abs(self.motion.step_m)
        a, b, c, d, e, f = rng.standard_normal((6, count))
        moved = np.empty_like(state)
        moved[RATE] = state[RATE]
        bias = state[BIAS] + length_m * state[RATE]
        bias += errors.bias_drift_rad_per_sqrt_m * length_m**0.5 * c
        moved[BIAS] = (bias + np.pi) % (2 * np.pi) - np.pi
        moved[LOG_SCALE] = state[LOG_SCALE] + errors.scale_drift_per_sqrt_m * length_m**0.5 * d
        turned, stretched = (exp(-length_m / x) for x in (errors.heading_m, errors.stretch_m))
        turn = turned * state[TURN] + errors.turn_sd_rad * (1 - turned**2) ** 0.5 * e
        jumps = rng.random(count) < 1 - exp(-errors.disturbances_per_m * length_m)
        moved[TURN] = np.where(jumps, errors.disturbed_rad * e, turn)
        new = errors.stretch_sd * (1 - stretched**2) ** 0.5
        moved[STRETCH] = stretched * state[STRETCH] + new * f
        heading = self.motion.heading_rad + moved[BIAS] + moved[TURN]
        scale = moved[LOG_SCALE] + moved[STRETCH]
        stretch = exp(0.5 * errors.white_rad**2)
        steps = length_m / errors.typical_step_m
        along = self.motion.step_m * stretch * np.exp(scale) + errors.step_sd_m * steps**0.5 * a
        across = length_m * errors.white_rad / min(steps, 1.0) ** 0.5 * b
        cosine, sine = np.cos(heading), np.sin(heading)
        moved[EAST] = state[EAST] + along * cosine - across * sine
        moved[NORTH] = state[NORTH] + along * sine + across * cosine
        moved[OFF], moved[MAP] = self._mapped(moved, state[OFF], length_m)
        return moved

    def log_likelihood(self, state: Floats) -> Floats:
        """Return the log-likelihood of map, serving cell and levels, shape (N,)."""
        return self.weigh(state)[0]

    def weigh(self, state: Floats) -> tuple[Floats, Floats]:
        """Return the log-likelihood of a whole step, and what particles keep, shape (W, N)."""
        area, reading = self.model.whole, self.reading
        pixel = self._pixels(state[EAST], state[NORTH])
        now = area.level_dbm[pixel]
        top = area.strongest(reading.serving)
        level, best, second = now[:, reading.serving], now[:, top], now[:, top + 1]
        margin = level - np.where(level >= best, second, best)
        middle = _TABLE_DB * _PER_DB
        place = np.clip(margin * _PER_DB + middle + 0.5, 0, 2 * middle).astype(np.int64)
        right = reading.serving_weight * self._serving[place]
        rough = 0.1 * area.flat_rough_db.reshape(area.level_dbm.shape)[pixel].astype(np.float64)
        flat = np.asarray(pixel[0] * area.lattice.cols + pixel[1], dtype=np.int32)
        memory, kept = self._aged()
        served, after = self._served(right, memory.fault_odds(reading.serving, kept))
        memory.fault_odds(reading.serving, kept)[:] = after
        matched, held = self._levels(now, rough, flat, memory, kept)
        return np.asarray(state[MAP] + served + matched), held

    def _aged(self) -> tuple[LevelMemory, Any]:
        """Return what is known of the errors of levels as the report finds it, with its cells."""
        errors, length_m = self.model.evidence.levels, self.reading.length_m
        memory, decay = self.shared.after(length_m)
        # The memory takes single precision or double alike.
        kept: Any = self.kept.copy()
        usual = errors.fault_log_odds
        kept[: decay.size] *= decay[:, None]
        kept[decay.size :] = usual + exp(-length_m / errors.fault_m) * (kept[decay.size :] - usual)
        first = np.array([self.reading.serving], dtype=np.int32)
        return memory.with_cells(first, kept, in_place=True)

    def _served(self, right: Floats, before: Any) -> tuple[Floats, Floats]:
        """Return the log-likelihood of the serving cell, and the log odds of its fault."""
        other = -self.model.evidence.serving.fault_nats * self.reading.serving_weight
        odds = before + other - right
        served = right + np.logaddexp(0, odds) - np.logaddexp(0, before)
        return served, np.clip(odds, -_KEPT_ODDS, _KEPT_ODDS)

    def _levels(
        self, now: Floats32, rough: Floats, pixel: Ints32, memory: LevelMemory, held: Any
    ) -> tuple[Floats, Floats]:
        errors, report, predicted = self.model.evidence.levels, self.levels, self.model.prediction
        report = expected_absent(predicted, pixel, report)
        cells = np.concatenate([report.cell, report.absent])[: memory.slots]
        memory, held = memory.with_cells(cells, held, in_place=True)
        memory, heard = memory.updated(report, mean_rough_db2(predicted, pixel, report.cell))
        absent, total = memory.absence(report), np.zeros(now.shape[0])
        for terms, below in ((heard, False), (absent, True)):
            for k in range(terms.cell.size):
                total += self._one(terms, k, now, rough, held, below=below)
        return errors.weight * total, held

    def _one(
        self, terms: LevelTerms, k: int, now: Floats32, rough: Floats, kept: Floats, *, below: bool
    ) -> Floats:
        """Return the log-likelihood of one level or absence, and update what particles keep."""
        means = terms.gain.shape[1]
        slots, s, cell = (means - 1) // 2, terms.slot[k], terms.cell[k]
        error = kept[s] + kept[slots + s] + kept[means - 1]
        own = float(terms.variance_db2[k])
        variance = own + self.model.evidence.levels.roughness * rough[:, cell] ** 2
        v = float(terms.level_dbm[k]) - now[:, cell] - error
        if below:
            z = v / np.sqrt(variance)
            middle = _TABLE_SD * _PER_SD
            right = self._below[np.clip(z * _PER_SD + middle + 0.5, 0, 2 * middle).astype(np.int64)]
            z = np.maximum(z, -_TABLE_SD)
            hazard = np.exp(-0.5 * z**2 - 0.9189385 - right)
            step = np.where(z < 6, -hazard * own / np.sqrt(variance), 0.0)
        else:
            right = -0.5 * (v**2 / variance + np.log(variance))
            step = v * own / variance
        before = kept[means + s].copy()
        odds = before + float(terms.other[k]) - right
        fine = 1 / (1 + np.exp(np.clip(odds, -_MOST_ODDS, _MOST_ODDS)))
        kept[means + s] = np.clip(odds, -_KEPT_ODDS, _KEPT_ODDS)
        kept[:means] += terms.gain[k][:, None] * (fine * step)
        return np.asarray(right + np.logaddexp(0, odds) - np.logaddexp(0, before))

    def _mapped(self, state: Floats, off: Floats, length_m: float) -> tuple[Floats, Floats]:
        lattice, raster = self.model.area.lattice, self.model.log_map
        step = lattice.resolution_m
        x = np.maximum((state[EAST] - step / 2) / step, 0)
        y = np.maximum(((lattice.rows - 0.5) * step - state[NORTH]) / step, 0)
        col = np.minimum(x.astype(np.int64), lattice.cols - 2)
        row = np.minimum(y.astype(np.int64), lattice.rows - 2)
        u, v = np.minimum(x - col, 1), np.minimum(y - row, 1)
        upper = raster[row, col] + u * (raster[row, col + 1] - raster[row, col])
        under = raster[row + 1, col] + u * (raster[row + 1, col + 1] - raster[row + 1, col])
        factors = self.model.weights.over(length_m)
        on = np.exp(factors.exponent * (upper + v * (under - upper)))
        away = off * (1 - factors.come_back) + (1 - off) * factors.leave
        total = away * factors.off + (1 - away) * on
        return away * factors.off / total, np.log(total)

    def _pixels(self, east: Floats, north: Floats) -> tuple[Ints, Ints]:
        lattice = self.model.area.lattice
        step = lattice.resolution_m
        col = np.clip(east / step, 0, lattice.cols - 1).astype(np.int64)
        row = np.clip(lattice.rows - north / step, 0, lattice.rows - 1).astype(np.int64)
        return row, col


def systematic_indices(weight: Floats, rng: np.random.Generator) -> Ints:
    """Return the indices that systematic resampling chooses, by a search among sums."""
    count = weight.size
    places = (np.arange(count) + rng.random()) / count
    found: Ints = np.minimum(np.searchsorted(np.cumsum(weight), places), count - 1)
    return found


def numpy_step(
    model: NumpyModel,
    jitter: Floats,
    rng: np.random.Generator,
    resample: Resample = systematic_indices,
) -> Step:
    """Return a whole step in NumPy: move, weigh, normalise, resample, jitter the copies."""

    def step(state: Floats) -> Floats:
        moved = model.move(state, rng)
        log_weight, kept = model.weigh(moved)
        weight = np.exp(log_weight - log_weight.max())
        weight /= weight.sum()
        chosen = resample(weight, rng)
        copies = moved[:, chosen]
        copies[:STATES] += jitter[:, None] * rng.standard_normal((STATES, weight.size))
        return np.concatenate([copies, kept[:, chosen]])

    return step
