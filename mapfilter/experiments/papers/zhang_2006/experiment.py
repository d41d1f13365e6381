"""Zhang, Knedlik & Loffeld (2006): bounds for timing advance and levels in GSM, and filters.

The paper prints neither the positions of its three base stations nor how filters were started
exactly; the defaults here are stated with the results.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapfilter._parallel import Progress
from mapfilter._types import Floats
from mapfilter.evaluation.bounds import (
    bound_of,
    expected_information,
    posterior_bound,
    rmse_over_time,
)
from mapfilter.filters.gaussian import EKF, IEKF, UKF, Method
from mapfilter.filters.gaussian_sum import run_mixtures, split
from mapfilter.filters.trials import run_trials
from mapfilter.models.gaussian import GaussianTerms, stack
from mapfilter.models.motion import LinearMotion, constant_velocity
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

SIGMAS_DB = (0.4, 4.0, 40.0)
STEPS = 400
FAR_M = 1000.0
POSITION = (0, 2)
VELOCITY = (1, 3)

PUBLISHED = (
    "Fig. 1: fusion is better than either kind alone",
    "Fig. 2: fusion gains most where levels are noisy",
    "Fig. 3: the EKF started from a timing advance attains the bound",
)
"""What the paper claims; it prints no figures."""

ASSUMPTIONS = (
    "base stations at (0, 0), (6000, 0) and (3000, 6000) m, which the paper does not print",
    "400 steps of 0.48 s; the bound at k holds the readings of steps 1 to k and the prior, not "
    "the timing advances that filters are started from",
    "filters are started from a fix by the three timing advances at k = 0, by least squares with "
    "its covariance, and a velocity drawn with 50 m/s about the truth",
    "wide starts are drawn with 5 km and 50 m/s about the truth, as P(0) says",
    "filters know the true process noise; timing advance is not rounded",
)  # fmt: skip


def motion() -> LinearMotion:
    """Return the paper's motion (eqs. 1 and 2)."""
    return constant_velocity(INTERVAL_S, ACCELERATION_MPS2)


def measurement(combination: Combination, sigma_db: float = SIGMA_RSS_DB) -> GaussianTerms:
    """Return timing advances, losses, or both (eq. 4)."""
    parts = []
    if combination != "rss":
        parts.append(timing_advances(MOVING, SITES_M, SIGMA_TA_M))
    if combination != "ta":
        parts.append(
            levels(
                MOVING, SITES_M, sigma_db, loss_at_km_db=LOSS_AT_KM_DB, exponent=EXPONENT,
                quantity="loss",
            )
        )  # fmt: skip
    return stack(parts)


def prior_covariance() -> Floats:
    """Return P(0) of section 4."""
    return np.diag(np.array([PRIOR_POSITION_M, PRIOR_VELOCITY_MPS] * 2) ** 2)


def true_states(trials: int, rng: np.random.Generator, steps: int = STEPS) -> Floats:
    """Draw true states at k = 1 ... K, shape (T, K, 4)."""
    states, model = np.empty((trials, steps, 4)), motion()
    now = np.tile(np.array(START), (trials, 1))
    for k in range(steps):
        now = model.sample(now, rng)
        states[:, k] = now
    return states


def bounds(states: Floats, combination: Combination, sigma_db: float) -> Floats:
    """Return the bound on the covariance at each step, shape (K, 4, 4)."""
    information = expected_information(measurement(combination, sigma_db), states)
    model = motion()
    return posterior_bound(model.transition, model.noise, prior_covariance(), information)


@dataclass(frozen=True, eq=False)
class Started:
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
    covariance = prior_covariance()
    drawn = rng.standard_normal((trials, 4)) * np.sqrt(np.diagonal(covariance))
    return Started(np.array(START) + drawn, covariance)


def run_filter(
    method: Method, states: Floats, combination: Combination, start: Started,
    rng: np.random.Generator,
) -> Floats:  # fmt: skip
    """Draw readings at σ_l 4 dB and run a filter over them; return its means, (T, K, 4)."""
    given, model = measurement(combination), motion()
    readings = given.sample(states, rng)
    run = run_trials(
        compiled(given), model.transition, model.noise, method, start.means, start.covariance,
        readings,
    )  # fmt: skip
    return run.means


def run_sum(
    states: Floats, combination: Combination, start: Started, rng: np.random.Generator,
    parts: int = 9, method: Method = EKF,
) -> Floats:  # fmt: skip
    """Run a Gaussian sum from a wide start, cut into ``parts`` along east and north."""
    given, model = measurement(combination), motion()
    readings = given.sample(states, rng)
    first = split(np.zeros(4), start.covariance, {0: parts, 2: parts})
    run = run_mixtures(
        compiled(given), model.transition, model.noise, method, first, start.means, readings
    )
    return run.means


def position_error_m(means: Floats, states: Floats) -> Floats:
    """Return the root mean square position error at each step."""
    return rmse_over_time(means, states, POSITION)


def position_bound_m(found: Floats) -> Floats:
    """Return the bound on the position at each step."""
    return bound_of(found, POSITION)


@dataclass(frozen=True, eq=False)
class PaperRun:
    """Curves over k = 1 ... 400; the first index of each is k = 1.

    Parameters
    ----------
    bounds : dict
        By σ_l in dB, then by combination, the bound's covariances (K, 4, 4).
    from_fix : dict
        By combination the position error of the EKF started from a fix.
    velocity_from_fix : dict
        By combination its velocity error.
    wide : dict
        By combination, then filter, the position error from the wide start.
    astray : dict
        By combination, then filter, the share of trials more than 1 km off at the end of that.
    """

    bounds: dict[float, dict[str, Floats]]
    from_fix: dict[str, Floats]
    velocity_from_fix: dict[str, Floats]
    wide: dict[str, dict[str, Floats]]
    astray: dict[str, dict[str, float]]


def run_paper(trials: int, seed: int, progress: Progress | None = None) -> PaperRun:
    """Run bounds and filters of all figures, and the wide starts.

    Parameters
    ----------
    trials : int
        1000 in the paper.
    seed : int
    progress : callable, optional
        Called with parts done and parts in all.
    """
    truth_rng, rng = np.random.default_rng(seed).spawn(2)
    states = true_states(trials, truth_rng)
    found: dict[float, dict[str, Floats]] = {
        sigma: {name: bounds(states, name, sigma) for name in COMBINATIONS} for sigma in SIGMAS_DB
    }
    start, vague = started_from_fix(trials, rng), started_wide(trials, rng)
    from_fix: dict[str, Floats] = {}
    velocity: dict[str, Floats] = {}
    wide: dict[str, dict[str, Floats]] = {}
    astray: dict[str, dict[str, float]] = {}
    for done, name in enumerate(COMBINATIONS, start=1):
        means = run_filter(EKF, states, name, start, rng)
        from_fix[name] = position_error_m(means, states)
        velocity[name] = rmse_over_time(means, states, VELOCITY)
        runs = {
            method.name: run_filter(method, states, name, vague, rng) for method in (EKF, IEKF, UKF)
        }
        runs["gaussian_sum"] = run_sum(states, name, vague, rng)
        wide[name] = {one: position_error_m(means, states) for one, means in runs.items()}
        astray[name] = {one: _astray(means, states) for one, means in runs.items()}
        if progress is not None:
            progress(done, len(COMBINATIONS))
    return PaperRun(found, from_fix, velocity, wide, astray)


def _astray(means: Floats, states: Floats) -> float:
    off = (means - states)[:, -1][:, list(POSITION)]
    return float(np.mean(np.hypot(*off.T) > FAR_M))
