"""Kalman-type filters step by step: prediction, update with the measurements present, smoothing.

The arithmetic of a step is that of :mod:`mapfilter.filters.trials`, for one belief.
"""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.filters.gaussian import Gaussian, Method, factor_of
from mapfilter.filters.trials import CompiledMeasurement, run_trials


class Taken(NamedTuple):
    """Outcome of an update.

    Parameters
    ----------
    evidence : float
        Log density of the reading given those before it; NaN where the update failed.
    nis : float
        Normalised innovation squared, of as many degrees of freedom as components are present.
    """

    evidence: float
    nis: float

    @property
    def used(self) -> bool:
        """Whether the belief has changed by it."""
        return isfinite(self.evidence)


def predict(
    belief: Gaussian, transition: Floats, process: Floats, shift: ArrayLike = 0.0
) -> Gaussian:
    """Return the belief after linear motion: ``Φ m + u``, ``Φ P Φᵀ + Q``.

    The transition is Φ, the process noise Q, and the shift u, such as the displacement by dead
    reckoning.

    Examples
    --------
    >>> still = Gaussian(np.zeros(1), np.eye(1))
    >>> moved = predict(still, np.eye(1), 3.0 * np.eye(1), [5.0])
    >>> moved.mean.tolist(), moved.covariance.tolist()
    ([5.0], [[4.0]])
    """
    mean = transition @ belief.mean + np.asarray(shift, dtype=np.float64)
    covariance = transition @ belief.covariance @ transition.T + process
    return Gaussian(mean, 0.5 * (covariance + covariance.T))


def update(
    belief: Gaussian, measurement: CompiledMeasurement, reading: ArrayLike, method: Method
) -> tuple[Gaussian, Taken]:
    """Return the belief after a reading (NaN where absent), and the outcome of the update.

    Raises
    ------
    InputError
        Sizes do not fit, the belief's covariance is none, or the reading is infinite.
    """
    n = belief.mean.size
    given, still = np.asarray(reading, dtype=np.float64)[None, None], (np.eye(n), np.zeros((n, n)))
    start = (belief.mean, belief.covariance)
    run = run_trials(measurement, *still, method, *start, given, covariances=True)
    taken = Taken(float(run.evidence[0, 0]), float(run.nis[0, 0]))
    return (Gaussian(run.means[0, 0], run.covariances[0, 0]) if taken.used else belief), taken


def as_belief(mean: ArrayLike, covariance: ArrayLike) -> Gaussian:
    """Check a mean and a covariance and make them a belief.

    Raises
    ------
    InputError
        The covariance has another size, is not symmetric, or has a negative eigenvalue.
    """
    centre = np.asarray(mean, dtype=np.float64)
    factor_of(covariance, centre.size)
    return Gaussian(centre, np.array(covariance, dtype=np.float64))


class Smoothed(NamedTuple):
    """Smoothed beliefs of T trials over K steps: means (T, K, n), covariances (T, K, n, n)."""

    means: Floats
    covariances: Floats


def smooth(transition: Floats, process: Floats, means: Floats, covariances: Floats) -> Smoothed:
    """Smooth the beliefs of any filter whose motion is linear (Rauch, Tung & Striebel 1965).

    ``x_s = x + G (x_s⁺ - Φ x)`` with ``G = P Φᵀ M⁻¹`` and M the covariance predicted. The
    covariance takes the form ``(I - GΦ) P (I - GΦ)ᵀ + G (P_s⁺ + Q) Gᵀ``, a sum of what cannot be
    negative.

    Parameters
    ----------
    transition, process : (n, n) or (K - 1, n, n) arrays
        Φ and Q, the same for all steps or from each step to the next.
    means, covariances : (T, K, n) and (T, K, n, n) arrays
        Of the updated beliefs.

    Raises
    ------
    InputError
        Sizes that do not fit.
    """
    trials, steps, n = means.shape
    if covariances.shape != (trials, steps, n, n) or transition.shape[-2:] != (n, n):
        expected = f"shape {(trials, steps, n, n)}"
        raise fail(InputError, "covariances", expected, covariances.shape)
    phi = np.broadcast_to(transition, (max(steps - 1, 0), n, n))
    noise = np.broadcast_to(process, (max(steps - 1, 0), n, n))
    smoothed, spread = means.copy(), covariances.copy()
    for k in range(steps - 2, -1, -1):
        own = covariances[:, k]
        predicted = phi[k] @ own @ phi[k].T + noise[k]
        # Scaled to correlations: a clock's bias may be known a million times worse than a speed.
        scale = np.sqrt(np.maximum(np.diagonal(predicted, axis1=-2, axis2=-1), 1e-300))
        unit = predicted / (scale[:, :, None] * scale[:, None, :])
        cross = (phi[k] @ own) / scale[:, :, None]
        gain = np.swapaxes(_solved(unit, cross), -1, -2) / scale[:, None, :]
        ahead = smoothed[:, k + 1] - means[:, k] @ phi[k].T
        smoothed[:, k] = means[:, k] + np.einsum("tij,tj->ti", gain, ahead)
        rest = np.eye(n) - gain @ phi[k]
        later = spread[:, k + 1] + noise[k]
        both = rest @ own @ np.swapaxes(rest, -1, -2) + gain @ later @ np.swapaxes(gain, -1, -2)
        spread[:, k] = 0.5 * (both + np.swapaxes(both, -1, -2))
    return Smoothed(smoothed, spread)


def _solved(unit: Floats, cross: Floats) -> Floats:
    """Solve for the gains of T trials; a component may be known, or follow from others."""
    try:
        return np.asarray(np.linalg.solve(unit, cross))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(unit, hermitian=True) @ cross)
