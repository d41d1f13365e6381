"""Where a phone is carried in another way than before, as the steps' accelerations show.

A phone that is taken out of a pocket and put back may lie at the same tilt and point elsewhere. In
a bag it turns slowly. Steps accelerate it forward: that direction jumps, or drifts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.tracks.pdr.attitude import Attitude
from mapfilter.tracks.pdr.direction import Forward
from mapfilter.tracks.pdr.signals import RATE_HZ

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_BESIDE = int(10 * RATE_HZ)
_JUMP_RAD = np.radians(60.0)
_ALIKE = 0.6
"""Walk beside a jump, the angle that is one, and the share of forward accelerations on either side
that have one direction. Of a phone in one hand, one of 200 such angles is so large."""
_DRIFT_S, _SWING_S = 30.0, 3.0
_WIDTH, _EVERY = int(RATE_HZ), int(RATE_HZ / 2)
HELD_SWING_RAD = float(np.radians(5.0))
"""Swing beyond which no hand holds a phone to look at it."""


def parted_where_remounted(turned: Attitude, forward: Forward, walking: Bools) -> Attitude:
    """Return an attitude whose postures end where the phone comes to point elsewhere.

    Parameters
    ----------
    turned : Attitude
    forward : (N,) array of complex
        From :func:`mapfilter.tracks.pdr.direction.forward_accelerations`.
    walking : (N,) array of bool
    """
    # Slow to import, and few commands need it.
    from scipy.spatial.transform import Rotation

    cuts: list[int] = []
    for k in range(len(turned.reference)):
        index = np.flatnonzero(walking & (turned.section == k))
        cuts += index[_jumps(forward[index])].tolist()
    if not cuts:
        return turned
    begins = np.zeros(len(turned.section), dtype=np.bool_)
    begins[cuts] = True
    begins[1:] |= np.diff(turned.section) > 0
    section = np.cumsum(begins).astype(np.int64)
    first = np.concatenate([[0], np.flatnonzero(begins)])
    ends = np.append(first[1:], len(section))
    parted = set(turned.section[cuts].tolist())
    references = [
        _mean_reference(turned, int(begin), int(end))
        if turned.section[begin] in parted
        else turned.reference[int(turned.section[begin])]
        for begin, end in zip(first, ends, strict=True)
    ]
    return replace(turned, section=section, reference=Rotation.concatenate(references))


def drifts(turned: Attitude, forward: Forward, walking: Bools) -> Floats:
    """Return how far the direction of walking has turned in each posture, from its mean there.

    Parameters are those of :func:`parted_where_remounted`.

    Returns
    -------
    (N,) array
        Counter-clockwise, in radians; over half a minute to either side.
    """
    # Slow to import, and few commands need it.
    from scipy.ndimage import gaussian_filter1d

    found = np.zeros(len(forward))
    for k in range(len(turned.reference)):
        inside = turned.section == k
        walked = np.flatnonzero(inside & walking)
        if not walked.size:
            continue
        own = np.where(walking[inside], forward[inside], 0.0) * forward[walked].sum().conj()
        # Second by second, as a recording may last for hours.
        second = np.arange(len(own)) // _WIDTH
        near = [
            gaussian_filter1d(np.bincount(second, part), _DRIFT_S, mode="constant")
            for part in (own.real, own.imag)
        ]
        turned_rad = np.unwrap(np.arctan2(near[1], near[0]))
        middle = np.arange(len(turned_rad)) * _WIDTH + _WIDTH / 2
        found[inside] = np.interp(np.arange(len(own)), middle, turned_rad)
    return found


def swings_rad(turned: Attitude, walking: Bools) -> Floats:
    """Return how far a phone swings about its mean tilt over 3 s in each posture, the median.

    In a hand that holds it some 1.5 to 4 degrees, in a bag 6 and more, in a pocket 11 and more.

    Returns
    -------
    (K,) array
        In radians; 0 where nobody walks.
    """
    # Slow to import, and few commands need it.
    from scipy.ndimage import uniform_filter1d

    up = turned.to_level.inv().apply([0.0, 0.0, 1.0])
    mean = uniform_filter1d(up, int(_SWING_S * RATE_HZ), axis=0, mode="nearest")
    away = np.linalg.norm(up - mean, axis=1)
    found = np.zeros(len(turned.reference))
    for k in np.unique(turned.section[walking]).tolist():
        found[k] = np.median(away[walking & (turned.section == k)])
    return found


def _jumps(forward: Forward) -> Ints:
    """Return the samples of a walk at which the direction of its accelerations jumps."""
    count = len(forward)
    if count < 2 * _BESIDE:
        return np.zeros(0, dtype=np.int64)
    total = np.concatenate([[0.0], np.cumsum(forward)])
    size = np.concatenate([[0.0], np.cumsum(np.abs(forward))])
    at = np.arange(_BESIDE, count - _BESIDE + 1)
    before, after = total[at] - total[at - _BESIDE], total[at + _BESIDE] - total[at]
    alike = np.minimum(
        np.abs(before) / np.maximum(size[at] - size[at - _BESIDE], 1e-12),
        np.abs(after) / np.maximum(size[at + _BESIDE] - size[at], 1e-12),
    )
    apart = np.where(alike > _ALIKE, np.abs(np.angle(after * before.conj())), 0.0)
    found: list[int] = []
    while apart.size and apart.max() > _JUMP_RAD:
        largest = int(np.argmax(apart))
        found.append(int(at[largest]))
        apart[max(0, largest - _BESIDE) : largest + _BESIDE] = 0.0
    return np.array(sorted(found), dtype=np.int64)


def _mean_reference(turned: Attitude, begin: int, end: int) -> Rotation:
    """Return the mean attitude between two samples, turned back by the yaw."""
    from scipy.spatial.transform import Rotation

    some = np.arange(begin, end, _EVERY)
    back = np.column_stack([np.zeros((len(some), 2)), -turned.yaw_rad[some]])
    return (Rotation.from_rotvec(back) * turned.to_level[some]).mean()
