"""A static fix from one reading: weighted least squares by Gauss-Newton steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError
from mapfilter.models.state import GaussianMeasurement

TOO_FEW = "not enough measurements"
BAD_GEOMETRY = "bad geometry"
UNSETTLED = "steps that do not resolve_alternative"

_ITERATIONS = 50
_SETTLED_M = 1e-9
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
        Whether the reading determines the state and the steps settled.
    iterations : int
    problem : str
        Why there is no fix: one of :data:`TOO_FEW`, :data:`BAD_GEOMETRY` and :data:`UNSETTLED`;
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
    """Solve for the state that explains a reading best.

    Each step minimises the residuals linearised, by an orthogonal decomposition; a step that does
    not lower the sum of squares is halved.

    Parameters
    ----------
    measurement : GaussianMeasurement
    reading : (m,) array_like
        NaN where absent.
    start : (n,) array_like
        Where to begin; components that are not solved for stay as they are.
    unknowns : sequence of int, optional
        Components to solve for; all without.
    largest_deviation : float, optional
        Largest standard deviation in any direction of the unknowns that is still a fix; a worse one
        is bad geometry. Without it only what determines nothing is.

    Raises
    ------
    InputError
        The start is not finite or the reading infinite.
    """
    state, given = np.array(start, dtype=np.float64), np.asarray(reading, dtype=np.float64)
    faults = Faults()
    if not np.isfinite(state).all():
        faults.add("start", "finite numbers", "NaN or infinity")
    if np.isinf(given).any():
        faults.add("reading", "finite numbers, or NaN where absent", "infinity")
    faults.raise_if_any(InputError)
    free = list(range(state.size)) if unknowns is None else list(unknowns)
    present = np.isfinite(given)

    def nothing(problem: str, iterations: int = 0) -> StaticFix:
        unknown = np.full((len(free), len(free)), np.nan)
        return StaticFix(np.full(state.size, np.nan), unknown, False, iterations, problem)

    if present.sum() < len(free):
        return nothing(TOO_FEW)
    factor = np.linalg.cholesky(measurement.covariance()[np.ix_(present, present)])

    def whitened(at: Floats) -> Floats:
        return np.asarray(np.linalg.solve(factor, (given - measurement.mean(at))[present]))

    residual = whitened(state)
    for iteration in range(1, _ITERATIONS + 1):
        slope = np.linalg.solve(factor, measurement.jacobian(state)[present][:, free])
        left, values, right = np.linalg.svd(slope, full_matrices=False)
        if values[-1] <= _LOWEST_RATIO * values[0]:
            return nothing(BAD_GEOMETRY, iteration)
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
        if np.abs(length * move).max() <= _SETTLED_M * (1 + np.abs(state[free]).max()):
            if largest_deviation is not None and values[-1] * largest_deviation < 1:
                return nothing(BAD_GEOMETRY, iteration)
            covariance = (right.T / values**2) @ right
            return StaticFix(state, covariance, True, iteration)
    return nothing(UNSETTLED, _ITERATIONS)
