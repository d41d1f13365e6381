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

import numpy as np
from numba import njit

from mapfilter._types import Floats, Ints

_ROUNDING = 4e-15


@njit(cache=True, nogil=True, error_model="numpy")
def cholesky_lanes(matrix: Floats) -> None:  # pragma: no cover
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


@njit(cache=True, nogil=True, error_model="numpy")
def predict_lanes(
    mean: Floats, factor: Floats, phi_row: Ints, phi_col: Ints, phi: Floats, noise: Floats,
    lower: Floats, work: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Move beliefs: mean becomes Φ·mean, lower the Cholesky factor of ``Φ T Tᵀ Φᵀ + Q``.

    Parameters
    ----------
    mean : (n, W) array
        Changed in place.
    factor : (n, n, W) array
        T of the last beliefs.
    phi_row, phi_col, phi : (e,) arrays
        The entries of Φ that are not zero.
    noise : (n, n) array
        Q.
    lower : (n, n, W) array
        Written; above the diagonal it is not touched.
    work : (n, n, W) array
        Written.
    """
    size, lanes = mean.shape
    for i in range(size):
        for j in range(size):
            work[i, j, :] = 0.0
    old = mean.copy()
    mean[:, :] = 0.0
    for e in range(phi.size):
        value, to, source = phi[e], mean[phi_row[e]], old[phi_col[e]]
        for w in range(lanes):
            to[w] += value * source[w]
        for k in range(size):
            into, out_of = work[phi_row[e], k], factor[phi_col[e], k]
            for w in range(lanes):
                into[w] += value * out_of[w]
    for i in range(size):
        for j in range(i + 1):
            target = lower[i, j]
            target[:] = noise[i, j]
            for k in range(size):
                left, right = work[i, k], work[j, k]
                for w in range(lanes):
                    target[w] += left[w] * right[w]
    cholesky_lanes(lower)


@njit(cache=True, nogil=True, error_model="numpy")
def whiten_lanes(
    noise_factor: Floats, diagonal: bool, slope: Floats, residual: Floats
) -> None:  # pragma: no cover
    """Multiply H and r by the inverse of a lower factor of the noise's covariance, in place."""
    m, columns, lanes = slope.shape
    inverse = np.empty(lanes)
    for i in range(m):
        if not diagonal:
            for k in range(i):
                left = noise_factor[i, k]
                below, above = residual[i], residual[k]
                for w in range(lanes):
                    below[w] -= left[w] * above[w]
                for j in range(columns):
                    target, source = slope[i, j], slope[k, j]
                    for w in range(lanes):
                        target[w] -= left[w] * source[w]
        pivot, own = noise_factor[i, i], residual[i]
        for w in range(lanes):
            inverse[w] = 1.0 / pivot[w]
            own[w] *= inverse[w]
        for j in range(columns):
            target = slope[i, j]
            for w in range(lanes):
                target[w] *= inverse[w]


@njit(cache=True, nogil=True, error_model="numpy")
def through_lanes(
    slope: Floats, uses: Ints, lower: Floats, seen: Floats
) -> None:  # pragma: no cover
    """Write ``A = H L``, where H has entries in the columns ``uses`` only."""
    lanes = lower.shape[2]
    for j in range(lower.shape[0]):
        for i in range(slope.shape[0]):
            seen[i, j, :] = 0.0
        for a in range(uses.size):
            if uses[a] >= j:
                right = lower[uses[a], j]
                for i in range(slope.shape[0]):
                    target, left = seen[i, j], slope[i, a]
                    for w in range(lanes):
                        target[w] += left[w] * right[w]


@njit(cache=True, nogil=True, error_model="numpy")
def solve_lanes(
    seen: Floats, residual: Floats, information: Floats, half: Floats, z: Floats
) -> None:  # pragma: no cover
    """Solve ``(I + AᵀA) z = Aᵀ r``.

    Parameters
    ----------
    seen : (m, n, W) array
        A, whitened.
    residual : (m, W) array
        r, whitened.
    information : (n, n, W) array
        Written: C of ``I + AᵀA = C Cᵀ``, lower triangle.
    half : (n, W) array
        Written: ``C⁻¹ Aᵀ r``.
    z : (n, W) array
        Written.
    """
    m, n, lanes = seen.shape
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
        target[:] = 0.0
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
        target[:] = source
        for k in range(i + 1, n):
            left, right = information[k, i], z[k]
            for w in range(lanes):
                target[w] -= left[w] * right[w]
        for w in range(lanes):
            target[w] /= pivot[w]


@njit(cache=True, nogil=True, error_model="numpy")
def settle_lanes(
    lower: Floats, information: Floats, z: Floats, mean: Floats, factor: Floats
) -> None:  # pragma: no cover
    """Add ``L z`` to the means and write the factors ``T = L C⁻ᵀ``."""
    n, lanes = mean.shape
    for i in range(n):
        target = mean[i]
        for k in range(i + 1):
            left, right = lower[i, k], z[k]
            for w in range(lanes):
                target[w] += left[w] * right[w]
    for i in range(n):
        for j in range(n):
            # Row j of C⁻¹ Lᵀ, column i.
            target = factor[i, j]
            if j <= i:
                target[:] = lower[i, j]
            else:
                target[:] = 0.0
            for k in range(j):
                left, right = information[j, k], factor[i, k]
                for w in range(lanes):
                    target[w] -= left[w] * right[w]
            pivot = information[j, j]
            for w in range(lanes):
                target[w] /= pivot[w]


@njit(cache=True, nogil=True, error_model="numpy")
def covariance_lanes(factor: Floats, out: Floats) -> None:  # pragma: no cover
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
