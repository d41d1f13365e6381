"""The road, the three base stations and what is measured there; filters, and how they start."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.evaluation.bounds import expected_information, posterior_bound
from mapfilter.filters.gaussian import EKF, Method
from mapfilter.filters.gaussian_sum import run_mixtures, split
from mapfilter.filters.trials import run_trials
from mapfilter.models.gaussian import GaussianTerms, stack
from mapfilter.models.motion import constant_velocity
from mapfilter.models.ranging import timing_advances
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import MOVING
from mapfilter.positioning.kalman.models import compiled
from mapfilter.positioning.kalman.static_fix import static_fix

Combination = Literal["fusion", "ta", "rss"]
COMBINATIONS: tuple[Combination, ...] = ("fusion", "ta", "rss")

INTERVAL_S, ACCELERATION_MPS2 = 0.48, 0.1
START = (0.0, 15.0, 3000.0, 0.0)
SIGMA_TA_M, SIGMA_RSS_DB = 288.0, 4.0
LOSS_AT_KM_DB, EXPONENT = 132.85, 3.8
PRIOR_POSITION_M, PRIOR_VELOCITY_MPS = 5000.0, 50.0
SITES_M = ((0.0, 0.0), (6000.0, 0.0), (3000.0, 6000.0))
"""Not in the paper: a triangle around the road."""

MOTION = constant_velocity(INTERVAL_S, ACCELERATION_MPS2)
"""Eqs. 1 and 2."""

PRIOR = np.diag(np.square([PRIOR_POSITION_M, PRIOR_VELOCITY_MPS] * 2))
"""P(0) of section 4."""

POSITION = (0, 2)
VELOCITY = (1, 3)


def measurement(combination: Combination, sigma_db: float = SIGMA_RSS_DB) -> GaussianTerms:
    """Return timing advances, losses, or both (eq. 4)."""
    advances = timing_advances(MOVING, SITES_M, SIGMA_TA_M)
    law: dict[str, Any] = {"loss_at_km_db": LOSS_AT_KM_DB, "exponent": EXPONENT}
    losses = levels(MOVING, SITES_M, sigma_db, quantity="loss", **law)
    return stack({"fusion": [advances, losses], "ta": [advances], "rss": [losses]}[combination])


def bounds(states: Floats, combination: Combination, sigma_db: float) -> Floats:
    """Return the bound on the covariance at each step, shape (K, 4, 4)."""
    information = expected_information(measurement(combination, sigma_db), states)
    return posterior_bound(MOTION.transition, MOTION.noise, PRIOR, information)


class Started(NamedTuple):
    """Where filters begin: means (T, 4), and a covariance of each trial (T, 4, 4) or of all."""

    means: Floats
    covariance: Floats


def started_from_fix(trials: int, rng: np.random.Generator) -> Started:
    """Draw one reading of the timing advances at k = 0 in each trial and solve for its position."""
    model, start = measurement("ta"), np.array(START)
    readings = model.sample(np.tile(start, (trials, 1)), rng)
    middle = np.append(np.mean(SITES_M, axis=0), 0.0)[[0, 2, 1, 2]]
    means = np.empty((trials, 4))
    covariance = np.zeros((trials, 4, 4))
    for trial, reading in enumerate(readings):
        fix = static_fix(model, reading, middle, POSITION)
        means[trial] = fix.state
        covariance[trial][np.ix_(POSITION, POSITION)] = fix.covariance
    means[:, VELOCITY] = start[list(VELOCITY)]
    means[:, VELOCITY] += PRIOR_VELOCITY_MPS * rng.standard_normal((trials, 2))
    covariance[:, VELOCITY, VELOCITY] = PRIOR_VELOCITY_MPS**2
    return Started(means, covariance)


def started_wide(trials: int, rng: np.random.Generator) -> Started:
    """Draw starts from P(0) about the truth."""
    drawn = rng.standard_normal((trials, 4)) * np.sqrt(np.diagonal(PRIOR))
    return Started(np.array(START) + drawn, PRIOR)


def run_filter(
    method: Method,
    states: Floats,
    combination: Combination,
    start: Started,
    rng: np.random.Generator,
) -> Floats:
    """Draw readings at σ_l 4 dB and run a filter over them; return its means, (T, K, 4)."""
    given, moving = measurement(combination), (MOTION.transition, MOTION.noise)
    readings = given.sample(states, rng)
    return run_trials(compiled(given), *moving, method, *start, readings).means


def run_sum(
    states: Floats,
    combination: Combination,
    start: Started,
    rng: np.random.Generator,
) -> Floats:
    """Run a Gaussian sum of EKFs from a wide start, cut into 9 parts along east and north."""
    given, moving = measurement(combination), (MOTION.transition, MOTION.noise)
    readings = given.sample(states, rng)
    first = split(np.zeros(4), start.covariance, {0: 9, 2: 9})
    return run_mixtures(compiled(given), *moving, EKF, first, start.means, readings).means
