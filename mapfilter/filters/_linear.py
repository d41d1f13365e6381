"""The update of the Kalman filter and of the extended Kalman filter, for many lanes at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from mapfilter._types import Bools, Floats, Ints
from mapfilter.filters._square_root import (
    UPDATE_SIGNATURE,
    drop_absent,
    evidence_lanes,
    noise_lanes,
    present_lanes,
    settle_lanes,
    solve_lanes,
    through_lanes,
    whiten_lanes,
)


@njit(cache=True, nogil=True, error_model="numpy")
def linear_update(
    slope: Floats, uses: Ints, residual: Floats, present: Bools, noise_factor: Floats,
    diagonal: bool, lower: Floats, mean: Floats, factor: Floats, evidence: Floats, nis: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Update beliefs with ``r = H δx + v`` in place; the Kalman filter's and the extended one's.

    Parameters
    ----------
    slope : (m, q, W) array
        H in the columns ``uses``; overwritten.
    uses : (q,) integer array
    residual : (m, W) array
        Readings less what was expected; overwritten.
    present : (m, W) array
    noise_factor : (m, m, W) array
        Of :func:`noise_lanes`.
    diagonal : bool
        Whether the noises are independent.
    lower : (n, n, W) array
        Cholesky factor of the prediction.
    mean : (n, W) array
        Changed.
    factor : (n, n, W) array
        Written: T of the updated covariance.
    evidence, nis : (W,) arrays
        Written.
    """
    m, lanes = residual.shape
    n = mean.shape[0]
    seen, information = np.empty((m, n, lanes)), np.empty((n, n, lanes))
    half, z = np.empty((n, lanes)), np.empty((n, lanes))
    drop_absent(present, slope, residual)
    whiten_lanes(noise_factor, diagonal, slope, residual)
    through_lanes(slope, uses, lower, seen)
    solve_lanes(seen, residual, information, half, z)
    evidence_lanes(present, noise_factor, residual, information, half, evidence, nis)
    settle_lanes(lower, information, z, mean, factor)


@njit([UPDATE_SIGNATURE], cache=True, nogil=True, error_model="numpy")
def linearised(
    measure: Any, slots: Ints, uses: Ints, rows: Floats, patterns: Floats, noise: Floats,
    diagonal: bool, iterations: int, spread: float, bend_weight: float, reading: Floats,  # noqa: ARG001
    lower: Floats, mean: Floats, factor: Floats, evidence: Floats, nis: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Update beliefs by a measurement linearised at the prediction, in place."""
    m, lanes = reading.shape
    present = np.empty((m, lanes), dtype=np.bool_)
    present_lanes(reading, present)
    noise_factor = np.empty((m, m, lanes))
    noise_lanes(noise, diagonal, present, noise_factor)
    points, residual = np.empty((uses.size, lanes)), np.empty((m, lanes))
    slope = np.empty((m, uses.size, lanes))
    for a in range(uses.size):
        points[a] = mean[uses[a]]
    measure(points, slots, rows, patterns, residual, slope, True)
    for i in range(m):
        for w in range(lanes):
            residual[i, w] = reading[i, w] - residual[i, w]
    linear_update(
        slope, uses, residual, present, noise_factor, diagonal, lower, mean, factor, evidence, nis
    )
