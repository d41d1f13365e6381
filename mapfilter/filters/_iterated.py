"""The update of the iterated extended Kalman filter, for many lanes at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from mapfilter._types import Floats, Ints
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

_SETTLED = 1e-9
_ROUNDING = 1e-8


@njit([UPDATE_SIGNATURE], cache=True, nogil=True, error_model="numpy")
def iterated(
    measure: Any, slots: Ints, uses: Ints, rows: Floats, patterns: Floats, noise: Floats,
    diagonal: bool, iterations: int, spread: float, bend_weight: float, reading: Floats,  # noqa: ARG001
    lower: Floats, mean: Floats, factor: Floats, evidence: Floats, nis: Floats,
) -> None:  # pragma: no cover  # fmt: skip
    """Update beliefs at the most probable state: Gauss-Newton with step halving, in place.

    In each lane a step is taken only when it lowers ``|z|² + |r(z)|²``; else it is halved.
    """
    m, lanes = reading.shape
    n = mean.shape[0]
    present = np.empty((m, lanes), dtype=np.bool_)
    present_lanes(reading, present)
    noise_factor = np.empty((m, m, lanes))
    noise_lanes(noise, diagonal, present, noise_factor)
    points, expected = np.empty((uses.size, lanes)), np.empty((m, lanes))
    slope = np.empty((m, uses.size, lanes))
    trial_seen, trial_r = np.empty((m, n, lanes)), np.empty((m, lanes))
    seen, r = np.zeros((m, n, lanes)), np.zeros((m, lanes))
    information, half = np.empty((n, n, lanes)), np.empty((n, lanes))
    z, trial, target = np.zeros((n, lanes)), np.zeros((n, lanes)), np.zeros((n, lanes))
    best, length = np.full(lanes, np.inf), np.ones(lanes)
    settled = np.zeros(lanes, dtype=np.bool_)
    for _ in range(iterations):
        for a in range(uses.size):
            points[a] = mean[uses[a]]
            for k in range(uses[a] + 1):
                for w in range(lanes):
                    points[a, w] += lower[uses[a], k, w] * trial[k, w]
        measure(points, slots, rows, patterns, expected, slope, True)
        for i in range(m):
            for w in range(lanes):
                trial_r[i, w] = reading[i, w] - expected[i, w]
        drop_absent(present, slope, trial_r)
        whiten_lanes(noise_factor, diagonal, slope, trial_r)
        through_lanes(slope, uses, lower, trial_seen)
        for w in range(lanes):
            if settled[w]:
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
        solve_lanes(seen, r, information, half, target)
        open_lanes = 0
        for w in range(lanes):
            if settled[w]:
                continue
            moved = 0.0
            for k in range(n):
                trial[k, w] = z[k, w] + length[w] * (target[k, w] - z[k, w])
                moved = max(moved, abs(trial[k, w] - z[k, w]))
            if moved < _SETTLED:
                settled[w] = True
            else:
                open_lanes += 1
        if open_lanes == 0:
            break
    evidence_lanes(present, noise_factor, r, information, half, evidence, nis)
    settle_lanes(lower, information, target if iterations == 1 else trial, mean, factor)
