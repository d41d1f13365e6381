"""How a vehicle turns, by the gyroscope of a phone in it, however the phone lies."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.tracks.pdr.orientation import turning_of_orientation
from mapfilter.tracks.pdr.turns import NO_VERTICAL, Turning, force_of, samples, turning_of_rate

_AROUND = 60
"""Seconds to either side whose mean force is taken for the vertical: what a vehicle gains by its
engine, brakes and curves meanwhile is little beside gravity."""
_BESIDE, _FEWEST = 10, 3
"""Seconds before and after that show another posture, and the fewest of them."""
_MOVED_RAD, _OFF_RAD = np.radians(30.0), np.radians(35.0)
"""Tilt of another posture, and of a second in a hand: curves of 0.5 g tilt the force by 27 deg."""
_HANDLED = 2
_LEAST_GRAVITY = 0.5


def turning_of_mounted(
    sensors: Mapping[str, pd.DataFrame],
) -> tuple[Turning | None, tuple[str, ...]]:
    """Return the turns of a vehicle that a phone in it shows, and notes.

    They are those of its gyroscope and accelerometer, without these those of its attitude.

    The vertical is the mean force over two minutes, in each posture that the phone is put to;
    while it is moved from one to another, turns are unknown.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        ``gyroscope`` with ``gravity`` or ``accelerometer``, else ``orientation``, of
        :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.

    Returns
    -------
    turning : Turning or None
        None where there are none of these, or nothing shows the vertical.
    notes : tuple of str

    Examples
    --------
    >>> time_s = np.arange(0.0, 20.0, 0.1)
    >>> rate = pd.DataFrame({"time_s": time_s, "x_radps": 0.0, "y_radps": -0.3, "z_radps": 0.0})
    >>> force = pd.DataFrame({"time_s": time_s, "x_mps2": 0.0, "y_mps2": -9.8, "z_mps2": 0.0})
    >>> turning, _ = turning_of_mounted({"gyroscope": rate, "accelerometer": force})
    >>> turning.between(np.array([2.0, 4.0])).round(3).tolist()
    [nan, 0.6]
    """
    gyroscope = samples(sensors, "gyroscope", ("x_radps", "y_radps", "z_radps"))
    force = force_of(sensors)
    if gyroscope is None or force is None:
        return _by_attitude(sensors, () if gyroscope is None else (NO_VERTICAL,))
    time_s, rate_radps = gyroscope
    # Seconds with samples only: times far apart are of one recording, too.
    seconds, second = np.unique(np.floor(time_s), return_inverse=True)
    direction = _by_second(*force[:2], seconds)
    if direction is None:
        return _by_attitude(sensors, (NO_VERTICAL,))
    cuts = _cuts(direction)
    up = _unit(np.concatenate([_mean(part) for part in np.split(direction, cuts)]))
    unknown = _handled(direction, up, cuts)
    up[unknown] = np.nan
    notes = [f"odometry: turns are those of a gyroscope, about the vertical of its {force[2]}"]
    if handled := int((unknown & np.isfinite(direction[:, 0])).sum()):
        some = number_of(handled, "second")
        notes.append(f"gyroscope: moved in the vehicle, turns are unknown for {some}")
    about = np.sum(rate_radps * up[second], axis=1)
    return turning_of_rate(time_s, about, "a gyroscope"), tuple(notes)


def _by_attitude(
    sensors: Mapping[str, pd.DataFrame], lacking: tuple[str, ...]
) -> tuple[Turning | None, tuple[str, ...]]:
    """Return the turns of a device that states its attitude, else what is lacking."""
    turning = turning_of_orientation(sensors)
    if turning is None:
        return None, lacking
    return turning, (f"odometry: turns are those of {turning.source}",)


def _by_second(time_s: Floats, force: Floats, seconds: Floats) -> Floats | None:
    """Return the direction of the mean force in each of some seconds, NaN without any.

    None where it does not include gravity.
    """
    second = np.floor(time_s)
    inside = np.isin(second, seconds) & np.isfinite(force).all(axis=1)
    if not inside.any():
        return None
    by_second = pd.DataFrame(force[inside]).groupby(second[inside]).mean()
    means = by_second.reindex(seconds).to_numpy(dtype=np.float64)
    # Without gravity the means of what is left nearly vanish.
    whole = np.nanmedian(np.linalg.norm(_mean(means), axis=1))
    typical = np.median(np.linalg.norm(force[inside], axis=1))
    return _unit(means) if whole > _LEAST_GRAVITY * typical else None


def _unit(vectors: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        unit: Floats = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit


def _mean(vectors: Floats) -> Floats:
    """Return the running mean of vectors, over seconds without any, too."""
    rolling = pd.DataFrame(vectors).rolling(2 * _AROUND + 1, center=True, min_periods=1)
    return np.asarray(rolling.mean(), dtype=np.float64)


def _angle(one: Floats, other: Floats) -> Floats:
    cosine = np.sum(_unit(one) * _unit(other), axis=1)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _cuts(direction: Floats) -> Ints:
    """Return the seconds that begin another posture: those of the largest tilt of each."""
    table = pd.DataFrame(direction)
    before = table.rolling(_BESIDE, min_periods=_FEWEST).median().shift(1).to_numpy()
    after = table[::-1].rolling(_BESIDE, min_periods=_FEWEST).median()[::-1].to_numpy()
    tilt = np.nan_to_num(_angle(before, after))
    over = np.flatnonzero(tilt > _MOVED_RAD)
    runs = np.split(over, np.flatnonzero(np.diff(over) > 1) + 1) if over.size else []
    return np.array([run[int(np.argmax(tilt[run]))] for run in runs], dtype=np.int64)


def _handled(direction: Floats, up: Floats, cuts: Ints) -> Bools:
    """Return the seconds about those in which the phone is tilted away from its posture."""
    off = np.nan_to_num(_angle(direction, up)) > _OFF_RAD
    off[cuts] = True
    width = np.ones(2 * _HANDLED + 1)
    return np.asarray(np.convolve(off, width, "full")[_HANDLED : _HANDLED + len(off)] > 0)
