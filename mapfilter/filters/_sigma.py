"""The update of filters with sigma points, for many lanes at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from mapfilter._types import Bools, Floats, Ints
from mapfilter.filters._square_root import (
    UPDATE_SIGNATURE,
    cholesky_lanes,
    drop_absent,
    evidence_lanes,
    present_lanes,
    settle_lanes,
    solve_lanes,
    whiten_lanes,
)


@njit(cache=True, nogil=True, error_model="numpy")
def spread_update(
    along: Floats, bend: Floats, spread: float, bend_weight: float, residual: Floats,
    present: Bools, noise: Floats, lower: Floats, mean: Floats, factor: Floats, evidence: Floats,
    nis: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Update beliefs from readings at sigma points, in place.

    With ``Y± = Y0 + γ (b ± a)`` at the two points of each column of L, the transform's covariance
    is ``Σ aaᵀ + Σ bbᵀ + (β - α²) ddᵀ + R`` with ``d = Σ b/γ`` (Table I of Fritsche & Klein 2009
    rewritten: the huge weights of small α have cancelled). So A = [a...] takes the part of the
    Jacobian, and the rest is noise.

    Parameters
    ----------
    along, bend : (m, n, W) arrays
        a and b; overwritten.
    spread : float
        γ = sqrt(n + λ).
    bend_weight : float
        β - α².
    residual : (m, W) array
        Readings less Y0; overwritten.
    noise : (m, m) array
        R.
    """
    m, n, lanes = along.shape
    shift, total = np.zeros((m, lanes)), np.zeros((m, m, lanes))
    for i in range(m):
        for j in range(n):
            for w in range(lanes):
                shift[i, w] += bend[i, j, w] / spread
        for w in range(lanes):
            residual[i, w] -= shift[i, w]
    drop_absent(present, along, residual)
    drop_absent(present, bend, shift)
    for i in range(m):
        for j in range(i + 1):
            target = total[i, j]
            for k in range(n):
                left, right = bend[i, k], bend[j, k]
                for w in range(lanes):
                    target[w] += left[w] * right[w]
            for w in range(lanes):
                target[w] += bend_weight * shift[i, w] * shift[j, w]
                if (present[i, w] and present[j, w]) or i == j:
                    target[w] += noise[i, j]
    cholesky_lanes(total)
    information = np.empty((n, n, lanes))
    half, z = np.empty((n, lanes)), np.empty((n, lanes))
    whiten_lanes(total, False, along, residual)
    solve_lanes(along, residual, information, half, z)
    evidence_lanes(present, total, residual, information, half, evidence, nis)
    settle_lanes(lower, information, z, mean, factor)


@njit([UPDATE_SIGNATURE], cache=True, nogil=True, error_model="numpy")
def by_sigma_points(
    measure: Any, slots: Ints, uses: Ints, rows: Floats, patterns: Floats, noise: Floats,
    diagonal: bool, iterations: int, spread: float, bend_weight: float, reading: Floats,  # noqa: ARG001
    lower: Floats, mean: Floats, factor: Floats, evidence: Floats, nis: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Send sigma points through a measurement and update beliefs, in place."""
    m, lanes = reading.shape
    n = mean.shape[0]
    present = np.empty((m, lanes), dtype=np.bool_)
    present_lanes(reading, present)
    points, centre = np.empty((uses.size, lanes)), np.empty((m, lanes))
    above, below = np.empty((m, lanes)), np.empty((m, lanes))
    along, bend = np.empty((m, n, lanes)), np.empty((m, n, lanes))
    none = np.empty((m, 0, 0))
    for a in range(uses.size):
        points[a] = mean[uses[a]]
    measure(points, slots, rows, patterns, centre, none, False)
    last = 0
    for a in range(uses.size):
        last = max(last, uses[a])
    for j in range(n):
        if j > last:
            # L is lower triangular: beyond, points differ in what is not measured.
            along[:, j, :] = 0.0
            bend[:, j, :] = 0.0
            continue
        for sign in (1.0, -1.0):
            for a in range(uses.size):
                points[a] = mean[uses[a]]
                if j <= uses[a]:
                    for w in range(lanes):
                        points[a, w] += sign * spread * lower[uses[a], j, w]
            measure(points, slots, rows, patterns, above if sign > 0 else below, none, False)
        for i in range(m):
            for w in range(lanes):
                up, down = above[i, w] - centre[i, w], below[i, w] - centre[i, w]
                along[i, j, w] = (up - down) / (2.0 * spread)
                bend[i, j, w] = (up + down) / (2.0 * spread)
    residual = reading - centre
    spread_update(
        along, bend, spread, bend_weight, residual, present, noise, lower, mean, factor,
        evidence, nis,
    )  # fmt: skip
