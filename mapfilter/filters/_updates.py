"""Updates of Kalman-type filters and whole runs of them, compiled, for a block of lanes.

Each update has the signature :data:`UPDATE_SIGNATURE`: a measurement, the problem, a reading
(m, W), NaN where absent, and the beliefs, which it changes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, types, void

from mapfilter._kernels import MEASURE_SIGNATURE, as_argument, on_demand
from mapfilter._types import Bools, Floats
from mapfilter.filters._square_root import (
    Lanes,
    Problem,
    cholesky_lanes,
    correct_lanes,
    covariance_lanes,
    evidence_lanes,
    kernel,
    predict_lanes,
    solve_lanes,
    through_lanes,
)
from mapfilter.filters._whitening import drop_absent, noise_lanes, whiten_lanes
from mapfilter.filters.gaussian import Method

_CONVERGED = 1e-9
_ROUNDING = 1e-8
VECTOR, MATRIX, BLOCK, INDEX = float64[::1], float64[:, ::1], float64[:, :, ::1], int64[::1]
TYPES: Any = types
_SENSOR, _METHOD = (INDEX, INDEX, MATRIX, VECTOR, MATRIX, boolean), (int64, float64, float64)
_MOTION = (INDEX, INDEX, VECTOR, MATRIX)
_PROBLEM = TYPES.NamedTuple((*_SENSOR, *_METHOD, *_MOTION), Problem)
_LANES = TYPES.NamedTuple((BLOCK, MATRIX, BLOCK, VECTOR, VECTOR), Lanes)
_MEASURE = types.FunctionType(MEASURE_SIGNATURE)
UPDATE_SIGNATURE = void(_MEASURE, _PROBLEM, MATRIX, _LANES)
RUN = (types.FunctionType(UPDATE_SIGNATURE), _MEASURE, _PROBLEM)
"""What compiled runs take first: the update, the measurement and the problem."""
_FOUND = TYPES.Tuple((BLOCK, float64[:, :, :, ::1], MATRIX, MATRIX))


@kernel
def _linear(
    measure: Any,
    problem: Problem,
    points: Floats,
    reading: Floats,
    present: Bools,
    noise_factor: Floats,
    lower: Floats,
) -> tuple[Floats, Floats]:
    """Linearise a measurement at points; return A = H L and the residual, both whitened."""
    uses, m, lanes = problem.uses, *reading.shape
    expected, slope = np.empty((m, lanes)), np.empty((m, uses.size, lanes))
    measure(points, problem.slots, problem.rows, problem.patterns, expected, slope, True)
    residual = reading - expected
    drop_absent(present, slope, residual)
    whiten_lanes(noise_factor, problem.diagonal, slope, residual)
    return through_lanes(slope, uses, lower), residual


@kernel
def _solve_and_correct(
    present: Bools, noise_factor: Floats, seen: Floats, residual: Floats, lanes: Lanes
) -> None:
    """Update by a whitened linear measurement ``r = A z + v``."""
    information, half, z = solve_lanes(seen, residual)
    evidence_lanes(present, noise_factor, residual, information, half, lanes)
    correct_lanes(information, z, lanes)


def _linearised(measure: Any, problem: Problem, reading: Floats, lanes: Lanes) -> None:
    """Update by a measurement linearised at the prediction; the (extended) Kalman filter."""
    present = ~np.isnan(reading)
    noise_factor = noise_lanes(problem, present)
    points = lanes.mean[problem.uses]
    seen, residual = _linear(measure, problem, points, reading, present, noise_factor, lanes.lower)
    _solve_and_correct(present, noise_factor, seen, residual, lanes)


def _iterated(measure: Any, problem: Problem, reading: Floats, lanes: Lanes) -> None:
    """Update at the most probable state: Gauss-Newton with step halving.

    In each lane a step is taken only when it lowers ``|z|² + |r(z)|²``; else it is halved.
    """
    lower, mean, uses = lanes.lower, lanes.mean, problem.uses
    m, count = reading.shape
    n = mean.shape[0]
    present = ~np.isnan(reading)
    noise_factor = noise_lanes(problem, present)
    seen, r = np.zeros((m, n, count)), np.zeros((m, count))
    information, half = np.empty((n, n, count)), np.empty((n, count))
    z, trial = np.zeros((n, count)), np.zeros((n, count))
    best, length = np.full(count, np.inf), np.ones(count)
    converged = np.zeros(count, dtype=np.bool_)
    for _ in range(problem.iterations):
        points = mean[uses]
        for a in range(uses.size):
            for k in range(uses[a] + 1):
                for w in range(count):
                    points[a, w] += lower[uses[a], k, w] * trial[k, w]
        trial_seen, trial_r = _linear(
            measure, problem, points, reading, present, noise_factor, lower
        )
        for w in range(count):
            if converged[w]:
                continue
            value = 0.0
            for k in range(n):
                value += trial[k, w] ** 2
            for i in range(m):
                value += trial_r[i, w] ** 2
            if value <= best[w] + _ROUNDING * (1.0 + best[w]):
                best[w], length[w] = min(best[w], value), 1.0
                for k in range(n):
                    z[k, w] = trial[k, w]
                for i in range(m):
                    # As seen from z = 0.
                    r[i, w] = trial_r[i, w]
                    for k in range(n):
                        seen[i, k, w] = trial_seen[i, k, w]
                        r[i, w] += seen[i, k, w] * z[k, w]
            else:
                length[w] *= 0.5
        information, half, target = solve_lanes(seen, r)
        open_lanes = 0
        for w in range(count):
            if converged[w]:
                continue
            moved = 0.0
            for k in range(n):
                trial[k, w] = z[k, w] + length[w] * (target[k, w] - z[k, w])
                moved = max(moved, abs(trial[k, w] - z[k, w]))
            converged[w] = moved < _CONVERGED
            open_lanes += not converged[w]
        if open_lanes == 0:
            break
    evidence_lanes(present, noise_factor, r, information, half, lanes)
    correct_lanes(information, trial, lanes)


def _by_sigma_points(measure: Any, problem: Problem, reading: Floats, lanes: Lanes) -> None:
    """Update by readings expected at sigma points.

    With ``Y± = Y0 + γ (b ± a)`` at the two points of each column of L, the transform's covariance
    is ``Σ aaᵀ + Σ bbᵀ + (β - α²) ddᵀ + R`` with ``d = Σ b/γ`` (Table I of Fritsche & Klein 2009
    rewritten: the huge weights of small α have cancelled). So A = [a...] takes the part of the
    Jacobian, and the rest is noise.
    """
    lower, mean, uses, spread = lanes.lower, lanes.mean, problem.uses, problem.spread
    m, count = reading.shape
    n = mean.shape[0]
    present = ~np.isnan(reading)
    centre, above, below = np.empty((m, count)), np.empty((m, count)), np.empty((m, count))
    along, bend = np.zeros((m, n, count)), np.zeros((m, n, count))
    none = np.empty((m, 0, 0))
    points = mean[uses]
    measure(points, problem.slots, problem.rows, problem.patterns, centre, none, False)
    # L is lower triangular: beyond the last component used, points differ in what is not measured.
    for j in range(uses.max() + 1):
        for sign in (1.0, -1.0):
            points = mean[uses]
            for a in range(uses.size):
                if j <= uses[a]:
                    for w in range(count):
                        points[a, w] += sign * spread * lower[uses[a], j, w]
            found = above if sign > 0 else below
            measure(points, problem.slots, problem.rows, problem.patterns, found, none, False)
        for i in range(m):
            for w in range(count):
                up, down = above[i, w] - centre[i, w], below[i, w] - centre[i, w]
                along[i, j, w] = (up - down) / (2.0 * spread)
                bend[i, j, w] = (up + down) / (2.0 * spread)
    residual, shift, total = reading - centre, np.zeros((m, count)), np.zeros((m, m, count))
    for i in range(m):
        for j in range(n):
            for w in range(count):
                shift[i, w] += bend[i, j, w] / spread
        for w in range(count):
            residual[i, w] -= shift[i, w]
    drop_absent(present, along, residual)
    drop_absent(present, bend, shift)
    for i in range(m):
        for j in range(i + 1):
            target = total[i, j]
            for k in range(n):
                left, right = bend[i, k], bend[j, k]
                for w in range(count):
                    target[w] += left[w] * right[w]
            for w in range(count):
                target[w] += problem.bend_weight * shift[i, w] * shift[j, w]
                if (present[i, w] and present[j, w]) or i == j:
                    target[w] += problem.noise[i, j]
    cholesky_lanes(total)
    whiten_lanes(total, False, along, residual)
    _solve_and_correct(present, total, along, residual, lanes)


@cache
def _compiled(update: Callable[..., None]) -> Callable[..., None]:
    compiled = njit([UPDATE_SIGNATURE], cache=True, nogil=True, error_model="numpy")(update)
    return as_argument(compiled, UPDATE_SIGNATURE)


def kernel_of(method: Method) -> Callable[..., None]:
    """Return the compiled update; each is compiled at its first use."""
    if method.sigma is not None:
        return _compiled(_by_sigma_points)
    return _compiled(_iterated if method.iterations > 1 else _linearised)


@kernel
def advance(
    update: Any,
    measure: Any,
    problem: Problem,
    reading: Floats,
    mean: Floats,
    factor: Floats,
    evidence: Floats,
    nis: Floats,
) -> None:
    """Predict and update; where an update is not finite, keep the prediction, and NaN as evidence.

    ``mean`` and ``factor`` are changed, ``evidence`` and ``nis`` written.
    """
    lower = predict_lanes(problem, mean, factor)
    predicted = mean.copy()
    update(measure, problem, reading, Lanes(lower, mean, factor, evidence, nis))
    n, lanes = mean.shape
    for w in range(lanes):
        total = evidence[w]
        for i in range(n):
            total += mean[i, w]
            for j in range(n):
                total += factor[i, j, w]
        if not np.isfinite(total):
            evidence[w] = np.nan
            nis[w] = np.nan
            for i in range(n):
                mean[i, w] = predicted[i, w]
                for j in range(n):
                    factor[i, j, w] = lower[i, j, w] if j <= i else 0.0


def run_lanes(
    update: Any,
    measure: Any,
    problem: Problem,
    readings: Floats,
    mean: Floats,
    factor: Floats,
    keep: bool,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Predict and update over all steps.

    Readings are (K, m, W), NaN where absent; the first beliefs, (n, W) and (n, n, W), are changed.
    Return means (K, n, W), covariances (K, W, n, n), with K = 0 unless they are kept, and evidence
    and normalised innovations squared (K, W), NaN where an update failed and the prediction was
    kept.
    """
    steps, (n, lanes) = readings.shape[0], mean.shape
    means = np.empty((steps, n, lanes))
    covariances = np.empty((steps if keep else 0, lanes, n, n))
    evidence, nis = np.empty((steps, lanes)), np.empty((steps, lanes))
    for k in range(steps):
        advance(update, measure, problem, readings[k], mean, factor, evidence[k], nis[k])
        # A loop: to assign arrays numba compiles a check of their shapes, for two seconds.
        for i in range(n):
            for w in range(lanes):
                means[k, i, w] = mean[i, w]
        if keep:
            covariance_lanes(factor, covariances[k])
    return means, covariances, evidence, nis


run_lanes_kernel = on_demand(_FOUND(*RUN, BLOCK, MATRIX, BLOCK, boolean), run_lanes)
"""Return :func:`run_lanes`, compiled."""
