"""Errors of fixes that last: fixes of a place that stays beside the true position for a while.

Positions of satellites, and those from Wi-Fi scans, err to the same side again and again. Taken as
independent, ten of them would count as one of a third of the error. Here the error is a first-order
Gauss-Markov process b beside the white noise of each fix (Bar-Shalom, Li & Kirubarajan 2001, sect.
8.2). The state is extended by the place that fixes are of, ``q = p + b``, as fixes then measure two
components of the state:

    p' = Φ p + u + w,    q' = p' + a (q - p) + v,    a = exp(-Δt / T),    var v = (1 - a²) B².

B follows what fixes state: where they are less precise than before an independent error is added to
b, and where they are more precise b shrinks.
"""

from __future__ import annotations

from dataclasses import replace
from math import exp

import numpy as np

from mapfilter._types import Floats
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.belief import SumBelief

LEAST_WHITE = 0.3
"""Least share of a fix's stated variance that is taken for white noise."""

Motion = tuple[Floats, Floats, Floats]
"""Transition, noise and shift."""


def extended_layout(layout: StateLayout) -> StateLayout:
    """Return a layout with two more components: east and north of the place that fixes are of."""
    return replace(layout, size=layout.size + 2)


def fix_layout(layout: StateLayout, first: int) -> StateLayout:
    """Return an extended layout as fixes measure it: ``first`` is the place's east."""
    return StateLayout(layout.size, first, first + 1)


def extended_belief(belief: SumBelief, layout: StateLayout, lasting_m: float) -> SumBelief:
    """Return a belief of a layout as one of its extension, before any fix.

    Parameters
    ----------
    layout : StateLayout
        Of the belief.
    lasting_m : float
        B, along one axis.
    """
    both = _both(layout)
    covariances = both @ belief.covariances @ both.T
    covariances[:, -2:, -2:] += lasting_m**2 * np.eye(2)
    return replace(belief, means=belief.means @ both.T, covariances=covariances)


def extended_motion(
    motion: Motion, layout: StateLayout, lasting_m: float, memory_s: float, elapsed_s: float
) -> Motion:
    """Return motion of a layout as that of its extension.

    Parameters
    ----------
    motion : tuple of arrays
        Transition, noise and shift in the layout.
    memory_s, elapsed_s : float
        T and Δt.
    """
    transition, noise, shift = motion
    n, where, both = layout.size, [layout.east, layout.north], _both(layout)
    kept = exp(-elapsed_s / memory_s)
    wide = np.zeros((n + 2, n + 2))
    wide[:, :n] = both @ transition
    for axis, own in enumerate(where):
        wide[n + axis, own] -= kept
        wide[n + axis, n + axis] = kept
    spread = both @ noise @ both.T
    spread[n:, n:] += (1 - kept**2) * lasting_m**2 * np.eye(2)
    return wide, spread, both @ shift


def rescaled(layout: StateLayout, size: int, before_m: float, now_m: float) -> Motion:
    """Return motion of an extended layout by which the error that lasts has another deviation.

    Parameters
    ----------
    layout : StateLayout
        Without the extension.
    size : int
        Components of the state, whatever is behind the extension.
    before_m, now_m : float
        B.
    """
    transition, noise, n = np.eye(size), np.zeros((size, size)), layout.size
    left = min(now_m / before_m, 1.0)
    for axis, own in enumerate((layout.east, layout.north)):
        transition[n + axis, [n + axis, own]] = left, 1 - left
        noise[n + axis, n + axis] = max(now_m**2 - before_m**2, 0.0)
    return transition, noise, np.zeros(size)


def white_part(covariance_m2: Floats, lasting_m: float) -> Floats:
    """Return what is left of a fix's covariance beside the error that lasts.

    Examples
    --------
    >>> white_part(np.diag([100.0, 100.0]), 6.0).tolist()
    [[64.0, 0.0], [0.0, 64.0]]
    >>> white_part(np.diag([25.0, 25.0]), 6.0).tolist()
    [[7.5, 0.0], [0.0, 7.5]]
    """
    mean_m2 = float(np.trace(covariance_m2)) / 2
    return covariance_m2 * max(1 - lasting_m**2 / mean_m2, LEAST_WHITE)


def _both(layout: StateLayout) -> Floats:
    """Return the matrix that appends the position to a state."""
    return np.vstack([np.eye(layout.size), np.eye(layout.size)[[layout.east, layout.north]]])
