"""The direction of walking, seen from the device: by its axes, or by the accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from mapfilter._types import Bools, Floats
from mapfilter.angles import wrap_rad
from mapfilter.tracks.pdr.options import Pose
from mapfilter.tracks.pdr.signals import RATE_HZ

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Forward = npt.NDArray[np.complex128]

DEVICE_SD_RAD = float(np.radians(8.0))
ACCELERATION_SD_RAD = float(np.radians(20.0))
_PHASE_RAD = np.radians(45.0)
_BAND_HZ = (1.2, 3.0)
_LEAST_S = 5.0
_AGREE_RAD = np.radians(40.0)
UPRIGHT = 0.7


def forward_accelerations(level_mps2: Floats, yaw_rad: Floats) -> Forward:
    """Return the horizontal acceleration that a step has forward, by the phase of its rise.

    Within a step the body speeds up about an eighth of a period before it rises; the horizontal
    acceleration of that phase points forward. This holds in any posture of the device.

    Parameters
    ----------
    level_mps2 : (N, 3) array
        Specific force in the level frame.
    yaw_rad : (N,) array

    Returns
    -------
    (N,) array of complex
        Its parts along the x and the y axis of the level frame at yaw 0; of no meaning where nobody
        walks.
    """
    # Slow to import (it imports scipy.stats), and few commands need it.
    from scipy.signal import butter, hilbert, sosfiltfilt

    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    x = level_mps2[:, 0] * cosine + level_mps2[:, 1] * sine
    y = level_mps2[:, 1] * cosine - level_mps2[:, 0] * sine
    sos = butter(2, _BAND_HZ, btype="band", fs=RATE_HZ, output="sos")
    along, across, up = (hilbert(sosfiltfilt(sos, part)) for part in (x, y, level_mps2[:, 2]))
    turned = np.exp(-1j * _PHASE_RAD) * up.conj()
    found: Forward = (along * turned).real + 1j * (across * turned).real
    return found


def direction_by_acceleration(forward: Forward, walking: Bools) -> float:
    """Return the direction of walking at yaw 0 by the accelerations of the steps, in radians.

    Parameters
    ----------
    forward : (N,) array of complex
        From :func:`forward_accelerations`.
    walking : (N,) array of bool
        Samples that are of a walk.

    Returns
    -------
    float
        Counter-clockwise from the x axis of the level frame; NaN with less than 5 s of walk.
    """
    if walking.sum() < _LEAST_S * RATE_HZ:
        return float("nan")
    return float(np.angle(forward[walking].sum()))


def direction_by_device(reference: Rotation) -> float:
    """Return the direction in which a device held in the hand points at yaw 0; NaN face down.

    It is the top edge (y axis) of one that lies flat, and away from the screen (-z axis) of one
    that is held upright, in any orientation of the screen.
    """
    up = reference.inv().apply([0.0, 0.0, 1.0])
    if up[2] < -UPRIGHT:
        return float("nan")
    axis = [0.0, 1.0, 0.0] if up[2] > UPRIGHT else [0.0, 0.0, -1.0]
    pointing = reference.apply(axis)
    return float(np.arctan2(pointing[1], pointing[0]))


def walking_direction(by_device: float, by_acceleration: float, pose: Pose) -> tuple[float, float]:
    """Choose a direction of walking at yaw 0, and its standard deviation, in radians.

    With ``auto`` the device's own axis is taken where the accelerations agree within 40 degrees,
    or are unknown; with ``device`` always, with ``any`` never.

    Examples
    --------
    >>> direction, sd = walking_direction(0.1, 0.4, "auto")
    >>> direction, round(float(np.degrees(sd)), 1)
    (0.1, 8.0)
    """
    if pose == "any" or np.isnan(by_device):
        device = False
    else:
        apart = abs(float(wrap_rad(by_device - by_acceleration)))
        device = pose == "device" or np.isnan(apart) or apart < _AGREE_RAD
    if device:
        return by_device, DEVICE_SD_RAD
    if np.isnan(by_acceleration):
        return float("nan"), float(np.pi)
    return by_acceleration, ACCELERATION_SD_RAD
