"""Correlated Gaussian fields as sums of sinusoids, evaluated at any position.

``S(x) = √(2/N) Σ cos(k_n · x + θ_n)``, with wave vectors drawn from the spectral density of the
autocorrelation ``exp(-d / d_c)`` and uniform phases (Cai & Giannakis 2003, *A two-dimensional
channel simulation model for shadowing processes*, IEEE Trans. Veh. Technol. 52(6); Pätzold & Nguyen
2004, *A spatial simulation model for shadow fading processes in mobile radio channels*, PIMRC). In
the plane that density is ``∝ (1 + k²d_c²)^(-3/2)``. Wave numbers are stratified: one from each of N
classes of equal power.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats

COUNT = 192
"""Sinusoids of a field."""
_AT_A_TIME = 2048


@dataclass(frozen=True, eq=False)
class SinusoidField:
    """A zero-mean field of unit variance over the plane.

    Parameters
    ----------
    east_per_m, north_per_m : (N,) arrays
        Wave vectors, rad/m.
    phase_rad : (N,) array
    """

    east_per_m: Floats
    north_per_m: Floats
    phase_rad: Floats

    @classmethod
    def draw(
        cls, correlation_m: float, rng: np.random.Generator, count: int = COUNT
    ) -> SinusoidField:
        """Draw a field of correlation ``exp(-d / correlation_m)``.

        Parameters
        ----------
        correlation_m : float
            Distance at which the correlation is 1/e, above 0.
        rng : numpy.random.Generator
        count : int
            Sinusoids; the more, the closer to Gaussian.
        """
        below = (np.arange(count) + rng.random(count)) / count
        # The share of the power below wave number k is 1 - 1/√(1 + k²d_c²).
        wave = np.sqrt((1.0 - below) ** -2 - 1.0) / correlation_m
        direction = rng.uniform(0.0, 2 * np.pi, count)
        phase = rng.uniform(0.0, 2 * np.pi, count)
        return cls(wave * np.cos(direction), wave * np.sin(direction), phase)

    def at(self, east_m: ArrayLike, north_m: ArrayLike) -> Floats:
        """Return the field at positions, shape (M,)."""
        east, north = (np.asarray(axis, dtype=np.float64) for axis in (east_m, north_m))
        found = np.empty(east.shape)
        for begin in range(0, east.size, _AT_A_TIME):
            part = slice(begin, begin + _AT_A_TIME)
            angle = np.multiply.outer(east[part], self.east_per_m)
            angle += np.multiply.outer(north[part], self.north_per_m)
            found[part] = np.cos(angle + self.phase_rad).sum(axis=1)
        return np.asarray(found * np.sqrt(2.0 / self.phase_rad.size))


def gauss_markov(time_s: Floats, correlation_s: float, rng: np.random.Generator) -> Floats:
    """Draw a stationary Gauss-Markov process of unit variance at given times.

    Parameters
    ----------
    time_s : (N,) array
        Rising; any unit, as long as ``correlation_s`` has the same.
    correlation_s : float
        Time at which the correlation is 1/e; 0 for white noise.
    """
    process: Floats = rng.standard_normal(time_s.shape)
    if correlation_s == 0 or time_s.size < 2:
        return process
    kept = np.exp(-np.diff(time_s) / correlation_s)
    fresh = np.sqrt(1.0 - kept**2)
    for i in range(1, process.size):
        process[i] = kept[i - 1] * process[i - 1] + fresh[i - 1] * process[i]
    return process
