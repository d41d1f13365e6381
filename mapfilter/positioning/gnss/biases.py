"""Errors of pseudoranges that last: a state for each satellite beside the receiver's clock.

Reflections in a street make a satellite's pseudorange late by tens of metres, for as long as the
receiver stays in the street: ten readings of it are no ten independent ones. So the lasting error
of each satellite is a state of its own, a Gauss-Markov process along the way, with a mean above 0.
It is linear and Gaussian given a hypothesis's path, like clock and height, and stands behind these
in the rows of the hypotheses and in the covariance that they share.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.positioning.gnss.options import GnssOptions

MOST = 64
"""Most satellites whose lasting errors are kept while others are received."""
_FORGOTTEN = 0.95
"""Share of the first variance from which on the error of a satellite is unknown again."""
_LOWEST_RAD = np.radians(10.0)
_MOST_TIMES = 3.0


@dataclass(frozen=True, eq=False)
class Biases:
    """Satellites whose lasting errors a receiver holds, in the order of its states.

    Parameters
    ----------
    names : tuple of str
        The satellites.
    reflection_m : (K,) array
        Standard deviations of their errors by reflections, as of the epochs at which they were
        received last.
    """

    names: tuple[str, ...] = ()
    reflection_m: Floats = field(default_factory=lambda: np.zeros(0))

    def means_m(self, options: GnssOptions) -> Floats:
        """Return the means of the errors before any reading, (K,): reflections are late."""
        return np.asarray(options.lateness * self.reflection_m)

    def variances_m2(self, options: GnssOptions) -> Floats:
        """Return the variances of the errors before any reading, (K,)."""
        return np.asarray(options.echo_m**2 + self.reflection_m**2)

    def index_of(self, names: tuple[str, ...]) -> Ints:
        """Return the indices of satellites, shape (m,)."""
        index = {name: k for k, name in enumerate(self.names)}
        return np.array([index[name] for name in names], dtype=np.int64)

    def known(self, options: GnssOptions, variance_m2: Floats) -> Bools:
        """Return which errors are known better than before any reading, by their variances."""
        return np.asarray(variance_m2 < _FORGOTTEN * self.variances_m2(options))


def kept_share(options: GnssOptions, gone_m: float, elapsed_s: float) -> float:
    """Return the share of a lasting error that is left after a distance and a time."""
    return float(np.exp(-gone_m / options.echo_memory_m - elapsed_s / options.echo_memory_s))


def reflection_deviations_m(options: GnssOptions, elevation_rad: Floats, sigma_m: Floats) -> Floats:
    """Return the standard deviations of errors by reflections, shape (m,).

    Where a receiver states deviations, they are larger for weak signals, which are the reflected
    ones: lasting errors are in proportion to a deviation, and to its ratio to the least one of the
    epoch. Else they are in proportion to the cotangent of the elevation: low satellites are hidden
    more often, and their reflections are later.

    Parameters
    ----------
    elevation_rad : (m,) array
        Elevations of the satellites of one epoch.
    sigma_m : (m,) array
        Deviations as stated; NaN where there is none.
    """
    stated = np.isfinite(sigma_m)
    by_elevation = options.reflection_m / np.tan(np.maximum(elevation_rad, _LOWEST_RAD))
    if not stated.any():
        return np.asarray(by_elevation)
    least_m = float(np.nanmin(sigma_m))
    times = np.minimum(sigma_m / max(least_m, 1e-9), _MOST_TIMES)
    return np.where(stated, options.reflection_times * sigma_m * times, by_elevation)
