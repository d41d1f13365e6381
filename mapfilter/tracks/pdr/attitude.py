"""Attitude of a device: its rotation to a level frame, its yaw, and its posture.

The level frame has its z axis upward; its x axis has an arbitrary direction, which gyroscope and
gravity keep. The compass turns it to the north later (:mod:`mapfilter.tracks.pdr.heading`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import imufusion
import numpy as np

from mapfilter._constants import GRAVITY_MPS2
from mapfilter._types import Floats, Ints
from mapfilter.tracks.pdr.signals import RATE_HZ, Signals

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_GAIN = 0.5
_GYROSCOPE_DPS = 4000.0
_START_S = 1.0
_POSTURE_S = 2.0
_TILTED_RAD = np.radians(60.0)
_LOWPASS_HZ = 0.3


@dataclass(frozen=True, eq=False)
class Attitude:
    """Rotation of a device through time.

    Parameters
    ----------
    to_level : Rotation
        N rotations from the device's axes to the level frame.
    yaw_rad : (N,) array
        Turning about the vertical since the start, counter-clockwise, not wrapped. It does not
        depend on how the device lies in hand or pocket.
    section : (N,) array of int
        Number of the posture: grows by one where the device is tilted to another one.
    reference : Rotation
        Mean attitude of each section, turned back by the yaw: where the device's axes point when
        the yaw is 0.
    """

    to_level: Rotation
    yaw_rad: Floats
    section: Ints
    reference: Rotation


def attitude(signals: Signals) -> Attitude:
    """Return the attitude by gyroscope and gravity; without gyroscope by gravity and compass."""
    if signals.rate_radps is None:
        return _with_yaw(_compass(signals))
    return _with_yaw(_fused(signals, signals.rate_radps))


def _level(up: Floats) -> Rotation:
    """Return the smallest rotation that brings the device's upward direction to the z axis."""
    from scipy.spatial.transform import Rotation

    up = up / np.linalg.norm(up)
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine, cosine = float(np.linalg.norm(axis)), float(up[2])
    if sine < 1e-9:
        return Rotation.from_rotvec([0.0, 0.0, 0.0] if cosine > 0 else [np.pi, 0.0, 0.0])
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine))


def _fused(signals: Signals, rate_radps: Floats) -> Rotation:
    """Fuse gyroscope and accelerometer by the complementary filter of imufusion."""
    from scipy.spatial.transform import Rotation

    filter_ = imufusion.Ahrs()
    filter_.set_settings(
        imufusion.AhrsSettings(
            sample_rate=RATE_HZ,
            convention=imufusion.CONVENTION_ENU,
            gain=_GAIN,
            gyroscope_range=_GYROSCOPE_DPS,
            acceleration_rejection=0.0,
            magnetic_rejection=0.0,
            rejection_timeout=0.0,
        )
    )
    filter_.skip_startup()
    start = _level(signals.force_mps2[: int(_START_S * RATE_HZ)].mean(axis=0))
    filter_.set_quaternion(np.roll(start.as_quat(), 1))
    rate_dps = np.degrees(rate_radps)
    force_g = signals.force_mps2 / GRAVITY_MPS2
    quaternions = np.empty((len(rate_dps), 4))
    for k in range(len(rate_dps)):
        filter_.update_no_magnetometer(rate_dps[k], force_g[k])
        quaternions[k] = filter_.get_quaternion()
    return Rotation.from_quat(np.roll(quaternions, -1, axis=1))


def _compass(signals: Signals) -> Rotation:
    """Return the attitude by low-passed gravity and field, its y axis to the magnetic north."""
    # Slow to import (it imports scipy.stats), and few commands need it.
    from scipy.signal import butter, sosfiltfilt
    from scipy.spatial.transform import Rotation

    assert signals.field_ut is not None
    sos = butter(2, _LOWPASS_HZ, fs=RATE_HZ, output="sos")
    up = sosfiltfilt(sos, signals.force_mps2, axis=0)
    field = signals.field_ut.copy()
    known = np.isfinite(field[:, 0])
    number = np.arange(len(field))
    for axis in range(3):
        field[:, axis] = np.interp(number, number[known], field[known, axis]) if known.any() else 1
    field = sosfiltfilt(sos, field, axis=0)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    east = np.cross(field, up)
    east /= np.maximum(np.linalg.norm(east, axis=1, keepdims=True), 1e-9)
    return Rotation.from_matrix(np.stack([east, np.cross(up, east), up], axis=1))


def _twist(relative: Rotation) -> tuple[Floats, Floats]:
    """Split rotations of the level frame: the turn about the vertical, and the tilt left over."""
    x, y, z, w = relative.as_quat().T
    tilt = 2 * np.arctan2(np.hypot(x, y), np.hypot(z, w))
    return np.unwrap(2 * np.arctan2(z, w)), tilt


def _with_yaw(rotation: Rotation) -> Attitude:
    """Measure yaw from one posture to the next; a new one begins at a tilt of 60 degrees.

    The turn about the vertical from a fixed posture returns to its value when the device does.
    The integral of the vertical rate would not: it drifts with the solid angle that a swinging
    device describes.
    """
    from scipy.spatial.transform import Rotation

    count, width = len(rotation), int(_POSTURE_S * RATE_HZ)
    yaw, section = np.zeros(count), np.zeros(count, dtype=np.int64)
    references: list[Rotation] = []
    begin = 0
    while begin < count:
        posture = rotation[begin : begin + width].mean()
        # The posture is a mean: within its time the device may be far from it.
        end = _posture_end(rotation, posture, begin + width)
        turned, _ = _twist(rotation[begin:end] * posture.inv())
        offset = (yaw[begin - 1] if begin else 0.0) - turned[0]
        yaw[begin:end] = turned + offset
        section[begin:end] = len(references)
        references.append(Rotation.from_rotvec([0.0, 0.0, -offset]) * posture)
        begin = end
    return Attitude(rotation, yaw, section, Rotation.concatenate(references))


def _posture_end(rotation: Rotation, posture: Rotation, start: int) -> int:
    """Return the first sample that is tilted by 60 degrees, looking on in growing parts."""
    count, width = len(rotation), 1000
    while start < count:
        _, tilt = _twist(rotation[start : start + width] * posture.inv())
        over = np.flatnonzero(tilt > _TILTED_RAD)
        if over.size:
            return start + int(over[0])
        start, width = start + width, 2 * width
    return count
