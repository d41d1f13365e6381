"""The two ways of counting angles.

Planners' azimuths are compass degrees clockwise from *true* north; headings are radians
counter-clockwise from *grid* east.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats


def wrap_rad(angle_rad: ArrayLike) -> Floats:
    """Wrap angles into [-π, π); those that are not finite become NaN.

    Examples
    --------
    >>> wrap_rad([3.5, -3.5, 0.25]).round(4).tolist()
    [-2.7832, 2.7832, 0.25]
    """
    angle = np.asarray(angle_rad, dtype=np.float64)
    # np.mod may round up to 2π itself for tiny negative arguments.
    with np.errstate(invalid="ignore"):
        wrapped = np.mod(angle + np.pi, 2 * np.pi) - np.pi
    return np.where(wrapped >= np.pi, -np.pi, wrapped)


def wrap_one_rad(angle_rad: float) -> float:
    """Wrap one angle as :func:`wrap_rad` does, with the same bits, in a tenth of the time.

    Examples
    --------
    >>> round(wrap_one_rad(3.5), 4)
    -2.7832
    """
    wrapped = (angle_rad + pi) % (2 * pi) - pi
    return -pi if wrapped >= pi else wrapped


def heading_from_azimuth_rad(azimuth_deg: ArrayLike, convergence_rad: ArrayLike = 0.0) -> Floats:
    """Turn compass azimuths (degrees clockwise from true north) into headings.

    Headings are radians counter-clockwise from grid east, in [-π, π). ``convergence_rad`` is the
    clockwise angle from true north to grid north at the place.

    Examples
    --------
    >>> np.degrees(heading_from_azimuth_rad([0.0, 90.0, 180.0])).tolist()
    [90.0, 0.0, -90.0]
    """
    azimuth_rad = np.radians(np.asarray(azimuth_deg, dtype=np.float64))
    return wrap_rad(np.pi / 2 - azimuth_rad + np.asarray(convergence_rad, dtype=np.float64))


def azimuth_from_heading_deg(heading_rad: ArrayLike, convergence_rad: ArrayLike = 0.0) -> Floats:
    """Turn headings into compass azimuths in [0, 360); the inverse of the function above.

    Examples
    --------
    >>> azimuth_from_heading_deg(0.0).item()
    90.0
    """
    heading = np.asarray(heading_rad, dtype=np.float64)
    azimuth = np.degrees(np.pi / 2 - heading + np.asarray(convergence_rad, dtype=np.float64))
    wrapped = np.mod(azimuth, 360.0)
    return np.where(wrapped >= 360.0, 0.0, wrapped)
