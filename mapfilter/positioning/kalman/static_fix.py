"""Static fixes from single readings, and the positioning Kalman filter (PKF) over them.

A fix is solved for by weighted least squares, with Gauss-Newton steps. The PKF takes the fix's
covariance as the noise of a measurement, and motion smooths it. Epochs without a fix are bridged by
motion alone, and their readings are lost: that is what filters that take the readings themselves
gain (DLR, section 3.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.filters.gaussian import EKF
from mapfilter.filters.kalman import as_belief, predict, update
from mapfilter.models.motion import LinearMotion
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import GaussianMeasurement, StateLayout
from mapfilter.positioning.kalman.models import compiled

TOO_FEW = "not enough measurements"
BAD_GEOMETRY = "bad geometry"
NOT_CONVERGED = "steps that do not converge"

_ITERATIONS = 50
_CONVERGED_M = 1e-9
_LOWEST_RATIO = 1e-7


@dataclass(frozen=True, eq=False)
class StaticFix:
    """A state from one reading.

    Parameters
    ----------
    state : (n,) array
        NaN where there is no fix.
    covariance : (u, u) array
        Of the components solved for, ``(Hᵀ R⁻¹ H)⁻¹``; NaN where there is no fix.
    ok : bool
        Whether the reading determines the state and the steps converged.
    iterations : int
        Gauss-Newton steps taken.
    problem : str
        Why there is no fix: one of :data:`TOO_FEW`, :data:`BAD_GEOMETRY` and :data:`NOT_CONVERGED`;
        empty where there is one.
    """

    state: Floats
    covariance: Floats
    ok: bool
    iterations: int
    problem: str = ""


def static_fix(
    measurement: GaussianMeasurement,
    reading: ArrayLike,
    start: ArrayLike,
    unknowns: Sequence[int] | None = None,
    largest_deviation: float | None = None,
) -> StaticFix:
    """Solve for the most likely state given one reading.

    Each step minimises the residuals linearised, by an orthogonal decomposition; a step that does
    not lower the sum of squares is halved.

    Parameters
    ----------
    reading : (m,) array_like
        NaN where absent.
    start : (n,) array_like
        First state; components that are not solved for keep its values.
    unknowns : sequence of int, optional
        Components to solve for; by default all.
    largest_deviation : float, optional
        Largest standard deviation in any direction of the unknowns that is still a fix; a worse one
        is bad geometry. Without it only a reading that leaves a direction undetermined is.

    Raises
    ------
    InputError
        The start is not finite, or the reading infinite or of another length.
    """
    state, given = np.array(start, dtype=np.float64), np.asarray(reading, dtype=np.float64)
    faults = Faults()
    if not np.isfinite(state).all():
        faults.add("start", "finite numbers", "NaN or infinity")
    if np.isinf(given).any():
        faults.add("reading", "finite numbers, or NaN where absent", "infinity")
    noise = measurement.covariance()
    if given.shape != noise.shape[:1]:
        faults.add(
            "reading", f"shape ({len(noise)},)", given.shape, "another measurement's reading"
        )
    faults.raise_if_any(InputError)
    free = list(range(state.size)) if unknowns is None else list(unknowns)
    present = np.isfinite(given)

    def failed(problem: str, iterations: int = 0) -> StaticFix:
        unknown = np.full((len(free), len(free)), np.nan)
        return StaticFix(np.full(state.size, np.nan), unknown, False, iterations, problem)

    if present.sum() < len(free):
        return failed(TOO_FEW)
    factor = np.linalg.cholesky(noise[np.ix_(present, present)])

    def whitened(at: Floats) -> Floats:
        return np.asarray(np.linalg.solve(factor, (given - measurement.mean(at))[present]))

    residual = whitened(state)
    for iteration in range(1, _ITERATIONS + 1):
        slope = np.linalg.solve(factor, measurement.jacobian(state)[present][:, free])
        left, values, right = np.linalg.svd(slope, full_matrices=False)
        if values[-1] <= _LOWEST_RATIO * values[0]:
            return failed(BAD_GEOMETRY, iteration)
        move = right.T @ (left.T @ residual / values)
        length = 1.0
        while length > 1e-6:
            tried = state.copy()
            tried[free] += length * move
            better = whitened(tried)
            # Rounding of ranges of 2e7 m alone may raise the sum by a hair.
            if better @ better <= residual @ residual * (1 + 1e-9) + 1e-12:
                break
            length /= 2
        state, residual = tried, better
        if np.abs(length * move).max() <= _CONVERGED_M * (1 + np.abs(state[free]).max()):
            if largest_deviation is not None and values[-1] * largest_deviation < 1:
                return failed(BAD_GEOMETRY, iteration)
            covariance = (right.T / values**2) @ right
            return StaticFix(state, covariance, True, iteration)
    return failed(NOT_CONVERGED, _ITERATIONS)


class PositionTrack(NamedTuple):
    """Beliefs of a PKF after each of K epochs, with n components of the state.

    Parameters
    ----------
    means, covariances : (K, n) and (K, n, n) arrays
        The beliefs.
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
    motion : LinearMotion
        Over one epoch.
    first_mean, first_covariance : (n,) and (n, n) array_like
        The belief before the first epoch.
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
    for k, fix in enumerate(fixes):
        belief = predict(belief, motion.transition, motion.noise)
        if fix.ok:
            if len(fix.covariance) < size or fix.state.size < size:
                expected = f"{size} components of the position"
                raise fail(InputError, "fix", expected, len(fix.covariance))
            model = position_fix(layout, fix.covariance[:size, :size])
            belief, _ = update(belief, compiled(model), fix.state[:size], EKF)
        means[k], covariances[k] = belief.mean, belief.covariance
    return PositionTrack(means, covariances, np.array([fix.ok for fix in fixes], dtype=np.bool_))
