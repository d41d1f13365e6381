"""Whole runs of Kalman-type filters, compiled: all steps of a block of lanes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, types, void

from mapfilter._types import Floats, Ints
from mapfilter.filters._square_root import (
    MEASURE_SIGNATURE,
    UPDATE_SIGNATURE,
    covariance_lanes,
    predict_lanes,
)


@njit(cache=True, nogil=True, error_model="numpy")
def keep_finite(
    predicted: Floats, lower: Floats, mean: Floats, factor: Floats, evidence: Floats, nis: Floats
) -> None:  # pragma: no cover
    """Put the prediction back in lanes whose update is not finite, and mark them by NaN."""
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


@njit(
    [
        void(
            types.FunctionType(UPDATE_SIGNATURE), types.FunctionType(MEASURE_SIGNATURE),
            int64[::1], int64[::1], float64[:, ::1], float64[::1], float64[:, ::1], boolean,
            int64, float64, float64, int64[::1], int64[::1], float64[::1], float64[:, ::1],
            float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, :, ::1],
            float64[:, :, :, ::1], float64[:, ::1], float64[:, ::1],
        )
    ],
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def run_lanes(
    update: Any, measure: Any, slots: Ints, uses: Ints, rows: Floats, patterns: Floats,
    noise: Floats, diagonal: bool, iterations: int, spread: float, bend_weight: float,
    phi_row: Ints, phi_col: Ints, phi: Floats, process: Floats, readings: Floats, mean: Floats,
    factor: Floats, means: Floats, covariances: Floats, evidence: Floats, nis: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Predict and update over all steps.

    Parameters
    ----------
    update : callable
        Compiled with :data:`mapfilter.filters._square_root.UPDATE_SIGNATURE`, which tells of
        ``measure`` to ``bend_weight``, too.
    phi_row, phi_col, phi, process
        Φ by its entries, and Q.
    readings : (K, m, W) array
        NaN where absent.
    mean : (n, W) array
        The first beliefs; changed.
    factor : (n, n, W) array
        Their factors; changed.
    means : (K, n, W) array
        Written.
    covariances : (K or 0, W, n, n) array
        Written where it has rows.
    evidence, nis : (K, W) arrays
        Written; NaN where an update failed and the prediction was kept.
    """
    n, lanes = mean.shape
    lower, work = np.zeros((n, n, lanes)), np.empty((n, n, lanes))
    predicted = np.empty((n, lanes))
    for k in range(readings.shape[0]):
        predict_lanes(mean, factor, phi_row, phi_col, phi, process, lower, work)
        predicted[:, :] = mean
        update(
            measure, slots, uses, rows, patterns, noise, diagonal, iterations, spread,
            bend_weight, readings[k], lower, mean, factor, evidence[k], nis[k],
        )  # fmt: skip
        keep_finite(predicted, lower, mean, factor, evidence[k], nis[k])
        means[k] = mean
        if covariances.shape[0] > 0:
            covariance_lanes(factor, covariances[k])


@njit(cache=True, nogil=True, error_model="numpy")
def reweigh(weight: Floats, evidence: Floats) -> float:  # pragma: no cover
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
        gained = np.exp(evidence[w] - most) if evidence[w] <= most else 0.0
        weight[w] *= gained
        total += weight[w]
    for w in range(weight.size):
        weight[w] /= total
    return float(most + np.log(total))


@njit(cache=True, nogil=True, error_model="numpy")
def moments(
    weight: Floats, mean: Floats, factor: Floats, centre: Floats, covariance: Floats
) -> None:  # pragma: no cover
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


@njit(
    [
        void(
            types.FunctionType(UPDATE_SIGNATURE), types.FunctionType(MEASURE_SIGNATURE),
            int64[::1], int64[::1], float64[:, ::1], float64[::1], float64[:, ::1], boolean,
            int64, float64, float64, int64[::1], int64[::1], float64[::1], float64[:, ::1],
            float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[::1], float64,
            float64[:, ::1], float64[:, :, ::1], float64[::1], int64[::1],
        )
    ],
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def run_mixture(
    update: Any, measure: Any, slots: Ints, uses: Ints, rows: Floats, patterns: Floats,
    noise: Floats, diagonal: bool, iterations: int, spread: float, bend_weight: float,
    phi_row: Ints, phi_col: Ints, phi: Floats, process: Floats, readings: Floats, mean: Floats,
    factor: Floats, weight: Floats, least: float, means: Floats, covariances: Floats,
    evidence: Floats, counts: Ints,
) -> None:  # pragma: no cover  # fmt: skip
    """Predict, update and reweigh the components of one belief over all steps.

    Parameters
    ----------
    update ... process
        As :func:`mapfilter.filters._runs.run_lanes` takes them.
    readings : (K, m) array
        NaN where absent.
    mean, factor, weight : (n, W), (n, n, W) and (W,) arrays
        The first components.
    least : float
        Components of less weight are dropped.
    means, covariances : (K, n) and (K, n, n) arrays
        Written: moments of the mixture.
    evidence : (K,) array
        Written; NaN where no component could take the reading.
    counts : (K,) integer array
        Written: how many components are left.
    """
    n = mean.shape[0]
    m = rows.shape[0]
    lanes = weight.size
    lower, work = np.zeros((n, n, lanes)), np.empty((n, n, lanes))
    predicted, reading = np.empty((n, lanes)), np.empty((m, lanes))
    own, nis = np.empty(lanes), np.empty(lanes)
    for k in range(readings.shape[0]):
        predict_lanes(mean, factor, phi_row, phi_col, phi, process, lower, work)
        predicted[:, :] = mean
        for i in range(m):
            reading[i, :] = readings[k, i]
        update(
            measure, slots, uses, rows, patterns, noise, diagonal, iterations, spread,
            bend_weight, reading, lower, mean, factor, own, nis,
        )  # fmt: skip
        keep_finite(predicted, lower, mean, factor, own, nis)
        evidence[k] = reweigh(weight, own)
        moments(weight, mean, factor, means[k], covariances[k])
        left = 0
        for w in range(lanes):
            if weight[w] >= least:
                left += 1
        counts[k] = left
        # Lanes are given up in larger lots, as moving the rest costs as much as a step.
        if 4 * left <= 3 * lanes and left > 0:
            mean2, factor2 = np.empty((n, left)), np.empty((n, n, left))
            weight2, at, total = np.empty(left), 0, 0.0
            for w in range(lanes):
                if weight[w] >= least:
                    mean2[:, at] = mean[:, w]
                    factor2[:, :, at] = factor[:, :, w]
                    weight2[at] = weight[w]
                    total += weight[w]
                    at += 1
            mean, factor, weight, lanes = mean2, factor2, weight2 / total, left
            lower, work = np.zeros((n, n, lanes)), np.empty((n, n, lanes))
            predicted, reading = np.empty((n, lanes)), np.empty((m, lanes))
            own, nis = np.empty(lanes), np.empty(lanes)
