"""Linear models of motion: ``x(k+1) = Φ x(k) + w``, w normal with covariance Q.

A receiver clock has two components: its bias c₀·δt in metres and the rate of it in metres per
second. Its process noise comes from the Allan variance parameters h0, h-1 and h-2 of the oscillator
(Brown & Hwang; Fritsche & Klein 2009, section III-B).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.options import NotNegative, Options


@dataclass(frozen=True, slots=True)
class Oscillator(Options):
    """Parameters of a clock's Allan variance.

    Parameters
    ----------
    h0 : float
        White frequency noise, seconds.
    h_minus1 : float
        Flicker frequency noise, no unit.
    h_minus2 : float
        Random walk of the frequency, 1/s.
    """

    h0: NotNegative
    h_minus1: NotNegative
    h_minus2: NotNegative


QUARTZ = Oscillator(9.4e-20, 1.8e-19, 3.8e-21)
"""A typical quartz standard (Fritsche & Klein 2009, section III-B, from Mao et al. 2003)."""


def clock_noise(
    interval_s: float,
    oscillator: Oscillator = QUARTZ,
    cross_term: Literal["as_printed", "textbook"] = "as_printed",
) -> Floats:
    """Return the covariance of bias and drift gained over an interval, (2, 2), in m² and m²/s².

    ``Q11 = h0 T/2 + 2 h-1 T² + 2/3 π² h-2 T³``, ``Q12 = 2 h-1 T + π² h-2 T²`` and
    ``Q22 = h0/(2T) + 2 h-1 + 8/3 π² h-2 T``, each times c₀².

    Parameters
    ----------
    interval_s : float
        T, above 0.
    oscillator : Oscillator
        The clock's noise.
    cross_term : {"as_printed", "textbook"}
        Fritsche & Klein print T³ in Q12, where the dimension asks for T². As printed, the result
        is no covariance for long intervals (of :data:`QUARTZ`: 2 s).
    """
    t = _positive(interval_s)
    h0, h1, h2 = oscillator.h0, oscillator.h_minus1, oscillator.h_minus2
    power = 3 if cross_term == "as_printed" else 2
    bias = h0 * t / 2 + 2 * h1 * t**2 + 2 / 3 * np.pi**2 * h2 * t**3
    cross = 2 * h1 * t + np.pi**2 * h2 * t**power
    drift = h0 / (2 * t) + 2 * h1 + 8 / 3 * np.pi**2 * h2 * t
    return np.array([[bias, cross], [cross, drift]]) * LIGHT_MPS**2


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """Change of a state over one interval.

    Parameters
    ----------
    transition : (n, n) array
        Φ.
    noise : (n, n) array
        Q, positive semidefinite; it may be singular.
    """

    transition: Floats
    noise: Floats

    def __post_init__(self) -> None:
        faults = Faults()
        phi, noise = self.transition, self.noise
        if phi.ndim != 2 or phi.shape[0] != phi.shape[1] or phi.shape != noise.shape:
            faults.add(
                "motion", "two square matrices of one shape", f"{phi.shape} and {noise.shape}"
            )
            faults.raise_if_any(InputError)
        if not (np.isfinite(phi).all() and np.isfinite(noise).all()):
            faults.add("motion", "finite numbers", "NaN or infinity")
        elif not np.allclose(noise, noise.T, rtol=1e-9):
            faults.add("motion, noise", "a symmetric matrix", "one that is not")
        elif np.linalg.eigvalsh(noise)[0] < -1e-9 * max(np.abs(noise).max(), 1e-300):
            faults.add("motion, noise", "no negative eigenvalue", np.linalg.eigvalsh(noise)[0])
        faults.raise_if_any(InputError)

    @property
    def size(self) -> int:
        """Number of components of the state."""
        return int(self.transition.shape[0])

    def sample(self, state: Floats, rng: np.random.Generator) -> Floats:
        """Draw the next states for states of shape (..., n)."""
        values, vectors = np.linalg.eigh(self.noise)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        drawn = rng.standard_normal(np.shape(state)) @ root.T
        return np.asarray(state @ self.transition.T + drawn)


def constant_velocity(
    interval_s: float,
    sigma_mps2: ArrayLike,
    dimensions: int = 2,
    noise: Literal["piecewise", "continuous"] = "piecewise",
) -> LinearMotion:
    """Return motion at nearly constant velocity: position and rate for each dimension.

    Parameters
    ----------
    interval_s : float
        T, above 0.
    sigma_mps2 : float or (dimensions,) array_like
        With ``piecewise`` noise the standard deviation of an acceleration that is constant within
        an interval, ``Q = σ² γγᵀ`` with ``γ = [T²/2, T]`` (Fritsche & Klein 2009, eq. 8; Zhang et
        al. 2006, eqs. 1 and 2). With ``continuous`` noise the root of the power density of white
        acceleration, m/s^1.5: ``Q = σ² [[T³/3, T²/2], [T²/2, T]]`` (Bar-Shalom, Li & Kirubarajan
        2001, eq. 6.2.2-4), whose sum does not depend on how time is cut up.
    dimensions : int
        Number of positions.
    noise : {"piecewise", "continuous"}
        Which kind of acceleration.

    Examples
    --------
    >>> constant_velocity(2.0, 1.0, dimensions=1).noise.tolist()
    [[4.0, 4.0], [4.0, 4.0]]
    """
    t = _positive(interval_s)
    from scipy.linalg import block_diag

    sigma = np.broadcast_to(np.asarray(sigma_mps2, dtype=np.float64), (dimensions,))
    if not (np.isfinite(sigma) & (sigma >= 0)).all():
        raise fail(InputError, "sigma_mps2", "m/s² >= 0", sigma)
    if noise == "piecewise":
        gain = np.array([t**2 / 2, t])
        unit = np.outer(gain, gain)
    else:
        unit = np.array([[t**3 / 3, t**2 / 2], [t**2 / 2, t]])
    phi = np.asarray(np.kron(np.eye(dimensions), [[1.0, t], [0.0, 1.0]]), dtype=np.float64)
    return LinearMotion(phi, np.asarray(block_diag(*(one**2 * unit for one in sigma))))


def random_walk(interval_s: float, sigma_m: float, dimensions: int = 2) -> LinearMotion:
    """Return a random walk: ``Q = σ² T I``, σ in metres per root second.

    Examples
    --------
    >>> random_walk(4.0, 3.0).noise.tolist()
    [[36.0, 0.0], [0.0, 36.0]]
    """
    t = _positive(interval_s)
    if not (np.isfinite(sigma_m) and sigma_m >= 0):
        raise fail(InputError, "sigma_m", "metres >= 0", sigma_m)
    return LinearMotion(np.eye(dimensions), sigma_m**2 * t * np.eye(dimensions))


def clock_motion(
    interval_s: float,
    oscillator: Oscillator = QUARTZ,
    cross_term: Literal["as_printed", "textbook"] = "as_printed",
) -> LinearMotion:
    """Return the motion of a receiver clock's bias (m) and drift (m/s), see :func:`clock_noise`.

    Raises
    ------
    InputError
        The interval is not positive, or too long for the cross term as printed.
    """
    noise = clock_noise(interval_s, oscillator, cross_term)
    if cross_term == "as_printed" and noise[0, 1] ** 2 > noise[0, 0] * noise[1, 1] * (1 + 1e-9):
        expected = "an interval so short that the cross term as printed leaves a covariance"
        hint = 'T³ where T² is due; take cross_term="textbook"'
        raise fail(InputError, "interval_s", expected, f"{interval_s} s", hint)
    return LinearMotion(np.array([[1.0, float(interval_s)], [0.0, 1.0]]), noise)


def together(parts: Sequence[LinearMotion]) -> LinearMotion:
    """Return the motion of several independent parts of a state, one after the other."""
    from scipy.linalg import block_diag

    if not parts:
        raise fail(InputError, "motion", "at least one part", "none")
    return LinearMotion(
        np.asarray(block_diag(*(part.transition for part in parts))),
        np.asarray(block_diag(*(part.noise for part in parts))),
    )


def scaled(motion: LinearMotion, factor: float) -> LinearMotion:
    """Return the same motion with its noise times a factor >= 0."""
    if not (np.isfinite(factor) and factor >= 0):
        raise fail(InputError, "factor", "a number >= 0", factor)
    return LinearMotion(motion.transition, factor * motion.noise)


def _positive(interval_s: float) -> float:
    if not (np.isfinite(interval_s) and interval_s > 0):
        raise fail(InputError, "interval_s", "seconds above 0", interval_s)
    return float(interval_s)
