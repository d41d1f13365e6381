"""What a cloud of weighted positions says: where it leads, how sure it is, what else there is.

The plane is cut into square bins. The leading hypothesis is the neighbourhood of 3 × 3 bins with
the largest mass, its position the mean of what lies within 50 m of it; the runners-up are what
leads when that is taken away. Radii hold shares of the *whole* belief about the leading position,
so that a belief of two places has a radius that reaches from one to the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log, nan

import numpy as np
from numba import njit

from mapfilter._types import Floats, Floats32, Ints32

NEAR_M = 50.0
SHARES = (0.50, 0.67, 0.95)
_RADIUS_BINS = 4096
_RINGS_PER_SQRT_M = 30.0


@dataclass(frozen=True, slots=True)
class Bins:
    """The bins of an area, from its south-western corner.

    Parameters
    ----------
    west_m, south_m : float
    size_m : float
        Side of a bin.
    cols, rows : int
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


@dataclass(frozen=True, slots=True)
class BeliefSummary:
    """What a belief says.

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
        """Return two to the power of the entropy: how many bins the belief covers."""
        return float(2.0**self.entropy_bits)


def summarise(state: Floats32, weight: Floats32, bins: Bins) -> BeliefSummary:
    """Return what a cloud says.

    Parameters
    ----------
    state : ndarray of float32, shape (R, N)
        The first two rows are east and north.
    weight : ndarray of float32, shape (N,)
        Summing to one.
    bins : Bins
    """
    rows = state.shape[0]
    found = np.zeros(rows + 3 + 3 + 1 + 6 + 1)
    mass = np.zeros((bins.rows, bins.cols), dtype=np.float32)
    _summarise(state, weight, bins.west_m, bins.south_m, bins.size_m, mass, found)
    mean, rest = found[:rows], found[rows:]
    covariance = np.array([[rest[0], rest[2]], [rest[2], rest[1]]])
    others = rest[7:13].reshape(2, 3)
    return BeliefSummary(
        mean, covariance, rest[3:6], float(rest[6]), others[others[:, 2] > 0], float(rest[13])
    )


def flattened(state: Floats32, weight: Floats32, bins: Bins, power: float) -> Floats32:
    """Return weights, summing to one, that spread over a belief's places more evenly.

    Each bin gets its mass to a power; its particles share it by their weights.
    """
    flat = np.empty_like(weight)
    mass = np.zeros(bins.rows * bins.cols, dtype=np.float32)
    _flatten(state, weight, bins.west_m, bins.south_m, bins.size_m, bins.cols, power, mass, flat)
    return flat


@njit(error_model="numpy", cache=True)
def _flatten(
    state: Floats32, weight: Floats32, west_m: float, south_m: float, size_m: float, cols: int,
    power: float, mass: Floats32, flat: Floats32,
) -> None:  # fmt: skip
    per_m, w, s = np.float32(1 / size_m), np.float32(west_m), np.float32(south_m)
    rows = mass.size // cols
    east, north = state[0], state[1]
    of_bin = np.empty(weight.size, dtype=np.int32)
    for i in range(weight.size):
        col = min(max(int((east[i] - w) * per_m), 0), cols - 1)
        row = min(max(int((north[i] - s) * per_m), 0), rows - 1)
        of_bin[i] = row * cols + col
        mass[of_bin[i]] += weight[i]
    total = 0.0
    for at in range(mass.size):
        if mass[at] > 0:
            share = float(mass[at]) ** power
            mass[at] = share / mass[at]
            total += share
    per_share = np.float32(1.0 / total)
    for i in range(weight.size):
        flat[i] = weight[i] * mass[of_bin[i]] * per_share


def empty_summary(rows: int) -> BeliefSummary:
    """Return the summary of an empty belief."""
    unknown = np.full((2, 2), nan)
    return BeliefSummary(np.full(rows, nan), unknown, np.full(3, nan), 0.0, np.empty((0, 3)), nan)


@njit(error_model="numpy", cache=True)
def _leader(mass: Floats32, touched: Ints32) -> tuple[int, float]:
    """Return the touched bin whose neighbourhood is the heaviest, and that mass."""
    rows, cols = mass.shape
    best, most = -1, 0.0
    for k in range(touched.size):
        row, col = touched[k] // cols, touched[k] % cols
        total = 0.0
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(col - 1, 0), min(col + 2, cols)):
                total += mass[r, c]
        if total > most:
            best, most = touched[k], total
    return best, most


@njit(error_model="numpy", cache=True)
def _bin_masses(
    east: Floats32, north: Floats32, weight: Floats32, west_m: float, south_m: float,
    size_m: float, mass: Floats32, touched: Ints32,
) -> int:  # fmt: skip
    rows, cols = mass.shape
    per_m, w, s = np.float32(1 / size_m), np.float32(west_m), np.float32(south_m)
    flat, count = mass.ravel(), 0
    for i in range(east.size):
        col = min(max(np.int32((east[i] - w) * per_m), 0), cols - 1)
        row = min(max(np.int32((north[i] - s) * per_m), 0), rows - 1)
        at = row * cols + col
        if flat[at] == 0:
            touched[count] = at
            count += 1
        # A weight of zero must not make its bin look untouched.
        flat[at] += max(weight[i], np.float32(1e-30))
    return count


@njit(error_model="numpy", cache=True)
def _summarise(
    state: Floats32, weight: Floats32, west_m: float, south_m: float, size_m: float,
    mass: Floats32, found: Floats,
) -> None:  # fmt: skip
    size, cols = state.shape[0], mass.shape[1]
    east, north = state[0], state[1]
    touched = np.empty(weight.size, dtype=np.int32)
    count = _bin_masses(east, north, weight, west_m, south_m, size_m, mass, touched)
    touched = touched[:count]
    flat, entropy = mass.ravel(), 0.0
    for k in range(count):
        share = float(flat[touched[k]])
        entropy -= share * log(share)
    place = size + 7
    x = y = 0.0
    for hypothesis in range(3):
        best, most = _leader(mass, touched)
        if best < 0 or (hypothesis > 0 and most < 1e-4):
            break
        cx = west_m + (best % cols + 0.5) * size_m
        cy = south_m + (best // cols + 0.5) * size_m
        if hypothesis == 0:
            for _ in range(2):
                cx, cy = _mean_near(east, north, weight, cx, cy)
            x, y = cx, cy
        else:
            found[place], found[place + 1], found[place + 2] = cx, cy, most
            place += 3
        # What lies in the 5 x 5 bins about it is taken away.
        row, col = best // cols, best % cols
        for r in range(max(row - 2, 0), min(row + 3, mass.shape[0])):
            for c in range(max(col - 2, 0), min(col + 3, cols)):
                mass[r, c] = 0
    _moments(state, weight, x, y, found)
    found[size + 13] = entropy / log(2.0)


@njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, cache=True)
def _mean_near(
    east: Floats32, north: Floats32, weight: Floats32, x: float, y: float
) -> tuple[float, float]:
    """Return the mean of what lies near a place, or the place where nothing does."""
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
def _moments(state: Floats32, weight: Floats32, x: float, y: float, found: Floats) -> None:
    """Fill mean, covariance, radii and the mass near a place."""
    size, count = state.shape[0], weight.size
    east, north = state[0], state[1]
    cx, cy, reach = np.float32(x), np.float32(y), np.float32(NEAR_M**2)
    zero, rings = np.float32(0.0), np.float32(_RINGS_PER_SQRT_M)
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
    for r in range(size):
        row, total = state[r], 0.0
        for i in range(count):
            total += float(near[i] * row[i])
        found[r] = total
    found[size], found[size + 1], found[size + 2] = xx, yy, xy
    by_radius = np.zeros(_RADIUS_BINS + 1)
    for i in range(count):
        by_radius[min(ring_of[i], _RADIUS_BINS)] += weight[i]
    if mass > 0:
        for r in range(size + 3):
            found[r] /= mass
    passed, ring = 0.0, 0
    for k in range(3):
        while ring <= _RADIUS_BINS and passed + by_radius[ring] < SHARES[k]:
            passed += by_radius[ring]
            ring += 1
        inside = (SHARES[k] - passed) / by_radius[ring] if ring <= _RADIUS_BINS else 1.0
        found[size + 3 + k] = ((ring + inside) / _RINGS_PER_SQRT_M) ** 2
    found[size + 6] = mass
