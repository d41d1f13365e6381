"""Nominal constellations, for the time when no almanac is at hand.

GPS has 24 slots in six planes (*GPS Standard Positioning Service Performance Standard*, 4th ed.
2008, Tables A.2-1 and A.2-2, for 0 h UTC on 1 July 1993). Galileo has 27 satellites in three planes
as first designed, a Walker constellation 27/3/1 at 56° (*Galileo OS SIS ICD* gives axis and
inclination).
"""

from __future__ import annotations

import numpy as np

from mapfilter.gnss.almanac import Almanac

_GPS_AXIS_M = 26_559_700.0
_GPS_TILT_DEG = 55.0
_GALILEO_AXIS_M = 29_600_318.0
_GALILEO_TILT_DEG = 56.0
_GALILEO_PER_PLANE, _GALILEO_PLANES = 9, 3

_GREENWICH_DEG = 279.0553
"""Sidereal angle of Greenwich at the epoch of the slots."""

_NODE_OF_A_DEG = 272.847
_SLOTS_DEG = (
    (268.126, 161.786, 11.676, 41.806),
    (80.956, 173.336, 309.976, 204.376),
    (111.876, 11.796, 339.666, 241.556),
    (135.226, 265.446, 35.156, 167.356),
    (197.046, 302.596, 66.066, 333.686),
    (238.886, 345.226, 105.206, 135.346),
)
"""Arguments of latitude in planes A to F."""


def nominal_gps(week: int = 0) -> Almanac:
    """Return the 24 slots of GPS, G01 to G24, plane by plane; their epoch is second 0 of a week.

    Examples
    --------
    >>> len(nominal_gps().names)
    24
    """
    latitude = np.array(_SLOTS_DEG)
    node = np.repeat(_NODE_OF_A_DEG - _GREENWICH_DEG + 60.0 * np.arange(6), 4)
    return _circular("G", _GPS_AXIS_M, _GPS_TILT_DEG, node, latitude.ravel(), week)


def nominal_galileo(week: int = 0) -> Almanac:
    """Return 27 satellites of Galileo, E01 to E27, plane by plane; epoch as for GPS.

    Examples
    --------
    >>> len(nominal_galileo().names)
    27
    """
    plane = np.repeat(np.arange(_GALILEO_PLANES), _GALILEO_PER_PLANE)
    slot = np.tile(np.arange(_GALILEO_PER_PLANE), _GALILEO_PLANES)
    phase = 360.0 / (_GALILEO_PER_PLANE * _GALILEO_PLANES)
    latitude = 360.0 / _GALILEO_PER_PLANE * slot + phase * plane
    node = 360.0 / _GALILEO_PLANES * plane
    return _circular("E", _GALILEO_AXIS_M, _GALILEO_TILT_DEG, node, latitude, week)


def _circular(
    system: str,
    axis_m: float,
    tilt_deg: float,
    node_deg: np.ndarray,
    latitude_deg: np.ndarray,
    week: int,
) -> Almanac:
    count = latitude_deg.size
    zero = np.zeros(count)
    wrapped = np.radians(np.mod(node_deg + 180.0, 360.0) - 180.0)
    return Almanac(
        tuple(f"{system}{index:02d}" for index in range(1, count + 1)),
        zero + week, zero, np.full(count, np.sqrt(axis_m)), zero,
        np.full(count, np.radians(tilt_deg)), wrapped, zero, zero, np.radians(latitude_deg),
        np.ones(count, dtype=np.bool_),
    )  # fmt: skip
