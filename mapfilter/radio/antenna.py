"""Antenna patterns: how much weaker a cell is off its boresight."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapfilter.errors import InputError, fail
from mapfilter.geodesy import wrap_rad

Floats = NDArray[np.float64]

_SIDE_LOBE_DB = 20.0


def sector_gain_db(
    offset_rad: ArrayLike, beamwidth_rad: float, max_attenuation_db: float
) -> Floats:
    """Return the horizontal gain of a sector antenna relative to boresight, in dB, 0 or less.

    ``-min(12 (φ / φ3dB)², A_m)``, where φ is wrapped into [-π, π) before it is squared
    (Fritsche & Klein 2009, eq. 2; 3GPP TR 36.814, table A.2.1.1-2).

    Parameters
    ----------
    offset_rad : array_like, any shape
        Angle between boresight and the direction to the receiver; need not be wrapped.
    beamwidth_rad : float
        Full width at half power, φ3dB.
    max_attenuation_db : float
        Largest attenuation, A_m.

    Raises
    ------
    InputError
        The beamwidth is not positive or the attenuation is negative.

    Examples
    --------
    >>> offset_rad = np.radians([0.0, 32.5, 180.0, 720.0])
    >>> sector_gain_db(offset_rad, np.radians(65.0), 25.0).round(9).tolist()
    [0.0, -3.0, -25.0, 0.0]
    """
    _check(beamwidth_rad, max_attenuation_db)
    ratio = wrap_rad(offset_rad) / beamwidth_rad
    return -np.minimum(12.0 * ratio**2, max_attenuation_db) + 0.0


def vertical_gain_db(
    depression_rad: ArrayLike, downtilt_rad: float, beamwidth_rad: float
) -> Floats:
    """Return the vertical gain relative to boresight, in dB, -20 or more.

    ``-min(12 ((θ - θ_tilt) / θ3dB)², 20 dB)`` (3GPP TR 36.814, table A.2.1.1-2).

    Parameters
    ----------
    depression_rad : array_like, any shape
        Angle below the horizon under which the antenna sees the receiver.
    downtilt_rad : float
        Boresight below the horizon.
    beamwidth_rad : float
        Full width at half power.

    Raises
    ------
    InputError
        The beamwidth is not positive.

    Examples
    --------
    >>> depression_rad = np.radians([6.0, 9.5, 60.0])
    >>> vertical_gain_db(depression_rad, np.radians(6.0), np.radians(7.0)).round(9).tolist()
    [0.0, -3.0, -20.0]
    """
    _check(beamwidth_rad, _SIDE_LOBE_DB)
    ratio = (np.asarray(depression_rad, dtype=np.float64) - downtilt_rad) / beamwidth_rad
    return -np.minimum(12.0 * ratio**2, _SIDE_LOBE_DB) + 0.0


def omni_gain_db(offset_rad: ArrayLike) -> Floats:
    """Return the horizontal gain of an omnidirectional antenna: 0 dB everywhere.

    Examples
    --------
    >>> omni_gain_db([0.0, 3.0]).tolist()
    [0.0, 0.0]
    """
    return np.zeros(np.shape(offset_rad))


def _check(beamwidth_rad: float, max_attenuation_db: float) -> None:
    if not 0 < beamwidth_rad <= 2 * np.pi:
        hint = "degrees given for radians" if beamwidth_rad > 2 * np.pi else ""
        raise fail(InputError, "beamwidth_rad", "radians > 0 and ≤ 2π", beamwidth_rad, hint)
    if not max_attenuation_db >= 0:
        raise fail(InputError, "max_attenuation_db", "dB ≥ 0", max_attenuation_db)
