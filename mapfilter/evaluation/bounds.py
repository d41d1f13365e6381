"""The least error that any filter can have: the posterior Cramér-Rao bound.

``J(k+1) = (Q + Φ J(k)⁻¹ Φᵀ)⁻¹ + E{Hᵀ R⁻¹ H}`` for linear motion and additive Gaussian noise
(Tichavský, Muravchik & Nehorai 1998; Fritsche & Klein 2009, eq. 11; Zhang et al. 2006, eq. 7).
The expectation is over true states; Q is the true process noise, which may be singular.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError
from mapfilter.filters.gaussian import factor_of
from mapfilter.models.state import GaussianMeasurement, StateLayout

_BATCH = 20_000


def expected_information(measurement: GaussianMeasurement, states: Floats) -> Floats:
    """Return ``E{Hᵀ R⁻¹ H}`` at each step, by the mean over trials.

    Parameters
    ----------
    states : (T, K, n) array
        True states of T trials over K steps.

    Returns
    -------
    (K, n, n) array
        Expected Fisher information of the state at each step.
    """
    trials, steps, n = states.shape
    factor = np.linalg.cholesky(measurement.covariance())
    inverse = np.linalg.solve(factor, np.eye(len(factor)))
    found = np.empty((steps, n, n))
    batch = max(1, _BATCH // max(trials, 1))
    for first in range(0, steps, batch):
        block = slice(first, first + batch)
        whitened = inverse @ measurement.jacobian(states[:, block])
        # Over trials and components at once: one product of matrices for each step.
        tall = whitened.transpose(1, 0, 2, 3).reshape(whitened.shape[1], -1, n)
        found[block] = np.swapaxes(tall, -1, -2) @ tall / trials
    return found


def posterior_bound(
    transition: Floats, process: Floats, first_covariance: ArrayLike, information: Iterable[Floats]
) -> Floats:
    """Return the bound on the covariance of the error at each step.

    In place of J its inverse C is carried, ``C = L (I + Lᵀ E L)⁻¹ Lᵀ`` with
    ``L Lᵀ = Q + Φ C Φᵀ``: nothing singular is inverted.

    Parameters
    ----------
    transition, process : (n, n) arrays
        Φ and the true Q.
    first_covariance : (n, n) array_like
        Inverse of J(0), the covariance before the first step.
    information : iterable of (n, n) arrays
        Expected information of the readings of each step, 1 to K.

    Returns
    -------
    (K, n, n) array
        Lower bound on the covariance of the estimate after each step, 1 to K.

    Raises
    ------
    InputError
        A covariance is not symmetric or has a negative eigenvalue; information is not finite.
    """
    n = transition.shape[0]
    root = factor_of(first_covariance, n, "first_covariance")
    noise_root = factor_of(process, n, "process")
    found = []
    for step, gained in enumerate(information):
        if gained.shape != (n, n) or not np.isfinite(gained).all():
            faults = Faults()
            faults.add(f"information, step {step + 1}", f"finite numbers, {n} x {n}", gained)
            faults.raise_if_any(InputError)
        # The triangular factor of a sum of squares, without forming the sum.
        lower = np.linalg.qr(np.vstack([(transition @ root).T, noise_root.T]))[1].T
        inner = np.linalg.cholesky(np.eye(n) + lower.T @ gained @ lower)
        root = np.linalg.solve(inner, lower.T).T
        found.append(root @ root.T)
    return np.array(found).reshape(-1, n, n)


def bound_of(covariances: Floats, components: Iterable[int]) -> Floats:
    """Return the bound on the root mean square error of some components together, shape (K,).

    It is the root of the sum of their variances in (K, n, n) covariances.
    """
    return np.asarray(np.sqrt(sum(covariances[:, index, index] for index in components)))


def rmse_over_time(estimates: Floats, states: Floats, components: Iterable[int]) -> Floats:
    """Return the root mean square error over trials at each step, shape (K,).

    Squared errors of the components of (T, K, n) estimates and states are added.
    """
    chosen = list(components)
    error = estimates[..., chosen] - states[..., chosen]
    return np.asarray(np.sqrt(np.mean(np.sum(error**2, axis=-1), axis=0)))


def quantities(layout: StateLayout) -> dict[str, tuple[int, ...]]:
    """Return which components make location, velocity, bias and drift; those that there are.

    Examples
    --------
    >>> from mapfilter.models.state import MOVING
    >>> quantities(MOVING)
    {'location_m': (0, 2), 'velocity_mps': (1, 3)}
    """
    found = {
        "location_m": tuple(i for i in (layout.east, layout.north, layout.up) if i is not None),
        "velocity_mps": layout.velocity,
    }
    if layout.clock is not None:
        found |= {"bias_m": (layout.clock,), "drift_mps": (layout.clock + 1,)}
    return found
