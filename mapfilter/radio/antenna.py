"""Antenna patterns by formula and by measured cuts: gain relative to the boresight.

Directions are given by the angle ``offset_rad`` from the boresight's azimuth, counter-clockwise
seen from above, and by the angle ``depression_rad`` below the horizon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.errors import InputError, fail

_SIDE_LOBE_DB = 20.0


def sector_gain_db(
    offset_rad: ArrayLike, beamwidth_rad: float, max_attenuation_db: float
) -> Floats:
    """Return the horizontal gain of a sector antenna relative to boresight, in dB, 0 or less.

    ``-min(12 (φ / φ3dB)², A_m)``, where φ is wrapped into [-π, π) before it is squared
    (Fritsche & Klein 2009, eq. 2; 3GPP TR 36.814, table A.2.1.1-2; TR 38.901, table 7.3-1).

    Parameters
    ----------
    offset_rad : array_like, any shape
        Angle between boresight and the direction to the receiver; need not be wrapped.
    beamwidth_rad : float
        Full width at half power, φ3dB.
    max_attenuation_db : float
        Largest attenuation, A_m.

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
    depression_rad: ArrayLike,
    downtilt_rad: float,
    beamwidth_rad: float,
    side_lobe_db: float = _SIDE_LOBE_DB,
) -> Floats:
    """Return the vertical gain relative to boresight, in dB, -SLA_V or more.

    ``-min(12 ((θ - θ_tilt) / θ3dB)², SLA_V)`` (3GPP TR 36.814, table A.2.1.1-2; TR 38.901,
    table 7.3-1).

    Parameters
    ----------
    depression_rad : array_like, any shape
        Angle below the horizon from the antenna to the receiver.
    downtilt_rad : float
        Electrical downtilt: the beam below the horizon, alike all around.
    beamwidth_rad : float
        Full width at half power.
    side_lobe_db : float
        Largest attenuation, SLA_V: 20 dB in TR 36.814, 30 dB in TR 38.901.

    Examples
    --------
    >>> depression_rad = np.radians([6.0, 9.5, 60.0])
    >>> vertical_gain_db(depression_rad, np.radians(6.0), np.radians(7.0)).round(9).tolist()
    [0.0, -3.0, -20.0]
    """
    _check(beamwidth_rad, side_lobe_db)
    ratio = (np.asarray(depression_rad, dtype=np.float64) - downtilt_rad) / beamwidth_rad
    return -np.minimum(12.0 * ratio**2, side_lobe_db) + 0.0


def combined_gain_db(
    horizontal_db: ArrayLike, vertical_db: ArrayLike, max_attenuation_db: float
) -> Floats:
    """Return the gain in three dimensions from the two cuts, ``-min(-(A_H + A_V), A_m)``.

    3GPP TR 36.814, table A.2.1.1-2; TR 38.901, table 7.3-1.

    Examples
    --------
    >>> combined_gain_db([0.0, -12.0, -25.0], [-3.0, -3.0, -20.0], 25.0).tolist()
    [-3.0, -15.0, -25.0]
    """
    return np.maximum(np.add(horizontal_db, vertical_db), -max_attenuation_db)


def leaning(
    offset_rad: ArrayLike, depression_rad: ArrayLike, mechanical_downtilt_rad: float
) -> tuple[Floats, Floats]:
    """Return a direction in the frame of an antenna that leans forward.

    The rotation of TR 38.901, eqs. (7.1-7) and (7.1-8), with bearing and slant 0: the beam sinks in
    front, rises behind and stays where it is at the sides.

    Parameters
    ----------
    mechanical_downtilt_rad : float
        β of the report.

    Returns
    -------
    offset_rad, depression_rad : ndarray
        In the antenna's own frame.

    Examples
    --------
    >>> front, down = leaning(np.radians([0.0, 180.0]), np.radians([6.0, 6.0]), np.radians(6.0))
    >>> np.degrees(down).round(9).tolist()
    [0.0, 12.0]
    """
    offset = np.asarray(offset_rad, dtype=np.float64)
    depression = np.asarray(depression_rad, dtype=np.float64)
    if mechanical_downtilt_rad == 0:
        return offset, depression
    ahead, left = np.cos(depression) * np.cos(offset), np.cos(depression) * np.sin(offset)
    below = np.sin(depression)
    cos_tilt, sin_tilt = np.cos(mechanical_downtilt_rad), np.sin(mechanical_downtilt_rad)
    own_ahead = ahead * cos_tilt + below * sin_tilt
    own_below = below * cos_tilt - ahead * sin_tilt
    return np.arctan2(left, own_ahead), np.arctan2(own_below, np.hypot(own_ahead, left))


@dataclass(frozen=True, eq=False)
class MeasuredAntenna:
    """An antenna given by its loss along two cuts.

    Parameters
    ----------
    horizontal_deg, horizontal_loss_db : ndarray, shape (N,)
        Angles clockwise from boresight seen from above, rising within [0, 360), and losses against
        the strongest direction, 0 or more.
    vertical_deg, vertical_loss_db : ndarray, shape (M,)
        Angles from the horizon in front downwards: 90 is straight down, 180 the horizon behind.
    downtilt_deg : float
        Electrical downtilt that the cuts were taken with.
    gain_dbi : float or None
        Gain at boresight over an isotropic antenna.
    frequency_mhz : float or None
        Frequency at which the cuts were taken.
    notes : tuple of str
        Assumptions made in reading.
    """

    name: str
    horizontal_deg: Floats
    horizontal_loss_db: Floats
    vertical_deg: Floats
    vertical_loss_db: Floats
    downtilt_deg: float = 0.0
    gain_dbi: float | None = None
    frequency_mhz: float | None = None
    notes: tuple[str, ...] = ()

    def gain_db(
        self, offset_rad: ArrayLike, depression_rad: ArrayLike, downtilt_deg: float | None = None
    ) -> Floats:
        """Return the gain relative to the strongest direction, in dB, 0 or less.

        The cuts H and V, interpolated in dB across the wrap, make three dimensions as in Atoll:
        ``loss = H(φ) - (1 - |φ|/180°) (H(0) - V(θ)) - |φ|/180° (H(180°) - V(180° - θ))``, which is
        V straight ahead and straight behind (Forsk, *Atoll technical reference guide*, antenna
        attenuation).

        Parameters
        ----------
        offset_rad, depression_rad : array_like
            Seen by the antenna, see :func:`leaning`; they broadcast.
        downtilt_deg : float or None
            Electrical downtilt wanted: the vertical cut is shifted from its own to this one. None
            leaves it as it was measured.
        """
        horizontal = self.horizontal_deg, self.horizontal_loss_db
        vertical = self.vertical_deg, self.vertical_loss_db
        shift_deg = 0.0 if downtilt_deg is None else downtilt_deg - self.downtilt_deg
        around_deg = -np.degrees(wrap_rad(offset_rad))
        down_deg = np.degrees(np.asarray(depression_rad, dtype=np.float64)) - shift_deg
        behind = np.abs(around_deg) / 180.0
        ahead_db = _at(*horizontal, 0.0) - _at(*vertical, down_deg)
        behind_db = _at(*horizontal, 180.0) - _at(*vertical, 180.0 - down_deg)
        loss_db = _at(*horizontal, around_deg) - (1 - behind) * ahead_db - behind * behind_db
        # Cuts that do not meet where they cross could make a direction stronger than boresight.
        return -np.maximum(loss_db, 0.0) + 0.0


def _at(cut_deg: Floats, loss_db: Floats, angle_deg: ArrayLike) -> Floats:
    return np.asarray(np.interp(np.asarray(angle_deg), cut_deg, loss_db, period=360.0))


def _check(beamwidth_rad: float, max_attenuation_db: float) -> None:
    if not 0 < beamwidth_rad <= 2 * np.pi:
        hint = "degrees given for radians" if beamwidth_rad > 2 * np.pi else ""
        raise fail(InputError, "beamwidth_rad", "radians > 0 and ≤ 2π", beamwidth_rad, hint)
    if not max_attenuation_db >= 0:
        raise fail(InputError, "max_attenuation_db", "dB ≥ 0", max_attenuation_db)
