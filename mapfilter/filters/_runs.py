"""Whole runs of Kalman-type filters, compiled: all steps of a block of lanes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, types, void

from mapfilter._types import Floats, Ints
from mapfilter.filters._square_root import covariance_lanes, predict_lanes
from mapfilter.filters._updates import MEASURE_SIGNATURE, UPDATE_SIGNATURE


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
        Compiled with :data:`mapfilter.filters._updates.UPDATE_SIGNATURE`, which tells of
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
