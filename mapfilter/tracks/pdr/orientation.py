"""Directions of a device that estimates its own attitude: how it turns, and where it points."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.tracks.pdr.direction import UPRIGHT
from mapfilter.tracks.pdr.turns import LONGEST_S, ORIENTATION, Turning, samples

_QUATERNION = ("qx", "qy", "qz", "qw")
_WALK_RAD_PER_SQRT_S = float(np.radians(2.5))
"""Android's rotation vector, which has a compass in it, against the gyroscopes of 82 walks in a
shopping mall: 4 deg apart over 2 s, 11 over 10 s, 14 over 40 s (root mean square)."""


def turning_of_orientation(sensors: Mapping[str, pd.DataFrame]) -> Turning | None:
    """Return the turns about the vertical of a device in any pose; None without its attitude.

    Where its x axis points while it is level may be anything, as long as it is always the same.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        ``orientation`` of :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.
    """
    rows = samples(sensors, "orientation", _QUATERNION)
    if rows is None:
        return None
    time_s, quaternion = rows
    turn = np.full(len(time_s), np.nan)
    near = np.diff(time_s) <= LONGEST_S
    turn[1:][near] = _about_vertical(quaternion[:-1], quaternion[1:])[near]
    return Turning(time_s, turn, _WALK_RAD_PER_SQRT_S, ORIENTATION)


def compass_of_orientation(sensors: Mapping[str, pd.DataFrame]) -> pd.DataFrame | None:
    """Return where a device points that is held in the hand; None without its attitude.

    It is the direction of its top edge, or of its back where it is held upright, clockwise from the
    north of its attitude; NaN face down.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        ``orientation`` of :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.

    Returns
    -------
    pandas.DataFrame or None
        time_s, magnetic_deg.
    """
    rows = samples(sensors, "orientation", _QUATERNION)
    if rows is None:
        return None
    x, y, z, w = rows[1].T
    up = 1 - 2 * (x * x + y * y)
    flat = up > UPRIGHT
    east = np.where(flat, 2 * (x * y - w * z), -2 * (x * z + w * y))
    north = np.where(flat, 1 - 2 * (x * x + z * z), -2 * (y * z - w * x))
    azimuth_deg = np.degrees(np.arctan2(east, north)) % 360
    return pd.DataFrame(
        {"time_s": rows[0], "magnetic_deg": np.where(up < -UPRIGHT, np.nan, azimuth_deg)}
    )


def _about_vertical(before: Floats, after: Floats) -> Floats:
    """Return the turns about the vertical by which one attitude becomes the next."""
    bx, by, bz, bw = before.T
    ax, ay, az, aw = after.T
    # Vertical and scalar part of after * inverse(before), a rotation of the level frame.
    vertical = az * bw - aw * bz - ax * by + ay * bx
    scalar = aw * bw + ax * bx + ay * by + az * bz
    return wrap_rad(2 * np.arctan2(vertical, scalar))
