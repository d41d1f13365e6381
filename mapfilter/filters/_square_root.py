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
from numba import boolean, float64, int64, njit, types, void

from mapfilter._types import Bools, Floats, Ints

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


_LOG_TWO_PI = np.log(2 * np.pi)

MEASURE_SIGNATURE = void(
    float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[:, ::1],
    float64[:, :, ::1], boolean,
)  # fmt: skip
"""What a compiled measurement takes: points (q, W), slots (4,), rows (m, c), patterns (p,), mean
(m, W) and slope (m, q, W) to be written, and whether the slope is wanted."""

UPDATE_SIGNATURE = void(
    types.FunctionType(MEASURE_SIGNATURE), int64[::1], int64[::1], float64[:, ::1], float64[::1],
    float64[:, ::1], boolean, int64, float64, float64, float64[:, ::1], float64[:, :, ::1],
    float64[:, ::1], float64[:, :, ::1], float64[::1], float64[::1],
)  # fmt: skip
"""What a compiled update takes:

- measure, slots (4,), uses (q,), rows (m, c), patterns (p,): the measurement;
- noise (m, m), diagonal: R, and whether nothing is off its diagonal;
- iterations, spread, bend_weight: see :class:`mapfilter.filters.gaussian.Method`;
- reading (m, W): NaN where absent;
- lower (n, n, W): Cholesky factors of the predictions;
- mean (n, W): predicted means, changed into updated ones;
- factor (n, n, W): written, T of the updated covariances;
- evidence, nis (W,): written, log densities of the readings and normalised innovations squared.
"""


@njit(cache=True, nogil=True, error_model="numpy")
def present_lanes(reading: Floats, present: Bools) -> None:  # pragma: no cover
    """Tell which components of (m, W) readings are there: those that are not NaN."""
    for i in range(reading.shape[0]):
        for w in range(reading.shape[1]):
            present[i, w] = not np.isnan(reading[i, w])


@njit(cache=True, nogil=True, error_model="numpy")
def drop_absent(present: Bools, slope: Floats, residual: Floats) -> None:  # pragma: no cover
    """Make absent components say nothing: zeros in H and r."""
    m, columns, lanes = slope.shape
    for i in range(m):
        for w in range(lanes):
            if not present[i, w]:
                residual[i, w] = 0.0
                for j in range(columns):
                    slope[i, j, w] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def noise_lanes(
    noise: Floats, diagonal: bool, present: Bools, factor: Floats
) -> None:  # pragma: no cover
    """Write the noise's Cholesky factor in each lane; absent components are left out of it."""
    m, lanes = present.shape
    for i in range(m):
        root = np.sqrt(noise[i, i])
        for w in range(lanes):
            factor[i, i, w] = root if diagonal else noise[i, i]
        if not diagonal:
            for j in range(i):
                for w in range(lanes):
                    there = present[i, w] and present[j, w]
                    factor[i, j, w] = noise[i, j] if there else 0.0
    if not diagonal:
        cholesky_lanes(factor)


@njit(cache=True, nogil=True, error_model="numpy")
def evidence_lanes(
    present: Bools, noise_factor: Floats, residual: Floats, information: Floats, half: Floats,
    evidence: Floats, nis: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Write the log density of the readings and the normalised innovations squared.

    ``rᵀ S⁻¹ r = rᵀr - |C⁻¹Aᵀr|²`` and ``log|S| = log|R| + log|G|``, r and A whitened.
    """
    lanes = evidence.size
    volume = np.ones(lanes)
    evidence[:] = 0.0
    nis[:] = 0.0
    for i in range(present.shape[0]):
        for w in range(lanes):
            nis[w] += residual[i, w] ** 2
            volume[w] *= noise_factor[i, i, w] if present[i, w] else 1.0
            evidence[w] -= 0.5 * _LOG_TWO_PI if present[i, w] else 0.0
        # One logarithm is for many factors, as far as their product can be held.
        if i % 8 == 7:
            for w in range(lanes):
                evidence[w] -= np.log(volume[w])
                volume[w] = 1.0
    for i in range(half.shape[0]):
        for w in range(lanes):
            nis[w] -= half[i, w] ** 2
            volume[w] *= information[i, i, w]
    for w in range(lanes):
        evidence[w] -= np.log(volume[w]) + 0.5 * nis[w]
