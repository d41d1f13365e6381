"""Calibrated regions: how large a circle holds the true position as often as it should.

Split conformal prediction (Papadopoulos et al. 2002; Lei et al. 2018) with errors of
cross-validation: blocks (logs, or squares of the ground) are left out, so that errors are those at
places and on days that the database did not have. An error is divided by the spread of the matched
places plus a constant; its quantiles are taken apart for good, middling and poor matches. Blocks
differ more than reports within them: levels are raised until left-out blocks are covered as often
as they should be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats, Ints

LEVELS = (0.50, 0.67, 0.95)
"""Shares of the true positions that the circles should hold."""

_CLASSES = 3
_LEAST_PER_CLASS = 40
_NOMINAL = np.unique(
    np.concatenate([np.linspace(0.3, 0.98, 69), np.linspace(0.981, 1.0, 20), LEVELS])
)


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of cross-validation, shape (N,) each.

    Parameters
    ----------
    error_m, spread_m, mismatch : ndarray
        Of the positions; the last two as in :class:`~.matches.Position`.
    block : ndarray of int
        What was left out together.
    """

    error_m: Floats
    spread_m: Floats
    mismatch: Floats
    block: Ints

    def __len__(self) -> int:
        return len(self.error_m)

    def where(self, kept: Floats) -> Errors:
        """Return some of them."""
        columns = (self.error_m, self.spread_m, self.mismatch, self.block)
        return Errors(*(column[kept] for column in columns))


@dataclass(frozen=True, eq=False)
class Regions:
    """How radii follow from spread and mismatch.

    Parameters
    ----------
    added_m : float
        Added to each spread.
    edges : ndarray, shape (G - 1,)
        Mismatches between classes of matches.
    factor : ndarray, shape (G, 3)
        Radius over spread, for each of :data:`LEVELS`.
    """

    added_m: float
    edges: Floats
    factor: Floats

    def radii_m(self, spread_m: Floats, mismatch: Floats) -> Floats:
        """Return the radii of circles, shape (N, 3)."""
        which = np.searchsorted(self.edges, mismatch, side="right")
        return np.asarray(self.factor[which] * (spread_m + self.added_m)[:, np.newaxis])


def calibrate(errors: Errors) -> Regions:
    """Return regions that hold as often as :data:`LEVELS` state; of at least one error."""
    added_m = max(float(np.median(errors.error_m)), 1e-3)
    edges = _edges(errors.mismatch)
    ratio = errors.error_m / (errors.spread_m + added_m)
    which = np.searchsorted(edges, errors.mismatch, side="right")
    nominal = _raised(ratio, which, errors.block, edges.size + 1)
    return Regions(added_m, edges, _quantiles(ratio, which, edges.size + 1, nominal))


def coverage(errors: Errors) -> tuple[float, float, float]:
    """Return the share of errors within each radius, calibrated without their own block.

    NaN with fewer than two blocks.
    """
    blocks = np.unique(errors.block)
    if len(blocks) < 2:
        return (float("nan"),) * 3
    held = np.zeros(len(LEVELS))
    for block in blocks:
        out = errors.block == block
        own = errors.where(out)
        radii_m = calibrate(errors.where(~out)).radii_m(own.spread_m, own.mismatch)
        held += np.sum(own.error_m[:, np.newaxis] <= radii_m, axis=0)
    low, middle, high = (held / len(errors)).tolist()
    return low, middle, high


def _edges(mismatch: Floats) -> Floats:
    count = min(_CLASSES, len(mismatch) // _LEAST_PER_CLASS)
    if count < 2:
        return np.empty(0)
    return np.unique(np.quantile(mismatch, np.arange(1, count) / count))


def _quantiles(ratio: Floats, which: Ints, classes: int, nominal: Floats) -> Floats:
    """Return conformal quantiles of each class, shape (G, L); of all where a class is small."""
    found = np.empty((classes, len(nominal)))
    for one in range(classes):
        own = ratio[which == one]
        if len(own) < min(_LEAST_PER_CLASS // 4, len(ratio)):
            own = ratio
        # One more error is to come, which may be larger than all.
        shares = np.minimum(nominal * (len(own) + 1) / len(own), 1.0)
        found[one] = np.quantile(own, shares, method="inverted_cdf")
    return found


def _raised(ratio: Floats, which: Ints, block: Ints, classes: int) -> Floats:
    """Return nominal shares at which left-out blocks are covered as :data:`LEVELS` state."""
    blocks = np.unique(block)
    if len(blocks) < 3:
        return np.asarray(LEVELS)
    held = np.zeros(len(_NOMINAL))
    for one in blocks:
        out = block == one
        limits = _quantiles(ratio[~out], which[~out], classes, _NOMINAL)
        held += np.sum(ratio[out][:, np.newaxis] <= limits[which[out]], axis=0)
    reached = np.maximum.accumulate(held) / len(ratio)
    first = [int(np.searchsorted(reached, level)) for level in LEVELS]
    return np.asarray(_NOMINAL[np.minimum(first, len(_NOMINAL) - 1)])
