"""Mass on a lattice that is moved, and spread over pixels and bins of an angle, by arrays."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, sin
from typing import NamedTuple

import numpy as np

from mapfilter._device import arrays_of
from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import MotionStep

_REACH_SD = 4.0
_READ_INTO_PIXELS = 1 / 6


class Waiting(NamedTuple):
    """Motion that mass has not been moved by yet.

    Parameters
    ----------
    east_m, north_m, length_m : float
        Displacement by headings, and its length.
    spread_m2 : float
        Further variance of it along each axis.
    turned_rad2 : float
        Variance of changes of the heading that were not measured.
    aside_m, aside_m2 : float
        Length of steps without a heading, and their variance along each axis.
    """

    east_m: float = 0.0
    north_m: float = 0.0
    length_m: float = 0.0
    spread_m2: float = 0.0
    turned_rad2: float = 0.0
    aside_m: float = 0.0
    aside_m2: float = 0.0

    def after(self, step: MotionStep) -> Waiting:
        """Return it after a further step."""
        length_m = abs(step.step_m)
        if not isfinite(step.heading_rad):
            return self._replace(
                turned_rad2=self.turned_rad2 + step.turned_sd_rad**2,
                aside_m=self.aside_m + length_m,
                aside_m2=self.aside_m2 + step.all_sides_m**2 / 2,
            )
        return self._replace(
            east_m=self.east_m + step.step_m * cos(step.heading_rad),
            north_m=self.north_m + step.step_m * sin(step.heading_rad),
            length_m=self.length_m + length_m,
            spread_m2=self.spread_m2 + step.sampling_sd_m**2,
        )


@dataclass(frozen=True, slots=True)
class Transport:
    """Effect of one stretch of dead reckoning on mass.

    Parameters
    ----------
    right_px, down_px, sd_right_px, sd_down_px : ndarray, shape (B,)
        Mean displacement of each bin of the heading error and its deviation, in pixels.
    turned_bins : float
        Standard deviation of the heading error's change, in bins.
    on, off : ndarray of float32, shape (rows, cols), and float
        Likelihood of the map at each pixel, and off it.
    leave, come_back : float
        Probabilities of leaving the map and of coming back.
    """

    right_px: Floats
    down_px: Floats
    sd_right_px: Floats
    sd_down_px: Floats
    turned_bins: float
    on: Floats32
    off: float
    leave: float
    come_back: float


@dataclass(frozen=True, slots=True)
class Spread:
    """Effect of a way to all sides on mass; on the map it follows the ways that there are.

    Parameters
    ----------
    sd_px : float
        Deviation along each axis, in pixels.
    ways : ndarray of float32, shape (rows, cols)
        How often one is at each pixel, relative to others.
    cost : float
        Likelihood, everywhere.
    leave, come_back : float
        Probabilities of leaving the map and of coming back.
    """

    sd_px: float
    ways: Floats32
    cost: float
    leave: float
    come_back: float


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


def carried(
    on: Floats32, off: Floats32, step: Transport, *, circular: bool
) -> tuple[Floats32, Floats32]:
    """Return masses (B, rows, cols) on and off the map after a stretch of dead reckoning."""
    arrays = arrays_of(on)
    moved_on, moved_off = arrays.empty_like(on), arrays.empty_like(off)
    for b in range(on.shape[0]):
        right = taps(step.right_px[b], step.sd_right_px[b])
        down = taps(step.down_px[b], step.sd_down_px[b])
        for source, target in ((on, moved_on), (off, moved_off)):
            target[b] = shifted(shifted(source[b], *right, axis=1), *down, axis=0)
    if step.turned_bins > 0 and on.shape[0] > 1:
        spread = taps(0.0, step.turned_bins)
        moved_on = turned(moved_on, *spread, circular=circular)
        moved_off = turned(moved_off, *spread, circular=circular)
    stayed, away = _exchanged(moved_on, moved_off, step.leave, step.come_back)
    return stayed * step.on, away * np.float32(step.off)


def spread_along(on: Floats32, off: Floats32, way: Spread) -> tuple[Floats32, Floats32]:
    """Return masses (B, rows, cols) on and off the map after a way to all sides.

    Mass on the map goes where ways are, of those that it may reach, and none is lost.
    """
    stayed, away = _exchanged(on, off, way.leave, way.come_back)
    kernel, cost = taps(0.0, way.sd_px), np.float32(way.cost)

    def to_all_sides(mass: Floats32) -> Floats32:
        rows, cols = mass.ndim - 2, mass.ndim - 1
        return shifted(shifted(mass, *kernel, axis=cols), *kernel, axis=rows)

    reached = to_all_sides(way.ways)
    along = way.ways * to_all_sides(stayed / reached)
    inside = to_all_sides(arrays_of(on).ones_like(way.ways))
    return along * cost, to_all_sides(away / inside) * cost


def _exchanged(
    on: Floats32, off: Floats32, leave: float, come_back: float
) -> tuple[Floats32, Floats32]:
    """Return the masses after some have left the map and some have come back."""
    left, back = np.float32(leave), np.float32(come_back)
    return on * (1 - left) + off * back, on * left + off * (1 - back)
