"""Seconds by which the clock of a phone differs from that of its vehicle's speeds."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats

_WITHIN_S, _PERIOD_S, _HALF_S = 30.0, 0.5, 1.0
_FEWEST_S, _LONGEST_S = 120.0, 3600.0
_LEAST, _TIMES, _GAIN = 0.4, 2.0, 0.05
"""Share of the accelerations that the shift explains; what is left has to be twice as much
elsewhere."""
_REMARKABLE_S, _PEAK_S = 1.0, 6.0


def clock_shift_s(
    speeds: tuple[Floats, Floats], forces: tuple[Floats, Floats]
) -> tuple[float, float, float]:
    """Return the shift of a phone's clock at which its forces explain a vehicle's accelerations.

    Whichever way it lies, a part of its force is that along the vehicle.

    Parameters
    ----------
    speeds : ((N,) array, (N,) array)
        Times in seconds, rising, and speeds in m/s.
    forces : ((M,) array, (M, 3) array)
        Times in seconds, rising, and specific forces in m/s², of one posture of the phone.

    Returns
    -------
    shift_s : float
        To be added to the phone's times; 0 where nothing is clearly better.
    best, now : float
        Share of the variance of accelerations that is explained with and without it.

    Examples
    --------
    >>> time_s = np.arange(0.0, 300.0, 0.5)
    >>> speed = 10 + 5 * np.sin(time_s / 9) + 3 * np.sin(time_s / 4)
    >>> ahead = 5 / 9 * np.cos(time_s / 9) + 3 / 4 * np.cos(time_s / 4)
    >>> force = np.stack([0 * ahead, -ahead, 9.8 + 0 * ahead], axis=1)
    >>> clock_shift_s((time_s, speed), (time_s + 3, force))[0]
    -3.0
    """
    begin_s = max(speeds[0][0], forces[0][0]) + _WITHIN_S + _HALF_S
    end_s = min(speeds[0][-1], forces[0][-1], begin_s + _LONGEST_S) - _WITHIN_S - _HALF_S
    if end_s - begin_s < _FEWEST_S:
        return 0.0, 0.0, 0.0
    at_s = np.arange(begin_s, end_s, _PERIOD_S)
    later, before = (np.interp(at_s + half, *speeds) for half in (_HALF_S, -_HALF_S))
    gained = (later - before) / (2 * _HALF_S)
    shifts = np.arange(-_WITHIN_S, _WITHIN_S + _PERIOD_S / 2, _PERIOD_S)
    way = _integral(*forces)
    share = np.array([_explained(gained, _means(at_s - one, forces[0], way)) for one in shifts])
    at, middle = int(np.argmax(share)), len(shifts) // 2
    best, now = float(share[at]), float(share[middle])
    far = np.abs(shifts - shifts[at]) > _PEAK_S
    others = max(now, float(share[far].max()))
    clear = best >= _LEAST and 1 - others >= _TIMES * (1 - best) + _GAIN
    shown = clear and abs(shifts[at]) >= _REMARKABLE_S and 0 < at < len(shifts) - 1
    return (float(shifts[at]) if shown else 0.0), best, now


def _integral(time_s: Floats, values: Floats) -> Floats:
    steps = np.diff(time_s)[:, None] * (values[1:] + values[:-1]) / 2
    return np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(steps, axis=0)])


def _means(at_s: Floats, time_s: Floats, integral: Floats) -> Floats:
    """Return means over the time about each moment."""
    later, before = (
        np.stack([np.interp(at_s + half, time_s, axis) for axis in integral.T], axis=1)
        for half in (_HALF_S, -_HALF_S)
    )
    means: Floats = (later - before) / (2 * _HALF_S)
    return means


def _explained(gained: Floats, force: Floats) -> float:
    """Return the share of the variance that a linear function of the forces explains."""
    spread = float(gained.var())
    if spread == 0:
        return 0.0
    columns = np.column_stack([force, np.ones(len(force))])
    weights, *_ = np.linalg.lstsq(columns, gained, rcond=None)
    return 1.0 - float(np.var(gained - columns @ weights)) / spread
