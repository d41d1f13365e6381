"""Moving mass on a lattice by a Gaussian that is integrated over each pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Floats32 = NDArray[np.float32]

_REACH_SD = 4.0
_LEAST_SD_PX = 0.05


def taps(shift_px: float, sd_px: float) -> tuple[int, Floats32]:
    """Return how far the first tap shifts, and a Gaussian's share of each pixel."""
    sd_px = max(sd_px, _LEAST_SD_PX)
    first = int(np.floor(shift_px - _REACH_SD * sd_px))
    last = int(np.ceil(shift_px + _REACH_SD * sd_px))
    edges = np.arange(first, last + 2) - 0.5
    return first, np.diff(ndtr((edges - shift_px) / sd_px)).astype(np.float32)


def shifted(mass: Floats32, first: int, taps: Floats32, *, axis: int) -> Floats32:
    """Spread mass along an axis; what leaves the lattice is lost."""
    spread = np.zeros_like(mass)
    size = mass.shape[axis]
    for k, tap in enumerate(taps, start=first):
        if abs(k) >= size or tap < 1e-7:
            continue
        target, source = [slice(None)] * mass.ndim, [slice(None)] * mass.ndim
        target[axis] = slice(max(k, 0), size + min(k, 0))
        source[axis] = slice(max(-k, 0), size - max(k, 0))
        spread[tuple(target)] += tap * mass[tuple(source)]
    return spread


def turned(mass: Floats32, first: int, taps: Floats32, *, circular: bool) -> Floats32:
    """Spread mass over the bins of an angle, around the circle where they go around."""
    if not circular:
        return shifted(mass, first, taps, axis=0)
    return np.asarray(
        sum(tap * np.roll(mass, k, axis=0) for k, tap in enumerate(taps, start=first)),
        dtype=np.float32,
    )
