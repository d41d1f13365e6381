"""TESA: GNSS and GSM fused by a Rao-Blackwellised particle filter; its two scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from mapfilter._parallel import Progress, ordered_results
from mapfilter.experiments.papers.tesa_scene import (
    BETA_DB,
    BETAS_DB,
    Motion,
    Scene,
    assumed,
    draw_readings,
    measurements,
    tesa_scene,
)
from mapfilter.filters import rao_blackwell
from mapfilter.filters.sir_options import SIR, SirOptions
from mapfilter.filters.trials import CompiledMeasurement

Floats = NDArray[np.float64]

PARTICLES = 10_000
AVAILABLE_M = 100.0


@dataclass(frozen=True, slots=True)
class Run:
    """One filter over one scenario.

    Parameters
    ----------
    scenario : int
        1: satellites all the way; 2: none during the outage.
    motion : {"identity", "isotropic", "velocity"}
    beta_db : float or None
        Shadowing; None for satellites alone.
    """

    scenario: int
    motion: Motion
    beta_db: float | None = None


RUNS = (
    Run(1, "identity"),
    *(Run(1, "identity", beta) for beta in BETAS_DB),
    Run(2, "identity"),
    *(Run(2, "identity", beta) for beta in BETAS_DB),
    *(Run(2, "velocity", beta) for beta in BETAS_DB),
    Run(2, "isotropic", BETA_DB),
)


def run_filter(
    run: Run,
    readings: Floats,
    models: Sequence[CompiledMeasurement],
    rng: np.random.Generator,
    particles: int = PARTICLES,
    options: SirOptions = SIR,
) -> Floats:
    """Run the filter over readings (K, m); return the positions it tells, (K, 3)."""
    known = assumed(run.motion)
    where = np.array(known.sampled)
    belief = rao_blackwell.init(
        known.first_mean, known.first_covariance, known.sampled, particles, rng
    )
    told = np.empty((len(readings), 3))
    for k, (reading, model) in enumerate(zip(readings, models, strict=True)):
        belief = rao_blackwell.predict(belief, known.motion.transition, known.motion.noise, rng)
        belief, _ = rao_blackwell.update(belief, model, reading, rng, options)
        told[k] = belief.mean()[where]
    return told


def trial_errors_m(
    trial: int, seed: int, particles: int = PARTICLES, runs: Sequence[Run] = RUNS
) -> Floats:
    """Draw one trial's readings and return the error of each run at each epoch, (runs, K)."""
    scene = _scene()
    drawn, *streams = np.random.default_rng([seed, trial]).spawn(1 + len(runs))
    ranges, level, shadow = draw_readings(scene, drawn)
    found = np.empty((len(runs), scene.drive.time_s.size))
    for own, run, rng in zip(found, runs, streams, strict=True):
        seen = ranges.copy()
        if run.scenario == 2:
            seen[scene.outage] = np.nan
        heard = [] if run.beta_db is None else [level + run.beta_db * shadow]
        told = run_filter(
            run, np.hstack([seen, *heard]), _models(run.motion, run.beta_db), rng, particles
        )
        own[:] = np.linalg.norm(told - scene.drive.place_m, axis=1)
    return found


@dataclass(frozen=True, eq=False)
class PaperRun:
    """Errors of all trials.

    Parameters
    ----------
    scene : Scene
    errors_m : dict
        By run, shape (T, K).
    """

    scene: Scene
    errors_m: dict[Run, Floats]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean over trials, and its interval.

    Parameters
    ----------
    value : float
    low, high : float
        95 % interval, by the normal distribution of means of trials.
    """

    value: float
    low: float
    high: float

    def within(self, least: float, most: float) -> Estimate:
        """Return the estimate with the interval cut to what is possible."""
        return Estimate(self.value, max(self.low, least), min(self.high, most))


def estimate(values: Floats) -> Estimate:
    """Return the mean over trials of (T,) values, and its 95 % interval.

    Examples
    --------
    >>> found = estimate(np.array([1.0, 3.0]))
    >>> found.value, round(found.low, 2), round(found.high, 2)
    (2.0, 0.04, 3.96)
    """
    mean = float(np.mean(values))
    half = 1.96 * float(np.std(values, ddof=1)) / np.sqrt(values.size) if values.size > 1 else 0.0
    return Estimate(mean, float(mean - half), float(mean + half))


def run_paper(
    trials: int, seed: int, executor: Executor, progress: Progress | None = None
) -> PaperRun:
    """Run all filters over all trials.

    Parameters
    ----------
    trials : int
    seed : int
    executor : concurrent.futures.Executor
    progress : callable, optional
        Called with trials done and trials in all.
    """
    one = partial(trial_errors_m, seed=seed)
    found = ordered_results(executor, one, range(trials), progress=progress)
    errors = np.stack(list(found), axis=1)
    return PaperRun(_scene(), dict(zip(RUNS, errors, strict=True)))


@lru_cache(maxsize=1)
def _scene() -> Scene:
    return tesa_scene()


@lru_cache(maxsize=len(RUNS))
def _models(motion: Motion, beta_db: float | None) -> tuple[CompiledMeasurement, ...]:
    return measurements(_scene(), motion, beta_db)
