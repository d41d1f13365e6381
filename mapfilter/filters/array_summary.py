"""Summary of a belief whose arrays lie on a device: :mod:`mapfilter.filters.hypotheses` by arrays.

Sums over hypotheses are taken where they lie. What is brought back are masses of bins and of rings,
and a few sums; the hypotheses are chosen among the bins on the processor.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mapfilter._device import arrays_of, on_host
from mapfilter._types import Floats, Ints
from mapfilter.filters.hypotheses import (
    NEAR_M,
    RADIUS_BINS,
    RINGS_PER_SQRT_M,
    SHARES,
    BeliefSummary,
    Bins,
)

_LEAST_RUNNER_UP = 1e-4
_TAKEN_AWAY = 2
"""Bins to each side of a hypothesis that are taken away with it."""


def summarise_arrays(state: Any, weight: Any, bins: Bins) -> BeliefSummary:
    """Summarise a cloud as :func:`mapfilter.filters.hypotheses.summarise` does, within rounding.

    Parameters
    ----------
    state : array of float32, shape (R, N)
        The first two rows are east and north.
    weight : array of float32, shape (N,)
        Sums to one.
    """
    arrays = arrays_of(weight)
    of_bin = _bin_of(state, bins)
    flat = on_host(arrays.bincount(of_bin, weights=weight, minlength=bins.rows * bins.cols))
    mass = flat.astype(np.float64).reshape(bins.rows, bins.cols)
    share = mass[mass > 0]
    entropy_bits = float(-(share * np.log2(share)).sum())
    bin_of, first = (on_host(one) for one in arrays.unique(of_bin, return_index=True))
    # Of equal bins that of the first hypothesis leads, as in the compiled summary.
    (east_m, north_m), others = _leaders(mass, bin_of[np.argsort(first)], bins)
    for _ in range(2):
        east_m, north_m = _mean_near(state, weight, east_m, north_m)
    dx, dy = state[0] - np.float32(east_m), state[1] - np.float32(north_m)
    square = dx * dx + dy * dy
    near = arrays.where(square <= np.float32(NEAR_M**2), weight, np.float32(0.0))
    sums = (near, near * dx * dx, near * dy * dy, near * dx * dy)
    held, xx, yy, xy = (float(one.sum(dtype=np.float64)) for one in sums)
    mean = on_host((state * near).sum(axis=1, dtype=np.float64)).copy()
    covariance = np.array([[xx, xy], [xy, yy]])
    if held > 0:
        mean /= held
        covariance /= held
    ring = (arrays.sqrt(arrays.sqrt(square)) * np.float32(RINGS_PER_SQRT_M)).astype(np.int32)
    ring = arrays.minimum(ring, RADIUS_BINS)
    by_ring = on_host(arrays.bincount(ring, weights=weight, minlength=RADIUS_BINS + 1))
    return BeliefSummary(mean, covariance, _radii_m(by_ring), held, others, entropy_bits)


def _bin_of(state: Any, bins: Bins) -> Any:
    """Return the flat index of each hypothesis's bin."""
    arrays, per_m = arrays_of(state), np.float32(1 / bins.size_m)
    # Truncated, then limited, as in the compiled summary.
    col = ((state[0] - np.float32(bins.west_m)) * per_m).astype(np.int32)
    row = ((state[1] - np.float32(bins.south_m)) * per_m).astype(np.int32)
    col = arrays.minimum(arrays.maximum(col, 0), bins.cols - 1)
    row = arrays.minimum(arrays.maximum(row, 0), bins.rows - 1)
    return row * bins.cols + col


def _leaders(mass: Floats, touched: Ints, bins: Bins) -> tuple[tuple[float, float], Floats]:
    """Return the middle of the leading hypothesis's bin, and the runners-up with their masses.

    One of the bins in ``touched`` leads, the first of equal ones.
    """
    left = mass.copy()
    found: list[tuple[float, float, float]] = []
    for _ in range(3):
        around = _neighbourhoods(left).ravel()[touched]
        best = int(around.argmax())
        most = float(around[best])
        row, col = divmod(int(touched[best]), bins.cols)
        if not most > 0 or (found and most < _LEAST_RUNNER_UP):
            break
        east_m = bins.west_m + (col + 0.5) * bins.size_m
        north_m = bins.south_m + (row + 0.5) * bins.size_m
        found.append((east_m, north_m, most))
        first_row, first_col = max(row - _TAKEN_AWAY, 0), max(col - _TAKEN_AWAY, 0)
        left[first_row : row + _TAKEN_AWAY + 1, first_col : col + _TAKEN_AWAY + 1] = 0.0
    east_m, north_m = found[0][:2] if found else (0.0, 0.0)
    return (east_m, north_m), np.array(found[1:], dtype=np.float64).reshape(-1, 3)


def _neighbourhoods(mass: Floats) -> Floats:
    """Return the mass of the 3 x 3 bins about each bin."""
    wide = np.pad(mass, 1)
    tall = wide[:-2] + wide[1:-1] + wide[2:]
    return np.asarray(tall[:, :-2] + tall[:, 1:-1] + tall[:, 2:])


def _mean_near(state: Any, weight: Any, east_m: float, north_m: float) -> tuple[float, float]:
    """Return the mean of the hypotheses near a place, or the place itself without any."""
    arrays = arrays_of(weight)
    dx, dy = state[0] - np.float32(east_m), state[1] - np.float32(north_m)
    near = arrays.where(dx * dx + dy * dy <= np.float32(NEAR_M**2), weight, np.float32(0.0))
    sums = (near, near * dx, near * dy)
    held, east, north = (float(one.sum(dtype=np.float64)) for one in sums)
    return (east_m + east / held, north_m + north / held) if held > 0 else (east_m, north_m)


def _radii_m(by_ring: Floats) -> Floats:
    """Return the radii that hold the shares of a belief, by its masses in rings."""
    passed = np.cumsum(by_ring)
    radii = np.empty(len(SHARES))
    for k, share in enumerate(SHARES):
        ring = int(np.searchsorted(passed, share))
        inside = 1.0
        if ring < by_ring.size:
            inside = float((share - (passed[ring] - by_ring[ring])) / by_ring[ring])
        radii[k] = ((ring + inside) / RINGS_PER_SQRT_M) ** 2
    return radii
