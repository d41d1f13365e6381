"""Mass on a lattice that is moved, and spread over pixels and bins of an angle, by arrays."""

from __future__ import annotations

import numpy as np

from mapfilter._device import arrays_of
from mapfilter._types import Floats32

_REACH_SD = 4.0
_READ_INTO_PIXELS = 1 / 6


def taps(shift_px: float, sd_px: float) -> tuple[int, Floats32]:
    """Return how far the first tap shifts, and the share of each tap.

    Their mean is the shift and their variance that of the displacement. Only where a shift falls
    between pixels, f from the nearest, no less than f (1 - f) is possible.

    Examples
    --------
    >>> taps(0.75, 0.0)
    (0, array([0.25, 0.75, 0.  ], dtype=float32))
    """
    from scipy.special import ndtr

    nearest = round(shift_px)
    beside = shift_px - nearest
    variance = max(sd_px**2, abs(beside) * (1 - abs(beside)))
    if variance + beside**2 <= 1:
        square = variance + beside**2
        share = [(square - beside) / 2, 1 - square, (square + beside) / 2]
        return nearest - 1, np.array(share, dtype=np.float32)
    # A Gaussian over mass that is spread evenly in its pixel, read into pixels again.
    narrower_px = float(np.sqrt(variance - _READ_INTO_PIXELS))
    first = int(np.floor(shift_px - _REACH_SD * narrower_px)) - 1
    last = int(np.ceil(shift_px + _REACH_SD * narrower_px)) + 1
    beyond = (np.arange(first - 1, last + 2) - shift_px) / narrower_px
    ramp = narrower_px * (beyond * ndtr(beyond) + np.exp(-0.5 * beyond**2) / np.sqrt(2 * np.pi))
    return first, np.diff(ramp, 2).astype(np.float32)


def shifted(mass: Floats32, first: int, taps: Floats32, *, axis: int) -> Floats32:
    """Spread mass along an axis; what leaves the lattice is lost."""
    spread: Floats32 = arrays_of(mass).zeros_like(mass)
    size = mass.shape[axis]
    # What goes farther than the lattice reaches is lost.
    for k in range(max(first, 1 - size), min(first + taps.size, size)):
        tap = taps[k - first]
        if tap < 1e-7:
            continue
        target, source = [slice(None)] * mass.ndim, [slice(None)] * mass.ndim
        target[axis] = slice(max(k, 0), size + min(k, 0))
        source[axis] = slice(max(-k, 0), size - max(k, 0))
        spread[tuple(target)] += mass[tuple(source)] * float(tap)
    return spread


def turned(mass: Floats32, first: int, taps: Floats32, *, circular: bool) -> Floats32:
    """Spread mass over the bins of an angle, around the circle where they go around."""
    if not circular:
        return shifted(mass, first, taps, axis=0)
    arrays = arrays_of(mass)
    spread: Floats32 = arrays.zeros_like(mass)
    # A wide spread goes around several times; each bin is reached once.
    count = mass.shape[0]
    share = np.bincount((first + np.arange(taps.size)) % count, taps, minlength=count)
    for k in np.flatnonzero(share):
        spread += arrays.roll(mass, int(k), axis=0) * float(share[k])
    return spread
