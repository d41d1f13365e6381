"""DLR: filters by satellites and LTE time differences of arrival, over the readings of a track."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.experiments.papers.dlr.scene import ARRIVAL, CLOCK_M, DETOUR_M, HEIGHT_M
from mapfilter.filters import gaussian, rao_blackwell
from mapfilter.filters.kalman import predict, update
from mapfilter.models.gaussian import GaussianTerms, stack
from mapfilter.models.motion import LinearMotion, constant_velocity, random_walk, together
from mapfilter.models.ranging import pseudoranges, range_differences
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.models import compiled
from mapfilter.positioning.kalman.static_fix import TOO_FEW, StaticFix, static_fix

Mobility = Literal["diagonal", "discretised"]

HYBRID = StateLayout(7, 0, 2, 4, 6)
"""East, north and up, each followed by its rate; clock bias."""

FIXES = StateLayout(6, 0, 2, 4)
"""The same without a clock, which static fixes have solved for already."""

FLAT = StateLayout(4, 0, 2, height_m=HEIGHT_M)
"""East and north, each followed by its rate, at a known height: for time differences alone."""

PLACE = StateLayout(2, 0, 1, height_m=HEIGHT_M)
"""East and north at a known height: what two time differences solve for."""

PARTICLES = 10_000
DRIFT_M, DRIFT_MPS = 0.3, 0.3
FIRST_M, FIRST_UP_M, FIRST_MPS, FIRST_UP_MPS, FIRST_CLOCK_M = 10.0, 2.0, 1.0, 0.1, 3e5
THREE = 3


class Epoch(NamedTuple):
    """Measurements of one epoch; the model is None where there are none."""

    model: GaussianTerms | None
    reading: Floats


def motion(layout: StateLayout, mobility: Mobility = "diagonal") -> LinearMotion:
    """Return the paper's mobility model, eq. 21, and a random walk of a clock.

    Its Q is diagonal, as in the paper, or that of white accelerations, properly discretised.
    """
    axes = 2 if layout.up is None else 3
    moving = constant_velocity(1.0, DRIFT_MPS, axes, "continuous")
    if mobility == "diagonal":
        noise = np.diag(np.square([DRIFT_M, DRIFT_MPS] * axes))
        moving = LinearMotion(moving.transition, noise)
    if layout.clock is None:
        return moving
    return together([moving, random_walk(1.0, CLOCK_M, dimensions=1)])


def start(layout: StateLayout, about_m: Floats) -> gaussian.Gaussian:
    """Return the belief before the first epoch, about a place (east, north)."""
    mean, deviation = [about_m[0], 0.0, about_m[1], 0.0], [FIRST_M, FIRST_MPS] * 2
    if layout.up is not None:
        mean += [HEIGHT_M, 0.0]
        deviation += [FIRST_UP_M, FIRST_UP_MPS]
    if layout.clock is not None:
        mean.append(0.0)
        deviation.append(FIRST_CLOCK_M)
    return gaussian.Gaussian(np.array(mean), np.diag(np.square(deviation)))


def satellites(
    layout: StateLayout, places_m: Floats, sigma_m: Floats, ranges_m: Floats
) -> list[Epoch]:
    """Return each epoch's pseudoranges: those of (K, S) that are not NaN."""
    found = []
    for row in ranges_m:
        seen = np.isfinite(row)
        model = pseudoranges(layout, places_m[seen], sigma_m[seen]) if seen.any() else None
        found.append(Epoch(model, row[seen]))
    return found


def differences(
    layout: StateLayout,
    stations_m: Floats,
    sinr_db: Floats,
    times_m: Floats,
    above_db: float | None = None,
) -> list[Epoch]:
    """Return each epoch's time differences of stations, (K, B); the best one is the reference.

    Stations with a SINR below ``above_db`` are dropped; without it the three best are taken,
    however bad.
    """
    found = []
    for sinr, times in zip(sinr_db, times_m, strict=True):
        best = np.argsort(-sinr, kind="stable")
        used = best[:THREE] if above_db is None else best[sinr[best] >= above_db]
        if used.size < 2:
            found.append(Epoch(None, np.zeros(0)))
            continue
        sigma = np.hypot(ARRIVAL.sigma_m(sinr[used]), DETOUR_M)
        model = range_differences(layout, stations_m[used], sigma)
        found.append(Epoch(model, times[used[1:]] - times[used[0]]))
    return found


def joined(first: Sequence[Epoch], second: Sequence[Epoch]) -> list[Epoch]:
    """Put two kinds of measurements together, epoch by epoch."""
    found = []
    for one, other in zip(first, second, strict=True):
        models = [epoch.model for epoch in (one, other) if epoch.model is not None]
        model = stack(models) if models else None
        found.append(Epoch(model, np.concatenate([one.reading, other.reading])))
    return found


def run_static(layout: StateLayout, epochs: Sequence[Epoch]) -> list[StaticFix]:
    """Solve each epoch from the middle of the scene: position and clock, or east and north."""
    begin = np.array([0.0, 0.0, HEIGHT_M, 0.0])[: layout.size]
    unknown = np.full((layout.size, layout.size), np.nan)
    nothing = StaticFix(np.full(layout.size, np.nan), unknown, False, 0, TOO_FEW)
    return [
        nothing if epoch.model is None else static_fix(epoch.model, epoch.reading, begin)
        for epoch in epochs
    ]


def run_ekf(
    layout: StateLayout, epochs: Sequence[Epoch], about_m: Floats, mobility: Mobility = "diagonal"
) -> Floats:
    """Filter measurements by an extended Kalman filter; return positions, (K, 2)."""
    belief, moving = start(layout, about_m), motion(layout, mobility)
    found = np.empty((len(epochs), 2))
    for k, epoch in enumerate(epochs):
        belief = predict(belief, moving.transition, moving.noise)
        if epoch.model is not None:
            belief, _ = update(belief, compiled(epoch.model), epoch.reading, gaussian.EKF)
        found[k] = belief.mean[[0, 2]]
    return found


def run_pf(
    layout: StateLayout,
    epochs: Sequence[Epoch],
    about_m: Floats,
    rng: np.random.Generator,
    particles: int = PARTICLES,
) -> Floats:
    """Filter measurements by particles of the position, drawn anew at every reading (SIR).

    Velocity and clock are Gaussians given a particle's path; returns positions, (K, 2).
    """
    first, moving = start(layout, about_m), motion(layout)
    sampled = (0, 2) if layout.up is None else (0, 2, 4)
    belief = rao_blackwell.init(first.mean, first.covariance, sampled, particles, rng)
    found = np.empty((len(epochs), 2))
    for k, epoch in enumerate(epochs):
        belief = rao_blackwell.predict(belief, moving.transition, moving.noise, rng)
        if epoch.model is not None:
            belief, _ = rao_blackwell.update(belief, compiled(epoch.model), epoch.reading, rng)
        found[k] = belief.mean()[[0, 2]]
    return found
