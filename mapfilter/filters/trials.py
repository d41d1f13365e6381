"""Kalman-type filters over many trials of one experiment, by compiled kernels.

All trials share motion, measurement and noise; each has its own first belief and its own readings,
of which any component may be absent at any step. The updates are those of
:mod:`mapfilter.filters._updates`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats, Ints
from mapfilter.errors import Faults, InputError
from mapfilter.filters._square_root import Problem
from mapfilter.filters._updates import kernel_of, run_lanes_kernel
from mapfilter.filters.gaussian import Method, factor_of, factors_of

LANES = 64
"""Trials that a kernel takes at once."""


@dataclass(frozen=True, eq=False)
class CompiledMeasurement:
    """A measurement that compiled kernels can call.

    Parameters
    ----------
    measure : callable
        Compiled with the arguments (points, slots, rows, patterns, mean, slope, derive), see
        :data:`mapfilter._kernels.MEASURE_SIGNATURE`.
    slots : (4,) integer array
        Rows of the points that hold east, north, up and the clock's bias; -1 for none.
    uses : (q,) integer array
        Components of the state that it depends on.
    rows, patterns : (m, c) and (p,) arrays
        The measurement's own constants.
    noise : (m, m) array
        Covariance of its noise, positive definite.
    """

    measure: Callable[..., None]
    slots: Ints
    uses: Ints
    rows: Floats
    patterns: Floats
    noise: Floats


@dataclass(frozen=True, eq=False)
class TrialRun:
    """Results of a filter over T trials of K steps.

    Parameters
    ----------
    means : (T, K, n) array
        Updated means.
    covariances : (T, K, n, n) array
        Updated covariances; K is 0 unless they are kept.
    evidence : (T, K) array
        Log density of each reading given those before it; NaN where an update failed and the
        prediction was kept.
    nis : (T, K) array
        Normalised innovations squared.
    """

    means: Floats
    covariances: Floats
    evidence: Floats
    nis: Floats


def run_trials(
    measurement: CompiledMeasurement,
    transition: Floats,
    process: Floats,
    method: Method,
    first_mean: ArrayLike,
    first_covariance: ArrayLike,
    readings: Floats,
    *,
    covariances: bool = False,
) -> TrialRun:
    """Run a filter over trials: predict, then update, at each step.

    Parameters
    ----------
    transition, process : (n, n) arrays
        Φ and Q.
    first_mean : (T, n) or (n,) array_like
        The beliefs before the first step.
    first_covariance : (n, n) or (T, n, n) array_like
        Of all of them, or of each.
    readings : (T, K, m) array
        NaN where absent.
    covariances : bool
        Whether to keep the covariances.

    Raises
    ------
    InputError
        Sizes that do not fit, a covariance that is none, infinite readings.
    """
    n = transition.shape[0]
    trials, steps = checked_sizes(measurement, transition, readings)
    starts = np.broadcast_to(np.asarray(first_mean, dtype=np.float64), (trials, n))
    given = np.asarray(first_covariance, dtype=np.float64)
    each = given.ndim == 3 and len(given) == trials
    factors = factors_of(given, n) if each else factor_of(given, n)[None]
    factors = np.broadcast_to(factors.reshape(-1, n, n), (trials, n, n))
    problem = problem_of(measurement, transition, process, method)
    means, found = np.empty((trials, steps, n)), np.empty((trials, steps * covariances, n, n))
    evidence, nis = np.empty((trials, steps)), np.empty((trials, steps))
    for first in range(0, trials, LANES):
        block = slice(first, min(first + LANES, trials))
        run = run_lanes_kernel()(
            kernel_of(method),
            measurement.measure,
            problem,
            np.ascontiguousarray(readings[block].transpose(1, 2, 0)),
            np.array(starts[block].T, order="C"),
            np.array(factors[block].transpose(1, 2, 0), order="C"),
            covariances,
        )
        means[block] = run[0].transpose(2, 0, 1)
        found[block] = run[1].transpose(1, 0, 2, 3)
        evidence[block], nis[block] = run[2].T, run[3].T
    return TrialRun(means, found, evidence, nis)


def problem_of(
    measurement: CompiledMeasurement, transition: Floats, process: Floats, method: Method
) -> Problem:
    """Return measurement, motion and method as the compiled filters take them."""
    row, col = np.nonzero(transition)
    sigma, noise = method.sigma, np.ascontiguousarray(measurement.noise)
    return Problem(
        measurement.slots,
        measurement.uses,
        np.ascontiguousarray(measurement.rows),
        np.ascontiguousarray(measurement.patterns),
        noise,
        not np.any(noise - np.diag(np.diagonal(noise))),
        method.iterations if sigma is None else 1,
        1.0 if sigma is None else sigma.spread(len(transition)),
        0.0 if sigma is None else sigma.bend_weight,
        np.ascontiguousarray(row),
        np.ascontiguousarray(col),
        np.ascontiguousarray(transition[row, col]),
        np.ascontiguousarray(process),
    )


def checked_sizes(
    measurement: CompiledMeasurement, transition: Floats, readings: Floats
) -> tuple[int, int]:
    """Check that measurement, state and readings (T, K, m) fit; return T and K."""
    faults = Faults()
    n, m = transition.shape[0], measurement.rows.shape[0]
    if readings.ndim != 3 or readings.shape[2] != m:
        faults.add("readings", f"shape (trials, steps, {m})", readings.shape)
    if np.isinf(readings).any():
        faults.add("readings", "finite numbers, or NaN where absent", "infinity")
    if measurement.uses.size and measurement.uses.max() >= n:
        faults.add("measurement", f"a state of {n} components", f"{measurement.uses.max() + 1}")
    faults.raise_if_any(InputError)
    return readings.shape[0], readings.shape[1]
