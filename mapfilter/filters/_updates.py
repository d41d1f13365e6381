"""What all compiled measurement updates share: absent components, noise, evidence, signatures."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, njit, types, void

from mapfilter._types import Bools, Floats
from mapfilter.filters._square_root import cholesky_lanes

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
