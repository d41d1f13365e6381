"""TESA: GNSS and GSM fused by a Rao-Blackwellised particle filter; its two scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from mapfilter._parallel import ordered_results
from mapfilter._types import Floats
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.experiments.papers.tesa.models import Motion, assumed, loading, measurements
from mapfilter.experiments.papers.tesa.scene import (
    BETA_DB,
    BETAS_DB,
    Scene,
    draw_readings,
    draw_start_m,
    tesa_scene,
)
from mapfilter.filters import rao_blackwell
from mapfilter.filters.rao_blackwell import SIR, SirOptions
from mapfilter.filters.trials import CompiledMeasurement

PARTICLES = 10_000
AVAILABLE_M = 100.0


class Run(NamedTuple):
    """One filter over one scenario; ``beta_db``, the shadowing, is None for satellites alone.

    Scenario 1: satellites all the way; 2: none during the outage; 3: as 2, with a halt in it.
    """

    scenario: int
    motion: Motion
    beta_db: float | None = None


RUNS = (
    Run(1, "identity"),
    Run(1, "identity", BETA_DB),
    Run(2, "velocity"),
    *(Run(2, "velocity", beta) for beta in BETAS_DB),
    Run(2, "identity"),
    *(Run(2, "identity", beta) for beta in BETAS_DB),
    Run(2, "known-bearing", BETA_DB),
    Run(3, "velocity"),
    Run(3, "velocity", BETA_DB),
    Run(3, "identity", BETA_DB),
)


def run_filter(
    run: Run,
    readings: Floats,
    models: Sequence[CompiledMeasurement],
    start_m: Floats,
    rng: np.random.Generator,
    particles: int = PARTICLES,
    options: SirOptions = SIR,
) -> Floats:
    """Run the filter over readings (K, m) from an assumed start (3,); return positions (K, 3)."""
    known = assumed(run.motion, run.beta_db)
    where = np.array(known.sampled)
    belief = rao_blackwell.init(
        known.first_mean(start_m), known.first_covariance, known.sampled, particles, rng
    )
    shadowing = loading(known, readings.shape[1])
    found = np.empty((len(readings), 3))
    for k, (reading, model) in enumerate(zip(readings, models, strict=True)):
        belief = rao_blackwell.predict(belief, known.motion.transition, known.motion.noise, rng)
        belief, _ = rao_blackwell.update(belief, model, reading, rng, options, shadowing)
        found[k] = belief.mean()[where]
    return found


def trial_errors_m(
    trial: int, seed: int, particles: int = PARTICLES, runs: Sequence[Run] = RUNS
) -> Floats:
    """Draw one trial's readings and return the error of each run at each epoch, (runs, K)."""
    streams = np.random.default_rng([seed, trial]).spawn(3 + len(runs))
    start_m = draw_start_m(streams[0])
    drawn = {halt: draw_readings(_scene(halt), streams[1 + halt]) for halt in (False, True)}
    found = np.empty((len(runs), _scene(False).drive.time_s.size))
    for own, run, rng in zip(found, runs, streams[3:], strict=True):
        halt = run.scenario == 3
        scene, (ranges, level, shadow) = _scene(halt), drawn[halt]
        seen = ranges.copy()
        if run.scenario > 1:
            seen[scene.outage] = np.nan
        received = [] if run.beta_db is None else [level + run.beta_db * shadow]
        models = _models(halt, run.motion, run.beta_db)
        places = run_filter(run, np.hstack([seen, *received]), models, start_m, rng, particles)
        own[:] = np.linalg.norm(places - scene.drive.place_m, axis=1)
    return found


class PaperRun(NamedTuple):
    """Errors of all trials: by run, (T, K)."""

    scene: Scene
    errors_m: dict[Run, Floats]


class Estimate(NamedTuple):
    """A mean over trials, and its 95 % interval by Student's t."""

    value: float
    low: float
    high: float


def estimate(values: Floats, least: float = -np.inf, most: float = np.inf) -> Estimate:
    """Return the mean over trials of (T,) values, its interval cut to what is possible.

    Examples
    --------
    >>> found = estimate(np.array([1.0, 3.0]), least=0.0)
    >>> found.value, found.low, round(found.high, 2)
    (2.0, 0.0, 14.71)
    """
    mean, half = float(np.mean(values)), 0.0
    if values.size > 1:
        factor = float(stdtrit(values.size - 1, 0.975))
        half = factor * float(np.std(values, ddof=1)) / float(np.sqrt(values.size))
    return Estimate(mean, max(mean - half, least), min(mean + half, most))


def run_paper(settings: PaperSettings) -> PaperRun:
    """Run all filters over all trials."""
    one, trials = partial(trial_errors_m, seed=settings.seed), range(settings.trials)
    found = ordered_results(settings.executor, one, trials, progress=settings.progress)
    errors = np.stack(list(found), axis=1)
    return PaperRun(_scene(False), dict(zip(RUNS, errors, strict=True)))


@lru_cache(maxsize=2)
def _scene(halt: bool) -> Scene:
    return tesa_scene(halt=halt)


@lru_cache(maxsize=len(RUNS))
def _models(halt: bool, motion: Motion, beta_db: float | None) -> tuple[CompiledMeasurement, ...]:
    return measurements(_scene(halt), motion, beta_db)
