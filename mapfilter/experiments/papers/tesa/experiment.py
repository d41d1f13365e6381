"""TESA: the filters of its two scenarios and a halt, and their errors.

Filters get what is available to a receiver, with two exceptions: the law and the correlation
distance of the shadowing are those of the simulation, and the known-bearing model, as its name
states, takes the bearing of the road from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, Literal, NamedTuple

import numpy as np

from mapfilter._parallel import SerialExecutor, ordered_results
from mapfilter._types import Floats
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.experiments.papers.tesa.scene import (
    BEARING_DEG,
    BETA_DB,
    BETAS_DB,
    CLOCK_M,
    CORRELATION_M,
    EIRP_DBM,
    START_HORIZONTAL_M,
    START_UP_M,
    STATIONS_LEFT_M,
    Scene,
    draw_readings,
    draw_start_m,
    loss_at_km_db,
    tesa_scene,
)
from mapfilter.filters import rao_blackwell
from mapfilter.filters.trials import CompiledMeasurement
from mapfilter.models.gaussian import stack
from mapfilter.models.motion import LinearMotion, constant_velocity, random_walk, together
from mapfilter.models.ranging import pseudoranges
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import POSITION_CLOCK_3D, StateLayout
from mapfilter.positioning.kalman.models import compiled
from mapfilter.simulation.drives import ahead_and_left

Motion = Literal["velocity", "identity", "known-bearing"]

VELOCITY: Motion = "velocity"
IDENTITY: Motion = "identity"
KNOWN_BEARING: Motion = "known-bearing"

SPEED_MPS = 50.0 / 3.6
"""The paper's v_mobile; the true speed is 13.1 m/s."""

INTERVAL_S = 1.0
ACCELERATION_MPS2 = 0.5
STEP_M, ACROSS_M, UP_M = 25.0, 5.0, 0.5
FIRST_CLOCK_M = 3e5
LEAST_SIGMA_DB = 0.5
RECEIVER_SIGMA_DB = 0.29
PARTICLES = 10_000


@dataclass(frozen=True, eq=False)
class Assumed:
    """State, motion and initial uncertainty that a filter assumes.

    ``sampled`` are the components with particles (east, north, up), ``shadowing`` those that are
    the shadowing of the stations in dB; none where it is taken as white.
    """

    layout: StateLayout
    motion: LinearMotion
    first_covariance: Floats
    sampled: tuple[int, ...] = (0, 1, 2)
    shadowing: tuple[int, ...] = ()

    def first_mean(self, start_m: Floats) -> Floats:
        """Return the first mean for a start (3,): at rest, clock and shadowing 0."""
        mean = np.zeros(self.layout.size)
        mean[list(self.sampled)] = start_m
        return mean

    def loading(self, rows: int) -> Floats | None:
        """Return how shadowing adds to a reading of ``rows`` values, (rows, n): to the last."""
        if not self.shadowing:
            return None
        found = np.zeros((rows, self.layout.size))
        first = rows - len(self.shadowing)
        found[np.arange(first, rows), list(self.shadowing)] = 1.0
        return found


def assumed(motion: Motion, beta_db: float | None = None) -> Assumed:
    """Return what a filter assumes, with shadowing of ``beta_db``; None without levels."""
    flat, up, clock = START_HORIZONTAL_M**2, START_UP_M**2, FIRST_CLOCK_M**2
    if motion == "velocity":
        speed = SPEED_MPS**2 / 2
        parts = [
            constant_velocity(INTERVAL_S, ACCELERATION_MPS2, 2),
            random_walk(INTERVAL_S, UP_M, dimensions=1),
            random_walk(INTERVAL_S, CLOCK_M, dimensions=1),
        ]
        first = [flat, speed, flat, speed, up, clock]
        own = len(first)
        if beta_db is not None:
            # A Gauss-Markov process of each station at the paper's speed.
            stations, sigma_db = len(STATIONS_LEFT_M), max(beta_db, LEAST_SIGMA_DB)
            rho = float(np.exp(-SPEED_MPS * INTERVAL_S / CORRELATION_M))
            unit = np.eye(stations)
            parts.append(LinearMotion(rho * unit, sigma_db**2 * (1 - rho**2) * unit))
            first += [sigma_db**2] * stations
        layout = StateLayout(len(first), 0, 2, 4, 5)
        shadowing = tuple(range(own, len(first)))
        return Assumed(layout, together(parts), np.diag(first), (0, 2, 4), shadowing)
    noise = np.diag([STEP_M**2, STEP_M**2, UP_M**2, CLOCK_M**2])
    if motion == "known-bearing":
        ahead, left = ahead_and_left(BEARING_DEG)
        noise[:2, :2] = STEP_M**2 * np.outer(ahead, ahead) + ACROSS_M**2 * np.outer(left, left)
    first_covariance = np.diag([flat, flat, up, clock])
    return Assumed(POSITION_CLOCK_3D, LinearMotion(np.eye(4), noise), first_covariance)


def measurements(
    scene: Scene, motion: Motion, beta_db: float | None
) -> tuple[CompiledMeasurement, ...]:
    """Return what is measured at each epoch: pseudoranges and, with β, levels."""
    known = assumed(motion, beta_db)
    received = []
    if beta_db is not None:
        sigma = RECEIVER_SIGMA_DB if known.shadowing else max(beta_db, LEAST_SIGMA_DB)
        law: dict[str, Any] = {"loss_at_km_db": loss_at_km_db(), "exponent": 2.0}
        received = [levels(known.layout, scene.stations_m, sigma, eirp_dbm=EIRP_DBM, **law)]
    return tuple(
        compiled(stack([pseudoranges(known.layout, place, sigma), *received]))
        for place, sigma in zip(scene.satellites_m, scene.range_sigma_m, strict=True)
    )


class Run(NamedTuple):
    """One filter over one scenario; ``beta_db``, the shadowing, is None for satellites alone.

    Scenario 1: satellites all the way; 2: none during the outage; 3: as 2, with a halt in it.
    """

    scenario: int
    motion: Motion
    beta_db: float | None = None


RUNS = (
    Run(1, IDENTITY),
    Run(1, IDENTITY, BETA_DB),
    *(Run(2, VELOCITY, beta) for beta in (None, *BETAS_DB)),
    *(Run(2, IDENTITY, beta) for beta in (None, *BETAS_DB)),
    Run(2, KNOWN_BEARING, BETA_DB),
    Run(3, VELOCITY),
    Run(3, VELOCITY, BETA_DB),
    Run(3, IDENTITY, BETA_DB),
)


def run_filter(
    run: Run,
    readings: Floats,
    models: Sequence[CompiledMeasurement],
    start_m: Floats,
    rng: np.random.Generator,
    particles: int,
) -> Floats:
    """Run the filter over readings (K, m) from an assumed start (3,); return positions (K, 3)."""
    known = assumed(run.motion, run.beta_db)
    where = np.array(known.sampled)
    belief = rao_blackwell.init(
        known.first_mean(start_m), known.first_covariance, known.sampled, particles, rng
    )
    loading = known.loading(readings.shape[1])
    found = np.empty((len(readings), 3))
    for k, (reading, model) in enumerate(zip(readings, models, strict=True)):
        belief = rao_blackwell.predict(belief, known.motion.transition, known.motion.noise, rng)
        belief, _ = rao_blackwell.update(belief, model, reading, rng, loading=loading)
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


def run_paper(settings: PaperSettings) -> PaperRun:
    """Run all filters over all trials."""
    one, trials = partial(trial_errors_m, seed=settings.seed), range(settings.trials)
    executor = settings.executor or SerialExecutor()
    found = ordered_results(executor, one, trials, progress=settings.progress)
    errors = np.stack(list(found), axis=1)
    return PaperRun(_scene(False), dict(zip(RUNS, errors, strict=True)))


@lru_cache(maxsize=2)
def _scene(halt: bool) -> Scene:
    return tesa_scene(halt=halt)


@lru_cache(maxsize=len(RUNS))
def _models(halt: bool, motion: Motion, beta_db: float | None) -> tuple[CompiledMeasurement, ...]:
    return measurements(_scene(halt), motion, beta_db)
