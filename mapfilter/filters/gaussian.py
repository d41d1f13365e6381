"""Gaussian beliefs, and the ways in which Kalman-type filters take readings in."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Annotated

import numpy as np
from annotated_types import Ge
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.options import Options, Positive


@dataclass(frozen=True, eq=False)
class Gaussian:
    """A belief: mean (n,) and covariance (n, n), symmetric and without negative eigenvalues."""

    mean: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True)
class SigmaPoints(Options):
    """Where sigma points lie, by Wan & van der Merwe (2000).

    ``λ = α² (n + κ) - n``; the points are the mean and the mean ± the columns of
    ``sqrt(n + λ) L``, L the lower Cholesky factor of the covariance; the weights of the mean are
    ``λ / (n + λ)`` and, in covariances, 1 - α² + β more.

    Parameters
    ----------
    alpha : float
        How far out, 1 for a good sample of wide beliefs.
    beta : float
        2 is best for Gaussian beliefs.
    kappa : float
        More than -n.
    """

    alpha: Positive = 1e-3
    beta: float = 2.0
    kappa: float = 0.0

    def spread(self, size: int) -> float:
        """Return ``sqrt(n + λ) = α sqrt(n + κ)`` for a state of n components.

        Raises
        ------
        InputError
            n + κ is not positive.
        """
        if size + self.kappa <= 0:
            raise fail(InputError, "sigma points, kappa", f"more than -{size}", self.kappa)
        return self.alpha * sqrt(size + self.kappa)

    @property
    def bend_weight(self) -> float:
        """Weight of the squared mean shift in the covariance, β - α²."""
        return self.beta - self.alpha**2


CUBATURE = SigmaPoints(1.0, 0.0, 0.0)
"""Spherical-radial cubature of degree 3 (Arasaratnam & Haykin 2009): sigma points without a
centre."""


@dataclass(frozen=True, slots=True)
class Method(Options):
    """How a Kalman-type filter takes readings in.

    Parameters
    ----------
    name : str
        As ``--filter`` takes it.
    sigma : SigmaPoints or None
        Sigma points; None for linearisation.
    iterations : int
        1 linearises at the prediction; more find the most probable state by Gauss-Newton steps,
        at most so many.
    """

    name: str
    sigma: SigmaPoints | None = None
    iterations: Annotated[int, Ge(1)] = 1


EKF = Method("ekf")
"""Extended Kalman filter; on linear problems the Kalman filter."""

IEKF = Method("iekf", iterations=30)
"""Iterated extended Kalman filter (Bell & Cathey 1993), its steps halved where they lead up."""

RBUKF = Method("rbukf", SigmaPoints())
"""Rao-Blackwellised unscented Kalman filter (Fritsche & Klein 2009, Table I)."""

UKF = Method("ukf", SigmaPoints(1.0, 2.0, 0.0))
"""Unscented Kalman filter with points far out; with linear motion its time update is exact."""

CKF = Method("ckf", CUBATURE)
"""Cubature Kalman filter."""

METHODS = {method.name: method for method in (EKF, IEKF, RBUKF, UKF, CKF)}
"""The methods by name."""


def factors_of(covariances: Floats, size: int) -> Floats:
    """Return a factor of each of (k, n, n) covariances, as by :func:`factor_of`.

    Those that are positive definite are factored together.

    Raises
    ------
    InputError
        One of them is no covariance.
    """
    if covariances.shape[1:] != (size, size):
        return np.array([factor_of(one, size) for one in covariances])
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    if np.isfinite(covariances).all() and (variances > 0).all():
        unit = np.sqrt(variances)
        off = np.abs(covariances - covariances.transpose(0, 2, 1))
        if (off <= 1e-9 * np.abs(covariances)).all():
            try:
                correlations = covariances / (unit[:, :, None] * unit[:, None, :])
                return np.asarray(unit[:, :, None] * np.linalg.cholesky(correlations))
            except np.linalg.LinAlgError:
                pass
    return np.array([factor_of(one, size) for one in covariances])


def factor_of(covariance: ArrayLike, size: int, where: str = "covariance") -> Floats:
    """Return T with ``T Tᵀ`` equal to a covariance, which may be singular.

    Raises
    ------
    InputError
        It has another size, is not symmetric, not finite, or has a negative eigenvalue.

    Examples
    --------
    >>> factor_of([[4.0, 2.0], [2.0, 1.0]], 2).round(12).tolist()
    [[2.0, 0.0], [1.0, 0.0]]
    """
    faults = Faults()
    found = np.asarray(covariance, dtype=np.float64)
    if found.shape != (size, size):
        faults.add(where, f"shape ({size}, {size})", found.shape)
    elif not np.isfinite(found).all():
        faults.add(where, "finite numbers", "NaN or infinity")
    elif not np.allclose(found, found.T, rtol=1e-9, atol=0):
        faults.add(where, "a symmetric matrix", "one that is not")
    elif (np.diagonal(found) < 0).any():
        faults.add(where, "variances >= 0", np.diagonal(found).min(), "a negative variance")
    faults.raise_if_any(InputError)
    # Scaled to correlations, components of very different units are judged alike.
    scale = np.sqrt(np.diagonal(found))
    unit = np.where(scale > 0, scale, 1.0)
    correlation = found / np.outer(unit, unit)
    try:
        return np.asarray(unit[:, None] * np.linalg.cholesky(correlation))
    except np.linalg.LinAlgError:
        lowest, vectors = np.linalg.eigh(0.5 * (correlation + correlation.T))
    if lowest[0] < -1e-9 * size:
        faults.add(where, "no negative eigenvalue", f"{lowest[0]:.3g} (of correlations)")
        faults.raise_if_any(InputError)
    root = (vectors * np.sqrt(np.maximum(lowest, 0.0))).T
    triangle = np.linalg.qr(root)[1].T
    triangle = triangle * np.where(np.diagonal(triangle) < 0, -1.0, 1.0)
    return np.asarray(unit[:, None] * triangle)
