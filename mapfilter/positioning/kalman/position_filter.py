"""The positioning Kalman filter (PKF): a linear Kalman filter over static fixes.

Each epoch's readings are first solved for a fix, whose covariance is the noise of the measurement;
motion then smooths it. Epochs without a fix are bridged by motion alone, and what they held of
readings is lost: that is what filters that take the readings themselves gain (DLR, section 3.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats
from mapfilter.errors import InputError, fail
from mapfilter.filters.gaussian import EKF, Gaussian
from mapfilter.filters.kalman import as_belief, predict, update
from mapfilter.models.motion import LinearMotion
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.models import compiled
from mapfilter.positioning.kalman.static_fix import StaticFix


@dataclass(frozen=True, eq=False)
class PositionTrack:
    """What a PKF makes of K epochs.

    Parameters
    ----------
    means : (K, n) array
    covariances : (K, n, n) array
    used : (K,) array of bool
        Epochs that had a fix.
    """

    means: Floats
    covariances: Floats
    used: Bools


def filter_fixes(
    layout: StateLayout,
    motion: LinearMotion,
    first_mean: ArrayLike,
    first_covariance: ArrayLike,
    fixes: Sequence[StaticFix],
) -> PositionTrack:
    """Filter static fixes: predict, then update where there is one.

    Parameters
    ----------
    layout : StateLayout
        Of the filter.
    motion : LinearMotion
        Over one epoch.
    first_mean : (n,) array_like
        Before the first epoch.
    first_covariance : (n, n) array_like
    fixes : sequence of StaticFix
        Whose first components are east, north and, where the filter has a height, up; all of these
        solved for.

    Raises
    ------
    InputError
        Sizes that do not fit, or a covariance that is none.

    Examples
    --------
    >>> from mapfilter.models.motion import random_walk
    >>> from mapfilter.models.state import POSITION
    >>> fixes = [StaticFix(np.array([10.0, 0.0]), np.eye(2), True, 1),
    ...          StaticFix(np.full(2, np.nan), np.full((2, 2), np.nan), False, 0)]
    >>> track = filter_fixes(POSITION, random_walk(1.0, 1.0), [0.0, 0.0], np.zeros((2, 2)), fixes)
    >>> track.means.round(9).tolist(), track.used.tolist()
    ([[5.0, 0.0], [5.0, 0.0]], [True, False])
    """
    belief = as_belief(first_mean, first_covariance)
    n, size = layout.size, 2 if layout.up is None else 3
    if belief.mean.shape != (n,) or motion.size != n:
        got = f"{belief.mean.size} and {motion.size}"
        raise fail(InputError, "PKF", f"a start and a motion of {n} components", got)
    means, covariances = np.empty((len(fixes), n)), np.empty((len(fixes), n, n))
    used = np.array([fix.ok for fix in fixes], dtype=np.bool_)
    for k, fix in enumerate(fixes):
        belief = predict(belief, motion.transition, motion.noise)
        if fix.ok:
            belief = _updated(belief, layout, fix, size)
        means[k], covariances[k] = belief.mean, belief.covariance
    return PositionTrack(means, covariances, used)


def _updated(belief: Gaussian, layout: StateLayout, fix: StaticFix, size: int) -> Gaussian:
    if len(fix.covariance) < size or fix.state.size < size:
        raise fail(InputError, "fix", f"{size} components of the position", len(fix.covariance))
    model = position_fix(layout, fix.covariance[:size, :size])
    after, _ = update(belief, compiled(model), fix.state[:size], EKF)
    return after
