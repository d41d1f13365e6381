"""The compass over the whole recording: what turns gyroscope yaw into headings, and how well.

The magnetometer, seen in the level frame that the gyroscope keeps, points to a direction that
should be constant. What remains is a slow drift of the gyroscope, and disturbances by iron and
currents that last for metres. A Kalman smoother with two states, the offset of the yaw and its
rate, follows the first; Student's t weights and the size and dip of the field keep out the second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.angles import wrap_rad
from mapfilter.tracks.pdr.gyroscope import RATE_SD_RADPS, UNSEEN_SD_RADPS, WALK_RAD_PER_SQRT_S

_SIZE_SHARE = 0.2
_DIP_RAD = np.radians(12.0)
_COMPASS_SD_RAD = np.radians(15.0)
_CORRELATION_S = 4.0
_DEGREES_OF_FREEDOM = 3.0
_ROUNDS = 6
_APART_RAD = np.radians(25.0)
_RATE_WALK = np.radians(0.002)
_BINS = 72
_PAIR_S, _PAIR_SHARE, _SHOWN = 20.0, 0.5, 4.0
"""Time over which the compass shows a rate, the share of pairs of it that have to agree, and
deviations from 0 that are no chance."""


@dataclass(frozen=True, eq=False)
class Compass:
    """Samples of the compass, one a second.

    Parameters
    ----------
    time_s : (M,) array
    north_rad : (M,) array
        Direction of the horizontal field in the level frame, counter-clockwise from its x axis.
    size_ut, dip_rad : (M,) array
        Size of the field, and its angle below the horizon.
    disturbed : (M,) array of bool
        Whether size or dip are not those of the recording's median, or nothing was measured.
    """

    time_s: Floats
    north_rad: Floats
    size_ut: Floats
    dip_rad: Floats
    disturbed: Bools


@dataclass(frozen=True, eq=False)
class YawOffset:
    """What has to be added to a yaw, through time.

    Parameters
    ----------
    time_s, offset_rad, sd_rad : (M,) array
        The offset and its standard deviation; without a compass its sd is π.
    rate_radps, rate_sd_radps : float
        The gyroscope's mean rate error, and what remains of it.
    disturbed : (M,) array of bool
        Where the compass was not used: by size or dip of the field, or because it contradicts the
        gyroscope.
    spread_rad : float
        Standard deviation of the compass around the offset, where it was used.
    """

    time_s: Floats
    offset_rad: Floats
    sd_rad: Floats
    rate_radps: float
    rate_sd_radps: float
    disturbed: Bools
    spread_rad: float


def compass_samples(
    time_s: Floats, level_ut: Floats, size_ut: float = 0.0, dip_rad: float = float("nan")
) -> Compass:
    """Return means over each second of the field in the level frame.

    Parameters
    ----------
    time_s : (N,) array
    level_ut : (N, 3) array
        NaN where nothing was measured.
    size_ut, dip_rad : float
        The field of the place; 0 and NaN for the medians of the recording.
    """
    second = np.floor(time_s - time_s[0]).astype(np.int64)
    count = int(second[-1]) + 1
    known = np.isfinite(level_ut[:, 0])
    number = np.maximum(np.bincount(second[known], minlength=count), 1)
    mean = np.stack(
        [np.bincount(second[known], part[known], count) / number for part in level_ut.T], axis=1
    )
    missing = np.bincount(second[known], minlength=count) == 0
    flat = np.hypot(mean[:, 0], mean[:, 1])
    size, dip = np.linalg.norm(mean, axis=1), np.arctan2(-mean[:, 2], flat)
    disturbed = missing.copy()
    if not missing.all():
        usual_ut = size_ut or float(np.median(size[~missing]))
        usual_rad = dip_rad if np.isfinite(dip_rad) else float(np.median(dip[~missing]))
        disturbed |= np.abs(size / usual_ut - 1) > _SIZE_SHARE
        disturbed |= np.abs(dip - usual_rad) > _DIP_RAD
    centre_s = time_s[0] + np.arange(count) + 0.5
    return Compass(centre_s, np.arctan2(mean[:, 1], mean[:, 0]), size, dip, disturbed)


def yaw_offset(
    compass: Compass,
    rates: Floats,
    rate_sds: Floats,
    *,
    use_compass: bool = True,
    walk_rad_per_sqrt_s: float = WALK_RAD_PER_SQRT_S,
    usual_radps: float = 0.0,
    alone_sd_radps: float = UNSEEN_SD_RADPS,
) -> YawOffset:
    """Smooth the offset between yaw and magnetic headings.

    Parameters
    ----------
    compass : Compass
    rates, rate_sds : (M,) array
        Yaw rate measured while standing still in each second, and its standard deviation (rad/s);
        NaN where the device moved.
    use_compass : bool
        Without, only the rate is estimated.
    walk_rad_per_sqrt_s : float
        Random walk of the gyroscope's yaw.
    usual_radps : float
        Its rate error, beside which that of a time is small.
    alone_sd_radps : float
        Deviation of the rate error without a compass, before rests are looked at.

    Returns
    -------
    YawOffset
        ``heading = yaw + offset``, counter-clockwise from magnetic east.
    """
    measured = np.pi / 2 - compass.north_rad
    good = ~compass.disturbed & use_compass
    # Where the field is disturbed nearly everywhere, a disturbed compass is better than none.
    if use_compass and good.sum() < 0.2 * len(good):
        good |= np.isfinite(compass.north_rad) & (compass.size_ut > 0)
    first_sd_radps = RATE_SD_RADPS if good.any() else alone_sd_radps
    if good.any() and not np.isfinite(rates).any():
        usual_radps, first_sd_radps = _rate_by_compass(compass, good)
    # What is left beside it is smoothed.
    rates = rates - usual_radps
    turned = usual_radps * (compass.time_s - compass.time_s[0])
    measured = measured + turned
    start = _usual_angle(measured[good]) if good.any() else 0.0
    measured = start + wrap_rad(measured - start)
    walks = first_sd_radps, walk_rad_per_sqrt_s
    base = _COMPASS_SD_RAD**2 * 2 * _CORRELATION_S
    weight = np.where(good, 1.0, 0.0)
    offset = np.full(len(measured), start)
    # Without a compass there are no weights to be found.
    for _ in range(_ROUNDS if good.any() else 1):
        variance = np.where(weight > 0, base / np.maximum(weight, 1e-12), np.inf)
        offset, sd, rate, rate_sd = _smooth(
            compass.time_s, measured, variance, rates, rate_sds, start, walks
        )
        ratio = (wrap_rad(measured - offset) / _COMPASS_SD_RAD) ** 2
        freedom = _DEGREES_OF_FREEDOM
        weight = np.where(good, (freedom + 1) / (freedom + ratio), 0.0)
    apart = np.abs(wrap_rad(measured - offset)) > _APART_RAD
    used = good & ~apart
    residual = wrap_rad(measured - offset)[used]
    spread = float(np.sqrt(np.mean(residual**2))) if residual.size else float(np.pi)
    if not good.any():
        sd = np.full(len(sd), np.pi)
        rate_sd = rate_sd if np.isfinite(rates).any() else alone_sd_radps
    rate += usual_radps
    return YawOffset(compass.time_s, offset - turned, sd, rate, rate_sd, ~used, spread)


def _rate_by_compass(compass: Compass, good: Bools) -> tuple[float, float]:
    """Return the rate error by which the compass turns in the level frame, and its deviation.

    It is the mean turn over 20 s, over a recording in which nothing rests. A compass that is
    off elsewhere at the end than at the start shows a small one: what that may be is none.
    """
    index = np.flatnonzero(good)
    time_s, north = compass.time_s[index], compass.north_rad[index]
    later = np.searchsorted(time_s, time_s + _PAIR_S)
    first = np.flatnonzero(later < len(time_s))
    first = first[time_s[later[first]] - time_s[first] < _PAIR_S + 1.0]
    if not first.size:
        return 0.0, RATE_SD_RADPS
    last = later[first]
    mean = np.mean(np.exp(1j * (north[last] - north[first])))
    rate_radps = float(np.angle(mean) / np.mean(time_s[last] - time_s[first]))
    sd_radps = float(np.hypot(2**0.5 * _APART_RAD / np.ptp(time_s), RATE_SD_RADPS))
    shown = abs(mean) > _PAIR_SHARE and abs(rate_radps) > _SHOWN * sd_radps
    return (rate_radps, sd_radps) if shown else (0.0, RATE_SD_RADPS)


def _usual_angle(angles: Floats) -> float:
    """Return the most frequent angle, then the mean of those within 45 degrees of it."""
    smooth = np.zeros(_BINS)
    centre = 2 * np.pi * np.arange(_BINS) / _BINS
    for angle in angles:
        smooth += np.exp(np.cos(centre - angle) / 0.1 - 10.0)
    best = centre[int(np.argmax(smooth))]
    near = angles[np.abs(wrap_rad(angles - best)) < np.pi / 4]
    return float(best + np.mean(wrap_rad(near - best))) if near.size else float(best)


def _smooth(
    time_s: Floats,
    measured: Floats,
    variance: Floats,
    rates: Floats,
    rate_sds: Floats,
    start_rad: float,
    walks: tuple[float, float],
) -> tuple[Floats, Floats, float, float]:
    """Run a Kalman filter and the smoother of Rauch, Tung and Striebel over offset and rate.

    ``walks`` are the deviation of the first rate and the random walk of the yaw.
    """
    count = len(time_s)
    state = np.array([start_rad, 0.0])
    spread = np.diag([np.pi**2, walks[0] ** 2])
    before, after = np.empty((count, 2)), np.empty((count, 2))
    before_p, after_p = np.empty((count, 2, 2)), np.empty((count, 2, 2))
    step_s = np.diff(time_s, prepend=time_s[:1])
    # A yaw that grows by a rate error is put back by an offset that falls.
    moves = np.tile(np.eye(2), (count, 1, 1))
    moves[:, 0, 1] = -step_s
    rate_walk = _RATE_WALK * max(walks[1] / WALK_RAD_PER_SQRT_S, 1.0)
    noise = np.diag([walks[1] ** 2, rate_walk**2]) * step_s[:, None, None]
    values, errors = np.column_stack([measured, rates]), np.column_stack([variance, rate_sds**2])
    known = (np.isfinite(values) & np.isfinite(errors)).tolist()
    for k in range(count):
        state = moves[k] @ state
        spread = moves[k] @ spread @ moves[k].T + noise[k]
        before[k], before_p[k] = state, spread
        for row in (0, 1):
            if known[k][row]:
                gain = spread[:, row] / (spread[row, row] + errors[k, row])
                state = state + gain * (values[k, row] - state[row])
                spread = spread - gain[:, None] * spread[row]
        after[k], after_p[k] = state, spread
    back = after_p[:-1] @ moves[1:].transpose(0, 2, 1) @ np.linalg.inv(before_p[1:])
    for k in range(count - 2, -1, -1):
        after[k] += back[k] @ (after[k + 1] - before[k + 1])
        after_p[k] += back[k] @ (after_p[k + 1] - before_p[k + 1]) @ back[k].T
    rate_sd = float(np.sqrt(np.mean(after_p[:, 1, 1])))
    sd = np.minimum(np.sqrt(np.maximum(after_p[:, 0, 0], 0.0)), np.pi)
    return after[:, 0], sd, float(np.mean(after[:, 1])), rate_sd
