"""Path loss that knows distance and frequency only: free space and log-distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats

SPEED_OF_LIGHT_MPS = 299_792_458.0
SHORTEST_FREE_DISTANCE_M = 1.0
"""Shorter distances count as this one in free space: nearer, an antenna has no far field."""


def friis_db(distance_m: ArrayLike, frequency_mhz: float) -> Floats:
    """Return the loss of free space between isotropic antennas in dB.

    ``L = 20 lg(4 π d f / c)`` (Friis 1946, for antennas of gain 1). Distances below 1 m
    count as 1 m.

    Parameters
    ----------
    distance_m : array_like, any shape
    frequency_mhz : float

    Examples
    --------
    >>> friis_db([1000.0, 2000.0], 1800.0).round(2).tolist()
    [97.55, 103.57]
    """
    distance = np.maximum(np.asarray(distance_m, dtype=np.float64), SHORTEST_FREE_DISTANCE_M)
    wavelength_m = SPEED_OF_LIGHT_MPS / (frequency_mhz * 1e6)
    return np.asarray(20 * np.log10(4 * np.pi * distance / wavelength_m))


def log_distance_db(
    distance_m: ArrayLike,
    frequency_mhz: float,
    exponent: float,
    reference_distance_m: float = 1.0,
    reference_loss_db: float | None = None,
) -> Floats:
    """Return the log-distance path loss in dB.

    ``L = L(d0) + 10 n lg(d / d0)`` (Rappaport 2002, eq. 4.68). L(d0) is that of free space unless
    it was measured; with d0 = 1 m this is the close-in model (Sun et al. 2016, eq. 1). Distances
    below d0 count as d0.

    Parameters
    ----------
    distance_m : array_like, any shape
    frequency_mhz : float
    exponent : float
        n: 2 in free space, 2.7 to 5 in towns.
    reference_distance_m : float
        d0.
    reference_loss_db : float or None
        L(d0); None for free space.

    Examples
    --------
    >>> log_distance_db([100.0, 1000.0], 1800.0, 3.5, 100.0, 80.0).tolist()
    [80.0, 115.0]
    """
    distance = np.maximum(np.asarray(distance_m, dtype=np.float64), reference_distance_m)
    if reference_loss_db is None:
        reference_loss_db = float(friis_db(reference_distance_m, frequency_mhz))
    return np.asarray(reference_loss_db + 10 * exponent * np.log10(distance / reference_distance_m))
