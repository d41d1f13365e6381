"""The bias of a gyroscope in a phone that is carried: by gravity, and by the magnetic field.

Seen in a frame that the gyroscope keeps, both keep their directions, but for what walking and iron
do to them for seconds. A bias turns them steadily. Gravity shows its horizontal parts and the field
all but that about itself, so that a phone that lies in several ways shows all three without a rest.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.tracks.pdr.gyroscope import RATE_SD_RADPS, UNSEEN_SD_RADPS
from mapfilter.tracks.pdr.signals import RATE_HZ, Signals

_LAG_S, _MEAN_S = 15, 3
"""Time over which directions are compared, and that over which they are means: of some strides."""
_LEAST_S = 60.0
"""Shorter recordings show a bias no better than is known before."""
_ROUNDS, _WEIGHINGS, _SETTLED_RADPS = 4, 10, float(np.radians(0.02))
_DEGREES_OF_FREEDOM = 3.0
_MEDIAN_OF_THREE = 2.37
"""Median of the sum of squares of three normal numbers."""
_SHOWN, _LEAST_RAD = 3.0, float(np.radians(0.5))
"""Deviations that are no chance, and the least error of a direction."""
_WIDTH = int(RATE_HZ)


@dataclass(frozen=True, eq=False)
class CarriedBias:
    """A bias in the axes of the device.

    Parameters
    ----------
    bias_radps : (3,) array
    covariance : (3, 3) array
        In (rad/s)².
    """

    bias_radps: Floats
    covariance: Floats

    @property
    def shown_radps(self) -> Floats:
        """The bias; 0 where it may be that of a usual gyroscope, 0.1 deg/s."""
        sd = np.sqrt(np.diag(self.covariance) + RATE_SD_RADPS**2)
        unusual = (np.abs(self.bias_radps) > _SHOWN * sd).any()
        return self.bias_radps if unusual else np.zeros(3)

    def sd_about_radps(self, axes: Floats) -> float:
        """Return the root mean square of the deviations about some axes, unit vectors (N, 3)."""
        return float(np.sqrt(np.einsum("ni,ij,nj->n", axes, self.covariance, axes).mean()))


def bias_while_carried(stretches: Iterable[Signals]) -> CarriedBias:
    """Return the bias of a gyroscope by directions 15 s apart.

    They are compared by robust least squares (Student's t weights), with an error of 0.5 deg/s an
    axis expected before. A recording of less than a minute shows none.

    Parameters
    ----------
    stretches : iterable of Signals
        Without gaps; those without a gyroscope are left out.
    """
    turning = [(part, part.rate_radps) for part in stretches if part.rate_radps is not None]
    before = np.eye(3) / UNSEEN_SD_RADPS**2
    bias, information = np.zeros(3), before
    lasts_s = sum(len(rate) for _, rate in turning) / RATE_HZ
    for _ in range(_ROUNDS if lasts_s >= _LEAST_S else 0):
        # Each round turns back by what is known, as a sum of small turns is one that is not small.
        parts = [_compared(part, rate - bias) for part, rate in turning]
        found = [_information(pairs) for part in parts for pairs in part if len(pairs[0])]
        information = before + sum((one for one, _ in found), np.zeros((3, 3)))
        pulls = sum((pull for _, pull in found), np.zeros(3)) - before @ bias
        more = np.linalg.solve(information, pulls)
        bias = bias + more
        if np.abs(more).max() < _SETTLED_RADPS:
            break
    covariance: Floats = np.linalg.inv(information).astype(np.float64)
    return CarriedBias(bias, covariance)


def _compared(signals: Signals, rate_radps: Floats) -> list[tuple[Floats, Floats]]:
    """Return how far gravity and field turned over the lag, and what a bias of 1 would do.

    Returns
    -------
    list of ((N, 3) array, (N, 3, 3) array)
    """
    vectors = [signals.force_mps2]
    if signals.field_ut is not None:
        vectors.append(signals.field_ut)
    turns, means = _by_second(rate_radps, vectors)
    total = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(turns, axis=0)])
    found = []
    for mean in means:
        count = len(mean) - _MEAN_S + 1
        if count <= _LAG_S:
            continue
        smooth = sum(mean[k : k + count] for k in range(_MEAN_S)) / _MEAN_S
        sizes = np.linalg.norm(smooth, axis=1)
        if not np.isfinite(sizes).any():
            continue
        smooth = smooth / np.nanmedian(sizes)
        first, last = smooth[:-_LAG_S], smooth[_LAG_S:]
        middle = np.arange(count - _LAG_S) + _MEAN_S // 2
        sums = total[middle + _LAG_S] - total[middle]
        # d/dt of a fixed direction u is (C b) x u, C the attitude and b the bias.
        effect = -_crossing((first + last) / 2) @ sums
        known = np.isfinite(last - first).all(axis=1)
        found.append(((last - first)[known], effect[known]))
    return found


def _information(pairs: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return the information on a bias that pairs of directions hold, and where it pulls."""
    turned, effect = pairs
    more = np.zeros(3)
    before = np.eye(3) / UNSEEN_SD_RADPS**2
    information, pull = np.zeros((3, 3)), np.zeros(3)
    for _ in range(_WEIGHINGS):
        squared = ((turned - effect @ more) ** 2).sum(axis=1)
        variance = max(float(np.median(squared)) / _MEDIAN_OF_THREE, _LEAST_RAD**2)
        freedom = _DEGREES_OF_FREEDOM
        weight = (freedom + 3) / (freedom + squared / variance)
        # Pairs that begin within the lag of each other tell the same.
        share = weight / variance / (_LAG_S + _MEAN_S)
        information = np.einsum("n,nij,nik->jk", share, effect, effect)
        pull = np.einsum("n,nij,ni->j", share, effect, turned)
        more = np.linalg.solve(information + before, pull)
    return information, pull


def _by_second(rate_radps: Floats, vectors: list[Floats]) -> tuple[Floats, list[Floats]]:
    """Return the sum of the attitude's matrices in each second, and the means of vectors.

    Both are in the frame of the first sample, as the gyroscope keeps it; times are in seconds.
    Means of less than half a second are NaN.
    """
    from scipy.spatial.transform import Rotation

    count = len(rate_radps) // _WIDTH
    angle = (rate_radps[: count * _WIDTH] / RATE_HZ).reshape(count, _WIDTH, 3)
    parts = [vector[: count * _WIDTH].reshape(count, _WIDTH, 3) for vector in vectors]
    sums = [np.zeros((count, 3)) for _ in vectors]
    numbers = [np.zeros((count, 1)) for _ in vectors]
    # All seconds are turned side by side, and then one after the other.
    within, turned = Rotation.identity(count), np.zeros((count, 3, 3))
    for k in range(_WIDTH):
        half = (within * Rotation.from_rotvec(angle[:, k] / 2)).as_matrix()
        turned += half / RATE_HZ
        for part, total, number in zip(parts, sums, numbers, strict=True):
            known = np.isfinite(part[:, k]).all(axis=1)
            total[known] += np.einsum("nij,nj->ni", half[known], part[known, k])
            number[known] += 1
        within = within * Rotation.from_rotvec(angle[:, k])
    steps, begin, now = within.as_matrix(), np.empty((count, 3, 3)), np.eye(3)
    for second in range(count):
        begin[second] = now
        now = now @ steps[second]
    means = [
        np.einsum("nij,nj->ni", begin, np.where(number < _WIDTH / 2, np.nan, total / number))
        for total, number in zip(sums, np.maximum(numbers, 1), strict=True)
    ]
    return begin @ turned, means


def _crossing(vectors: Floats) -> Floats:
    """Return the matrices of the cross products with some vectors, shape (N, 3, 3)."""
    x, y, z = vectors.T
    zero = np.zeros(len(vectors))
    rows = [zero, -z, y, z, zero, -x, -y, x, zero]
    return np.stack(rows, axis=1).reshape(-1, 3, 3)
