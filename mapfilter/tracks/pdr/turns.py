"""Turns between the rows of a step counter: of a log's turns, a yaw rate, or a gyroscope."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.tracks.joining.equal_times import joined_times
from mapfilter.tracks.pdr.gyroscope import WALK_RAD_PER_SQRT_S, sample_noise

AXES = ("x_mps2", "y_mps2", "z_mps2")
"""Columns of forces."""
ORIENTATION = "the phone's orientation"
"""Source of turns that are no gyroscope's alone."""
LONGEST_S = 2.0
"""Rates that lie farther apart say nothing about what is between them."""
_GRAVITY_S = 1.0
_LEAST_GRAVITY = 0.5
NO_VERTICAL = (
    "a gyroscope without gravity (acc_x, acc_y, acc_z) does not show which way is up; of a phone "
    "held flat, screen up, its z axis will do: --column yaw_rate_radps=COLUMN"
)


@dataclass(frozen=True, eq=False)
class Turning:
    """Turns through time, counter-clockwise seen from above.

    Parameters
    ----------
    time_s : (N,) array
        Times that grow.
    turn_rad : (N,) array
        Turn since the time before; NaN where unknown. The first one is not used.
    walk_rad_per_sqrt_s : float
        Random walk of their sum.
    source : str
        What they were measured by, in notes.
    """

    time_s: Floats
    turn_rad: Floats
    walk_rad_per_sqrt_s: float
    source: str

    def between(self, time_s: Floats) -> Floats:
        """Return the turn from each time to the next, NaN for the first and where unknown.

        Examples
        --------
        >>> turning = Turning(np.arange(4.0), np.array([0.0, 0.2, 0.4, np.nan]), 0.0, "")
        >>> turning.between(np.array([0.0, 1.5, 2.0, 3.0, 9.0])).round(3).tolist()
        [nan, 0.4, 0.2, nan, nan]
        """
        if len(self.time_s) < 2:
            return np.full(len(time_s), np.nan)
        unknown = np.isnan(self.turn_rad[1:])
        sums = (np.where(unknown, 0.0, self.turn_rad[1:]), unknown)
        turned, lost = (
            np.interp(time_s, self.time_s, np.append(0.0, np.cumsum(one)), np.nan, np.nan)
            for one in sums
        )
        found = np.diff(turned, prepend=np.nan)
        known = np.diff(lost, prepend=np.nan) == 0
        return np.where(known, found, np.nan)


def turning_of(sensors: Mapping[str, pd.DataFrame]) -> tuple[Turning | None, str]:
    """Return the turns that sensors show, or why they show none.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        ``turns``, else ``gyroscope`` with ``gravity`` or ``accelerometer``, of
        :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.

    Returns
    -------
    turning : Turning or None
    reason : str
        "" with turns, and where no such sensor is there.
    """
    if "turns" in sensors:
        sensors = {**sensors, "turns": _added(sensors["turns"])}
    if (rows := samples(sensors, "turns", ("turn_rad", "yaw_rate_radps"))) is not None:
        turn, rate = rows[1].T
        # A single turn says less than a rate in every row.
        if np.isfinite(turn).sum() >= np.isfinite(rate).sum():
            return Turning(rows[0], turn, WALK_RAD_PER_SQRT_S, "turns"), ""
        return turning_of_rate(rows[0], rate, "a yaw rate"), ""
    gyroscope = samples(sensors, "gyroscope", ("x_radps", "y_radps", "z_radps"))
    if gyroscope is None:
        return None, ""
    force = force_of(sensors)
    up = None if force is None else _up(gyroscope[0], *force[:2])
    if up is None:
        return None, NO_VERTICAL
    return turning_of_rate(gyroscope[0], np.sum(gyroscope[1] * up, axis=1), "a gyroscope"), ""


def _added(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows in which the turns of one time, such as a whole second, are their sum."""
    turn = rows["turn_rad"].groupby(rows["time_s"]).transform("sum", min_count=1)
    return rows.assign(turn_rad=turn)


def force_of(sensors: Mapping[str, pd.DataFrame]) -> tuple[Floats, Floats, str] | None:
    """Return times, the (N, 3) force of gravity or the accelerometer, and which; None without."""
    for name in ("gravity", "accelerometer"):
        if (rows := samples(sensors, name, AXES)) is not None:
            return *rows, name
    return None


def samples(
    sensors: Mapping[str, pd.DataFrame], name: str, columns: tuple[str, ...]
) -> tuple[Floats, Floats] | None:
    """Return times that grow, and the columns; None where there are not two rows.

    Nor are there any of a gyroscope all of whose rates are 0, as where a phone has none.
    """
    if name not in sensors:
        return None
    rows = joined_times(sensors[name].sort_values("time_s", kind="stable"))
    if len(rows) < 2:
        return None
    values = rows[list(columns)].to_numpy(dtype=np.float64)
    if name == "gyroscope" and not values.any():
        return None
    return rows["time_s"].to_numpy(dtype=np.float64), values


def turning_of_rate(time_s: Floats, rate: Floats, source: str) -> Turning:
    """Integrate a rate by the mean of both ends of each interval.

    A walker sways: rates that are sampled seldom scatter by that, from one to the next.
    """
    known = np.isfinite(rate)
    time_s, rate = time_s[known], rate[known]
    lasted_s = np.diff(time_s)
    turn = np.where(lasted_s <= LONGEST_S, lasted_s * (rate[1:] + rate[:-1]) / 2, np.nan)
    scatter = sample_noise(np.diff(rate, 2))
    usual_s = float(np.median(lasted_s)) if lasted_s.size else 0.0
    walk = float(np.hypot(WALK_RAD_PER_SQRT_S, scatter * usual_s**0.5))
    return Turning(time_s, np.concatenate([[np.nan], turn])[: len(time_s)], walk, source)


def _up(time_s: Floats, known_s: Floats, force: Floats) -> Floats | None:
    """Return the upward direction in the device's axes, by the mean force of 1 s before and after.

    NaN where there was none; None where the force does not include gravity.
    """
    measured = np.isfinite(force).all(axis=1)
    if not measured.any():
        return None
    known_s, force = known_s[measured], force[measured]
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(force, axis=0)])
    first = np.searchsorted(known_s, time_s - _GRAVITY_S, side="left")
    last = np.searchsorted(known_s, time_s + _GRAVITY_S, side="right")
    count = last - first
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (total[last] - total[first]) / count[:, None]
        size = np.linalg.norm(mean, axis=1)
        up: Floats = mean / size[:, None]
    typical = float(np.median(np.linalg.norm(force, axis=1)))
    # Without gravity the means of what is left nearly vanish.
    with_gravity = np.isfinite(size).any() and np.nanmedian(size) > _LEAST_GRAVITY * typical
    return up if with_gravity else None
