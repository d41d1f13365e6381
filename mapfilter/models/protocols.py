"""The two protocols of measurement models.

A :class:`Likelihood` says how probable a reading is in a state and draws one. Cell identities,
censored levels and ambiguous neighbours are only this. A :class:`GaussianMeasurement` is a function
of the state with additive Gaussian noise; one such object serves five uses: a simulator samples
it, an extended Kalman filter linearises it, sigma points go through it, particle filters weigh
with it, and the Cramér-Rao recursion takes its Fisher information.

States are arrays of shape (..., n): every method takes one state or a batch of them.
"""

from __future__ import annotations

from typing import Protocol, TypeVar, runtime_checkable

import numpy as np

from mapfilter._types import Floats

ReadingT = TypeVar("ReadingT")


@runtime_checkable
class Likelihood(Protocol[ReadingT]):
    """How probable a reading is, given the state."""

    def log_likelihood(self, state: Floats, reading: ReadingT) -> Floats:
        """Return the natural logarithm of the likelihood.

        Parameters
        ----------
        state : (..., n) array
        reading : object
            What was measured; what is absent of it does not count.

        Returns
        -------
        (...) array
        """

    def sample(self, state: Floats, rng: np.random.Generator) -> ReadingT:
        """Draw a reading in a state."""


@runtime_checkable
class GaussianMeasurement(Likelihood[Floats], Protocol):
    """A function of the state with additive Gaussian noise; readings are (..., m) arrays.

    A component that is absent is NaN in the reading.
    """

    def mean(self, state: Floats) -> Floats:
        """Return the expected reading, shape (..., m)."""

    def jacobian(self, state: Floats) -> Floats:
        """Return the derivative of the mean by the state, shape (..., m, n)."""

    def covariance(self) -> Floats:
        """Return the covariance of the noise, shape (m, m), in squared units of the reading."""


def fisher_information(measurement: GaussianMeasurement, state: Floats) -> Floats:
    """Return the Fisher information of one reading about the state, ``Hᵀ R⁻¹ H``.

    Parameters
    ----------
    measurement : GaussianMeasurement
    state : (..., n) array
        True states.

    Returns
    -------
    (..., n, n) array
    """
    slope = measurement.jacobian(state)
    factor = np.linalg.cholesky(measurement.covariance())
    # R⁻¹ is never formed.
    whitened = np.linalg.solve(factor, slope)
    return np.asarray(np.swapaxes(whitened, -1, -2) @ whitened)
