"""Inertial sensors of a device, brought to one rate and cut at gaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mapfilter._types import Floats

RATE_HZ = 50.0
_SLOWEST_HZ = 15.0
_LONGEST_GAP_S = 0.5
_SHORTEST_S = 2.0
_GRAVITY_RANGE_MPS2 = (8.0, 13.0)
_FORCE = ("x_mps2", "y_mps2", "z_mps2")
_RATE = ("x_radps", "y_radps", "z_radps")
_FIELD = ("x_ut", "y_ut", "z_ut")

_USUAL_RADPS, _MOST_RADPS = 6.0, 36.0
"""A turn each second, and the end of the scale of a phone's gyroscope (2000 deg/s)."""


@dataclass(frozen=True, eq=False)
class Signals:
    """Sensors of a device at :data:`RATE_HZ` without gaps, in its own right-handed axes.

    Parameters
    ----------
    time_s : (N,) array
    force_mps2 : (N, 3) array
        Specific force: upward and of the size of gravity at rest.
    rate_radps : (N, 3) array or None
        Angular rate; None without a gyroscope.
    field_ut : (N, 3) array or None
        Magnetic field, NaN in gaps of the magnetometer; None without one.
    """

    time_s: Floats
    force_mps2: Floats
    rate_radps: Floats | None = None
    field_ut: Floats | None = None


def inertial_signals(
    sensors: Mapping[str, pd.DataFrame],
) -> tuple[list[Signals], tuple[str, ...]]:
    """Return the stretches without gaps of the inertial sensors, and notes on what hinders steps.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        Tables of :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`: an accelerometer, or gravity and
        linear acceleration; gyroscope and magnetometer where there are any.

    Returns
    -------
    signals : list of Signals
        None without an accelerometer that is fast enough (15 Hz) and includes gravity.
    notes : tuple of str
    """
    force = _force(sensors)
    if force is None:
        return [], ()
    time_s, values = force
    if len(time_s) < 3 or (rate_hz := 1 / float(np.median(np.diff(time_s)))) < _SLOWEST_HZ:
        hz = 0.0 if len(time_s) < 3 else rate_hz
        return [], (f"accelerometer: {hz:.3g} Hz; steps need {_SLOWEST_HZ:g} Hz",)
    # The mean: the force of a brisk walk lies below gravity most of the time.
    typical = float(np.mean(np.linalg.norm(values, axis=1)))
    low, high = _GRAVITY_RANGE_MPS2
    if not low <= typical <= high:
        why = "g given for m/s², or gravity left out"
        return [], (f"accelerometer: {typical:.3g} m/s² in the mean, at rest 9.8: {why}",)
    gyroscope = gyroscope_samples(sensors)
    if gyroscope is not None and (fault := _rate_fault(gyroscope[1])):
        return [], (fault,)
    field = _field_samples(sensors)
    notes = () if gyroscope is not None else ("no gyroscope: headings by the compass alone",)
    every = [_stretches(time_s)]
    if gyroscope is not None:
        every.append(_stretches(gyroscope[0]))
    found = []
    for begin_s, end_s in _common(every):
        if end_s - begin_s < _SHORTEST_S:
            continue
        edge_s = begin_s + np.arange(int((end_s - begin_s) * RATE_HZ) + 1) / RATE_HZ
        found.append(
            Signals(
                (edge_s[1:] + edge_s[:-1]) / 2,
                _means(edge_s, time_s, values),
                None if gyroscope is None else _means(edge_s, *gyroscope),
                None if field is None else _field((edge_s[1:] + edge_s[:-1]) / 2, *field),
            )
        )
    if field is None and gyroscope is None:
        return [], ("accelerometer without gyroscope and magnetometer: no headings",)
    return found, notes


def gyroscope_samples(sensors: Mapping[str, pd.DataFrame]) -> tuple[Floats, Floats] | None:
    """Return times that grow and rates as they were measured; None where there are not two.

    All are 0 in tables of phones without a gyroscope.
    """
    found = _table(sensors, "gyroscope", _RATE)
    return found if found is not None and found[1].any() else None


def _field_samples(sensors: Mapping[str, pd.DataFrame]) -> tuple[Floats, Floats] | None:
    """Return times that grow and fields but those of 0, which mean that there is none."""
    found = _table(sensors, "magnetometer", _FIELD)
    if found is None:
        return None
    there = found[1].any(axis=1)
    return (found[0][there], found[1][there]) if there.sum() > 1 else None


def _rate_fault(rate: Floats) -> str:
    """Return what is wrong with the unit of a gyroscope; "" where a phone may turn so."""
    size = np.linalg.norm(rate, axis=1)
    usual, most = (float(np.quantile(size, share)) for share in (0.5, 0.99))
    if usual <= _USUAL_RADPS and most <= _MOST_RADPS:
        return ""
    turns = f"{usual:.3g} rad/s in the median, {most:.3g} in the hundredth part of the time"
    return f"gyroscope: {turns}: degrees for radians per second"


def _table(
    sensors: Mapping[str, pd.DataFrame], name: str, columns: tuple[str, ...]
) -> tuple[Floats, Floats] | None:
    """Return times that grow and finite values; None where there are not two rows."""
    rows = sensors.get(name)
    if rows is None:
        return None
    values = rows[list(columns)].to_numpy(dtype=np.float64)
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    time_s, values = (part[np.isfinite(values).all(axis=1)] for part in (time_s, values))
    time_s, first = np.unique(time_s, return_index=True)
    return (time_s, values[first]) if len(time_s) > 1 else None


def _force(sensors: Mapping[str, pd.DataFrame]) -> tuple[Floats, Floats] | None:
    """Return the specific force, measured or as the sum of gravity and linear acceleration."""
    measured = _table(sensors, "accelerometer", _FORCE)
    if measured is not None:
        return measured
    moved = _table(sensors, "linear_acceleration", _FORCE)
    gravity = _table(sensors, "gravity", _FORCE)
    if moved is None or gravity is None:
        return None
    within = (moved[0] >= gravity[0][0]) & (moved[0] <= gravity[0][-1])
    time_s = moved[0][within]
    if len(time_s) < 2:
        return None
    return time_s, moved[1][within] + _at(time_s, *gravity)


def _at(time_s: Floats, known_s: Floats, values: Floats) -> Floats:
    return np.stack([np.interp(time_s, known_s, column) for column in values.T], axis=1)


def _means(edge_s: Floats, known_s: Floats, values: Floats) -> Floats:
    """Return the mean between edges, so that no rotation and no velocity is lost."""
    from scipy.integrate import cumulative_trapezoid

    total = cumulative_trapezoid(values, known_s, axis=0, initial=0)
    means: Floats = np.diff(_at(edge_s, known_s, total), axis=0) * RATE_HZ
    return means


def _field(time_s: Floats, known_s: Floats, values: Floats) -> Floats:
    """Return the field at some times, NaN farther than a gap from any sample."""
    found = _at(time_s, known_s, values)
    after = np.clip(np.searchsorted(known_s, time_s), 1, len(known_s) - 1)
    away = np.minimum(np.abs(time_s - known_s[after - 1]), np.abs(time_s - known_s[after]))
    found[away > _LONGEST_GAP_S] = np.nan
    return found


def _stretches(time_s: Floats) -> list[tuple[float, float]]:
    """Return begin and end of stretches without gaps."""
    cuts = np.flatnonzero(np.diff(time_s) > _LONGEST_GAP_S)
    first = np.concatenate([[0], cuts + 1])
    last = np.concatenate([cuts, [len(time_s) - 1]])
    return [(float(time_s[i]), float(time_s[j])) for i, j in zip(first, last, strict=True)]


def _common(every: list[list[tuple[float, float]]]) -> list[tuple[float, float]]:
    """Return the intersections of lists of intervals."""
    common = every[0]
    for others in every[1:]:
        common = [
            (max(a, c), min(b, d)) for a, b in common for c, d in others if max(a, c) < min(b, d)
        ]
    return sorted(common)
