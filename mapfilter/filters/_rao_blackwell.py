"""The loops over particles of :mod:`mapfilter.filters.rao_blackwell`."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np
from numba import float64, int64, njit, types

from mapfilter._kernels import MEASURE_SIGNATURE, hashed, normals, on_demand
from mapfilter._types import Floats, Floats32, Ints, Ints32

_LANES = 256
"""Particles that are weighed at once: what they need stays in the nearest cache."""


class Entries(NamedTuple):
    """A sparse matrix by its entries: row, column and value, (e,) arrays."""

    row: Ints
    column: Ints
    value: Floats

    @classmethod
    def of(cls, matrix: Floats) -> Entries:
        """Return the entries of a matrix that are not zero."""
        row, column = (np.ascontiguousarray(index) for index in np.nonzero(matrix))
        return cls(row, column, np.ascontiguousarray(matrix[row, column]))


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def move(state: Floats, change: Entries, gain: Floats, key: np.uint64) -> Floats:
    """Return ``x + A x + G ε`` for each particle of ``state`` (n, N).

    ``change`` holds A, ``gain`` G, (n, d); ε is counted from the key.
    """
    moved = np.empty_like(state)
    n, count = state.shape
    sources = gain.shape[1]
    half = (sources * _LANES + 1) // 2
    drawn = np.empty(2 * half, dtype=np.float32)
    for begin in range(0, count, _LANES):
        lanes = min(_LANES, count - begin)
        first = np.uint64(begin) << np.uint64(16)
        for k in range(half):
            a, b = normals(hashed(key, first + np.uint64(k)))
            drawn[k] = a
            drawn[half + k] = b
        for i in range(n):
            to, source = moved[i, begin : begin + lanes], state[i, begin : begin + lanes]
            for k in range(lanes):
                to[k] = source[k]
            for j in range(sources):
                share = gain[i, j]
                if share != 0.0:
                    noise = drawn[j * _LANES : j * _LANES + lanes]
                    for k in range(lanes):
                        to[k] += share * noise[k]
        for e in range(change.value.size):
            to = moved[change.row[e], begin : begin + lanes]
            source = state[change.column[e], begin : begin + lanes]
            value = change.value[e]
            for k in range(lanes):
                to[k] += value * source[k]
    return moved


@njit(cache=True, nogil=True, error_model="numpy")
def propagate(
    covariance: Floats, transition: Floats, process: Floats, sampled: Ints
) -> tuple[Floats, Floats]:
    """Return the gain G of what is drawn, (n, d), and the covariance that is left, (n, n)."""
    n, d = transition.shape[0], sampled.size
    half, joint = np.zeros((n, n)), process.copy()
    for i in range(n):
        for k in range(n):
            if transition[i, k] != 0.0:
                for j in range(n):
                    half[i, j] += transition[i, k] * covariance[k, j]
    for j in range(n):
        for k in range(n):
            if transition[j, k] != 0.0:
                for i in range(n):
                    joint[i, j] += half[i, k] * transition[j, k]
    gain = np.zeros((n, d))
    for j in range(d):
        # Cholesky's steps; what was drawn already leaves nothing where the noise is singular.
        pivot = joint[sampled[j], sampled[j]]
        for k in range(j):
            pivot -= gain[sampled[j], k] ** 2
        if pivot <= 1e-14 * joint[sampled[j], sampled[j]]:
            continue
        root = np.sqrt(pivot)
        for i in range(n):
            value = joint[i, sampled[j]]
            for k in range(j):
                value -= gain[i, k] * gain[sampled[j], k]
            gain[i, j] = value / root
    left = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            left[i, j] = joint[i, j]
            for k in range(d):
                left[i, j] -= gain[i, k] * gain[j, k]
    for j in range(d):
        left[sampled[j], :] = 0.0
        left[:, sampled[j]] = 0.0
        for i in range(j):
            gain[sampled[i], j] = 0.0
    return gain, 0.5 * (left + left.T)


@njit(cache=True, nogil=True, error_model="numpy")
def gains(slope: Floats, covariance: Floats, noise: Floats) -> tuple[Floats, Floats, Floats, float]:
    """Return the update of a covariance P by a linear reading of slope C (m, n) and noise R.

    These are L⁻¹ (m, m) with ``L Lᵀ = C P Cᵀ + R``; ``P Cᵀ L⁻ᵀ`` (n, m), the gain for residuals
    whitened by L⁻¹; the covariance ``P - P Cᵀ (L Lᵀ)⁻¹ C P``; and the logarithm of the
    determinant of L, NaN where there is none.
    """
    m, n = slope.shape
    factor, inverse = np.zeros((m, m)), np.zeros((m, m))
    crossed = np.zeros((n, m))
    for a in range(n):
        for b in range(n):
            if covariance[a, b] != 0.0:
                for i in range(m):
                    crossed[a, i] += covariance[a, b] * slope[i, b]
    log_root = 0.0
    for i in range(m):
        for j in range(i + 1):
            value = noise[i, j]
            for a in range(n):
                value += slope[i, a] * crossed[a, j]
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            factor[i, j] = np.sqrt(value) if i == j else value / factor[j, j]
        log_root += np.log(factor[i, i])
        inverse[i, i] = 1.0 / factor[i, i]
        for j in range(i):
            value = 0.0
            for k in range(j, i):
                value -= factor[i, k] * inverse[k, j]
            inverse[i, j] = value / factor[i, i]
    gain, updated = np.zeros((n, m)), covariance.copy()
    for a in range(n):
        for i in range(m):
            for j in range(i + 1):
                gain[a, i] += inverse[i, j] * crossed[a, j]
    for a in range(n):
        for b in range(n):
            for i in range(m):
                updated[a, b] -= gain[a, i] * gain[b, i]
    return inverse, gain, updated, log_root


class Weighing(NamedTuple):
    """A reading of m components, all of them present, as :func:`weigh` takes it.

    The first four fields are those of :class:`mapfilter.filters.trials.CompiledMeasurement`.
    ``inverse`` is that of the lower Cholesky factor of the reading's covariance; ``corrected`` are
    the components to correct, with their gains for whitened residuals, (u, m); ``loading`` is what
    else of the state adds to the reading.
    """

    slots: Ints
    uses: Ints
    rows: Floats
    patterns: Floats
    reading: Floats
    inverse: Floats
    corrected: Ints
    gain: Floats
    loading: Entries


_VECTOR, _MATRIX, _INDEX, _TYPES = float64[::1], float64[:, ::1], int64[::1], cast(Any, types)
_ENTRIES = _TYPES.NamedTuple((_INDEX, _INDEX, _VECTOR), Entries)
_WEIGHING = _TYPES.NamedTuple(
    (_INDEX, _INDEX, _MATRIX, _VECTOR, _VECTOR, _MATRIX, _INDEX, _MATRIX, _ENTRIES), Weighing
)
_SIGNATURE = float64(types.FunctionType(MEASURE_SIGNATURE), _WEIGHING, _MATRIX, _VECTOR)


def weigh(measure: Any, given: Weighing, state: Floats, log_weight: Floats) -> float:
    """Add the log density of a reading to each weight, and correct the means; both in place.

    ``state`` is (n, N), ``log_weight`` (N,). Return the smallest normalised square of a residual.
    """
    slots, uses, rows, patterns = given.slots, given.uses, given.rows, given.patterns
    reading, inverse, used, gain = given.reading, given.inverse, given.corrected, given.gain
    row, column, entry = given.loading
    m = reading.size
    count = state.shape[1]
    slope = np.zeros((1, 1, 1))
    least = np.inf
    for begin in range(0, count, _LANES):
        lanes = min(_LANES, count - begin)
        points, mean = np.empty((uses.size, lanes)), np.empty((m, lanes))
        white, square = np.empty(lanes), np.zeros(lanes)
        for a in range(uses.size):
            # A loop: to assign arrays numba compiles a check of their shapes, for two seconds.
            to, source = points[a], state[uses[a]]
            for k in range(lanes):
                to[k] = source[begin + k]
        measure(points, slots, rows, patterns, mean, slope, False)
        for e in range(entry.size):
            to, source, value = mean[row[e]], state[column[e]], entry[e]
            for k in range(lanes):
                to[k] += value * source[begin + k]
        for i in range(m):
            own, given = mean[i], reading[i]
            for k in range(lanes):
                own[k] = given - own[k]
        for i in range(m):
            white[:] = 0.0
            for j in range(i + 1):
                share = inverse[i, j]
                if share != 0.0:
                    own = mean[j]
                    for k in range(lanes):
                        white[k] += share * own[k]
            for k in range(lanes):
                square[k] += white[k] * white[k]
            for c in range(used.size):
                step = gain[c, i]
                if step != 0.0:
                    own = state[used[c]]
                    for k in range(lanes):
                        own[begin + k] += step * white[k]
        for k in range(lanes):
            log_weight[begin + k] -= 0.5 * square[k]
            least = min(least, square[k])
    return least


weigh_kernel = on_demand(_SIGNATURE, weigh, contract=True)
"""Return :func:`weigh`, compiled."""


@njit(cache=True, nogil=True, error_model="numpy")
def copies(state: Floats, chosen: Ints32) -> Floats:
    """Return the chosen particles of ``state`` (n, N), shape (n, M)."""
    out = np.empty((state.shape[0], chosen.size))
    for i in range(state.shape[0]):
        source, to = state[i], out[i]
        for k in range(chosen.size):
            to[k] = source[np.uint32(chosen[k])]
    return out


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def means(state: Floats, weight: Floats32) -> Floats:
    """Return the weighted mean of particles (n, N), counted from the first one of them."""
    mean, total = np.empty(state.shape[0]), 0.0
    for k in range(weight.size):
        total += weight[k]
    for i in range(mean.size):
        off, one = 0.0, state[i]
        origin = one[0]
        for k in range(weight.size):
            off += weight[k] * (one[k] - origin)
        mean[i] = origin + off / total
    return mean


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def sums(state: Floats, weight: Floats32) -> tuple[Floats, Floats]:
    """Return the weighted mean and covariance of particles (n, N)."""
    n, count = state.shape
    mean, spread, total = means(state, weight), np.zeros((n, n)), 0.0
    for k in range(count):
        total += weight[k]
    for i in range(n):
        for j in range(i + 1):
            product, one, two = 0.0, state[i], state[j]
            for k in range(count):
                product += weight[k] * (one[k] - mean[i]) * (two[k] - mean[j])
            spread[i, j] = spread[j, i] = product / total
    return mean, spread
