"""Linear algebra of Gaussian beliefs, for many lanes (beliefs) at once.

A covariance P is carried as a factor T with ``P = T Tᵀ``. An update works in coordinates z in which
the prediction is standard normal, ``x = m + L z`` with the Cholesky factor L of its covariance. A
measurement ``r = A z + v``, v of unit covariance, gives the information ``G = I + AᵀA = C Cᵀ``,
the estimate ``z = G⁻¹ Aᵀ r`` and the factor ``T = L C⁻ᵀ``. Nothing is subtracted from a covariance
and no innovation covariance is inverted, so beliefs stay positive definite, however large the
first deviation of a clock against that of a pseudorange.

Lanes are the last axis of all arrays, and the innermost loops run along them, so that compilers
turn them into vector instructions. In each lane the operations are the same whatever the number of
lanes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._types import Bools, Floats, Ints

_ROUNDING = 4e-15
_LOG_TWO_PI = np.log(2 * np.pi)

kernel = njit(cache=True, nogil=True, error_model="numpy")


class Problem(NamedTuple):
    """Measurement, method and motion for the kernels; equal in all lanes and steps.

    Parameters
    ----------
    slots, uses, rows, patterns, noise
        As in :class:`mapfilter.filters.trials.CompiledMeasurement`.
    diagonal : bool
        Whether the noise has nothing off its diagonal.
    iterations : int
        Of the iterated filter, see :class:`mapfilter.filters.gaussian.Method`.
    spread, bend_weight : float
        γ = sqrt(n + λ) and β - α², see :class:`mapfilter.filters.gaussian.SigmaPoints`.
    phi_row, phi_col, phi : (e,) arrays
        The entries of Φ that are not zero.
    process : (n, n) array
        Q.
    """

    slots: Ints
    uses: Ints
    rows: Floats
    patterns: Floats
    noise: Floats
    diagonal: bool
    iterations: int
    spread: float
    bend_weight: float
    phi_row: Ints
    phi_col: Ints
    phi: Floats
    process: Floats


class Lanes(NamedTuple):
    """Beliefs of W lanes during an update, which writes to all arrays but the first.

    Parameters
    ----------
    lower : (n, n, W) array
        Cholesky factors of the predictions; only the lower triangles count.
    mean : (n, W) array
        Predicted means, which become the updated ones.
    factor : (n, n, W) array
        T of the updated covariances.
    evidence, nis : (W,) arrays
        Log densities of the readings, and normalised innovations squared.
    """

    lower: Floats
    mean: Floats
    factor: Floats
    evidence: Floats
    nis: Floats


@kernel
def cholesky_lanes(matrix: Floats) -> None:
    """Replace the lower triangles of (k, k, W) matrices by their Cholesky factors.

    A pivot that is zero but for rounding makes a column of zeros: the matrix may be singular. One
    that is clearly negative becomes NaN.
    """
    size, _, lanes = matrix.shape
    own, inverse = np.empty(lanes), np.empty(lanes)
    for j in range(size):
        pivot = matrix[j, j]
        for w in range(lanes):
            own[w] = abs(pivot[w])
        for k in range(j):
            left = matrix[j, k]
            for i in range(j, size):
                target, other = matrix[i, j], matrix[i, k]
                for w in range(lanes):
                    target[w] -= other[w] * left[w]
        for w in range(lanes):
            positive = pivot[w] > _ROUNDING * own[w]
            zero = abs(pivot[w]) <= 1e3 * _ROUNDING * own[w]
            root = np.sqrt(pivot[w])
            pivot[w] = root if positive else (0.0 if zero else np.nan)
            inverse[w] = 1.0 / root if positive else 0.0
        for i in range(j + 1, size):
            target = matrix[i, j]
            for w in range(lanes):
                target[w] *= inverse[w]


@kernel
def predict_lanes(problem: Problem, mean: Floats, factor: Floats) -> Floats:
    """Move means in place; return the Cholesky factors of ``Φ T Tᵀ Φᵀ + Q``, (n, n, W)."""
    size, lanes = mean.shape
    work, lower = np.zeros((size, size, lanes)), np.empty((size, size, lanes))
    old = mean.copy()
    mean[:, :] = 0.0
    for e in range(problem.phi.size):
        row, col, value = problem.phi_row[e], problem.phi_col[e], problem.phi[e]
        to, source = mean[row], old[col]
        for w in range(lanes):
            to[w] += value * source[w]
        for k in range(size):
            into, out_of = work[row, k], factor[col, k]
            for w in range(lanes):
                into[w] += value * out_of[w]
    for i in range(size):
        for j in range(i + 1):
            target = lower[i, j]
            target[:] = problem.process[i, j]
            for k in range(size):
                left, right = work[i, k], work[j, k]
                for w in range(lanes):
                    target[w] += left[w] * right[w]
    cholesky_lanes(lower)
    return lower


@kernel
def through_lanes(slope: Floats, uses: Ints, lower: Floats) -> Floats:
    """Return ``A = H L``, (m, n, W), where H has entries in the columns ``uses`` only."""
    m, n, lanes = slope.shape[0], lower.shape[0], lower.shape[2]
    seen = np.zeros((m, n, lanes))
    for j in range(n):
        for a in range(uses.size):
            if uses[a] >= j:
                right = lower[uses[a], j]
                for i in range(m):
                    target, left = seen[i, j], slope[i, a]
                    for w in range(lanes):
                        target[w] += left[w] * right[w]
    return seen


@kernel
def solve_lanes(seen: Floats, residual: Floats) -> tuple[Floats, Floats, Floats]:
    """Solve ``(I + AᵀA) z = Aᵀ r`` for whitened A (m, n, W) and r (m, W).

    Returns C of ``I + AᵀA = C Cᵀ``, (n, n, W), lower triangle; ``C⁻¹ Aᵀ r`` and z, (n, W) each.
    """
    m, n, lanes = seen.shape
    information, half, z = np.empty((n, n, lanes)), np.zeros((n, lanes)), np.empty((n, lanes))
    for i in range(n):
        for j in range(i + 1):
            target = information[i, j]
            target[:] = 1.0 if i == j else 0.0
            for k in range(0, m - 1, 2):
                left, right, left2, right2 = seen[k, i], seen[k, j], seen[k + 1, i], seen[k + 1, j]
                for w in range(lanes):
                    target[w] += left[w] * right[w] + left2[w] * right2[w]
            if m % 2 == 1:
                left, right = seen[m - 1, i], seen[m - 1, j]
                for w in range(lanes):
                    target[w] += left[w] * right[w]
        target = half[i]
        for k in range(m):
            left, right = seen[k, i], residual[k]
            for w in range(lanes):
                target[w] += left[w] * right[w]
    cholesky_lanes(information)
    for i in range(n):
        target, pivot = half[i], information[i, i]
        for k in range(i):
            left, right = information[i, k], half[k]
            for w in range(lanes):
                target[w] -= left[w] * right[w]
        for w in range(lanes):
            target[w] /= pivot[w]
    for i in range(n - 1, -1, -1):
        target, source, pivot = z[i], half[i], information[i, i]
        # A loop: to assign arrays numba compiles a check of their shapes, for two seconds.
        for w in range(lanes):
            target[w] = source[w]
        for k in range(i + 1, n):
            left, right = information[k, i], z[k]
            for w in range(lanes):
                target[w] -= left[w] * right[w]
        for w in range(lanes):
            target[w] /= pivot[w]
    return information, half, z


@kernel
def evidence_lanes(
    present: Bools,
    noise_factor: Floats,
    residual: Floats,
    information: Floats,
    half: Floats,
    lanes: Lanes,
) -> None:
    """Write the log density of the readings and the normalised innovations squared.

    ``rᵀ S⁻¹ r = rᵀr - |C⁻¹Aᵀr|²`` and ``log|S| = log|R| + log|G|``, r and A whitened.
    """
    evidence, nis = lanes.evidence, lanes.nis
    volume = np.ones(evidence.size)
    evidence[:] = 0.0
    nis[:] = 0.0
    for i in range(present.shape[0]):
        for w in range(evidence.size):
            nis[w] += residual[i, w] ** 2
            volume[w] *= noise_factor[i, i, w] if present[i, w] else 1.0
            evidence[w] -= 0.5 * _LOG_TWO_PI if present[i, w] else 0.0
        # One logarithm is for many factors, as far as their product can be held.
        if i % 8 == 7:
            for w in range(evidence.size):
                evidence[w] -= np.log(volume[w])
                volume[w] = 1.0
    for i in range(half.shape[0]):
        for w in range(evidence.size):
            nis[w] -= half[i, w] ** 2
            volume[w] *= information[i, i, w]
    for w in range(evidence.size):
        evidence[w] -= np.log(volume[w]) + 0.5 * nis[w]


@kernel
def correct_lanes(information: Floats, z: Floats, lanes: Lanes) -> None:
    """Add ``L z`` to the means and write the factors ``T = L C⁻ᵀ``."""
    lower, mean, factor = lanes.lower, lanes.mean, lanes.factor
    n, count = mean.shape
    for i in range(n):
        target = mean[i]
        for k in range(i + 1):
            left, right = lower[i, k], z[k]
            for w in range(count):
                target[w] += left[w] * right[w]
    for i in range(n):
        for j in range(n):
            # Row j of C⁻¹ Lᵀ, column i.
            target = factor[i, j]
            if j <= i:
                source = lower[i, j]
                for w in range(count):
                    target[w] = source[w]
            else:
                target[:] = 0.0
            for k in range(j):
                left, right = information[j, k], factor[i, k]
                for w in range(count):
                    target[w] -= left[w] * right[w]
            pivot = information[j, j]
            for w in range(count):
                target[w] /= pivot[w]


@kernel
def covariance_lanes(factor: Floats, out: Floats) -> None:
    """Write ``T Tᵀ`` for factors (n, n, W) as (W, n, n)."""
    n, _, lanes = factor.shape
    for i in range(n):
        for j in range(i + 1):
            for w in range(lanes):
                total = 0.0
                for k in range(n):
                    total += factor[i, k, w] * factor[j, k, w]
                out[w, i, j] = total
                out[w, j, i] = total
