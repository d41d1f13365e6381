"""Gaussian sums: a belief as a mixture, each component a Kalman-type filter of its own.

Where the start is so uncertain that measurements are strongly nonlinear over it, a single Gaussian
diverges. A Gaussian sum cuts the start into narrow components, updates each by itself and weighs
them by the evidence of their readings (Alspach & Sorenson 1972). Components without weight are
dropped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numba import float64
from numpy.typing import ArrayLike

from mapfilter._kernels import on_demand
from mapfilter._types import Floats, Ints
from mapfilter.errors import Faults, InputError
from mapfilter.filters._square_root import Problem, kernel
from mapfilter.filters._updates import BLOCK, INDEX, MATRIX, RUN, TYPES, VECTOR, advance, kernel_of
from mapfilter.filters.gaussian import Method, factor_of
from mapfilter.filters.trials import CompiledMeasurement, checked_sizes, problem_of

_WIDEST = 0.9
"""Largest deviation of a part, as a share of that of the whole."""
_FOUND = TYPES.Tuple((MATRIX, BLOCK, VECTOR, INDEX))


@dataclass(frozen=True, eq=False)
class Mixture:
    """Gaussians of weights (c,) that sum to one, means (c, n) and one covariance (n, n)."""

    weights: Floats
    means: Floats
    covariance: Floats


def split(
    mean: ArrayLike, covariance: ArrayLike, parts: Mapping[int, int], reach: float = 2.5
) -> Mixture:
    """Cut a Gaussian into narrower ones along some components of the state.

    Along a component cut into c parts, the parts' means are spaced evenly over ± ``reach``
    standard deviations (two parts lie nearer), and their deviation is that spacing, at most 0.9 of
    what it was; weights are such that mean and variance are kept, up to the cut tails. Components
    must be independent at the start.

    Parameters
    ----------
    mean, covariance : (n,) and (n, n) array_like
        The Gaussian, without correlation between what is cut and anything else.
    parts : mapping of int to int
        Number of parts for each index that is cut.
    reach : float
        Standard deviations over which means are spread.

    Raises
    ------
    InputError
        The covariance is none, a part is not at least 1, or what is cut is correlated.

    Examples
    --------
    >>> cut = split([0.0, 5.0], np.diag([4.0, 1.0]), {0: 3}, reach=1.5)
    >>> cut.means.tolist()
    [[-3.0, 5.0], [0.0, 5.0], [3.0, 5.0]]
    >>> round(float(cut.weights @ cut.means[:, 0] ** 2 + cut.covariance[0, 0]), 9)
    4.0
    """
    centre, wide = np.asarray(mean, dtype=np.float64), np.array(covariance, dtype=np.float64)
    n = centre.size
    factor_of(wide, n)
    faults = Faults()
    for index, count in parts.items():
        if not 0 <= index < n or count < 1:
            faults.add("parts", f"indices below {n} and counts >= 1", f"{index}: {count}")
        elif np.any(np.delete(wide[index], index)):
            faults.add(f"covariance, row {index}", "no correlation with the rest", "some")
    faults.raise_if_any(InputError)
    axes, shares = [], []
    for index, count in parts.items():
        if count == 1:
            continue
        # Two parts farther out would have more than the whole variance by their means alone.
        out = min(reach, np.sqrt(1 - _WIDEST**2)) if count == 2 else reach
        places = np.linspace(-out, out, count)
        # The weights' own variance is 1 - narrow: searched for, as the ends are cut.
        narrow = min(places[1] - places[0], _WIDEST) ** 2
        share = _shares(places, 1.0 - narrow)
        axes.append([(index, np.sqrt(wide[index, index]) * place) for place in places])
        shares.append(share)
        wide[index, index] *= 1.0 - float(share @ places**2)
    weights = np.array([np.prod(factors) for factors in product(*shares)])
    means = np.tile(centre, (weights.size, 1))
    for shifted, chosen in zip(means, product(*axes), strict=True):
        for index, shift in chosen:
            shifted[index] += shift
    return Mixture(weights, means, wide)


def _shares(places: Floats, variance: float) -> Floats:
    """Return normal weights on places whose variance is the one wanted, as near as possible."""
    low, high = 1e-3, 1e3
    for _ in range(80):
        middle = np.sqrt(low * high)
        share = np.exp(-0.5 * places**2 / middle)
        share /= share.sum()
        low, high = (middle, high) if share @ places**2 < variance else (low, middle)
    return np.asarray(share)


@kernel
def _reweigh(weight: Floats, evidence: Floats) -> float:
    """Weigh components by their evidence, in place; return the logarithm of the whole's.

    A component whose update failed (NaN) gets no weight, unless all failed: then nothing changes.
    """
    most = -np.inf
    for w in range(weight.size):
        if weight[w] > 0.0 and evidence[w] > most:
            most = evidence[w]
    if not np.isfinite(most):
        return np.nan
    total = 0.0
    for w in range(weight.size):
        weight[w] *= np.exp(evidence[w] - most) if evidence[w] <= most else 0.0
        total += weight[w]
    for w in range(weight.size):
        weight[w] /= total
    return float(most + np.log(total))


@kernel
def _moments(
    weight: Floats, mean: Floats, factor: Floats, centre: Floats, covariance: Floats
) -> None:
    """Write the mean and the covariance of a mixture."""
    n, lanes = mean.shape
    centre[:] = 0.0
    covariance[:, :] = 0.0
    for i in range(n):
        for w in range(lanes):
            centre[i] += weight[w] * mean[i, w]
    for w in range(lanes):
        if weight[w] > 0.0:
            for i in range(n):
                for j in range(i + 1):
                    total = (mean[i, w] - centre[i]) * (mean[j, w] - centre[j])
                    for k in range(n):
                        total += factor[i, k, w] * factor[j, k, w]
                    covariance[i, j] += weight[w] * total
    for i in range(n):
        for j in range(i):
            covariance[j, i] = covariance[i, j]


def _run_mixture(
    update: Any,
    measure: Any,
    problem: Problem,
    readings: Floats,
    mean: Floats,
    factor: Floats,
    weight: Floats,
    least: float,
) -> tuple[Floats, Floats, Floats, Ints]:
    """Predict, update and reweigh the components of one belief over all steps.

    Readings are (K, m), NaN where absent; the first components, (n, W), (n, n, W) and (W,), are
    changed, and those of less weight than ``least`` are dropped. Return moments of the mixture,
    (K, n) and (K, n, n), evidence (K,), NaN where no component could be updated, and the numbers
    of components left (K,).
    """
    n, (steps, m) = mean.shape[0], readings.shape
    means, covariances = np.empty((steps, n)), np.empty((steps, n, n))
    evidence, counts = np.empty(steps), np.empty(steps, dtype=np.int64)
    for k in range(steps):
        lanes = weight.size
        reading, own, nis = np.empty((m, lanes)), np.empty(lanes), np.empty(lanes)
        for i in range(m):
            reading[i, :] = readings[k, i]
        advance(update, measure, problem, reading, mean, factor, own, nis)
        evidence[k] = _reweigh(weight, own)
        _moments(weight, mean, factor, means[k], covariances[k])
        left = np.flatnonzero(weight >= least)
        counts[k] = left.size
        # Lanes are given up in larger lots, as moving the rest costs as much as a step.
        if 0 < 4 * left.size <= 3 * lanes:
            total = 0.0
            for w in left:
                total += weight[w]
            mean, factor = mean[:, left], factor[:, :, left]
            weight = weight[left] / total
    return means, covariances, evidence, counts


run_mixture_kernel = on_demand(_FOUND(*RUN, MATRIX, MATRIX, BLOCK, VECTOR, float64), _run_mixture)
"""Return :func:`_run_mixture`, compiled."""


@dataclass(frozen=True, eq=False)
class MixtureRun:
    """Results of Gaussian sums over T trials of K steps.

    Parameters
    ----------
    means, covariances : (T, K, n) and (T, K, n, n) arrays
        Moments of the mixtures.
    evidence : (T, K) array
        Log density of each reading given those before it.
    counts : (T, K) integer array
        Components left.
    """

    means: Floats
    covariances: Floats
    evidence: Floats
    counts: Ints


def run_mixtures(
    measurement: CompiledMeasurement,
    transition: Floats,
    process: Floats,
    method: Method,
    first: Mixture,
    first_mean: ArrayLike,
    readings: Floats,
    *,
    least_weight: float = 1e-8,
) -> MixtureRun:
    """Run Gaussian sums over trials.

    Parameters
    ----------
    measurement, transition, process, readings
        As :func:`mapfilter.filters.trials.run_trials` takes them.
    method : Method
        How each component takes readings in.
    first : Mixture
        The first components, about 0.
    first_mean : (T, n) or (n,) array_like
        What is added to their means in each trial.
    least_weight : float
        Components of less weight are dropped.

    Raises
    ------
    InputError
        Sizes that do not fit, a covariance that is none, infinite readings.
    """
    n = transition.shape[0]
    trials, steps = checked_sizes(measurement, transition, readings)
    starts = np.broadcast_to(np.asarray(first_mean, dtype=np.float64), (trials, n))
    factor = factor_of(first.covariance, n)
    problem = problem_of(measurement, transition, process, method)
    means, covariances = np.empty((trials, steps, n)), np.empty((trials, steps, n, n))
    evidence, counts = np.empty((trials, steps)), np.empty((trials, steps), dtype=np.int64)
    for trial in range(trials):
        means[trial], covariances[trial], evidence[trial], counts[trial] = run_mixture_kernel()(
            kernel_of(method),
            measurement.measure,
            problem,
            np.ascontiguousarray(readings[trial]),
            np.ascontiguousarray((starts[trial] + first.means).T),
            np.repeat(factor[:, :, None], first.weights.size, axis=2),
            first.weights.copy(),
            least_weight,
        )
    return MixtureRun(means, covariances, evidence, counts)
