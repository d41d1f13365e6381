"""Noise of a measurement, for many lanes at once: absent components, and whitening."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.filters._square_root import Problem, cholesky_lanes, kernel


@kernel
def noise_lanes(problem: Problem, present: Bools) -> Floats:
    """Return the noise's Cholesky factor in each lane; absent components are left out of it."""
    m, lanes = present.shape
    noise, factor = problem.noise, np.empty((m, m, lanes))
    for i in range(m):
        factor[i, i, :] = np.sqrt(noise[i, i]) if problem.diagonal else noise[i, i]
        if not problem.diagonal:
            for j in range(i):
                for w in range(lanes):
                    there = present[i, w] and present[j, w]
                    factor[i, j, w] = noise[i, j] if there else 0.0
    if not problem.diagonal:
        cholesky_lanes(factor)
    return factor


@kernel
def drop_absent(present: Bools, slope: Floats, residual: Floats) -> None:
    """Take absent components out of a measurement: zeros in H and r."""
    m, columns, lanes = slope.shape
    for i in range(m):
        for w in range(lanes):
            if not present[i, w]:
                residual[i, w] = 0.0
                for j in range(columns):
                    slope[i, j, w] = 0.0


@kernel
def whiten_lanes(noise_factor: Floats, diagonal: bool, slope: Floats, residual: Floats) -> None:
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
