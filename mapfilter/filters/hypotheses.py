"""Summary of a cloud of weighted positions: leading hypothesis, uncertainty, runners-up.

The plane is cut into square bins. The leading hypothesis is the neighbourhood of 3 × 3 bins with
the largest mass, its position the mean of what lies within 50 m of it; the runners-up are what
leads when that is taken away. Radii hold shares of the *whole* belief about the leading position,
so that a belief of two places has a radius that reaches from one to the other.
"""

from __future__ import annotations

from math import ceil, log, nan
from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.filters.contract import Estimate

NEAR_M = 50.0
SHARES = (0.50, 0.67, 0.95)
RADIUS_BINS = 4096
RINGS_PER_SQRT_M = 30.0


class Bins(NamedTuple):
    """The bins of an area, from its south-western corner.

    Parameters
    ----------
    west_m, south_m : float
        The corner.
    size_m : float
        Side of a bin.
    cols, rows : int
        Numbers of bins to the east and to the north.
    """

    west_m: float
    south_m: float
    size_m: float
    cols: int
    rows: int

    @classmethod
    def over(cls, bounds_m: tuple[float, float, float, float], size_m: float = 25.0) -> Bins:
        """Return bins over west, south, east, north, with a margin of one."""
        west, south, east, north = bounds_m
        cols, rows = (max(ceil(side / size_m), 1) + 2 for side in (east - west, north - south))
        return cls(west - size_m, south - size_m, size_m, cols, rows)


class BeliefSummary(NamedTuple):
    """Leading hypothesis of a belief, its uncertainty, and the runners-up.

    Parameters
    ----------
    mean : ndarray of float64, shape (R,)
        Mean state of what lies within 50 m of the leading hypothesis.
    covariance_m2 : ndarray, shape (2, 2)
        Of the same, east and north.
    radii_m : ndarray, shape (3,)
        About the mean, for 50, 67 and 95 % of the belief.
    mass_50m : float
        Share of the belief within 50 m of the mean.
    runners_up : ndarray, shape (K, 3)
        East, north and mass of up to two other hypotheses.
    entropy_bits : float
        Of the bins' masses.
    """

    mean: Floats
    covariance_m2: Floats
    radii_m: Floats
    mass_50m: float
    runners_up: Floats
    entropy_bits: float

    @property
    def effective_bins(self) -> float:
        """Number of bins that the belief covers: two to the power of the entropy."""
        return float(2.0**self.entropy_bits)

    @property
    def estimate(self) -> Estimate:
        """The leading hypothesis."""
        east_m, north_m = float(self.mean[0]), float(self.mean[1])
        return Estimate(east_m, north_m, self.covariance_m2, self.radii_m)


def summarise(state: Floats32, weight: Floats32, bins: Bins) -> BeliefSummary:
    """Summarise a cloud (R, N), whose first two rows are east and north; its weights sum to one.

    Particles beyond the bins count to those at the edge.
    """
    return BeliefSummary(*_summarise(state, weight, bins))


def empty_summary(rows: int) -> BeliefSummary:
    """Return the summary of an empty belief."""
    unknown = np.full((2, 2), nan)
    return BeliefSummary(np.full(rows, nan), unknown, np.full(3, nan), 0.0, np.empty((0, 3)), nan)


@njit(error_model="numpy", cache=True)
def flattened(state: Floats32, weight: Floats32, bins: Bins, power: float) -> Floats32:
    """Return weights, summing to one, that spread over a belief's places more evenly.

    Each bin gets its mass to a power; its particles share it by their weights.
    """
    of_bin, mass = _bin_of(state, bins), np.zeros(bins.rows * bins.cols, dtype=np.float32)
    for i in range(weight.size):
        mass[of_bin[i]] += weight[i]
    total = 0.0
    for at in range(mass.size):
        if mass[at] > 0:
            share = float(mass[at]) ** power
            mass[at] = share / mass[at]
            total += share
    per_share, flat = np.float32(1.0 / total), np.empty_like(weight)
    for i in range(weight.size):
        flat[i] = weight[i] * mass[of_bin[i]] * per_share
    return flat


@njit(error_model="numpy", cache=True)
def _bin_of(state: Floats32, bins: Bins) -> Ints32:
    """Return the flat index of each particle's bin."""
    east, north = state[0], state[1]
    per_m, w, s = np.float32(1 / bins.size_m), np.float32(bins.west_m), np.float32(bins.south_m)
    of_bin = np.empty(east.size, dtype=np.int32)
    for i in range(east.size):
        col = min(max(int((east[i] - w) * per_m), 0), bins.cols - 1)
        row = min(max(int((north[i] - s) * per_m), 0), bins.rows - 1)
        of_bin[i] = row * bins.cols + col
    return of_bin


@njit(error_model="numpy", cache=True)
def _fill_around(
    mass: Floats32, touched: Ints32, row: int, col: int, reach: int, around: Floats
) -> None:
    """Fill the masses of 3 x 3 bins about the touched ones that lie within reach of a bin."""
    rows, cols = mass.shape
    for k in range(touched.size):
        at_row, at_col = touched[k] // cols, touched[k] % cols
        if abs(at_row - row) <= reach and abs(at_col - col) <= reach:
            total = 0.0
            for r in range(max(at_row - 1, 0), min(at_row + 2, rows)):
                for c in range(max(at_col - 1, 0), min(at_col + 2, cols)):
                    total += mass[r, c]
            around[k] = total


@njit(error_model="numpy", cache=True)
def _leader(touched: Ints32, around: Floats) -> tuple[int, float]:
    """Return the touched bin whose neighbourhood is the heaviest, and that mass."""
    best, most = -1, 0.0
    for k in range(touched.size):
        if around[k] > most:
            best, most = touched[k], around[k]
    return best, most


@njit(error_model="numpy", cache=True)
def _summarise(
    state: Floats32, weight: Floats32, bins: Bins
) -> tuple[Floats, Floats, Floats, float, Floats, float]:
    mass = np.zeros((bins.rows, bins.cols), dtype=np.float32)
    flat, of_bin, count = mass.ravel(), _bin_of(state, bins), 0
    touched = np.empty(weight.size, dtype=np.int32)
    least = np.float32(1e-30)
    for i in range(weight.size):
        at = np.uint32(of_bin[i])
        if flat[at] == 0:
            touched[count] = of_bin[i]
            count += 1
        # A weight of zero must not make its bin look untouched.
        flat[at] += weight[i] if weight[i] > least else least
    touched, entropy = touched[:count], 0.0
    for k in range(count):
        share = float(flat[touched[k]])
        entropy -= share * log(share)
    others, found = np.empty((2, 3)), 0
    x = y = 0.0
    around = np.empty(count)
    _fill_around(mass, touched, 0, 0, max(bins.rows, bins.cols), around)
    for hypothesis in range(3):
        best, most = _leader(touched, around)
        if best < 0 or (hypothesis > 0 and most < 1e-4):
            break
        row, col = best // bins.cols, best % bins.cols
        cx = bins.west_m + (col + 0.5) * bins.size_m
        cy = bins.south_m + (row + 0.5) * bins.size_m
        if hypothesis == 0:
            for _ in range(2):
                cx, cy = _mean_near(state[0], state[1], weight, cx, cy)
            x, y = cx, cy
        else:
            others[found, 0], others[found, 1], others[found, 2] = cx, cy, most
            found += 1
        # What lies in the 5 x 5 bins about it is taken away, which changes the neighbourhoods of
        # 7 x 7.
        mass[max(row - 2, 0) : row + 3, max(col - 2, 0) : col + 3] = 0
        _fill_around(mass, touched, row, col, 3, around)
    mean, covariance, radii, near = _moments(state, weight, x, y)
    return mean, covariance, radii, near, others[:found], entropy / log(2.0)


@njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, cache=True)
def _mean_near(
    east: Floats32, north: Floats32, weight: Floats32, x: float, y: float
) -> tuple[float, float]:
    """Return the mean of the hypotheses near a place, or the place itself without any."""
    cx, cy, reach = np.float32(x), np.float32(y), np.float32(NEAR_M**2)
    total, sx, sy = np.float32(0.0), np.float32(0.0), np.float32(0.0)
    for i in range(weight.size):
        dx, dy = east[i] - cx, north[i] - cy
        w = weight[i] if dx * dx + dy * dy <= reach else np.float32(0.0)
        total += w
        sx += w * dx
        sy += w * dy
    if total <= 0:
        return x, y
    return x + float(sx / total), y + float(sy / total)


@njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, cache=True)
def _moments(
    state: Floats32, weight: Floats32, x: float, y: float
) -> tuple[Floats, Floats, Floats, float]:
    """Return mean and covariance of what lies near a place, radii, and the mass near it."""
    size, count = state.shape[0], weight.size
    east, north = state[0], state[1]
    cx, cy, reach = np.float32(x), np.float32(y), np.float32(NEAR_M**2)
    zero, rings = np.float32(0.0), np.float32(RINGS_PER_SQRT_M)
    near = np.empty(count, dtype=np.float32)
    ring_of = np.empty(count, dtype=np.int32)
    mass, xx, yy, xy = 0.0, 0.0, 0.0, 0.0
    # Ever wider rings, of a decimetre at 2 m and of a metre at 200 m; the last ends at 18 km.
    for i in range(count):
        dx, dy = east[i] - cx, north[i] - cy
        square = dx * dx + dy * dy
        w = float(weight[i] if square <= reach else zero)
        near[i] = w
        mass += w
        xx += w * dx * dx
        yy += w * dy * dy
        xy += w * dx * dy
        ring_of[i] = np.int32(rings * np.sqrt(np.sqrt(square)))
    mean, radii = np.empty(size), np.empty(3)
    for r in range(size):
        row, total = state[r], 0.0
        for i in range(count):
            total += float(near[i] * row[i])
        mean[r] = total
    by_radius = np.zeros(RADIUS_BINS + 1)
    for i in range(count):
        by_radius[min(ring_of[i], RADIUS_BINS)] += weight[i]
    covariance = np.array([[xx, xy], [xy, yy]])
    if mass > 0:
        for r in range(size):
            mean[r] /= mass
        for r in range(2):
            for c in range(2):
                covariance[r, c] /= mass
    passed, ring = 0.0, 0
    for k in range(3):
        while ring <= RADIUS_BINS and passed + by_radius[ring] < SHARES[k]:
            passed += by_radius[ring]
            ring += 1
        inside = (SHARES[k] - passed) / by_radius[ring] if ring <= RADIUS_BINS else 1.0
        radii[k] = ((ring + inside) / RINGS_PER_SQRT_M) ** 2
    return mean, covariance, radii, mass
