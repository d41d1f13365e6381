"""A step of the Bayes map filter against NumPy, particles and Stone Soup, with the same model.

Run by hand, after ``pip install particles stonesoup``: ``python benchmarks/bayes_peers.py``.
Nanoseconds per particle are medians over repetitions that take turns; packages that are not
installed are left out.
"""

from __future__ import annotations

import importlib.util
import tempfile
import time
from collections.abc import Callable
from datetime import datetime, timedelta
from functools import cached_property
from math import exp
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from mapfilter._types import Floats, Ints, Ints32
from mapfilter.database.store import open_database
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
from mapfilter.positioning.bayes.model import expected_absent, mean_rough_db2
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.store import read_log
from mapfilter.workflows.bench_filter import StepInputs, make_world, step_inputs, whole_step

Step = Callable[[Floats], Floats]
"""From equally weighted particles, shape (9, N), to those after a whole step."""

MAP = STATES
"""Row of a step's log-likelihood of the map, after the rows of the model's own state."""

_MOST_ODDS, _KEPT_ODDS = 20.0, 8.0
_RUNS, _PACKAGE_STEPS = 5, 10
_JITTER = (0.5, 0.5, 0.005, 0.003, 0.0, 0.004, 0.004, 1e-4)
_TABLE_DB, _PER_DB = 64, 4
_TABLE_SD, _PER_SD = 8, 32


class NumpyModel:
    """One step of the Bayes map filter's model, by whole arrays.

    What all particles share of the errors of levels is prepared by the package itself.
    """

    def __init__(self, inputs: StepInputs) -> None:
        self.model, self.motion = inputs.model, inputs.motion
        self.reading, self.levels = inputs.reading, inputs.levels

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
        area, reading = self.model.area, self.reading
        pixel = self._pixels(state[EAST], state[NORTH])
        now = area.level_dbm[pixel]
        level, best, second = now[:, reading.serving], now[:, -2], now[:, -1]
        margin = level - np.where(level >= best, second, best)
        middle = _TABLE_DB * _PER_DB
        place = np.clip(margin * _PER_DB + middle + 0.5, 0, 2 * middle).astype(np.int64)
        right = reading.serving_weight * self._serving[place]
        rough = 0.1 * area.flat_rough_db.reshape(area.level_dbm.shape)[pixel].astype(np.float64)
        flat = np.asarray(pixel[0] * area.lattice.cols + pixel[1], dtype=np.int32)
        served, odds = self._served(right)
        matched, kept = self._levels(now, rough, flat, odds)
        return np.asarray(state[MAP] + served + matched), kept

    def _served(self, right: Floats) -> tuple[Floats, Floats]:
        """Return the log-likelihood of the serving cell, and the log odds of its fault."""
        evidence = self.model.evidence
        other = -evidence.serving.fault_nats * self.reading.serving_weight
        before = evidence.levels.fault_log_odds
        odds = before + other - right
        served = right + np.logaddexp(0, odds) - np.logaddexp(0, before)
        return served, np.clip(odds, -_KEPT_ODDS, _KEPT_ODDS)

    def _levels(
        self, now: Floats, rough: Floats, pixel: Ints32, odds: Floats
    ) -> tuple[Floats, Floats]:
        errors, report, area = self.model.evidence.levels, self.levels, self.model.area
        predicted = self.model.prediction
        memory = LevelMemory.empty(errors, area.site_of)
        kept = memory.start(now.shape[0])
        first = np.array([self.reading.serving], dtype=np.int32)
        memory, kept = memory.with_cells(first, kept)
        memory.fault_odds(self.reading.serving, kept)[:] = odds
        report = report._replace(absent=expected_absent(predicted, pixel, report))
        cells = np.concatenate([report.cell, report.absent])[: memory.slots]
        memory, kept = memory.with_cells(cells, kept)
        memory, heard = memory.updated(report, mean_rough_db2(predicted, pixel, report.cell))
        absent, total = memory.absence(report), np.zeros(now.shape[0])
        held = kept.astype(np.float64)
        for terms, below in ((heard, False), (absent, True)):
            for k in range(terms.cell.size):
                total += self._one(terms, k, now, rough, held, below=below)
        return errors.weight * total, held

    def _one(
        self, terms: LevelTerms, k: int, now: Floats, rough: Floats, kept: Floats, *, below: bool
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


def numpy_step(model: NumpyModel, jitter: Floats, rng: np.random.Generator) -> Step:
    """Return a whole step in NumPy: move, weigh, normalise, resample, jitter the copies."""

    def step(state: Floats) -> Floats:
        moved = model.move(state, rng)
        log_weight, kept = model.weigh(moved)
        weight = np.exp(log_weight - log_weight.max())
        weight /= weight.sum()
        count = weight.size
        places = (np.arange(count) + rng.random()) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(weight), places), count - 1)
        copies = moved[:, chosen]
        copies[:STATES] += jitter[:, None] * rng.standard_normal((STATES, count))
        return np.concatenate([copies, kept[:, chosen]])

    return step


def particles_step(model: NumpyModel, rng: np.random.Generator, steps: int) -> Step | None:
    """Return some steps by the package ``particles``, or None without it."""
    if importlib.util.find_spec("particles") is None:
        return None
    import particles
    from particles.core import FeynmanKac

    class Walk(FeynmanKac):  # type: ignore[misc]
        first: Floats

        def M0(self, N: int) -> Floats:  # noqa: N802, N803
            return self.first[:N]

        def M(self, t: int, xp: Floats) -> Floats:  # noqa: ARG002, N802
            return model.move(xp.T, rng).T

        def logG(self, t: int, xp: Floats, x: Floats) -> Floats:  # noqa: ARG002, N802
            return model.log_likelihood(x.T)

    def step(state: Floats) -> Floats:
        walk = Walk(T=steps)
        walk.first = np.ascontiguousarray(state.T)
        run = particles.SMC(fk=walk, N=state.shape[1], resampling="systematic", ESSrmin=1.0)
        run.run()
        return np.asarray(run.X).T

    return step


def stone_soup_step(model: NumpyModel, rng: np.random.Generator) -> Step | None:
    """Return a whole step by Stone Soup, or None without it."""
    if importlib.util.find_spec("stonesoup") is None:
        return None
    from stonesoup.models.measurement import MeasurementModel
    from stonesoup.models.transition import TransitionModel
    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import SystematicResampler
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import ParticleState
    from stonesoup.updater.particle import ParticleUpdater

    class Walk(TransitionModel):  # type: ignore[misc]
        ndim_state = MAP + 1

        def function(self, state: Any, **_: Any) -> Any:
            return StateVectors(model.move(np.asarray(state.state_vector), rng))

        def rvs(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

        def pdf(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

    class ReportRow(MeasurementModel):  # type: ignore[misc]
        ndim_state = MAP + 1
        ndim_meas = 1
        mapping = (0,)

        def function(self, state: Any, **_: Any) -> Any:
            return state.state_vector[:1]

        def rvs(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

        def pdf(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

        def logpdf(self, _: Any, state: Any, **__: Any) -> Floats:
            return model.log_likelihood(np.asarray(state.state_vector))

    began = datetime(2000, 1, 1)
    later = began + timedelta(seconds=1)
    predictor = ParticlePredictor(Walk())
    updater = ParticleUpdater(measurement_model=ReportRow(), resampler=SystematicResampler())
    report = Detection(np.zeros((1, 1)), timestamp=later)

    def step(state: Floats) -> Floats:
        count = state.shape[1]
        known = ParticleState(
            StateVectors(state), weight=np.full(count, 1 / count), timestamp=began
        )
        predicted = predictor.predict(known, timestamp=later)
        found = updater.update(SingleHypothesis(predicted, report))
        return np.asarray(found.state_vector)

    return step


def compare(inputs: StepInputs, belief: Any, runs: int = _RUNS) -> dict[str, float]:
    """Return nanoseconds per particle of a whole step, by package."""
    count = belief.log_weight.size
    rng, jitter = np.random.default_rng(1), np.array(_JITTER)
    peer = NumpyModel(inputs)
    wide = np.vstack([belief.state.astype(np.float64), np.zeros(count)])
    steps = {
        "numpy": (numpy_step(peer, jitter, rng), 1),
        "particles": (particles_step(peer, rng, _PACKAGE_STEPS), _PACKAGE_STEPS),
        "stonesoup": (stone_soup_step(peer, rng), 1),
    }
    tasks: dict[str, tuple[Callable[[], object], int]] = {
        name: (lambda step=step: step(wide), times)
        for name, (step, times) in steps.items()
        if step is not None
    }
    tasks["mapfilter"] = (
        lambda: whole_step(inputs, belief, jitter.astype(np.float32), rng),
        1,
    )
    took_ns: dict[str, list[float]] = {name: [] for name in tasks}
    for run in range(runs + 1):
        for name, (task, times) in tasks.items():
            began_s = time.process_time()
            task()
            # The first loads what is compiled.
            if run > 0:
                took_ns[name].append(1e9 * (time.process_time() - began_s) / (times * count))
    return {name: median(values) for name, values in took_ns.items()}


def main() -> None:
    """Print a line for each number of particles and package."""
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        database, folders = make_world(Path(name), ["journeys.count=1"])
        model = BayesFilter().over(open_database(database)).model
        for count in (10_000, 100_000):
            found = compare(*step_inputs(model, read_log(folders[0]), count))
            for package, ns in found.items():
                ratio = ns / found["mapfilter"]
                print(f"{count} particles, {package}: {ns:.0f} ns per particle, {ratio:.1f} times")


if __name__ == "__main__":
    main()
