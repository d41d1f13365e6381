"""Kalman-type filters step by step: predict, then update with whatever was measured.

The arithmetic is that of :mod:`mapfilter.filters.trials`, for one belief.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian, Method, factor_of
from mapfilter.filters.trials import CompiledMeasurement, run_trials


@dataclass(frozen=True, slots=True)
class Taken:
    """News of an update.

    Parameters
    ----------
    evidence : float
        Log density of the reading before it was known; NaN where it could not be taken in.
    nis : float
        Normalised innovation squared, of as many degrees of freedom as components were there.
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

    Parameters
    ----------
    belief : Gaussian
    transition, process : (n, n) arrays
        Φ and Q.
    shift : (n,) array_like
        u, such as the way by dead reckoning.

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
    """Return the belief after a reading, and the news.

    Parameters
    ----------
    belief : Gaussian
    measurement : CompiledMeasurement
    reading : (m,) array_like
        NaN where absent.
    method : Method

    Raises
    ------
    InputError
        Sizes do not fit, the belief's covariance is none, or the reading is infinite.
    """
    n = belief.mean.size
    run = run_trials(
        measurement, np.eye(n), np.zeros((n, n)), method, belief.mean, belief.covariance,
        np.asarray(reading, dtype=np.float64)[None, None], covariances=True,
    )  # fmt: skip
    news = Taken(float(run.evidence[0, 0]), float(run.nis[0, 0]))
    return (Gaussian(run.means[0, 0], run.covariances[0, 0]) if news.used else belief), news


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
