"""State, motion and measurement models of the filters of TESA's scenarios.

Everything here is available to a receiver, with two exceptions: the law and the correlation
distance of the shadowing are those of the simulation, and the known-bearing model, as its name
states, takes the bearing of the road from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from mapfilter._types import Floats
from mapfilter.experiments.papers.tesa.scene import (
    BEARING_DEG,
    CLOCK_M,
    CORRELATION_M,
    EIRP_DBM,
    START_HORIZONTAL_M,
    START_UP_M,
    STATIONS_LEFT_M,
    Scene,
    loss_at_km_db,
)
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


@dataclass(frozen=True, eq=False)
class Assumed:
    """State, motion and initial uncertainty that a filter assumes.

    ``sampled`` are the components with particles (east, north, up), ``shadowing`` those that are
    the shadowing of the stations in dB; none where it is taken as white.
    """

    layout: StateLayout
    motion: LinearMotion
    first_covariance: Floats
    sampled: tuple[int, ...]
    shadowing: tuple[int, ...] = ()

    def first_mean(self, start_m: Floats) -> Floats:
        """Return the first mean for a start (3,): at rest, clock and shadowing 0."""
        mean = np.zeros(self.layout.size)
        mean[list(self.sampled)] = start_m
        return mean


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
            stations = len(STATIONS_LEFT_M)
            parts.append(shadowing_motion(stations, assumed_sigma_db(beta_db)))
            first += [assumed_sigma_db(beta_db) ** 2] * stations
        layout = StateLayout(len(first), 0, 2, 4, 5)
        shadowing = tuple(range(own, len(first)))
        return Assumed(layout, together(parts), np.diag(first), (0, 2, 4), shadowing)
    noise = np.diag([STEP_M**2, STEP_M**2, UP_M**2, CLOCK_M**2])
    if motion == "known-bearing":
        ahead, left = ahead_and_left(BEARING_DEG)
        noise[:2, :2] = STEP_M**2 * np.outer(ahead, ahead) + ACROSS_M**2 * np.outer(left, left)
    first_covariance = np.diag([flat, flat, up, clock])
    return Assumed(POSITION_CLOCK_3D, LinearMotion(np.eye(4), noise), first_covariance, (0, 1, 2))


def assumed_sigma_db(beta_db: float) -> float:
    """Return the standard deviation of shadowing that filters assume."""
    return max(beta_db, LEAST_SIGMA_DB)


def shadowing_motion(stations: int, sigma_db: float) -> LinearMotion:
    """Return shadowing as a Gauss-Markov process of each station at the paper's speed."""
    rho = float(np.exp(-SPEED_MPS * INTERVAL_S / CORRELATION_M))
    unit = np.eye(stations)
    return LinearMotion(rho * unit, sigma_db**2 * (1 - rho**2) * unit)


def loading(known: Assumed, rows: int) -> Floats | None:
    """Return how shadowing adds to a reading of ``rows`` values, (rows, n): to the last of them."""
    if not known.shadowing:
        return None
    found = np.zeros((rows, known.layout.size))
    first = rows - len(known.shadowing)
    found[np.arange(first, rows), list(known.shadowing)] = 1.0
    return found


def measurements(
    scene: Scene, motion: Motion, beta_db: float | None
) -> tuple[CompiledMeasurement, ...]:
    """Return what is measured at each epoch: pseudoranges and, with β, levels."""
    known = assumed(motion, beta_db)
    received = []
    if beta_db is not None:
        sigma = RECEIVER_SIGMA_DB if known.shadowing else assumed_sigma_db(beta_db)
        law: dict[str, Any] = {"loss_at_km_db": loss_at_km_db(), "exponent": 2.0}
        received = [levels(known.layout, scene.stations_m, sigma, eirp_dbm=EIRP_DBM, **law)]
    return tuple(
        compiled(stack([pseudoranges(known.layout, place, sigma), *received]))
        for place, sigma in zip(scene.satellites_m, scene.range_sigma_m, strict=True)
    )
