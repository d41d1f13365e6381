"""Noise of pseudoranges: it grows towards the horizon, and multipath in streets adds to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import log_ndtr

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail


def elevation_sigma_m(elevation_rad: ArrayLike, zenith_m: float = 2.0) -> Floats:
    """Return the standard deviation of pseudoranges, ``σ / sin(elevation)``.

    σ is that overhead; elevations and deviation must be above 0.

    Examples
    --------
    >>> elevation_sigma_m(np.radians([90.0, 30.0])).round(9).tolist()
    [2.0, 4.0]
    """
    elevation = np.asarray(elevation_rad, dtype=np.float64)
    faults = Faults()
    if not (np.isfinite(zenith_m) and zenith_m > 0):
        faults.add("zenith_m", "metres above 0", zenith_m)
    if not ((elevation > 0) & (elevation <= np.pi / 2 + 1e-9)).all():
        got = f"{np.degrees(elevation).min(initial=np.inf):g}°"
        faults.add("elevation_rad", "satellites above the horizon", got, "no elevation mask")
    faults.raise_if_any(InputError)
    return np.asarray(zenith_m / np.sin(elevation))


def multipath_bias_m(
    travelled_m: ArrayLike,
    satellites: int,
    rng: np.random.Generator,
    *,
    mean_m: float = 3.0,
    correlation_m: float = 10.0,
) -> Floats:
    """Draw the excess of pseudoranges by echoes in a street, never below 0.

    Each satellite's excess is exponentially distributed; along the way it is that of a normal
    process with correlation ``exp(-d / correlation_m)``.

    Parameters
    ----------
    travelled_m : (K,) array_like
        Distance travelled at each epoch, never decreasing.
    mean_m : float
        0 in the open.

    Returns
    -------
    (K, S) array
        Excess of the pseudorange of each of S satellites at each of K epochs, in metres.
    """
    travelled = np.asarray(travelled_m, dtype=np.float64)
    if not (mean_m >= 0 and correlation_m > 0 and (np.diff(travelled) >= 0).all()):
        got = f"{mean_m} m, {correlation_m} m"
        raise fail(
            InputError, "multipath", "mean >= 0, length > 0, distances that never decrease", got
        )
    drawn = correlated_along(travelled, satellites, correlation_m, rng)
    # The logarithm of the upper tail of a normal is that of a uniform number.
    return np.asarray(-mean_m * log_ndtr(-drawn))


def correlated_along(
    travelled_m: ArrayLike, columns: int, correlation_m: float, rng: np.random.Generator
) -> Floats:
    """Draw standard normal numbers with correlation ``exp(-d / correlation_m)`` along a way.

    The columns of the result, (K, columns), are independent.
    """
    # Slow to import (it imports scipy.stats), and few commands need it.
    from scipy.signal import lfilter

    travelled = np.asarray(travelled_m, dtype=np.float64)
    drawn = rng.standard_normal((travelled.size, columns))
    keep = np.exp(-np.diff(travelled) / correlation_m)
    if keep.size and np.ptp(keep) < 1e-12:
        drawn[1:] *= np.sqrt(1 - keep[0] ** 2)
        return np.asarray(lfilter([1.0], [1.0, -keep[0]], drawn, axis=0))
    for k, share in enumerate(keep, start=1):
        drawn[k] = share * drawn[k - 1] + np.sqrt(1 - share**2) * drawn[k]
    return drawn
